//! Report of one step, as plain values.

use super::{DeferredWork, PosePrecision, StageDigests, WorkUnits, static_map::MapWork};
use crate::{
    digest::Digest,
    egomotion::{MotionEstimate, icp::IcpReport},
    geometry::{MapSegment, Transform},
    inertial::InertialReport,
    objects::ObjectsReport,
    rectify::RectifyReport,
    rectify::self_calibration::{CalibrationState, SelfCalibrationReport},
    scene_flow::FlowReport,
    segmentation::SegmentationReport,
    stereo::StereoReport,
    tracking::TrackingReport,
    volume::{AllocationReport, BLOCK_VOXELS, PruneReport},
};

/// Severity of a step's events.
///
/// ```
/// use dynvox_core::Severity;
///
/// assert!(Severity::MapAffected > Severity::Recovered && Severity::Recovered > Severity::Info);
/// assert_eq!(Severity::MapAffected.name(), "map affected");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Severity {
    /// Nothing to say.
    #[default]
    Info,
    /// Something went wrong and was made good within the frame.
    Recovered,
    /// The map lacks what it should hold, or the pose is a guess.
    MapAffected,
}

impl Severity {
    /// Name in tables and files.
    ///
    /// ```
    /// use dynvox_core::Severity;
    ///
    /// assert!(Severity::Info < Severity::MapAffected);
    /// assert_eq!(Severity::MapAffected.name(), "map affected");
    /// ```
    pub const fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Recovered => "recovered",
            Self::MapAffected => "map affected",
        }
    }
}

/// Source of the camera's pose.
///
/// ```
/// use dynvox_core::PoseOrigin;
/// # use dynvox_core::{
/// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
/// #     image::View, memory::SLAB_ALIGN,
/// # };
/// # let rig =
/// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// # let capacity = Capacity {
/// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
/// # };
/// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
/// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
/// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
/// # let view = View::new(&grey, 320, 96).unwrap();
/// # let frame = StereoFrame {
/// #     disparity_q8: View::new(&wall, 320, 96),
/// #     t_world_camera: Some(Transform::IDENTITY),
/// #     ..StereoFrame::pair(view, view)
/// # };
/// assert_eq!(mapper.step(&frame, &Serial)?.pose, PoseOrigin::First);
/// assert_eq!(mapper.step(&frame, &Serial)?.pose, PoseOrigin::Given);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PoseOrigin {
    /// The first frame: the camera is the world, or where it is said to be.
    #[default]
    First,
    /// Estimated from this frame.
    Estimated,
    /// A guess: the estimate failed, and the motion before was continued, or a camera that was lost
    /// is still searched for. Where it failed, the next frames are matched with the last one whose
    /// pose is not a guess.
    Extrapolated,
    /// Given with the frame.
    Given,
    /// Found in the map after the camera was lost: the map looks from here like the image.
    Relocalized,
}

/// The state of a block pool after a step.
///
/// ```
/// # use dynvox_core::{
/// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
/// #     image::View, memory::SLAB_ALIGN,
/// # };
/// # let rig =
/// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// # let capacity = Capacity {
/// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
/// # };
/// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
/// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
/// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
/// # let view = View::new(&grey, 320, 96).unwrap();
/// # let frame = StereoFrame {
/// #     disparity_q8: View::new(&wall, 320, 96),
/// #     t_world_camera: Some(Transform::IDENTITY),
/// #     ..StereoFrame::pair(view, view)
/// # };
/// let blocks = mapper.step(&frame, &Serial)?.blocks;
/// assert!(0 < blocks.used && blocks.used <= blocks.peak && blocks.peak <= blocks.capacity);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct BlockCount {
    /// Blocks in use.
    pub used: u32,
    /// The most ever in use.
    pub peak: u32,
    /// Blocks the pool can hold.
    pub capacity: u32,
    /// Blocks visible in this frame.
    pub visible: u32,
}

/// One step.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Report {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// Pose of the left camera: camera to world; the first frame's camera defines the world.
    pub t_world_camera: Transform,
    /// Report of the rectification; `None` if pairs come rectified.
    pub rectify: Option<RectifyReport>,
    /// Pixels of the left image that no stage used because the caller ignores them
    /// ([`crate::StereoFrame::ignored`]).
    pub ignored_pixels: u32,
    /// Other pixels of the left image that no stage used because they are attached to the camera:
    /// they stay in place while it moves, as its own bonnet does.
    pub attached_pixels: u32,
    /// The stereo matcher.
    pub stereo: StereoReport,
    /// The scene flow.
    pub scene_flow: FlowReport,
    /// Source of the pose: measured, extrapolated, or given.
    pub pose: PoseOrigin,
    /// Segment of the map that the pose lies in and that frames are fused into. A camera lost for
    /// [`crate::egomotion::MAX_REFERENCE_FRAMES`] frames that is not found in the map begins
    /// another one, whose first camera is its origin. Poses and map of a segment are right among
    /// themselves; where one segment lies in another is not known.
    pub segment: MapSegment,
    /// The camera's motion from matches; none was looked for in the first frame, nor where the pose
    /// was given.
    pub egomotion: Option<MotionEstimate>,
    /// Precision of the pose, by the covariances of the motions that led to it.
    pub precision: PosePrecision,
    /// The camera's motion from depth, where that is asked for; none in the first frame.
    pub icp: Option<IcpReport>,
    /// Report of the self-calibration.
    pub self_calibration: SelfCalibrationReport,
    /// Report of the inertial unit; `None` without one.
    pub inertial: Option<InertialReport>,
    /// Counts of detections and tracks; [`crate::Mapper::tracks`] has the tracks one by one.
    pub tracking: TrackingReport,
    /// Counts of objects that were found by their motion.
    pub segmentation: SegmentationReport,
    /// Counts of the objects' volumes.
    pub objects: ObjectsReport,
    /// True if loops that were closed changed poses of keyframes in this frame: the world moved.
    /// [`crate::Mapper::corrected_keyframes`] has the poses, [`crate::Mapper::loops`] the counts.
    /// The camera and the map go on in the world as it was driven.
    pub world_moved: bool,
    /// True if something of the frame was fused. A frame whose pose was extrapolated is not, because
    /// it would smear the map; nor is one without depth, or between two turns of
    /// `mapper.fuse_every`.
    pub fused: bool,
    /// Blocks made and refused.
    pub allocate: AllocationReport,
    /// Report of pruning.
    pub prune: PruneReport,
    /// The static map's pool.
    pub blocks: BlockCount,
    /// Work of the step, in units that are the same on every machine and for any number of threads.
    /// No digest depends on it.
    pub work: WorkUnits,
    /// Work that the budget did not allow: `mapper.work_budget`.
    pub deferred: DeferredWork,
    /// Contradictions in what the core itself keeps: always 0, or the core has a fault.
    pub internal_faults: u32,
    /// Digests of what went in and of what each stage made of it.
    pub digests: StageDigests,
    /// One digest for all stages: [`StageDigests::whole`], and with it that of the rectified images
    /// where there are any.
    pub digest: u64,
}

impl Report {
    /// The worst event of this step. The map is affected where anything that belongs in a map was
    /// refused or lost: blocks of any map, detections, tracks, objects, masks and crops.
    ///
    /// ```
    /// use dynvox_core::Severity;
    /// # use dynvox_core::{
    /// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
    /// #     image::View, memory::SLAB_ALIGN,
    /// # };
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let capacity = Capacity {
    /// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
    /// # };
    /// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    /// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
    /// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
    /// # let view = View::new(&grey, 320, 96).unwrap();
    /// # let frame = StereoFrame {
    /// #     disparity_q8: View::new(&wall, 320, 96),
    /// #     t_world_camera: Some(Transform::IDENTITY),
    /// #     ..StereoFrame::pair(view, view)
    /// # };
    /// let report = mapper.step(&frame, &Serial)?;
    /// assert_eq!(report.severity(), Severity::Info);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn severity(&self) -> Severity {
        // Anything lost for the map counts, however little.
        let allocation = &self.allocate;
        let blocks =
            allocation.refused + allocation.beyond + allocation.unlisted + allocation.eviction.lost;
        let refused = blocks
            + self.tracking.refused()
            + self.segmentation.refused
            + self.objects.refusals()
            + self.internal_faults;
        if self.pose == PoseOrigin::Extrapolated
            || self.segment > MapSegment::FIRST
            || self.egomotion.is_some_and(|motion| motion.weak.any())
            || self.precision == PosePrecision::Displaced
            || refused > 0
            || self.self_calibration.is_uncorrected()
        {
            Severity::MapAffected
        } else if self.pose == PoseOrigin::Relocalized
            || self.precision == PosePrecision::Imprecise
            || self.dropped_features() + self.prune.early + self.deferred.fused_blocks > 0
            || self.stereo.is_left_out()
            || self.self_calibration.state() > CalibrationState::Sound
        {
            Severity::Recovered
        } else {
            Severity::Info
        }
    }

    /// The report with the digest of what went in and with what rectification made of it.
    pub(crate) fn with_input(self, input: u64, rectify: Option<RectifyReport>) -> Self {
        let digest = rectify.map_or(self.digest, |report| {
            let mut digest = Digest::default();
            digest.u64(self.digest);
            digest.u64(report.digest);
            digest.finish()
        });
        Self { digests: StageDigests { input, ..self.digests }, rectify, digest, ..self }
    }

    /// The report with the units of work that its counts stand for, and those of the map.
    pub(super) fn with_work(self, map: &MapWork) -> Self {
        let Self { stereo, scene_flow: flow, allocate, prune, .. } = &self;
        let sum = |counts: &[u32]| counts.iter().map(|&count| u64::from(count)).sum::<u64>();
        let voxels = |blocks: u32| u64::from(blocks) * BLOCK_VOXELS as u64;
        let eviction = &allocate.eviction;
        let work = WorkUnits {
            stereo_pixels: u64::from(stereo.row_pixels),
            support_candidates: u64::from(stereo.candidates),
            triangles: sum(&[stereo.triangles_left, stereo.triangles_right]),
            features: sum(&[
                flow.left.dense,
                flow.left.sparse,
                flow.right.dense,
                flow.right.sparse,
            ]),
            compared_descriptors: flow.sparse.compared + flow.dense.compared,
            circles: sum(&[flow.sparse.closed, flow.dense.closed]),
            cast_pixels: map.cast_pixels,
            block_requests: u64::from(allocate.requests),
            moved_blocks: sum(&[eviction.stored, eviction.lost, eviction.empty, eviction.loaded]),
            fused_voxels: voxels(map.fused.map_or(0, |fused| fused.count)),
            pruned_voxels: voxels(prune.visited),
        };
        let deferred = DeferredWork {
            fused_blocks: map.fused.map_or(0, |fused| fused.deferred),
            pruned_blocks: map.prune_deferred,
        };
        Self { work, deferred, ..self }
    }

    /// Features and matches beyond the capacity.
    pub fn dropped_features(&self) -> u32 {
        let flow = &self.scene_flow;
        flow.left.dropped + flow.right.dropped + flow.sparse.dropped + flow.dense.dropped
    }
}

#[cfg(test)]
mod tests;
