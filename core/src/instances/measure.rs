//! One object's motion in one frame: an estimate that sorts out the outliers, then the filter.

use super::{
    config::MotionConfig,
    filter::{Filter, Sighting},
};
use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform, renormalised},
    random::Random,
    scene_flow::Match,
};
use nalgebra::Point3;

/// Smallest disparity a point is triangulated from, px.
const DISPARITY_MIN_PX: f64 = 0.1;

/// The camera and the time between two frames, to measure motions over ground by.
pub(super) struct Ground<'a> {
    pub rig: &'a StereoRig,
    pub t_world_camera: &'a Transform,
    pub t_current_previous: &'a Transform,
    pub interval_s: f64,
}

/// How a measurement went.
pub(super) struct Measured {
    pub matches: u32,
    pub inliers: u32,
    pub measured: bool,
}

/// Estimates a motion from an object's matches and lets the filter, already predicted, take in those it explains.
pub(super) fn measure<'m>(
    config: &MotionConfig,
    ground: &Ground<'_>,
    matches: impl Iterator<Item = &'m Match> + Clone,
    filter: &mut Filter,
    seed: u64,
    estimator: &mut Estimator<'_>,
) -> Measured {
    let points = matches.clone().count() as u32;
    let mut measured = Measured { matches: points, inliers: 0, measured: false };
    let needed = if filter.is_known() { config.matches_again } else { config.matches_min };
    if points < u32::from(needed) {
        return measured;
    }
    // Where the motion so far would take the object, seen from the camera.
    let camera_world = ground.t_world_camera.inverse();
    let motion_camera = camera_world * filter.motion(ground.interval_s) * ground.t_world_camera;
    let expected = renormalised(&(motion_camera * ground.t_current_previous));
    let settings = config.estimator();
    let estimate = estimator.estimate(&settings, ground.rig, matches.clone(), &mut Random::new(seed), Some(&expected));
    if estimate.t_current_previous.is_none() {
        return measured;
    }
    measured.inliers = estimate.inliers;
    let inlying = Inlying { indexed: (0u32..).zip(matches), inliers: estimator.inliers() };
    let sightings = inlying.filter_map(|m| sighting(m, ground));
    let noise_px =
        if estimate.residual_rms_px > f64::from(config.noise_px) { estimate.residual_rms_px } else { f64::from(config.noise_px) };
    measured.measured = filter.update(config, ground.rig, ground.t_world_camera, ground.interval_s, noise_px, sightings);
    measured
}

/// The matches at the positions `inliers` names, in ascending order both.
#[derive(Clone)]
struct Inlying<M, I> {
    indexed: M,
    inliers: I,
}

impl<'m, M: Iterator<Item = (u32, &'m Match)>, I: Iterator<Item = u32>> Iterator for Inlying<M, I> {
    type Item = &'m Match;

    fn next(&mut self) -> Option<&'m Match> {
        let wanted = self.inliers.next()?;
        self.indexed.find(|(index, _)| *index == wanted).map(|(_, m)| m)
    }
}

/// A match as the filter takes it: its point triangulated in the previous camera and carried along by the camera's motion.
fn sighting(m: &Match, ground: &Ground<'_>) -> Option<Sighting> {
    let rig = ground.rig;
    let centered = |[u, v]: [f32; 2]| [f64::from(u) - rig.center_u_px, f64::from(v) - rig.center_v_px];
    let ([u, v], [u_right, v_right]) = (centered(m.previous_left), centered(m.previous_right));
    let disparity = u - u_right;
    // Not so for NaN.
    let triangulates = disparity >= DISPARITY_MIN_PX;
    if !triangulates {
        return None;
    }
    let per_px = rig.baseline_m / disparity;
    let before = Point3::new(u * per_px, 0.5 * (v + v_right) * per_px, rig.focal_px * per_px);
    Some(Sighting {
        standing: ground.t_current_previous * before,
        left: centered(m.current_left),
        right: centered(m.current_right),
    })
}
