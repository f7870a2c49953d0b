//! Position of a frame among the keyframes: descriptors, then geometry.
//!
//! The keyframes with most scores are compared one by one. The motion from a keyframe's points to
//! the frame's must have enough inliers, over enough of the image; and no other place may fit
//! nearly as well, as houses of a row do for each other.

use super::{
    PlaceView,
    index::Index,
    query::Query,
    table::{SegmentPose, Table},
};
use crate::{
    egomotion::{EgomotionConfig, Estimator, MotionHypotheses},
    random::Random,
};

/// Keyframes that are compared with a frame.
const COMPARED: usize = 6;
/// Fewest inliers of a place.
const INLIERS_MIN: u32 = 20;
/// Columns and rows that the image is cut into, and the fewest of these cells with inliers.
const CELLS: [usize; 2] = [6, 4];
const CELLS_MIN: u32 = 6;
/// Another place may have at most so many tenths of the best one's inliers.
const AMBIGUOUS_TENTHS: u32 = 6;
/// Poses of one place differ by at most this share of the scene's depth, and by this angle, rad.
pub(super) const AGREE_DEPTH_SHARE: f64 = 0.05;
pub(super) const AGREE_RAD: f64 = 0.03;

/// Pose of a frame by one keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub pose: SegmentPose,
    /// Slot of the keyframe.
    pub slot: usize,
    /// Matches that the motion explains.
    pub inliers: u32,
}

/// Tells that two poses are of one place, at a depth of the scene.
pub(super) fn agree(a: &SegmentPose, b: &SegmentPose, depth_m: f64) -> bool {
    let apart = a.t_world_camera.inverse() * b.t_world_camera;
    a.segment == b.segment
        && apart.distance_m() <= AGREE_DEPTH_SHARE * depth_m
        && apart.angle_rad() <= AGREE_RAD
}

/// Tables and scratch memory that a recognition reads.
pub(super) struct Recognition<'a, 's> {
    pub table: &'a Table<'s>,
    pub index: &'a mut Index<'s>,
    pub query: &'a mut Query<'s>,
    pub random: &'a mut Random,
}

impl Recognition<'_, '_> {
    /// Finds the frame that the query describes among the keyframes that `may` takes.
    pub(super) fn find(
        self,
        view: &PlaceView<'_>,
        estimator: &mut Estimator<'_>,
        may: impl Fn(usize) -> bool,
    ) -> Option<Candidate> {
        let Self { table, index, query, random } = self;
        let depth_m = view.rig.focal_baseline_px_m() / query.mean_disparity_px()?;
        query.score(table, index, may);
        // Best place, and the most inliers of any other place.
        let (mut best, mut rival): (Option<Candidate>, u32) = (None, 0);
        for _ in 0..COMPARED {
            let Some(slot) = query.take_best() else { break };
            let Some(keyframe) = table.pose(slot) else { continue };
            let matches = query.match_points(table, slot);
            let hypotheses = MotionHypotheses::from_draws(random);
            let estimate =
                estimator.estimate(&config(view.egomotion), view.rig, matches, hypotheses);
            let Some(motion) = estimate.t_current_previous else { continue };
            let inliers = estimator.inliers();
            let positions = inliers.filter_map(|at| Some(matches.get(at as usize)?.current_left));
            if spread(positions, [view.image.width(), view.image.height()]) < CELLS_MIN {
                continue;
            }
            let t_world_camera = (keyframe.t_world_camera * motion.inverse()).normalized();
            let pose = SegmentPose { segment: keyframe.segment, t_world_camera };
            let found = Candidate { pose, slot, inliers: estimate.inliers };
            if best.is_none_or(|before| before.inliers < found.inliers) {
                query.keep_covariance(estimate.covariance.as_ref());
            }
            match best {
                // Neighbouring keyframes of one place confirm each other.
                Some(before) if agree(&before.pose, &found.pose, depth_m) => {
                    best = Some(if before.inliers >= found.inliers { before } else { found });
                }
                Some(before) if before.inliers >= found.inliers => {
                    rival = rival.max(found.inliers);
                }
                Some(before) => {
                    rival = rival.max(before.inliers);
                    best = Some(found);
                }
                None => best = Some(found),
            }
        }
        best.filter(|best| 10 * rival <= AMBIGUOUS_TENTHS * best.inliers)
    }
}

/// Settings of the motion from a keyframe: of its matches fewer are right than from frame to frame,
/// and positions are rounded; right ones are off by a pixel or two, and would take turns at the
/// scale of a frame's motion without coming to rest.
fn config(of: &EgomotionConfig) -> EgomotionConfig {
    EgomotionConfig {
        samples: 500,
        inlier_px: 4.0,
        refined_inlier_px: 3.0,
        matches_min: INLIERS_MIN as u16,
        inlier_share_min: 0.3,
        robust_px: 2.5,
        ..*of
    }
}

/// Cells of the image that have a position.
fn spread(positions: impl Iterator<Item = [f32; 2]>, size: [usize; 2]) -> u32 {
    let mut cells = 0u32;
    for position in positions {
        let [column, row] = [0, 1].map(|axis: usize| {
            let at = |values: [usize; 2]| values.get(axis).copied().unwrap_or(1);
            let pixel = position.get(axis).copied().unwrap_or_default() as usize;
            (pixel * at(CELLS) / at(size).max(1)).min(at(CELLS) - 1)
        });
        cells |= 1 << (row * CELLS[0] + column);
    }
    cells.count_ones()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{MapSegment, Transform};

    #[test]
    fn points_of_one_corner_are_not_spread() {
        let corner = (0..100).map(|at| [(at % 10) as f32, (at / 10) as f32]);
        assert_eq!(spread(corner, [600, 200]), 1);
        let whole = (0..24).map(|at| [(at % 6 * 100) as f32, (at / 6 * 50) as f32]);
        assert_eq!(spread(whole, [600, 200]), 24);
        assert_eq!(spread([[599.9, 199.9], [9e9, 9e9]].into_iter(), [600, 200]), 1);
    }

    #[test]
    fn poses_agree_by_segment_way_and_angle() {
        let at = |segment, ahead_m, angle_rad| SegmentPose {
            segment: MapSegment::new(segment),
            t_world_camera: Transform::new([0.0, angle_rad, 0.0], [0.0, 0.0, ahead_m]),
        };
        let here = at(0, 10.0, 0.0);
        assert!(agree(&here, &at(0, 10.4, 0.02), 10.0));
        assert!(!agree(&here, &at(0, 10.6, 0.0), 10.0));
        assert!(!agree(&here, &at(0, 10.0, 0.04), 10.0));
        assert!(!agree(&here, &at(1, 10.0, 0.0), 10.0));
    }
}
