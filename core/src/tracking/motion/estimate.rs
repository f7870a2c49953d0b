//! One object's motion in one frame: an estimate that removes the outliers, then the filter.
//!
//! An object's points lie close together: a match much nearer or farther than the median (by
//! disparity) is not on the object but on what occludes it, or behind it. A nearer one would
//! outweigh all of the object's own.

use super::{FilterView, MotionConfig, MotionFilter, Observation};
use crate::{
    egomotion::{Estimator, MotionEstimate, MotionHypotheses},
    geometry::{StereoRig, Transform, histogram::Histogram},
    random::Random,
    scene_flow::Match,
    slices::clipped,
};
use nalgebra::Point3;

/// Least error of a match coordinate, px: the single-precision number nearest to 0.3.
const NOISE_PX: f64 = 0.3_f32 as f64;
/// Largest distance of a match from the median depth to be on the object, m; its error comes on
/// top.
const EXTENT_M: f64 = 5.0;

/// Camera and matches by which a frame's motions are measured.
pub(in super::super) struct MotionFrame<'a> {
    pub config: &'a MotionConfig,
    pub rig: &'a StereoRig,
    pub t_world_camera: &'a Transform,
    pub t_current_previous: &'a Transform,
    pub interval_s: f64,
    /// Seed of the random samples.
    pub seed: u64,
}

/// Search for more matches if there are few.
pub(in super::super) struct GuidedSearch<'m, F> {
    /// Searches where a motion from the previous camera to the current one projects them; returns
    /// how many it wrote.
    pub find: F,
    /// Buffer for the matches that are found.
    pub found: &'m mut [Match],
}

/// The outcome of an estimate.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct ObjectMotion {
    pub matches: u32,
    pub inliers: u32,
    pub measured: bool,
}

/// The disparities matches of one object can have. Their median is found to half a pixel, up to 256
/// px.
#[derive(Clone, Copy)]
struct DisparityRange {
    least_px: f64,
    max_px: f64,
}

impl DisparityRange {
    /// Keeps the matches no more than [`EXTENT_M`] and three sigmas nearer or farther than the
    /// median.
    fn new<'m>(rig: &StereoRig, matches: impl Iterator<Item = &'m Match> + Clone) -> Self {
        let mut disparities = Histogram::new();
        for m in matches {
            // What is not a number counts as 0.
            disparities.add((2.0 * disparity(m)) as usize);
        }
        let median_px = (disparities.median().unwrap_or(0) as f64 + 0.5) * 0.5;
        let slack_px = 3.0 * core::f64::consts::SQRT_2 * NOISE_PX + 0.5;
        let depth_m = rig.focal_baseline_px_m() / median_px;
        let nearest_m = depth_m - EXTENT_M;
        let max_px = if nearest_m > 0.0 { rig.focal_baseline_px_m() / nearest_m } else { f64::MAX };
        Self {
            least_px: rig.focal_baseline_px_m() / (depth_m + EXTENT_M) - slack_px,
            max_px: max_px + slack_px,
        }
    }

    fn contains(&self, m: &Match) -> bool {
        let disparity = disparity(m);
        disparity >= self.least_px && disparity <= self.max_px
    }
}

/// Disparity in the previous frame, px.
fn disparity(m: &Match) -> f64 {
    f64::from(m.previous_left[0]) - f64::from(m.previous_right[0])
}

impl MotionFrame<'_> {
    /// Estimates a motion from an object's matches and updates the filter, already predicted, by
    /// its inliers.
    ///
    /// `search`, given where matches are few, finds more: by the motion so far or, of an object
    /// without one, by that of the few matches; where they have none, by that of a static object.
    pub fn estimate<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        search: Option<GuidedSearch<'m, impl FnOnce(&Transform, &mut [Match]) -> usize>>,
        filter: &mut MotionFilter,
        estimator: &mut Estimator<'_>,
    ) -> ObjectMotion {
        // Where the motion so far would take the object, seen from the camera.
        let camera_world = self.t_world_camera.inverse();
        let motion_camera = camera_world * filter.motion(self.interval_s) * self.t_world_camera;
        let mut expected = (motion_camera * self.t_current_previous).normalized();
        let mut found: &'m [Match] = &[];
        if let Some(GuidedSearch { find, found: buffer }) = search {
            if !filter.is_known() {
                let range = DisparityRange::new(self.rig, matches.clone());
                let matches = matches.clone().filter(|m| range.contains(m));
                let guess = self.sample(matches, &expected, estimator);
                expected = guess.t_current_previous.unwrap_or(expected);
            }
            let count = find(&expected, buffer);
            debug_assert!(count <= buffer.len());
            found = clipped(buffer, ..count);
        }
        // The object's own matches: enough of them, and the inliers of one motion.
        let matches = matches.chain(found);
        let range = DisparityRange::new(self.rig, matches.clone());
        let matches = matches.filter(move |m| range.contains(m));
        let points = matches.clone().count() as u32;
        let mut outcome = ObjectMotion { matches: points, inliers: 0, measured: false };
        let config = self.config;
        let needed = if filter.is_known() { config.matches_again } else { config.matches_min };
        if points < u32::from(needed) {
            return outcome;
        }
        let estimate = self.sample(matches.clone(), &expected, estimator);
        if estimate.t_current_previous.is_none() {
            return outcome;
        }
        outcome.inliers = estimate.inliers;
        let inliers = Inliers { indexed: (0u32..).zip(matches), inliers: estimator.inliers() };
        // They correct the prediction.
        let noise_px =
            if estimate.residual_rms_px > NOISE_PX { estimate.residual_rms_px } else { NOISE_PX };
        let &Self { rig, t_world_camera, interval_s, .. } = self;
        let view = FilterView { rig, t_world_camera, interval_s, noise_px };
        let observations = inliers.filter_map(|m| self.observation(m));
        outcome.measured = filter.update(config, &view, observations);
        outcome
    }

    /// Estimates a motion by random samples; the hypothesis `initial` comes first.
    fn sample<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        initial: &Transform,
        estimator: &mut Estimator<'_>,
    ) -> MotionEstimate {
        let random = &mut Random::new(self.seed);
        let hypotheses = MotionHypotheses { random, initial: Some(initial) };
        estimator.estimate(&self.config.estimator(), self.rig, matches, hypotheses)
    }

    /// A match as the filter takes it: its point is triangulated in the previous camera and
    /// predicted as a static one.
    fn observation(&self, m: &Match) -> Option<Observation> {
        let rig = self.rig;
        let previous =
            Point3::from(rig.triangulate(&rig.observation(m.previous_left, m.previous_right))?);
        Some(Observation {
            static_prediction: self.t_current_previous.transform_point(previous),
            left: rig.centered(m.current_left),
            right: rig.centered(m.current_right),
        })
    }
}

/// The matches at the positions `inliers` names, in ascending order both.
#[derive(Clone)]
struct Inliers<M, I> {
    indexed: M,
    inliers: I,
}

impl<'m, M: Iterator<Item = (u32, &'m Match)>, I: Iterator<Item = u32>> Iterator for Inliers<M, I> {
    type Item = &'m Match;

    fn next(&mut self) -> Option<&'m Match> {
        let inlier = self.inliers.next()?;
        self.indexed.find(|(index, _)| *index == inlier).map(|(_, m)| m)
    }
}
