//! A disparity offset planted in real pictures, found from their own matches.

use crate::{
    Capacity, Serial,
    egomotion::{Egomotion, EgomotionConfig, Estimator, TimedMatches},
    geometry::{StereoRig, Transform},
    image::View,
    memory::{Carver, SLAB_ALIGN},
    rectify::self_calibration::{RigConfig, SelfCalibration, SelfCalibrationReport},
    scene_flow::{FlowMatcher, SceneFlowConfig},
};
use std::{path::Path, println, vec, vec::Vec};

const FRAMES: usize = 31;
/// The rig of KITTI odometry 06.
const RIG: StereoRig = StereoRig {
    focal_px: 707.0912,
    center_u_px: 601.8873,
    center_v_px: 183.1104,
    baseline_m: 379.8145 / 707.0912,
};

/// A grey picture, row by row.
struct Grey {
    pixels: Vec<u8>,
    width: usize,
    height: usize,
}

impl Grey {
    fn view(&self) -> View<'_, u8> {
        View::new(&self.pixels, self.width, self.height).unwrap()
    }
}

fn grey(camera: &str, frame: usize) -> Grey {
    let sequence = Path::new(dynvox_needs::data_folder!()).join("kitti-odometry/sequences/06");
    let picture = image::open(sequence.join(camera).join(std::format!("{frame:06}.png")))
        .unwrap()
        .into_luma8();
    let (width, height) = picture.dimensions();
    Grey { pixels: picture.into_raw(), width: width as usize, height: height as usize }
}

/// The picture moved to the right by `by_px`, with cubic interpolation.
fn shifted(picture: &Grey, by_px: f64) -> Grey {
    let Grey { pixels, width, height } = picture;
    let (width, height) = (*width, *height);
    let whole = (-by_px).floor();
    let t = -by_px - whole;
    // The weights of Catmull and Rom, by the fraction.
    let weights = [
        -0.5 * t + t * t - 0.5 * t * t * t,
        1.0 - 2.5 * t * t + 1.5 * t * t * t,
        0.5 * t + 2.0 * t * t - 1.5 * t * t * t,
        0.5 * t * t * (t - 1.0),
    ];
    let moved = |at: usize| {
        let (row, column) = (at / width, (at % width) as i64 + whole as i64 - 1);
        let pixel = |k: i64| {
            f64::from(pixels[row * width + (column + k).clamp(0, width as i64 - 1) as usize])
        };
        let sum: f64 = (0..4).zip(weights).map(|(k, weight)| weight * pixel(k)).sum();
        sum.round() as u8
    };
    Grey { pixels: (0..width * height).map(moved).collect(), width, height }
}

/// Returns the report with the right pictures moved by `by_px`, and the distance that the camera
/// drove, m.
fn driven(by_px: f64) -> (SelfCalibrationReport, f64) {
    let capacity = Capacity::ONBOARD;
    let bytes = FlowMatcher::bytes(&capacity) + Estimator::bytes(&capacity);
    let mut slab = vec![0; bytes + SLAB_ALIGN];
    let mut carver = Carver::new(&mut slab, bytes).unwrap();
    let (mut matcher, mut estimator) =
        (FlowMatcher::new_in(&capacity, &mut carver), Estimator::new_in(&capacity, &mut carver));
    let (mut camera, mut calibration) =
        (Egomotion::default(), SelfCalibration::new(&RigConfig::default()));
    for frame in 0..FRAMES {
        let (left, right) = (grey("image_0", frame), shifted(&grey("image_1", frame), by_px));
        let images = [left.view(), right.view()];
        matcher.push(&SceneFlowConfig::default(), images[0], images[1], &Serial);
        // Matches are corrected by what is known so far, as the mapper does.
        matcher.correct(calibration.pixel_correction(&RIG).unwrap_or_default());
        if frame > 0 {
            let estimate = camera.step(
                &EgomotionConfig::default(),
                &RIG,
                TimedMatches { interval_s: 0.1, matches: matcher.bucketed() },
                &mut estimator,
            );
            let observations = matcher.bucketed().map(|m| {
                [(m.previous_left, m.previous_right), (m.current_left, m.current_right)]
                    .map(|(l, r)| RIG.observation(l, r))
            });
            calibration.update(&RIG, observations, &estimate.t_current_previous.unwrap());
        }
    }
    let way: &Transform = camera.t_world_camera();
    (calibration.report(), way.distance_m())
}

#[dynvox_needs::clips("kitti-odometry/sequences/06")]
#[test]
fn an_offset_planted_in_real_pictures_is_found() {
    let (own, way_m) = driven(0.0);
    // In both directions: an offset of one sign could be a bias of the search.
    for planted in [-0.7, 0.7] {
        let (found, planted_way_m) = driven(planted);
        println!("{planted}: {found:?}; {planted_way_m} m for {way_m} m");
        assert!(
            // The recording has an offset of its own, to which the planted one adds.
            (found.offset_px - own.offset_px - planted).abs() < 0.05,
            "{planted}: {found:?}, {own:?}"
        );
        assert!((found.applied_offset_px - found.offset_px).abs() < 0.01);
        assert!(
            (planted_way_m / way_m - 1.0).abs() < 0.01,
            "{planted_way_m} m for {way_m} m: 3 per cent without correction"
        );
    }
}
