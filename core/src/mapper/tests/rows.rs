//! A pair whose rows do not agree, as a calibration leaves it.

use super::*;
use crate::{
    geometry::scalar::clamp_f32, image::View, rectify::self_calibration::SelfCalibrationMode,
};

const FRAMES: usize = 8;

/// An image turned about its middle by a small angle.
fn turned(image: &[u8], angle_rad: f32) -> Vec<u8> {
    let pixel = |row: usize, column: usize| {
        f32::from(image[row.min(HEIGHT - 1) * WIDTH + column.min(WIDTH - 1)])
    };
    let between = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let [middle_u, middle_v] = [WIDTH, HEIGHT].map(|side| side as f32 / 2.0);
    let source = |at: usize| {
        let (u, v) = ((at % WIDTH) as f32, (at / WIDTH) as f32);
        // For small angles the sine is the angle and the cosine 1.
        let column = clamp_f32(u - angle_rad * (v - middle_v), 0.0, (WIDTH - 1) as f32);
        let row = clamp_f32(v + angle_rad * (u - middle_u), 0.0, (HEIGHT - 1) as f32);
        let along = |row: usize| {
            between(pixel(row, column as usize), pixel(row, column as usize + 1), column.fract())
        };
        between(along(row as usize), along(row as usize + 1), row.fract()).round() as u8
    };
    (0..WIDTH * HEIGHT).map(source).collect()
}

/// The report and the disparities of the last frame of a walk whose right images are turned.
fn driven(config: &Config, angle_rad: f32) -> (Report, Vec<u16>) {
    let walk = Walk::new(FRAMES);
    let mut slab = vec![0u8; CAPACITY.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&CAPACITY, config, &mut slab[start..]).unwrap();
    let mut last = None;
    for [left, right] in &walk.pairs {
        let right = turned(right, angle_rad);
        let [left, right] = [left, &right].map(|pixels| View::new(pixels, WIDTH, HEIGHT).unwrap());
        last = Some(mapper.step(&StereoFrame::pair(left, right), &Serial).unwrap());
    }
    (last.unwrap(), mapper.stereo.disparity_q8().pixels().to_vec())
}

/// Share of the pixels with both disparities in which these are within a quarter of a pixel.
fn agreement(a: &[u16], b: &[u16]) -> f64 {
    let differences: Vec<u16> =
        a.iter().zip(b).filter(|(a, b)| **a > 0 && **b > 0).map(|(a, b)| a.abs_diff(*b)).collect();
    differences.iter().filter(|&&difference| difference <= 64).count() as f64
        / differences.len() as f64
}

#[test]
fn rows_that_a_calibration_left_apart_are_aligned() {
    // A pixel and a half down at one side, and up at the other.
    let roll_rad = 3.0 / WIDTH as f32;
    let mut off = Walk::config();
    off.rig_settings.self_calibration = SelfCalibrationMode::Off;
    let (sound, exact) = driven(&Walk::config(), 0.0);
    assert!(sound.self_calibration.rows.largest_px() < 0.1, "{:?}", sound.self_calibration);
    let (aligned, close) = driven(&Walk::config(), roll_rad);
    assert!(
        (1.2..2.2).contains(&aligned.self_calibration.rows.largest_px()),
        "{:?}",
        aligned.self_calibration
    );
    let (apart, far) = driven(&off, roll_rad);
    assert_eq!(apart.self_calibration.rows.largest_px(), 0.0);
    let [close, far] = [&close, &far].map(|disparities| agreement(&exact, disparities));
    assert!(close > 0.95 && far < 0.9, "{close} aligned, {far} without");
}
