//! Record of every frame.

use super::DepthCensus;
use crate::formats::shown_pose;
use crate::input::MaskRefusals;
use dynvox_core::egomotion::icp::IcpStatus;
use dynvox_core::egomotion::{MotionCovariance, MotionStatus, RightAhead, WeakDirections};
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::rectify::self_calibration::SelfCalibrationReport;
use dynvox_core::view::RaycastView;
use dynvox_core::{PoseOrigin, PosePrecision, Report, Severity, Stage};
use serde::{Deserialize, Serialize};

/// Stages whose time is taken.
pub const STAGES: usize = Stage::ALL.len();

/// Time of one stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageTime {
    /// Wall time, ms.
    pub wall_ms: f64,
    /// CPU time of all threads together, ms.
    pub cpu_ms: f64,
}

/// Times of a step's stages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepTimes {
    /// CPU time of all threads together, ms: of the stages, and of what is between them.
    pub cpu_ms: f64,
    /// By stage, in the order of `Stage::ALL`.
    pub stages: [StageTime; STAGES],
}

/// One frame.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FrameRow {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Time stamp, ns, if the source has one.
    pub stamp_ns: Option<u64>,
    /// Time of the frame, s: by its stamp, else by an assumed rate.
    pub time_s: f64,
    /// Report of the core.
    pub report: Report,
    /// Frames in the pruning window's history.
    pub history_frames: usize,
    /// Tracks seen in this frame by motion state: uncertain, static, dynamic.
    pub track_states: [u32; 3],
    /// Masks of the source that could not be used.
    pub mask_refusals: MaskRefusals,
    /// Pixels with a depth, by what the map shows of it.
    pub depth: DepthCensus,
    /// Invalid values of a given depth image: not finite, negative, or no disparity of this rig.
    pub depth_refused: u32,
    /// Wall time of the whole step, ms.
    pub step_ms: f64,
    /// Resident memory of the process, where the system reports it.
    pub rss_bytes: Option<u64>,
    /// CPU time of the step and times of its stages.
    pub times: StepTimes,
}

impl FrameRow {
    /// View of the map from the frame's pose, in its segment.
    pub fn view(&self) -> RaycastView {
        let Report { segment, t_world_camera, .. } = &self.report;
        RaycastView { segment: Some(*segment), ..t_world_camera.into() }
    }

    /// Pose of the camera as files show it: later segments of the map above the first.
    pub fn shown_t_world_camera(&self) -> Transform {
        shown_pose(self.report.segment, &self.report.t_world_camera)
    }

    /// Returns the frame's time, ns: by its stamp, else by an assumed rate.
    pub fn time_ns(&self) -> u64 {
        self.stamp_ns.unwrap_or((self.time_s * 1e9).round() as u64)
    }

    /// Returns how the camera's motion was found, in one word.
    pub fn motion(&self) -> &'static str {
        // Depth registration, where it was used, says more than the matches.
        if let Some(icp) = &self.report.icp {
            return match icp.status {
                IcpStatus::Tracked => "tracked",
                IcpStatus::TooFewPairs => "tracking_failure_too_few_pairs",
                IcpStatus::Degenerate => "tracking_failure_degenerate_direction",
                IcpStatus::OffTheMap => "tracking_failure_off_the_map",
                IcpStatus::TooFar => "tracking_failure_too_far",
                IcpStatus::Contradicted => "tracking_failure_contradicted_by_the_images",
            };
        }
        match self.report.egomotion.map(|motion| motion.status) {
            None if self.report.pose == PoseOrigin::Given => "given",
            None if self.report.pose == PoseOrigin::Extrapolated => "frozen_image",
            None => "first",
            Some(_) if self.report.pose == PoseOrigin::Relocalized => "relocalized",
            Some(MotionStatus::Estimated) => "estimated",
            Some(MotionStatus::TooFewMatches) => "too_few_matches",
            Some(MotionStatus::TooFewInliers) => "too_few_inliers",
            Some(MotionStatus::NotConverged) => "not_converged",
            Some(MotionStatus::Implausible) => "implausible",
            Some(MotionStatus::Unsynchronized) => "unsynchronized_cameras",
            Some(MotionStatus::Contested) => "contested",
            Some(MotionStatus::BadRig) => "bad_rig",
        }
    }

    /// Returns true if the pose was extrapolated at constant velocity because there was no
    /// estimate.
    pub fn is_extrapolated(&self) -> bool {
        self.report.pose == PoseOrigin::Extrapolated
    }

    /// Distance of the right camera ahead of its place, where matches show it.
    pub fn right_ahead(&self) -> Option<RightAhead> {
        self.report.egomotion.and_then(|motion| motion.right_ahead)
    }

    /// Covariance of the camera's motion, where it was estimated from matches.
    pub fn motion_sigma(&self) -> Option<MotionCovariance> {
        self.report.egomotion.and_then(|motion| motion.covariance)
    }

    /// Findings of self-calibration, where enough is known.
    pub fn rig(&self) -> Option<&SelfCalibrationReport> {
        Some(&self.report.self_calibration).filter(|rig| rig.known)
    }

    /// Matches the estimate was made of, inliers among them, and their root mean square error in
    /// px; for the depth tracker the matches that were checked, and those that agree.
    pub fn matches(&self) -> (u32, u32, f64) {
        if let Some(icp) = &self.report.icp {
            return (icp.matches[1], icp.matches[0], 0.0);
        }
        self.report
            .egomotion
            .map_or((0, 0, 0.0), |motion| (motion.matches, motion.inliers, motion.residual_rms_px))
    }

    /// The worst event of the frame: what the core reports, and what the sources of masks and depth
    /// refused. Objects of a frame without masks go into the static map.
    pub fn severity(&self) -> Severity {
        let masks = &self.mask_refusals;
        // Objects without masks are in the map now.
        let of_sources = if masks.missing + masks.beyond > 0 {
            Severity::MapAffected
        } else if masks.unnamed + masks.unknown_class + masks.empty + self.depth_refused > 0 {
            Severity::Recovered
        } else {
            Severity::Info
        };
        self.report.severity().max(of_sources)
    }

    /// Describes what affected the map in this frame.
    pub fn cause(&self) -> String {
        let (allocation, motion, masks) =
            (&self.report.allocate, self.motion(), &self.mask_refusals);
        let Report { tracking, segmentation, objects, .. } = &self.report;
        // A frame may have several causes, the gravest first.
        let lost = (self.report.segment > MapSegment::FIRST).then(|| {
            format!(
                "segment {} of the map, apart from the others: the camera was lost before",
                self.report.segment.get()
            )
        });
        // A rig that is off explains why matches disagree, which looks like other faults.
        let offset = self.uncorrected_offset();
        let guessed = self.is_extrapolated().then(|| match &offset {
            Some(_) => "no motion estimate, the frame was not fused".to_owned(),
            None => format!(
                "no motion estimate ({}), the frame was not fused",
                motion.replace('_', " ")
            ),
        });
        let weak = self.report.egomotion.map(|motion| motion.weak).filter(WeakDirections::any);
        let weak = weak.map(|weak| {
            format!(
                "matches do not hold the camera ({weak}): along these axes its last motion went on"
            )
        });
        let displaced = (self.report.precision == PosePrecision::Displaced).then(|| {
            "motions are imprecise, and surfaces may lie beside those of before".to_owned()
        });
        let counts = [
            (allocation.refused, "block requests refused, the pool is full"),
            (allocation.beyond, "points beyond the map's coordinates"),
            (allocation.unlisted, "visible blocks beyond the list's capacity"),
            (allocation.eviction.lost, "blocks evicted and not stored"),
            (masks.missing, "frame without masks"),
            (masks.beyond, "masks beyond the source's limits"),
            (tracking.detections.refused() + segmentation.refused, "detections refused"),
            (tracking.tracks.refused, "tracks refused, the table is full"),
            (tracking.tracks.masks_lost, "masks of unseen tracks lost"),
            (objects.refused, "objects refused, all volumes are in use"),
            (objects.blocks_refused, "blocks of objects refused"),
            (objects.crops_dropped, "crops of objects dropped"),
            (self.report.internal_faults, "internal faults: please report them"),
        ];
        let counted = counts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"));
        offset
            .into_iter()
            .chain(guessed)
            .chain(weak)
            .chain(displaced)
            .chain(lost)
            .chain(counted)
            .collect::<Vec<_>>()
            .join("; ")
    }

    /// Describes the rig's disparity offset where it is known and not corrected.
    fn uncorrected_offset(&self) -> Option<String> {
        let rig = &self.report.self_calibration;
        rig.is_uncorrected().then(|| {
            format!(
                "disparity offset {:.1} px, not corrected (rig.self_calibration=\"apply\" does)",
                rig.offset_px
            )
        })
    }

    /// Blocks the map lacks after this frame: refused, beyond its coordinates, or left out of the
    /// list of visible ones.
    pub fn blocks_refused(&self) -> u32 {
        let allocation = &self.report.allocate;
        allocation.refused + allocation.beyond + allocation.unlisted
    }
}
