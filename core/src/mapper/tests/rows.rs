//! A pair whose rows do not agree, as a calibration leaves it.

use super::*;
use crate::{geometry::scalar::clamp_f32, image::View, rectify::self_calibration::SelfCalibrationMode};

const FRAMES: usize = 8;

/// The report and the disparities of the last frame of a walk whose right images are moved down by `moved_px` of the column.
fn driven(config: &Config, moved_px: impl Fn(f32) -> f32) -> (Report, Vec<u16>) {
    let walk = Walk::new(FRAMES);
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&CAPACITY, config, &mut slab[start..]).unwrap();
    let mut last = None;
    for [left, right] in &walk.pairs {
        let moved: Vec<u8> = (0..WIDTH * HEIGHT)
            .map(|at| {
                let from = (at / WIDTH) as f32 - moved_px((at % WIDTH) as f32);
                let from = clamp_f32(from, 0.0, (HEIGHT - 1) as f32);
                let (upper, share) = (from as usize, from.fract());
                let pixel = |row: usize| f32::from(right[row.min(HEIGHT - 1) * WIDTH + at % WIDTH]);
                (pixel(upper) * (1.0 - share) + pixel(upper + 1) * share).round() as u8
            })
            .collect();
        let [left, right] = [left, &moved].map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        last = Some(mapper.step(&StereoFrame::pair(left, right), &Serial).unwrap());
    }
    (last.unwrap(), mapper.stereo.disparity_q8().pixels().to_vec())
}

/// Share of the pixels with both disparities in which these are within a quarter of a pixel.
fn agreement(a: &[u16], b: &[u16]) -> f64 {
    let differences: Vec<u16> = a.iter().zip(b).filter(|(a, b)| **a > 0 && **b > 0).map(|(a, b)| a.abs_diff(*b)).collect();
    differences.iter().filter(|&&difference| difference <= 64).count() as f64 / differences.len() as f64
}

#[test]
fn rows_that_a_calibration_left_apart_are_aligned() {
    // A roll of the right camera: a pixel and a half down at one side, and up at the other.
    let roll = |u: f32| 1.5 - 3.0 * u / WIDTH as f32;
    let mut off = Walk::config();
    off.rig_settings.self_calibration = SelfCalibrationMode::Off;
    let (sound, exact) = driven(&Walk::config(), |_| 0.0);
    assert!(sound.self_calibration.row_error_px < 0.1, "{:?}", sound.self_calibration);
    let (aligned, close) = driven(&Walk::config(), roll);
    assert!((1.2..2.2).contains(&aligned.self_calibration.row_error_px), "{:?}", aligned.self_calibration);
    let (apart, far) = driven(&off, roll);
    assert_eq!(apart.self_calibration.row_error_px, 0.0);
    let [close, far] = [&close, &far].map(|disparities| agreement(&exact, disparities));
    assert!(close > 0.95 && far < 0.9, "{close} aligned, {far} without");
}
