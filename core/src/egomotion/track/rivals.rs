//! Motions that compete for what carries the camera.
//!
//! A truck ahead that drives at our speed, or the car's own bonnet, moves rigidly as the world
//! does, and may have more matches. Where the motion found leaves enough matches unexplained,
//! further ones are sought among them. A motion explains matches exactly, or it is one between two:
//! where flow is slow, that has more inliers than either. Two witnesses choose between two motions:
//!
//! - *structure*: the world reaches over many columns of the image and many depths; a vehicle has
//!   few of one of them, a bonnet or a bus across the view few depths;
//! - *the last motion*: a camera can accelerate only so much, and if it can go on by both motions,
//!   the world is where it was expected, and what moves by itself surprises.
//!
//! Where both witnesses disagree there is no motion ([`MotionStatus::Contested`]); where neither
//! says anything, more matches win.
//!
//! Before that, where what is near stays in the image, as a bonnet does, and the rest moves and is
//! not explained exactly, the motion of the rest is sought by itself: what stays at one distance
//! pulls a motion to a turn that a way aside makes up for.
//!
//! **Time.** Two looks at each match; where [`RIVAL_SHARE_MIN`] of them are left, one or two
//! estimates more, on those; two more where the motion of the rest is sought.

use super::{
    Egomotion, EgomotionConfig, Estimator, MotionEstimate, MotionHypotheses, MotionStatus,
};
use crate::{
    egomotion::points::SinglePrecision,
    geometry::{StereoRig, Transform},
    random::Random,
    scene_flow::{Match, NEAR_BASELINES, STILL_PX},
};

/// Distance within which a motion explains a match, px over four coordinates. It is a third of an
/// inlier's: where flow is slow, a motion between two has the inliers of both.
const EXACT_PX: f32 = 0.7;
/// Motions that compete at most.
const MAX_RIVALS: usize = 3;
/// Least share of all matches that only a rival explains, and the fewest.
const RIVAL_SHARE_MIN: f32 = 0.12;
const RIVAL_MATCHES_MIN: u32 = 24;
/// Distance from which on a motion does not explain a match, as a multiple of [`EXACT_PX`].
const APART: f32 = 1.5;
/// Columns that the image is divided into, and half octaves of disparity.
const COLUMNS: usize = 16;
const DEPTHS: usize = 20;
/// Factor by which one structure must exceed another.
const CLEARLY: u32 = 2;
/// Mean distance between the matches of a motion and where the last motion puts them from which on
/// they contradict it, px over four coordinates, and factor by which it must exceed another.
const SURPRISE_PX: f32 = 0.5;
const SURPRISE_FACTOR: f32 = 1.5;
/// Distance beyond which a match surprises no more, px.
const SURPRISE_MOST_PX: f32 = 20.0;

/// Extent of the matches that one of two motions explains, and the other does not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Structure {
    matches: u32,
    /// Columns of the image that have some of them, times half octaves of disparity that have.
    cells: u32,
    /// Mean distance from where the camera's last motion puts them, px.
    surprise_px: f32,
}

/// Motion that a witness prefers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Preferred {
    First,
    Second,
}

impl Structure {
    fn new<'m>(
        rig: &StereoRig,
        matches: impl Iterator<Item = &'m Match>,
        [own, other, last]: [&SinglePrecision; 3],
    ) -> Self {
        let (mut columns, mut depths) = ([0u32; COLUMNS], [0u32; DEPTHS]);
        let (mut count, mut surprise_px) = (0, 0.0);
        for m in matches {
            if !own.explains(m, rig, EXACT_PX) || other.explains(m, rig, APART * EXACT_PX) {
                continue;
            }
            count += 1;
            let px = last.distance_px(m, rig);
            surprise_px += if px < SURPRISE_MOST_PX { px } else { SURPRISE_MOST_PX };
            let disparity_px = m.previous_left[0] - m.previous_right[0];
            // The square's whole logarithm is that of half octaves. Casts hold at the ends.
            let depth = ((disparity_px * disparity_px) as u32).max(1).ilog2() as usize;
            let width_px = 2.0 * rig.center_u_px as f32;
            let column = (m.current_left[0] * COLUMNS as f32 / width_px) as usize;
            for slot in [columns.get_mut(column.min(COLUMNS - 1)), depths.get_mut(depth)] {
                slot.into_iter().for_each(|slot| *slot += 1);
            }
        }
        // Single wrong matches agree with anything.
        let column_count = columns.iter().filter(|&&found| found >= 2).count();
        let depth_count = depths.iter().filter(|&&found| found >= 2 + count / 32).count();
        let surprise_px = surprise_px / count.max(1) as f32;
        Self { matches: count, cells: (column_count * depth_count) as u32, surprise_px }
    }

    /// The motion whose structure is clearly the larger one.
    fn preferred([first, second]: [Self; 2]) -> Option<Preferred> {
        if first.cells >= CLEARLY * second.cells {
            Some(Preferred::First)
        } else if second.cells >= CLEARLY * first.cells {
            Some(Preferred::Second)
        } else {
            None
        }
    }
}

/// Winner of a contest.
pub(super) enum Winner {
    /// The motion that was found first.
    Found,
    /// Another motion.
    Rival(Transform),
    /// None: the witnesses disagree.
    Contested,
}

/// A camera whose motion is contested.
pub(super) struct Contest<'a> {
    pub camera: &'a Egomotion,
    pub config: &'a EgomotionConfig,
    pub rig: &'a StereoRig,
    /// Motion since the reference, if the camera moves on as before.
    pub expected: &'a Transform,
}

impl Contest<'_> {
    /// Replaces a motion that near surfaces which stay in the image have pulled to themselves by
    /// that of the rest, if it explains more of the rest exactly. What stays at one distance agrees
    /// with every turn that a way aside makes up for, so it is no witness of a camera that moves.
    #[inline(never)]
    pub fn unmix<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        estimator: &mut Estimator<'_>,
        found: &mut MotionEstimate,
    ) {
        let Self { camera, rig, expected, .. } = *self;
        let first = found.t_current_previous;
        // A camera that stands has still surfaces about it.
        if first.is_some_and(|first| is_at_rest(&first, rig)) {
            return;
        }
        let view = first.map(|first| SinglePrecision::new(&first, rig));
        let (mut all, mut staying, mut moving, mut exact) = (0, 0, 0, 0);
        for m in matches.clone() {
            let (is_still, is_near) = (m.is_still(), m.is_near(rig.focal_px));
            let is_exact = view.as_ref().is_some_and(|view| view.explains(m, rig, EXACT_PX));
            all += 1;
            staying += u32::from(is_still && is_near);
            moving += u32::from(!is_still);
            exact += u32::from(!is_still && is_exact);
        }
        // Three quarters of the rest: the motion is theirs.
        if !is_enough(staying, all) || !is_enough(moving, all) || 4 * exact >= 3 * moving {
            return;
        }
        let mut random: Random = camera.random.clone();
        let hypotheses = MotionHypotheses { random: &mut random, initial: Some(expected) };
        let rest = matches.clone().filter(|m| !m.is_still());
        let rest = estimator.find(&self.exact(), rig, rest, hypotheses).t_current_previous;
        let Some(motion) = rest else { return };
        let view = SinglePrecision::new(&motion, rig);
        let is_inlier = |m: &&Match| !m.is_still() && view.explains(m, rig, EXACT_PX);
        let inliers = matches.clone().filter(is_inlier).count() as u32;
        if is_enough(inliers.saturating_sub(exact), all) {
            *found = self.estimate(Winner::Rival(motion), matches, estimator, *found);
        }
    }

    /// Chooses between the motion found and those of the matches that it does not explain. It is
    /// the one found where no other motion has enough matches.
    #[inline(never)]
    pub fn choose<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        estimator: &mut Estimator<'_>,
        found: &MotionEstimate,
    ) -> Winner {
        let Self { camera, rig, expected, .. } = *self;
        let Some(first) = found.t_current_previous else { return Winner::Found };
        // No rival can have enough matches where few are left.
        let view = SinglePrecision::new(&first, rig);
        let is_left = |m: &&Match| !view.explains(m, rig, APART * EXACT_PX);
        if !is_enough(matches.clone().filter(is_left).count() as u32, found.matches) {
            return Winner::Found;
        }
        let exact = self.exact();
        let (mut champion, mut known) = (first, [first; MAX_RIVALS]);
        let mut contested = false;
        // The camera's own draws stay as they are: a contest must not change what comes after it.
        let mut random: Random = camera.random.clone();
        for round in 1..MAX_RIVALS {
            let views = known.map(|motion| SinglePrecision::new(&motion, rig));
            let is_left =
                |m: &&Match| views.iter().all(|view| !view.explains(m, rig, APART * EXACT_PX));
            let hypotheses = MotionHypotheses { random: &mut random, initial: Some(expected) };
            let rest = matches.clone().filter(is_left);
            let rival = estimator.find(&exact, rig, rest, hypotheses);
            let Some(motion) = rival.t_current_previous else { break };
            // A slot that is not filled yet repeats the first motion.
            known.iter_mut().skip(round).for_each(|slot| *slot = motion);
            match self.preferred(matches.clone(), [&champion, &motion]) {
                Verdict::First => {}
                Verdict::Second => (champion, contested) = (motion, false),
                Verdict::Disagreed => contested = true,
                Verdict::TooFew => break,
            }
        }
        if contested {
            Winner::Contested
        } else if champion == first {
            Winner::Found
        } else {
            Winner::Rival(champion)
        }
    }

    /// The estimate of the motion that won. What the estimator holds belongs to another one by now.
    pub fn estimate<'m>(
        &self,
        winner: Winner,
        matches: impl Iterator<Item = &'m Match> + Clone,
        estimator: &mut Estimator<'_>,
        found: MotionEstimate,
    ) -> MotionEstimate {
        match winner {
            Winner::Found => found,
            Winner::Contested => MotionEstimate {
                status: MotionStatus::Contested,
                t_current_previous: None,
                covariance: None,
                ..found
            },
            // Far matches agree with several motions, and hold the rotation: all of them count
            // again.
            Winner::Rival(motion) => {
                let config = EgomotionConfig { inlier_share_min: RIVAL_SHARE_MIN, ..self.exact() };
                let estimate = estimator.estimate_near(&config, self.rig, matches, &motion);
                MotionEstimate { samples: found.samples, ..estimate }
            }
        }
    }

    /// Settings of an estimate that exact matches make.
    fn exact(&self) -> EgomotionConfig {
        EgomotionConfig { inlier_px: EXACT_PX, refined_inlier_px: EXACT_PX, ..*self.config }
    }

    /// Asks the witnesses about two motions.
    fn preferred<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        motions: [&Transform; 2],
    ) -> Verdict {
        let Self { rig, expected, .. } = *self;
        let [first, second] = motions.map(|motion| SinglePrecision::new(motion, rig));
        let last = SinglePrecision::new(expected, rig);
        let count = matches.clone().count() as u32;
        let structures = [[&first, &second, &last], [&second, &first, &last]]
            .map(|views| Structure::new(rig, matches.clone(), views));
        let [_, of_second] = structures;
        if !is_enough(of_second.matches, count) {
            return Verdict::TooFew;
        }
        let by_structure = Structure::preferred(structures);
        let by_last = self.preferred_by_last(motions);
        let by_last = by_last.or_else(|| self.unsurprising(structures));
        match (by_structure, by_last) {
            (Some(Preferred::First), Some(Preferred::Second))
            | (Some(Preferred::Second), Some(Preferred::First)) => Verdict::Disagreed,
            (Some(Preferred::Second), _) | (None, Some(Preferred::Second)) => Verdict::Second,
            _ => Verdict::First,
        }
    }

    /// The one of two motions that the camera's last one leads to.
    fn preferred_by_last(&self, motions: [&Transform; 2]) -> Option<Preferred> {
        let Self { camera, config, .. } = *self;
        let frames = camera.since_reference() + 1;
        let frame_s = camera.reference_s / f64::from(frames);
        let can = |motion: &Transform| {
            let motion = if frames == 1 { *motion } else { motion.part_of(frames) };
            camera.can_accelerate_to(config, &motion, frame_s)
        };
        match motions.map(can) {
            [true, false] => Some(Preferred::First),
            [false, true] => Some(Preferred::Second),
            _ => None,
        }
    }

    /// The motion whose matches clearly lie nearer to where the last motion puts them; `None`
    /// without a last motion.
    fn unsurprising(&self, [first, second]: [Structure; 2]) -> Option<Preferred> {
        let is_clear = |less: f32, more: f32| more > SURPRISE_PX && more > SURPRISE_FACTOR * less;
        let is_known = self.camera.motion_s > 0.0 && !self.camera.is_lost();
        if is_known && is_clear(first.surprise_px, second.surprise_px) {
            Some(Preferred::First)
        } else if is_known && is_clear(second.surprise_px, first.surprise_px) {
            Some(Preferred::Second)
        } else {
            None
        }
    }
}

/// Tells that a motion moves what is near by less than a match that stays.
fn is_at_rest(motion: &Transform, rig: &StereoRig) -> bool {
    let by_way = motion.distance_m() / (f64::from(NEAR_BASELINES) * rig.baseline_m);
    rig.focal_px * (motion.angle_rad() + by_way) < f64::from(STILL_PX)
}

/// Tells that so many of `matches` may be a motion of their own.
fn is_enough(count: u32, matches: u32) -> bool {
    count >= RIVAL_MATCHES_MIN && count as f32 >= RIVAL_SHARE_MIN * matches as f32
}

/// Result of a contest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// The first motion carries the camera.
    First,
    /// The second one does.
    Second,
    /// One witness says the first, one the second.
    Disagreed,
    /// The second one explains too few matches to be one.
    TooFew,
}
