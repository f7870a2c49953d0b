//! Raw cameras through C: the digests of the core with the same rectification, and what cannot be
//! rectified is a status.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(clippy::undocumented_unsafe_blocks, reason = "each call keeps the header's promises")]

use dynvox_capi::*;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::rectify::{Lens, LensModel, RawCamera, RawRig, Rectification, Sizing};
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame, image::View};
use std::ptr;

const RAW: [usize; 2] = [176, 80];
const RECTIFIED: [u32; 2] = [160, 64];
/// k1 to k6, p1, p2; a radial-tangential lens has no more.
const PARAMETERS: [f64; 15] = {
    let mut parameters = [0.0; 15];
    parameters[0] = -0.1;
    parameters[1] = 0.02;
    parameters[6] = 0.001;
    parameters[7] = -0.001;
    parameters
};

fn camera() -> DynvoxRawCamera {
    DynvoxRawCamera {
        width: RAW[0] as u32,
        height: RAW[1] as u32,
        focal_px: [100.0, 101.0],
        center_px: [88.0, 40.0],
        model: DYNVOX_LENS_RADIAL_TANGENTIAL,
        parameters: PARAMETERS,
    }
}

/// The right camera turned by 1.1 degrees, so that rows and columns of its rotation differ.
fn rig() -> DynvoxRawRig {
    let (sin, cos) = 0.02f64.sin_cos();
    DynvoxRawRig {
        left: camera(),
        right: camera(),
        r_right_left: [cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos],
        t_right_left_m: [-0.5, 0.0, 0.0],
        width: RECTIFIED[0],
        height: RECTIFIED[1],
        focal_px: 0.0,
    }
}

fn config_of(rig: &DynvoxRawRig) -> Result<DynvoxConfig, DynvoxStatus> {
    let mut config = unsafe { std::mem::zeroed() };
    match unsafe { dynvox_config_raw(rig, &raw mut config) } {
        DynvoxStatus::Ok => Ok(config),
        status => Err(status),
    }
}

fn pixels(shift: usize) -> Vec<u8> {
    (0..RAW[0] * RAW[1])
        .map(|i| (((i + shift) / 3) as u32).wrapping_mul(2_654_435_761).rotate_left(9) as u8)
        .collect()
}

/// The digest that the core gives for two frames.
fn digest_of_core(capacity: &Capacity) -> u64 {
    let lens = LensModel::RadialTangential {
        radial: [-0.1, 0.02, 0.0, 0.0, 0.0, 0.0],
        tangential: [0.001, -0.001],
    };
    let camera = RawCamera {
        lens: Lens::new([100.0, 101.0], [88.0, 40.0], lens).unwrap(),
        width: RAW[0] as u32,
        height: RAW[1] as u32,
    };
    let (sin, cos) = 0.02f64.sin_cos();
    let rig = RawRig {
        left: camera,
        right: camera,
        // By columns.
        r_right_left: [[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]].into(),
        t_right_left_m: [-0.5, 0.0, 0.0].into(),
    };
    let sizing = Sizing::Given { width: RECTIFIED[0], height: RECTIFIED[1], focal_px: None };
    let (rectification, rig) = Rectification::new(&rig, sizing).unwrap();
    let config = Config { rectification: Some(rectification), ..Config::for_rig(rig) };
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(capacity, &config, &mut slab).unwrap();
    let (left, right) = (pixels(0), pixels(4));
    let view = |pixels| View::new(pixels, RAW[0], RAW[1]).unwrap();
    let frame = StereoFrame::pair(view(&left), view(&right));
    (0..2).map(|_| mapper.step(&frame, &Serial).unwrap().digest).last().unwrap()
}

fn capacity_and_bytes() -> (DynvoxCapacity, usize) {
    let (mut capacity, mut len): (DynvoxCapacity, usize) = (unsafe { std::mem::zeroed() }, 0);
    assert_eq!(
        unsafe { dynvox_capacity_of_profile(DYNVOX_PROFILE_TINY, &raw mut capacity) },
        DynvoxStatus::Ok
    );
    // The named profiles hold no raw images.
    (capacity.raw_width, capacity.raw_height) = (RAW[0], RAW[1]);
    assert_eq!(unsafe { dynvox_bytes(&raw const capacity, &raw mut len) }, DynvoxStatus::Ok);
    (capacity, len)
}

/// Digest that the second of two equal frames gives, or the first status that is not OK.
fn digest_of(
    images: [&[u8]; 2],
    stride: usize,
    change: impl Fn(&mut DynvoxFrame),
) -> Result<u64, DynvoxStatus> {
    let (capacity, len) = capacity_and_bytes();
    let mut buffer = vec![0u8; len + dynvox_alignment()];
    let start = buffer.as_ptr().align_offset(dynvox_alignment());
    let (config, mut mapper) = (config_of(&rig()).unwrap(), ptr::null_mut());
    let at = buffer[start..].as_mut_ptr();
    assert_eq!(
        unsafe { dynvox_create(&raw const capacity, &raw const config, at, len, &raw mut mapper) },
        DynvoxStatus::Ok
    );
    let [left, right] = images.map(|pixels| DynvoxImage { pixels: pixels.as_ptr(), stride });
    let mut frame: DynvoxFrame = unsafe { std::mem::zeroed() };
    (frame.width, frame.height) = (RAW[0], RAW[1]);
    (frame.left, frame.right) = (left, right);
    change(&mut frame);
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    // The second frame is matched with the first.
    for _ in 0..2 {
        match unsafe { dynvox_step(mapper, &raw const frame, ptr::null(), &raw mut report) } {
            DynvoxStatus::Ok => {}
            status => return Err(status),
        }
    }
    assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::Ok);
    Ok(report.digest)
}

#[test]
fn raw_pairs_give_the_digests_of_the_core() {
    let config = config_of(&rig()).unwrap();
    assert!(
        (config.rig.baseline_m - 0.5).abs() < 1e-12 && config.rig.focal_px > 80.0,
        "{:?}",
        config.rig
    );
    // Disparities of 4 px.
    let digest = digest_of([&pixels(0), &pixels(4)], RAW[0], |_| {});
    let of_core = Capacity { raw_width: RAW[0], raw_height: RAW[1], ..Capacity::TINY };
    assert_eq!(digest, Ok(digest_of_core(&of_core)));
}

/// Samples packed in groups, a byte of low bits, which are not read, after each.
fn packed(pixels: &[u8], group: usize) -> Vec<u8> {
    pixels.chunks(group).flat_map(|samples| samples.iter().copied().chain([0x5A])).collect()
}

#[test]
fn packed_samples_give_the_digest_of_bytes() {
    let (left, right) = (pixels(0), pixels(4));
    let of_bytes = digest_of([&left, &right], RAW[0], |_| {});
    for (layout, group) in [(DYNVOX_SAMPLES_PACKED_10, 4), (DYNVOX_SAMPLES_PACKED_12, 2)] {
        let images = [&left, &right].map(|pixels| packed(pixels, group));
        let images = [&images[0][..], &images[1]];
        let row = RAW[0] + RAW[0] / group;
        let digest = |stride, layout| digest_of(images, stride, |frame| frame.layout = layout);
        assert_eq!(digest(row, layout), of_bytes, "layout {layout}");
        assert_ne!(digest(row, DYNVOX_SAMPLES_BYTES), of_bytes, "read as bytes");
        assert_eq!(digest(row - 1, layout), Err(DynvoxStatus::Size), "rows that are too short");
        assert_eq!(digest(row, 3), Err(DynvoxStatus::Unknown));
    }
}

#[test]
fn marks_and_disparities_of_raw_pairs_have_the_rectified_size() {
    let (left, right) = (pixels(0), pixels(4));
    let rectified = RECTIFIED[0] as usize * RECTIFIED[1] as usize;
    let ignoring = |value| {
        let marks = vec![value; rectified];
        digest_of([&left, &right], RAW[0], |frame| {
            frame.ignored = DynvoxImage { pixels: marks.as_ptr(), stride: RECTIFIED[0] as usize };
        })
    };
    let plain = digest_of([&left, &right], RAW[0], |_| {});
    assert!(ignoring(1).is_ok());
    assert_ne!(ignoring(1), plain, "nothing is left to map");
    assert_eq!(ignoring(0), plain, "nothing is marked");
    let near = vec![9 << 8; rectified];
    let given = digest_of([&left, &right], RAW[0], |frame| frame.disparity_q8 = near.as_ptr());
    assert!(given.is_ok_and(|digest| Ok(digest) != plain), "{given:?}");
}

#[test]
fn what_cannot_be_rectified_is_a_status() {
    let refused = |change: fn(&mut DynvoxRawRig)| {
        let mut rig = rig();
        change(&mut rig);
        config_of(&rig).err()
    };
    assert_eq!(refused(|rig| rig.left.model = 9), Some(DynvoxStatus::Unknown));
    assert_eq!(refused(|rig| rig.right.focal_px[0] = -1.0), Some(DynvoxStatus::Config));
    assert_eq!(refused(|rig| rig.r_right_left[0] = 3.0), Some(DynvoxStatus::Config));
    assert_eq!(refused(|rig| rig.t_right_left_m[0] = 0.5), Some(DynvoxStatus::Config), "exchanged");
    assert_eq!(refused(|rig| rig.width = 0), Some(DynvoxStatus::Size));
    assert_eq!(unsafe { dynvox_config_raw(ptr::null(), ptr::null_mut()) }, DynvoxStatus::Null);
}
