//! One object's motion in one frame: an estimate that sorts out the outliers, then the filter.
//!
//! An object's points lie together: a match much nearer or farther than the middle one (by disparity) is not on the object but on what hides
//! it, or behind it. Were it nearer it would count more than all the object's own.

use super::{
    config::MotionConfig,
    filter::{Filter, Sighting},
};
use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
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

/// Half pixels of disparity the middle is sought among: up to 256 px.
const BINS: usize = 512;

/// Which matches can lie on one object.
#[derive(Clone, Copy)]
struct Reach {
    least_px: f64,
    most_px: f64,
}

impl Reach {
    /// Those no more than `config.extent_m` and three sigmas nearer or farther than the middle one.
    fn of<'m>(config: &MotionConfig, rig: &StereoRig, matches: impl Iterator<Item = &'m Match> + Clone) -> Self {
        let mut counts = [0u32; BINS];
        let mut total = 0;
        for m in matches {
            // What is not a number counts as 0.
            if let Some(count) = counts.get_mut((2.0 * disparity(m)) as usize) {
                *count += 1;
                total += 1;
            }
        }
        let mut below = 0;
        let middle = counts.iter().position(|&count| {
            below += count;
            2 * below > total
        });
        let middle_px = (middle.unwrap_or(0) as f64 + 0.5) * 0.5;
        let slack_px = 3.0 * core::f64::consts::SQRT_2 * f64::from(config.noise_px) + 0.5;
        let depth_m = rig.focal_baseline_px_m() / middle_px;
        let nearest_m = depth_m - f64::from(config.extent_m);
        let most_px = if nearest_m > 0.0 { rig.focal_baseline_px_m() / nearest_m } else { f64::MAX };
        Self {
            least_px: rig.focal_baseline_px_m() / (depth_m + f64::from(config.extent_m)) - slack_px,
            most_px: most_px + slack_px,
        }
    }

    fn holds(&self, m: &Match) -> bool {
        let disparity = disparity(m);
        disparity >= self.least_px && disparity <= self.most_px
    }
}

/// Disparity in the previous frame, px.
fn disparity(m: &Match) -> f64 {
    f64::from(m.previous_left[0]) - f64::from(m.previous_right[0])
}

/// Estimates a motion from an object's matches and lets the filter, already predicted, take in those it explains.
///
/// `look`, where matches are few, finds more of them where a motion from the previous camera to the current one puts them, and writes them to the
/// slice beside it: the motion so far or, of a thing seen for the first time, that of the few; where they have none, that of a thing that stands.
pub(super) fn measure<'m>(
    config: &MotionConfig,
    ground: &Ground<'_>,
    matches: impl Iterator<Item = &'m Match> + Clone,
    look: Option<(impl FnOnce(&Transform, &mut [Match]) -> usize, &'m mut [Match])>,
    filter: &mut Filter,
    seed: u64,
    estimator: &mut Estimator<'_>,
) -> Measured {
    let settings = config.estimator();
    // Where the motion so far would take the object, seen from the camera.
    let camera_world = ground.t_world_camera.inverse();
    let motion_camera = camera_world * filter.motion(ground.interval_s) * ground.t_world_camera;
    let mut expected = (motion_camera * ground.t_current_previous).normalized();
    let mut found: &'m [Match] = &[];
    if let Some((look, room)) = look {
        if !filter.is_known() {
            let reach = Reach::of(config, ground.rig, matches.clone());
            let matches = matches.clone().filter(|m| reach.holds(m));
            let guess = estimator.estimate(&settings, ground.rig, matches, &mut Random::new(seed), Some(&expected));
            expected = guess.t_current_previous.unwrap_or(expected);
        }
        let count = look(&expected, room);
        found = room.get(..count).unwrap_or(&[]);
    }
    let matches = matches.chain(found);
    let reach = Reach::of(config, ground.rig, matches.clone());
    let matches = matches.filter(move |m| reach.holds(m));
    let points = matches.clone().count() as u32;
    let mut measured = Measured { matches: points, inliers: 0, measured: false };
    let needed = if filter.is_known() { config.matches_again } else { config.matches_min };
    if points < u32::from(needed) {
        return measured;
    }
    let estimate = estimator.estimate(&settings, ground.rig, matches.clone(), &mut Random::new(seed), Some(&expected));
    if estimate.t_current_previous.is_none() {
        return measured;
    }
    measured.inliers = estimate.inliers;
    let inlying = Inlying { indexed: (0u32..).zip(matches), inliers: estimator.inliers() };
    let noise_px =
        if estimate.residual_rms_px > f64::from(config.noise_px) { estimate.residual_rms_px } else { f64::from(config.noise_px) };
    let sightings = inlying.filter_map(|m| sighting(m, ground));
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
        standing: ground.t_current_previous.transform_point(before),
        left: centered(m.current_left),
        right: centered(m.current_right),
    })
}
