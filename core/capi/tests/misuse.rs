//! What is done wrong comes back as a status.
#![allow(missing_docs, clippy::unwrap_used, clippy::indexing_slicing)]
#![expect(clippy::undocumented_unsafe_blocks, reason = "each call keeps the header's promises, but for the one it breaks on purpose")]

use dynvox_capi::*;
use std::{ffi::c_void, ptr};

const WIDTH: usize = 160;
const HEIGHT: usize = 64;

/// A buffer aligned as a mapper wants it, and a mapper's size.
struct Buffer {
    bytes: Vec<u8>,
    start: usize,
    len: usize,
}

impl Buffer {
    fn new() -> Self {
        let mut len = 0;
        assert_eq!(unsafe { dynvox_bytes(DYNVOX_PROFILE_TINY, &raw mut len) }, DynvoxStatus::Ok);
        let bytes = vec![0xAA; len + 2 * dynvox_alignment()];
        let start = bytes.as_ptr().align_offset(dynvox_alignment());
        Self { bytes, start, len }
    }

    fn at(&mut self, offset: usize) -> *mut u8 {
        self.bytes[self.start + offset..].as_mut_ptr()
    }
}

fn config() -> DynvoxConfig {
    let rig = DynvoxRig { focal_px: 100.0, center_u_px: 80.0, center_v_px: 32.0, baseline_m: 0.5 };
    let mut config = unsafe { std::mem::zeroed() };
    assert_eq!(unsafe { dynvox_config_default(&raw const rig, &raw mut config) }, DynvoxStatus::Ok);
    config.voxel_size_m = 0.1;
    config
}

fn create(buffer: &mut Buffer, config: &DynvoxConfig) -> Result<*mut DynvoxMapper, DynvoxStatus> {
    let (len, mut mapper) = (buffer.len, ptr::null_mut());
    match unsafe { dynvox_create(DYNVOX_PROFILE_TINY, config, buffer.at(0), len, &raw mut mapper) } {
        DynvoxStatus::Ok => Ok(mapper),
        status => Err(status),
    }
}

fn pixels() -> Vec<u8> {
    (0..WIDTH * HEIGHT).map(|i| (i as u32).wrapping_mul(2_654_435_761).rotate_left(9) as u8).collect()
}

fn frame(pixels: &[u8]) -> DynvoxFrame {
    let image = DynvoxImage { pixels: pixels.as_ptr(), stride: WIDTH };
    DynvoxFrame {
        width: WIDTH,
        height: HEIGHT,
        left: image,
        right: image,
        colour: DynvoxImage { pixels: ptr::null(), stride: 0 },
        detections: ptr::null(),
        detection_count: 0,
        t_world_camera: ptr::null(),
    }
}

fn step(mapper: *mut DynvoxMapper, frame: &DynvoxFrame) -> DynvoxStatus {
    unsafe { dynvox_step(mapper, frame, ptr::null(), ptr::null_mut()) }
}

#[test]
fn buffers_too_small_null_or_misaligned_are_refused() {
    let mut buffer = Buffer::new();
    let (config, len, mut mapper) = (config(), buffer.len, ptr::null_mut());
    let mut make = |profile, config: *const _, start, len| unsafe { dynvox_create(profile, config, start, len, &raw mut mapper) };
    assert_eq!(make(0, &raw const config, buffer.at(0), len - 1), DynvoxStatus::TooSmall);
    assert_eq!(make(0, &raw const config, buffer.at(8), len), DynvoxStatus::Misaligned);
    assert_eq!(make(0, &raw const config, ptr::null_mut(), len), DynvoxStatus::Null);
    assert_eq!(make(0, ptr::null(), buffer.at(0), len), DynvoxStatus::Null);
    assert_eq!(make(9, &raw const config, buffer.at(0), len), DynvoxStatus::Unknown);
    assert_eq!(make(0, &raw const config, buffer.at(0), len), DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_bytes(0, ptr::null_mut()) }, DynvoxStatus::Null);
}

#[test]
fn a_calibration_that_is_not_a_number_is_refused_with_its_name() {
    let mut buffer = Buffer::new();
    for value in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let mut config = config();
        config.rig.focal_px = value;
        assert_eq!(create(&mut buffer, &config), Err(DynvoxStatus::Config));
        let mut text = [1i8; 16];
        assert_eq!(unsafe { dynvox_config_problem(&raw const config, text.as_mut_ptr().cast(), 16) }, DynvoxStatus::Ok);
        let text: String = text.iter().take_while(|&&byte| byte != 0).map(|&byte| byte as u8 as char).collect();
        assert_eq!(text, "rig.focal_px mu", "cut off to fit");
    }
}

#[test]
fn frames_that_are_not_what_they_should_be_are_refused_and_change_nothing() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    let pixels = pixels();
    let good = frame(&pixels);
    assert_eq!(unsafe { dynvox_step(mapper, ptr::null(), ptr::null(), ptr::null_mut()) }, DynvoxStatus::Null);
    let image = |pixels, stride| DynvoxImage { pixels, stride };
    assert_eq!(step(mapper, &DynvoxFrame { left: image(ptr::null(), WIDTH), ..good }), DynvoxStatus::Null);
    assert_eq!(step(mapper, &DynvoxFrame { left: image(pixels.as_ptr(), WIDTH - 1), ..good }), DynvoxStatus::Size);
    assert_eq!(step(mapper, &DynvoxFrame { left: image(pixels.as_ptr(), usize::MAX), ..good }), DynvoxStatus::Size);
    assert_eq!(step(mapper, &DynvoxFrame { width: 16, ..good }), DynvoxStatus::Size);
    assert_eq!(step(mapper, &DynvoxFrame { height: 0, ..good }), DynvoxStatus::Size);
    let inside = buffer.at(4_096);
    assert_eq!(step(mapper, &DynvoxFrame { right: image(inside, WIDTH), ..good }), DynvoxStatus::Overlap);
    let pose = DynvoxPose { rotation: [1.0, 0.0, 0.0, 0.0], translation_m: [0.0, f64::NAN, 0.0] };
    assert_eq!(step(mapper, &DynvoxFrame { t_world_camera: &raw const pose, ..good }), DynvoxStatus::Pose);
    let pose = DynvoxPose { rotation: [2.0, 0.0, 0.0, 0.0], ..pose };
    assert_eq!(step(mapper, &DynvoxFrame { t_world_camera: &raw const pose, ..good }), DynvoxStatus::Pose);
    let seen = DynvoxDetection {
        class_code: 99,
        score: 1.0,
        left: 0,
        top: 0,
        width: 4,
        height: 4,
        mask: pixels.as_ptr(),
    };
    let detected = |seen: &[DynvoxDetection]| DynvoxFrame { detections: seen.as_ptr(), detection_count: seen.len(), ..good };
    assert_eq!(step(mapper, &detected(&[seen])), DynvoxStatus::Unknown);
    assert_eq!(step(mapper, &detected(&[DynvoxDetection { class_code: 1, mask: ptr::null(), ..seen }])), DynvoxStatus::Null);
    assert_eq!(step(mapper, &detected(&[DynvoxDetection { class_code: 1, ..seen }; 65])), DynvoxStatus::TooMany);
    let mut report: DynvoxReport = unsafe { std::mem::zeroed() };
    assert_eq!(unsafe { dynvox_step(mapper, &raw const good, ptr::null(), &raw mut report) }, DynvoxStatus::Ok);
    assert_eq!(report.frame, 0, "none of the above was taken");
    assert_eq!(step(mapper, &detected(&[DynvoxDetection { class_code: 1, score: f32::NAN, ..seen }])), DynvoxStatus::Ok);
    let other = DynvoxFrame { height: HEIGHT - 1, ..good };
    assert_eq!(step(mapper, &other), DynvoxStatus::SizeChanged);
}

#[test]
fn handles_of_nothing_are_told_from_mappers() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    let mut pose = DynvoxPose::default();
    let mut picture: DynvoxPicture = unsafe { std::mem::zeroed() };
    assert_eq!(unsafe { dynvox_pose(mapper, &raw mut pose) }, DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_raycast(mapper, &raw const pose, &raw mut picture) }, DynvoxStatus::NoFrame);
    assert_eq!(step(mapper, &frame(&pixels())), DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_raycast(mapper, &raw const pose, &raw mut picture) }, DynvoxStatus::TooSmall);
    assert_eq!(unsafe { dynvox_triangles(mapper, None, ptr::null_mut(), ptr::null_mut()) }, DynvoxStatus::Null);
    assert_eq!(unsafe { dynvox_stream_out(mapper, ptr::null(), ptr::null_mut(), ptr::null_mut()) }, DynvoxStatus::Null);
    assert_eq!(unsafe { dynvox_pose(ptr::null_mut(), &raw mut pose) }, DynvoxStatus::Null);
    assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::Ok);
    assert_eq!(unsafe { dynvox_destroy(mapper) }, DynvoxStatus::NoMapper);
    assert_eq!(step(mapper, &frame(&pixels())), DynvoxStatus::NoMapper);
}

extern "C" fn call_back(context: *mut c_void, _: *const DynvoxTriangle) {
    let calls = context.cast::<(*mut DynvoxMapper, u32)>();
    let mut pose = DynvoxPose::default();
    // SAFETY: the context is the test's pair, the handle its mapper's.
    unsafe {
        (*calls).1 += 1;
        assert_eq!(dynvox_pose((*calls).0, &raw mut pose), DynvoxStatus::Busy);
        assert_eq!(dynvox_destroy((*calls).0), DynvoxStatus::Busy);
    }
}

#[test]
fn a_callback_cannot_call_its_own_mapper() {
    let mut buffer = Buffer::new();
    let mapper = create(&mut buffer, &config()).unwrap();
    let (left, mut right) = (pixels(), pixels());
    right.rotate_left(8);
    let mut frame = frame(&left);
    frame.right.pixels = right.as_ptr();
    assert_eq!(step(mapper, &frame), DynvoxStatus::Ok);
    assert_eq!(step(mapper, &frame), DynvoxStatus::Ok);
    let (mut context, mut count) = ((mapper, 0u32), 0);
    let status = unsafe { dynvox_triangles(mapper, Some(call_back), (&raw mut context).cast(), &raw mut count) };
    assert_eq!((status, u64::from(context.1)), (DynvoxStatus::Ok, count));
    assert!(count > 0, "the callback was called");
}
