//! The motion estimate.

use super::{
    EgomotionConfig, MotionCovariance, WeakDirections,
    covariance::PointWeights,
    normal_equations::{NormalEquations, RotationMatrix},
    points::{Point, Points},
    synchrony::RightAhead,
    weights::{robust_growth, robust_weight, side_weight},
};
use crate::{
    geometry::{StereoRig, Transform},
    memory::{Capacity, Carver, region_bytes},
    random::Random,
    scene_flow::Match,
};

/// Step below which a hypothesis has converged (rad and m, the largest of six).
const SAMPLE_STEP_MIN: f64 = 1e-6;
/// Step below which the refinement has converged.
const REFINE_STEP_MIN: f64 = 1e-6;
/// Rounds of choosing inliers anew and refining on them.
const ROUNDS: usize = 3;

/// Standard deviation of a turn without a covariance, and the least of any, rad.
const TURN_SIGMA_UNKNOWN_RAD: f64 = 0.005;
const TURN_SIGMA_MIN_RAD: f64 = 0.0005;

/// Outcome of an estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionStatus {
    /// There is a motion, and its refinement converged.
    #[default]
    Estimated,
    /// Fewer matches than asked for.
    TooFewMatches,
    /// No motion explains as many matches as asked for.
    TooFewInliers,
    /// The refinement did not come to rest.
    NotConverged,
    /// The camera would have to accelerate too much ([`EgomotionConfig::acceleration_max_m_s2`]),
    /// and too few matches agree.
    Implausible,
    /// The cameras of the pair do not seem to expose at the same time
    /// ([`EgomotionConfig::right_ahead_max_m`]), and too few matches agree.
    Unsynchronized,
    /// Two groups of matches move differently, each as a world may, and nothing tells which of them
    /// carries the camera.
    Contested,
    /// The rig cannot be used.
    BadRig,
}

/// A motion, or why it could not be estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct MotionEstimate {
    /// Outcome.
    pub status: MotionStatus,
    /// Maps previous camera coordinates to current camera coordinates; `None` unless `status` is
    /// `Estimated`. Of the camera: from the last frame whose pose is not a guess.
    pub t_current_previous: Option<Transform>,
    /// Matches handed in that could be triangulated.
    pub matches: u32,
    /// Matches among them that the motion explains.
    pub inliers: u32,
    /// Root mean square error of one coordinate over the inliers, px.
    pub residual_rms_px: f64,
    /// Covariance of the motion, in the current camera's frame; `None` unless `status` is
    /// `Estimated`. It holds the noise of the inliers as measured, and what all of them share. Of
    /// an `anchored` motion it is the covariance since the anchor.
    pub covariance: Option<MotionCovariance>,
    /// For the camera: true where the pose follows from that of an older frame, the anchor, because
    /// the camera is slow. The anchor is the frame before the last estimate that is not anchored,
    /// and errors of the motions since then do not add up.
    pub anchored: bool,
    /// For the camera: directions in which the motion is not determined; along them the last one
    /// was continued, if there was one.
    pub weak: WeakDirections,
    /// Hypotheses drawn.
    pub samples: u32,
    /// Gauss-Newton steps of the refinement.
    pub steps: u32,
    /// For the camera: distance by which the right one seems to be ahead of its calibrated
    /// position; far if both do not expose at the same time. `None` if too few matches determine
    /// it.
    pub right_ahead: Option<RightAhead>,
}

impl MotionEstimate {
    /// Standard deviation of the turn about one axis, rad: the largest of the three, and not below
    /// what matches never resolve.
    pub(crate) fn turn_sigma_rad(&self) -> f64 {
        let sigmas =
            self.covariance.map_or([TURN_SIGMA_UNKNOWN_RAD; 3], |c| c.rotation_sigma_rad());
        sigmas.into_iter().fold(TURN_SIGMA_MIN_RAD, |most, one| if one > most { one } else { most })
    }

    /// Tells that half of the matches and more agree with the motion.
    pub(crate) fn is_strong(&self) -> bool {
        2 * self.inliers >= self.matches
    }

    fn failed(status: MotionStatus, matches: usize, inliers: usize, samples: u32) -> Self {
        Self {
            status,
            t_current_previous: None,
            matches: matches as u32,
            inliers: inliers as u32,
            residual_rms_px: 0.0,
            covariance: None,
            anchored: false,
            weak: WeakDirections::default(),
            samples,
            steps: 0,
            right_ahead: None,
        }
    }
}

/// Origin of an estimate's hypotheses: the first one, and the draws of the others.
#[derive(Debug)]
pub struct MotionHypotheses<'a> {
    /// Draws that belong to this purpose alone.
    pub random: &'a mut Random,
    /// First hypothesis, from which the others are refined as well; standing still where it is
    /// absent.
    pub initial: Option<&'a Transform>,
}

impl<'a> MotionHypotheses<'a> {
    /// Hypotheses that begin with a camera that stands still.
    pub fn from_draws(random: &'a mut Random) -> Self {
        Self { random, initial: None }
    }
}

/// Scratch memory for estimating motions one after the other: the camera's, then each object's.
#[derive(Debug)]
pub struct Estimator<'s> {
    points: Points<'s>,
    inliers: &'s mut [u32],
    inlier_len: usize,
}

impl<'s> Estimator<'s> {
    /// Bytes of the slab.
    ///
    /// ```
    /// use dynvox_core::{Capacity, egomotion::Estimator};
    ///
    /// let twice = Capacity { matches: 2 * Capacity::TINY.matches, ..Capacity::TINY };
    /// assert!(Estimator::bytes(&twice) > Estimator::bytes(&Capacity::TINY));
    /// ```
    pub const fn bytes(capacity: &Capacity) -> usize {
        Points::bytes(capacity.matches) + region_bytes::<u32>(capacity.matches)
    }

    /// Allocates its regions.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            points: Points::new_in(capacity.matches, carver),
            inliers: carver.alloc("egomotion.inlier", capacity.matches),
            inlier_len: 0,
        }
    }

    /// Positions, in the order handed in, of the matches the last estimate explains.
    pub fn inliers(&self) -> impl Iterator<Item = u32> + Clone {
        self.inliers
            .iter()
            .take(self.inlier_len)
            .filter_map(|&index| self.points.source(index as usize))
    }

    /// Estimates the motion that carries the matches' points from the previous camera to the
    /// current one.
    ///
    /// Matches beyond `capacity.matches` are ignored.
    // Never inlined: what it needs of the stack must not lie below a look at the map.
    #[inline(never)]
    pub fn estimate<'m>(
        &mut self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        matches: impl IntoIterator<Item = &'m Match>,
        hypotheses: MotionHypotheses<'_>,
    ) -> MotionEstimate {
        let found = self.find(config, rig, matches, hypotheses);
        self.with_covariance(config, rig, found)
    }

    /// Finds the motion like [`Self::estimate`], without its covariance.
    #[inline(never)]
    pub(super) fn find<'m>(
        &mut self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        matches: impl IntoIterator<Item = &'m Match>,
        MotionHypotheses { random, initial }: MotionHypotheses<'_>,
    ) -> MotionEstimate {
        self.inlier_len = 0;
        if rig.validate().is_err() {
            return MotionEstimate::failed(MotionStatus::BadRig, 0, 0, 0);
        }
        // The share of inliers is asked of all matches, so it sets the bound before any is drawn.
        self.points.fill(matches, rig);
        let matches = self.points.len();
        if matches < usize::from(config.matches_min).max(3) {
            return MotionEstimate::failed(MotionStatus::TooFewMatches, matches, 0, 0);
        }
        // A hypothesis from the last motion needs fewer steps than one from rest.
        let start = initial.copied().unwrap_or(Transform::IDENTITY);
        let (best, samples) = self.ransac(config, rig, random, &start);
        self.refine_best(config, rig, &best, samples)
    }

    /// Estimates the motion near `start`, without another hypothesis.
    pub(super) fn estimate_near<'m>(
        &mut self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        matches: impl IntoIterator<Item = &'m Match>,
        start: &Transform,
    ) -> MotionEstimate {
        self.inlier_len = 0;
        self.points.fill(matches, rig);
        let found = self.refine_best(config, rig, start, 0);
        self.with_covariance(config, rig, found)
    }

    /// Adds the covariance to a motion that was found. Apart from the search, whose stack must not
    /// lie below it.
    fn with_covariance(
        &self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        found: MotionEstimate,
    ) -> MotionEstimate {
        let motion = found.t_current_previous.as_ref();
        let covariance = motion.and_then(|motion| self.covariance(config, rig, motion));
        MotionEstimate { covariance, ..found }
    }

    /// Refines a hypothesis on its inliers among the points, which are chosen anew in each round.
    #[inline(never)]
    fn refine_best(
        &mut self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        best: &Transform,
        samples: u32,
    ) -> MotionEstimate {
        let matches = self.points.len();
        let share = libm::ceilf(config.inlier_share_min * matches as f32) as usize;
        let needed = usize::from(config.matches_min).max(3).max(share);
        let mut estimate = MotionEstimate::failed(MotionStatus::TooFewInliers, matches, 0, samples);
        let mut motion = *best;
        // Each round refines on the inliers of the motion before it.
        for round in 0..ROUNDS {
            let inlier_px = if round == 0 { config.inlier_px } else { config.refined_inlier_px };
            self.inlier_len = self.points.select(&motion, rig, inlier_px, self.inliers);
            estimate.inliers = self.inlier_len as u32;
            // Too few inliers: the motion of the few is as likely a coincidence.
            if self.inlier_len < needed {
                return estimate;
            }
            let (better, steps, converged) = self.refine(config, rig, &motion);
            estimate.steps += steps;
            if !converged {
                return MotionEstimate { status: MotionStatus::NotConverged, ..estimate };
            }
            motion = better;
        }
        // The residual is reported without robust weights: it is what the inliers really show.
        let matrix = RotationMatrix::new(&motion);
        let mut sums = NormalEquations::ZERO;
        for point in self.inlier_points() {
            sums.add(&point, &matrix, rig, |_| 1.0);
        }
        estimate.residual_rms_px = libm::sqrt(sums.error / (4.0 * sums.weight));
        MotionEstimate {
            status: MotionStatus::Estimated,
            t_current_previous: Some(motion),
            ..estimate
        }
    }

    /// Counts the matches that `motion` explains within `within_px`, and the matches that can be
    /// triangulated.
    pub fn count_inliers<'m>(
        &mut self,
        rig: &StereoRig,
        matches: impl IntoIterator<Item = &'m Match>,
        motion: &Transform,
        within_px: f32,
    ) -> [u32; 2] {
        // The inliers of the estimate before are of other points.
        self.inlier_len = 0;
        self.points.fill(matches, rig);
        [self.points.score(motion, rig, within_px, 0), self.points.len() as u32]
    }

    /// RANSAC: the hypothesis with most inliers, the first of equals, and how many were drawn.
    fn ransac(
        &self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        random: &mut Random,
        start: &Transform,
    ) -> (Transform, u32) {
        // The start is a hypothesis, too: if it is good, few others have to be drawn.
        let mut best = *start;
        let mut most = self.points.score(start, rig, config.inlier_px, 0);
        let mut required = required_iterations(config, most, self.points.len());
        let mut drawn = 0;
        while drawn < required {
            // Three points without a motion count as drawn, so that the loop ends.
            drawn += 1;
            let Some(motion) = self.hypothesis(config, rig, random, start) else { continue };
            // Scoring stops as soon as the best can no longer be beaten.
            let count = self.points.score(&motion, rig, config.inlier_px, most);
            if count > most {
                (best, most) = (motion, count);
                required = required_iterations(config, most, self.points.len());
            }
        }
        (best, drawn)
    }

    /// The motion of three points drawn at random, if they have one.
    fn hypothesis(
        &self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        random: &mut Random,
        start: &Transform,
    ) -> Option<Transform> {
        let len = self.points.len() as u32;
        // Distinct by construction: each draw skips those before it.
        let a = random.below(len);
        let b = random.below(len - 1);
        let b = b + u32::from(b >= a);
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let c = random.below(len - 2);
        let c = c + u32::from(c >= low);
        let c = c + u32::from(c >= high);
        let points = [
            self.points.get(a as usize)?,
            self.points.get(b as usize)?,
            self.points.get(c as usize)?,
        ];
        // Three matches determine a motion; Gauss-Newton finds it from the start.
        let mut motion = *start;
        for _ in 0..config.sample_steps {
            let matrix = RotationMatrix::new(&motion);
            let mut sums = NormalEquations::ZERO;
            for point in &points {
                sums.add(point, &matrix, rig, |_| 1.0);
            }
            let step = sums.solve()?;
            motion = motion.retract(step);
            if largest(step) < SAMPLE_STEP_MIN {
                return Some(motion);
            }
        }
        None
    }

    /// The covariance of a refined motion, with the weights of its refinement.
    fn covariance(
        &self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        motion: &Transform,
    ) -> Option<MotionCovariance> {
        let weights = |point: &Point, squared_px: f64| {
            let side = side_weight(config, rig, point);
            PointWeights {
                pull: side * robust_weight(config, squared_px),
                growth: side * robust_growth(config, squared_px),
            }
        };
        MotionCovariance::from_points(motion, rig, self.inlier_points(), weights)
    }

    fn inlier_points(&self) -> impl Iterator<Item = Point> {
        self.inliers
            .iter()
            .take(self.inlier_len)
            .filter_map(|&index| self.points.get(index as usize))
    }

    /// Gauss-Newton on all inliers. Returns the motion, the steps taken and whether it came to
    /// rest.
    fn refine(
        &self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        motion: &Transform,
    ) -> (Transform, u32, bool) {
        let mut motion = *motion;
        for taken in 1..=u32::from(config.refine_steps) {
            let matrix = RotationMatrix::new(&motion);
            let mut sums = NormalEquations::ZERO;
            for point in self.inlier_points() {
                let side = side_weight(config, rig, &point);
                sums.add(&point, &matrix, rig, |squared| side * robust_weight(config, squared));
            }
            // Too few inliers, or all of them in one direction.
            let Some(step) = sums.solve() else { return (motion, taken, false) };
            motion = motion.retract(step);
            // At rest: a further step would not change a digit that counts.
            if largest(step) < REFINE_STEP_MIN {
                return (motion, taken, true);
            }
        }
        (motion, u32::from(config.refine_steps), false)
    }
}

/// Hypotheses to draw so that one is free of outliers with the configured probability, given the
/// most inliers so far.
fn required_iterations(config: &EgomotionConfig, inliers: u32, points: usize) -> u32 {
    let share = f64::from(inliers) / points as f64;
    // Three matches are drawn, and all of them must be inliers.
    let clean = share * share * share;
    if clean >= 1.0 {
        return 1;
    }
    // So few inliers that the logarithm would be 0.
    if clean < 1e-9 {
        return u32::from(config.samples);
    }
    let required = libm::ceil(libm::log(1.0 - config.confidence) / libm::log(1.0 - clean));
    if required < f64::from(config.samples) { required as u32 } else { u32::from(config.samples) }
}

fn largest(step: [f64; 6]) -> f64 {
    step.iter().map(|x| libm::fabs(*x)).fold(0.0, |most, x| if x > most { x } else { most })
}

#[cfg(test)]
mod tests;
