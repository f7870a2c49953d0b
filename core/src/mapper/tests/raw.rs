//! Raw pairs: the mapper's own rectification, and pixels that show nothing.

use super::*;
use crate::{
    Digested,
    image::{InvalidPixels, SampleLayout},
    rectify::{Lens, LensModel, RawCamera, RawRig, Rectification, RectifierError, Sizing},
};
use nalgebra::Matrix3;

const RAW: Capacity = Capacity { raw_width: WIDTH, raw_height: HEIGHT, ..CAPACITY };

/// The walk's pictures taken for those of bent lenses, the right camera rolled: what they show is
/// of no matter here.
fn config(focal_px: Option<f64>) -> Config {
    let model = LensModel::RadialTangential {
        radial: [-0.05, 0.01, 0.0, 0.0, 0.0, 0.0],
        tangential: [1e-4, 0.0],
    };
    let lens = Lens::new([RIG.focal_px; 2], [RIG.center_u_px, RIG.center_v_px], model).unwrap();
    let camera = RawCamera { lens, width: WIDTH as u32, height: HEIGHT as u32 };
    // The right camera is rolled by 4 mrad.
    let (sine, cosine) = (0.004f64.sin(), 0.004f64.cos());
    let raw = RawRig {
        left: camera,
        right: camera,
        r_right_left: Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0),
        t_right_left_m: Vector3::new(-RIG.baseline_m, 0.0, 0.0),
    };
    let sizing = Sizing::Given { width: WIDTH as u32, height: HEIGHT as u32, focal_px };
    let (rectification, rig) = Rectification::new(&raw, sizing).unwrap();
    Config { rig, rectification: Some(rectification), ..Walk::config() }
}

fn with_raw_mapper<R>(config: &Config, test: impl FnOnce(&mut Mapper<'_>) -> R) -> R {
    let mut slab = vec![0u8; RAW.bytes() + SLAB_ALIGN];
    test(&mut Mapper::new(&RAW, config, &mut slab).unwrap())
}

/// Rows of packed samples, `stride` apart, whose upper bits are those of the image and whose lower
/// ones mean nothing.
fn packed(image: &[u8], layout: SampleLayout, stride: usize) -> Vec<u8> {
    let mut memory = vec![0xA5; stride * HEIGHT];
    for (row, samples) in memory.chunks_exact_mut(stride).zip(image.chunks_exact(WIDTH)) {
        // Four samples, then their eight lower bits; or two.
        let group = if layout == SampleLayout::Packed10 { 4 } else { 2 };
        for (bytes, samples) in row.chunks_mut(group + 1).zip(samples.chunks(group)) {
            bytes[..samples.len()].copy_from_slice(samples);
        }
    }
    memory
}

#[test]
fn packed_samples_give_the_bits_of_their_upper_eight() {
    let (walk, config) = (Walk::new(4), config(None));
    let digests = |layout: SampleLayout, stride: usize| -> Vec<u64> {
        with_raw_mapper(&config, |mapper| {
            let step = |[left, right]: &[Vec<u8>; 2]| {
                let memory = [left, right].map(|image| match layout {
                    SampleLayout::Bytes => image.clone(),
                    _ => packed(image, layout, stride),
                });
                let [left, right] = memory
                    .each_ref()
                    .map(|bytes| View::with_stride(bytes, WIDTH, HEIGHT, stride).unwrap());
                let frame = StereoFrame { layout, ..StereoFrame::pair(left, right) };
                mapper.step(&frame, &Serial).unwrap().digest
            };
            walk.pairs.iter().map(step).collect()
        })
    };
    let bytes = digests(SampleLayout::Bytes, WIDTH);
    for (layout, padding) in
        [(SampleLayout::Packed10, 0), (SampleLayout::Packed10, 24), (SampleLayout::Packed12, 7)]
    {
        assert_eq!(digests(layout, layout.row_bytes(WIDTH) + padding), bytes, "{layout:?}");
    }
}

#[test]
fn packed_samples_that_cannot_be_read_are_refused() {
    let memory = vec![0u8; SampleLayout::Packed10.row_bytes(WIDTH) * HEIGHT];
    let tight = View::new(&memory, WIDTH, HEIGHT).unwrap();
    let frame = StereoFrame { layout: SampleLayout::Packed10, ..StereoFrame::pair(tight, tight) };
    let row_bytes = SampleLayout::Packed10.row_bytes(WIDTH);
    with_raw_mapper(&config(None), |mapper| {
        let refusal = mapper.step(&frame, &Serial).unwrap_err();
        assert_eq!(refusal, StepError::PackedTooShort { row_bytes });
    });
    let rectified = Config { rectification: None, ..config(None) };
    with_raw_mapper(&rectified, |mapper| {
        assert_eq!(mapper.step(&frame, &Serial).unwrap_err(), StepError::PackedNotRectified);
    });
}

#[test]
fn a_raw_pair_is_mapped_as_the_rectified_pair_is() {
    let (walk, config) = (Walk::new(4), config(None));
    let mut rectified = Vec::new();
    let raw: Vec<Report> = with_raw_mapper(&config, |mapper| {
        assert!(mapper.rectifier.invalid().is_none());
        let step = |at| {
            let report = walk.step(at, mapper);
            // What the rectifier made of each pair, to be given to a mapper that does not rectify.
            rectified.push(mapper.rectified_pair().unwrap().map(|image| image.pixels().to_vec()));
            report
        };
        (0..4).map(step).collect()
    });
    // Its twin gets the rectified pictures.
    let ready = Walk { pairs: rectified, ..walk };
    let plain = Config { rectification: None, ..config };
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&CAPACITY, &plain, &mut slab).unwrap();
    for (at, raw) in raw.iter().enumerate() {
        let report = ready.step(at, &mut mapper);
        assert_eq!(
            raw.digests.first_difference(&report.digests),
            Some(Digested::Input),
            "the input alone differs"
        );
        assert_eq!(
            StageDigests { input: 0, ..raw.digests },
            StageDigests { input: 0, ..report.digests }
        );
        assert!(raw.rectify.is_some() && report.rectify.is_none() && raw.digest != report.digest);
    }
}

#[test]
fn every_profile_has_regions_left_for_raw_pairs_planning_and_places() {
    for (name, profile) in Capacity::PROFILES {
        let raw = Capacity {
            raw_width: 1_392,
            raw_height: 512,
            colour: true,
            planning_width: 40,
            planning_length: 40,
            planning_height: 8,
            planning_distance_3d: true,
            keyframes: 10,
            ..profile
        };
        assert_eq!(raw.footprint().bytes(), raw.bytes(), "{name}: a region is not in the list");
    }
}

#[test]
fn pixels_that_show_nothing_have_neither_disparity_nor_match() {
    // A shorter focal length: the rectified image reaches beyond the raw one.
    let (walk, config) = (Walk::new(3), config(Some(0.7 * RIG.focal_px)));
    with_raw_mapper(&config, |mapper| {
        let mut valid = 0;
        for at in 0..3 {
            let report = walk.step(at, mapper);
            assert!(report.rectify.unwrap().invalid_left > 1_000);
            let invalid = mapper.rectifier.invalid().unwrap();
            for (v, row) in mapper.disparity_q8().rows().enumerate() {
                valid += row.iter().filter(|disparity| **disparity != 0).count();
                assert!(invalid.left.in_row(v).all(|u| row[u] == 0), "row {v}");
            }
            let shows = |invalid: &InvalidPixels<'_>, at: [f32; 2]| {
                !invalid.contains(at[0] as usize, at[1] as usize)
            };
            // Matches of both images, each with its own invalid pixels.
            let right = invalid.right.unwrap();
            assert!(mapper.scene_flow.sparse().iter().all(|m| {
                shows(&invalid.left, m.current_left) && shows(&right, m.current_right)
            }));
        }
        assert!(valid > WIDTH * HEIGHT / 4 && !mapper.scene_flow.sparse().is_empty());
    });
}

#[test]
fn a_raw_mapper_goes_on_from_its_snapshot_and_refuses_other_sizes() {
    // With invalid pixels, which a restored mapper must know again.
    let (walk, config) = (Walk::new(4), config(Some(0.7 * RIG.focal_px)));
    let mut saved = Vec::new();
    let next = with_raw_mapper(&config, |mapper| {
        for at in 0..3 {
            walk.step(at, mapper);
        }
        let mut sink = |bytes: &[u8]| {
            saved.extend_from_slice(bytes);
            Ok::<(), ()>(())
        };
        mapper.save(&mut sink).unwrap();
        walk.step(3, mapper)
    });
    let mut slab = vec![0u8; RAW.bytes() + SLAB_ALIGN];
    let mut rest = saved.as_slice();
    let mut source = |bytes: &mut [u8]| {
        let (now, later) = rest.split_at_checked(bytes.len()).ok_or(())?;
        bytes.copy_from_slice(now);
        rest = later;
        Ok::<(), ()>(())
    };
    let mut mapper = Mapper::restore(&RAW, &config, &mut slab, &mut source).unwrap();
    let restored = walk.step(3, &mut mapper);
    assert_eq!((restored.digest, restored.digests), (next.digest, next.digests));

    // Another size than the calibration's.
    let small = vec![0u8; 100 * 80];
    let small = View::new(&small, 100, 80).unwrap();
    let refused = mapper.step(&StereoFrame::pair(small, small), &Serial);
    assert_eq!(refused.unwrap_err(), StepError::RawSizeDiffers { width: WIDTH, height: HEIGHT });
    // A capacity without raw images cannot rectify.
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let refused = Mapper::new(&CAPACITY, &config, &mut slab).unwrap_err();
    assert_eq!(
        refused,
        NewError::Rectification(RectifierError::RawTooLarge { width: 0, height: 0 })
    );
}

#[test]
fn bytes_are_those_of_the_regions() {
    assert_eq!(RAW.footprint().bytes(), RAW.bytes());
    let pixels = CAPACITY.pixels();
    let words = WIDTH.div_ceil(64) * HEIGHT;
    let whole = |bytes: usize| bytes.next_multiple_of(SLAB_ALIGN);
    assert_eq!(
        RAW.bytes() - CAPACITY.bytes(),
        2 * (whole(4 * pixels) + whole(8 * words) + whole(pixels))
    );
}
