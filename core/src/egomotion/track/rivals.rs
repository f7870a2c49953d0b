//! Motions that compete for what carries the camera.
//!
//! A truck ahead that drives at our speed, or the car's own bonnet, moves rigidly as the world
//! does, and may have more matches. Where the motion found explains too few matches, further ones
//! are sought among the rest. Two witnesses choose between two motions:
//!
//! - *structure*: the world reaches over many columns of the image and many depths; a vehicle has
//!   few of one of them, a bonnet or a bus across the view few depths;
//! - *the last motion*: a camera can accelerate only so much.
//!
//! Where both witnesses disagree there is no motion ([`MotionStatus::Contested`]); where neither
//! says anything, more matches win.
//!
//! **Time.** Nothing where [`UNCONTESTED_SHARE`] of the matches agree; else one or two estimates
//! more, on the matches that are left.

use super::{
    Egomotion, EgomotionConfig, Estimator, MotionEstimate, MotionHypotheses, MotionStatus,
};
use crate::{
    egomotion::points::SinglePrecision,
    geometry::{StereoRig, Transform},
    random::Random,
    scene_flow::Match,
};

/// Share of the matches from which on no other motion is sought.
const UNCONTESTED_SHARE: f32 = 0.8;
/// Motions that compete at most.
const MAX_RIVALS: usize = 3;
/// Least share of all matches that only a rival explains, and the fewest.
const RIVAL_SHARE_MIN: f32 = 0.12;
const RIVAL_MATCHES_MIN: u32 = 24;
/// Distance from which on a motion does not explain a match, as a multiple of an inlier's.
const APART: f32 = 1.5;
/// Columns that the image is divided into, and half octaves of disparity.
const COLUMNS: usize = 16;
const DEPTHS: usize = 20;
/// Factor by which one structure must exceed another.
const CLEARLY: u32 = 2;

/// Extent of the matches that one of two motions explains, and the other does not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Structure {
    matches: u32,
    /// Columns of the image that have some of them, times half octaves of disparity that have.
    cells: u32,
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
        [own, other]: [&SinglePrecision; 2],
        within_px: f32,
    ) -> Self {
        let (mut columns, mut depths) = ([0u32; COLUMNS], [0u32; DEPTHS]);
        let mut count = 0;
        for m in matches {
            if !own.explains(m, rig, within_px) || other.explains(m, rig, APART * within_px) {
                continue;
            }
            count += 1;
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
        Self { matches: count, cells: (column_count * depth_count) as u32 }
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
}

impl Contest<'_> {
    /// Chooses between the motion found and those of the matches that it does not explain. It is
    /// the one found where no other motion has enough matches.
    #[inline(never)]
    pub fn choose<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        estimator: &mut Estimator<'_>,
        found: &MotionEstimate,
    ) -> Winner {
        let Self { camera, config, rig } = *self;
        let Some(first) = found.t_current_previous else { return Winner::Found };
        if found.inliers as f32 >= UNCONTESTED_SHARE * found.matches as f32 {
            return Winner::Found;
        }
        let (mut champion, mut known) = (first, [first; MAX_RIVALS]);
        let mut contested = false;
        // The camera's own draws stay as they are: a contest must not change what comes after it.
        let mut random: Random = camera.random.clone();
        for round in 1..MAX_RIVALS {
            let views = known.map(|motion| SinglePrecision::new(&motion, rig));
            let is_left = |m: &&Match| {
                views.iter().all(|view| !view.explains(m, rig, APART * config.inlier_px))
            };
            let hypotheses = MotionHypotheses { random: &mut random, initial: None };
            let rest = matches.clone().filter(is_left);
            let rival = estimator.find(config, rig, rest, hypotheses);
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
                let config = EgomotionConfig { inlier_share_min: RIVAL_SHARE_MIN, ..*self.config };
                let estimate = estimator.estimate_near(&config, self.rig, matches, &motion);
                MotionEstimate { samples: found.samples, ..estimate }
            }
        }
    }

    /// Asks the witnesses about two motions.
    fn preferred<'m>(
        &self,
        matches: impl Iterator<Item = &'m Match> + Clone,
        motions: [&Transform; 2],
    ) -> Verdict {
        let Self { config, rig, .. } = *self;
        let [first, second] = motions.map(|motion| SinglePrecision::new(motion, rig));
        let count = matches.clone().count() as f32;
        let structures = [[&first, &second], [&second, &first]]
            .map(|views| Structure::new(rig, matches.clone(), views, config.inlier_px));
        let [_, of_second] = structures;
        let needed = RIVAL_SHARE_MIN * count;
        if of_second.matches < RIVAL_MATCHES_MIN || (of_second.matches as f32) < needed {
            return Verdict::TooFew;
        }
        let by_structure = Structure::preferred(structures);
        match (by_structure, self.preferred_by_last(motions)) {
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
