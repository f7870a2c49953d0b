//! Plain values of the interface.

use crate::{DynvoxInertialReport, DynvoxInertialSample, DynvoxStatus, DynvoxWork};
use dynvox_core::{PoseOrigin, Report, Severity, geometry::Transform};

/// Pose of a camera: a rotation as a quaternion of length 1 and a translation, camera to world.
/// Camera axes: x right, y down, z forward.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct DynvoxPose {
    /// w, x, y, z.
    pub rotation: [f64; 4],
    /// m.
    pub translation_m: [f64; 3],
}

impl DynvoxPose {
    /// Bit for bit: nothing is normalised.
    pub(crate) fn transform(&self) -> Result<Transform, DynvoxStatus> {
        let [w, x, y, z] = self.rotation;
        let pose = Transform { rotation: [x, y, z, w], translation_m: self.translation_m };
        if pose.is_finite() && pose.is_rotation() { Ok(pose) } else { Err(DynvoxStatus::Pose) }
    }
}

impl From<&Transform> for DynvoxPose {
    fn from(pose: &Transform) -> Self {
        let [x, y, z, w] = pose.rotation;
        Self { rotation: [w, x, y, z], translation_m: pose.translation_m }
    }
}

/// An image of one byte a pixel, three for a colour image: red, green, blue.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxImage {
    /// The upper left pixel; `stride` times `height - 1` and one row's pixels must be readable from
    /// here on. Null: there is no such image.
    pub pixels: *const u8,
    /// Pixels from one row to the next; bytes where samples are packed.
    pub stride: usize,
}

/// Something a detector saw in the left image.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxDetection {
    /// 0 other, 1 car, 2 bus, 3 truck, 4 van, 5 train, 6 person, 7 rider, 8 bicycle, 9 motorcycle,
    /// 10 animal, 11 moving object.
    pub class_code: u8,
    /// Confidence of the detector, 0 to 1.
    pub score: f32,
    /// First column of the box, px; may lie beside the image.
    pub left: i32,
    /// First row of the box, px; may lie beside the image.
    pub top: i32,
    /// Columns of the box, px.
    pub width: u32,
    /// Rows of the box, px.
    pub height: u32,
    /// `width` times `height` bytes, row by row; a pixel belongs to the object unless its byte is
    /// 0.
    pub mask: *const u8,
}

/// A stereo pair and what is known of it, rectified, or raw where the configuration is
/// dynvox_config_raw's. Everything is read during the call alone.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxFrame {
    /// Width of every image, px; disparities and ignored pixels of raw pairs have the size of the
    /// rectified images.
    pub width: usize,
    /// Height of every image, px; as above.
    pub height: usize,
    /// Left grey image.
    pub left: DynvoxImage,
    /// Right grey image.
    pub right: DynvoxImage,
    /// Left image in colour, or null pixels.
    pub colour: DynvoxImage,
    /// Detections in any order; null without detections.
    pub detections: *const DynvoxDetection,
    /// Number of detections.
    pub detection_count: usize,
    /// Pose of the left camera in the world, if known; null lets the mapper estimate it.
    pub t_world_camera: *const DynvoxPose,
    /// Time of the pair, ns since any moment that stays the same, rising from frame to frame; null
    /// if unknown: then "tracking.frame_interval_s" has passed since the frame before.
    pub time_ns: *const u64,
    /// Disparity of the left pixels in 1/256 px, 0 where it is unknown, a value for each pixel
    /// without padding; null lets the mapper match the pair.
    pub disparity_q8: *const u16,
    /// Samples of the configuration's inertial unit since the frame before, in order of time; at
    /// most 1,024 are read. Null without samples; they need `time_ns`.
    pub inertial: *const DynvoxInertialSample,
    /// Number of samples.
    pub inertial_count: usize,
    /// DYNVOX_SAMPLES_..., the arrangement of the samples of `left` and `right`. Packed ones need a
    /// mapper that rectifies: DYNVOX_STATUS_SIZE from others.
    pub layout: DynvoxSampleLayout,
    /// Pixels of the left image that no stage uses, marked by any value but 0: the car's own
    /// bonnet, a dirty lens. Null pixels: none.
    pub ignored: DynvoxImage,
}

/// Arrangement of the samples of an image.
pub type DynvoxSampleLayout = u32;
/// A byte for each sample (RAW8).
pub const DYNVOX_SAMPLES_BYTES: DynvoxSampleLayout = 0;
/// Five bytes for four samples (RAW10): a row has 5 bytes for each group of four, a last group that
/// is not full included.
pub const DYNVOX_SAMPLES_PACKED_10: DynvoxSampleLayout = 1;
/// Three bytes for two samples (RAW12), counted likewise.
pub const DYNVOX_SAMPLES_PACKED_12: DynvoxSampleLayout = 2;

/// Severity of a step's events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum DynvoxSeverity {
    /// Nothing to say.
    Info = 0,
    /// Something went wrong and was made good within the frame.
    Recovered,
    /// The map lacks what it should hold, or the pose is a guess.
    MapAffected,
}

/// Origin of a frame's pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum DynvoxPoseOrigin {
    /// The first frame: the camera is the world, or where it is said to be.
    First = 0,
    /// Estimated from this frame.
    Estimated,
    /// A guess: the estimate failed, and the motion before was continued.
    Extrapolated,
    /// Given with the frame.
    Given,
    /// Found in the map after the camera was lost.
    Relocalized,
}

/// Report of one step.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxReport {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// The worst that happened.
    pub severity: DynvoxSeverity,
    /// Pose of the left camera in the world, which is that of its segment of the map.
    pub t_world_camera: DynvoxPose,
    /// Origin of the pose.
    pub pose_origin: DynvoxPoseOrigin,
    /// Covariance of the motion since the frame it was matched with, row by row: rotation vector
    /// (rad), then translation (m), in this camera's axes. A slow camera's is that since an older
    /// frame, and does not add up from frame to frame. All 0 where no motion was estimated.
    pub motion_covariance: [f64; 36],
    /// True if something of the frame was fused into the map: its pose is known, and it shows
    /// depth.
    pub fused: bool,
    /// Number of the map's segment, from 0: another one begins where the camera was lost and is not
    /// found again, with that camera as its world. Where one segment lies in another is not known.
    pub segment: u16,
    /// Pixels with a disparity.
    pub disparities: u32,
    /// Matches the camera's motion rests on.
    pub inliers: u32,
    /// Blocks in use.
    pub blocks: u32,
    /// Most blocks ever in use.
    pub blocks_peak: u32,
    /// Blocks the pool holds.
    pub blocks_capacity: u32,
    /// Blocks refused in this step: pool full, or beyond the map.
    pub blocks_refused: u32,
    /// Blocks evicted and stored in this step.
    pub blocks_stored: u32,
    /// Blocks evicted and lost in this step.
    pub blocks_lost: u32,
    /// Voxels that pruning reset.
    pub voxels_reset: u32,
    /// Digest of what went in: the same pictures give the same number everywhere.
    pub input_digest: u64,
    /// Digest of all that came of the step: the same frames and configuration give the same number
    /// everywhere.
    pub digest: u64,
    /// The inertial unit.
    pub inertial: DynvoxInertialReport,
    /// Work of the step.
    pub work: DynvoxWork,
    /// Visible blocks that the frame was not fused into because of "mapper.work_budget", all of
    /// them farther than those it was.
    pub fused_blocks_deferred: u32,
    /// Blocks that pruning leaves to a later frame because of it.
    pub pruned_blocks_deferred: u32,
    /// True if loops that were closed changed poses of keyframes in this frame. The camera and the
    /// map go on in the world as it was driven.
    pub world_moved: bool,
}

impl From<&Report> for DynvoxReport {
    fn from(report: &Report) -> Self {
        let allocation = &report.allocate;
        Self {
            frame: report.frame,
            severity: match report.severity() {
                Severity::Info => DynvoxSeverity::Info,
                Severity::Recovered => DynvoxSeverity::Recovered,
                Severity::MapAffected => DynvoxSeverity::MapAffected,
            },
            t_world_camera: (&report.t_world_camera).into(),
            pose_origin: match report.pose {
                PoseOrigin::First => DynvoxPoseOrigin::First,
                PoseOrigin::Estimated => DynvoxPoseOrigin::Estimated,
                PoseOrigin::Extrapolated => DynvoxPoseOrigin::Extrapolated,
                PoseOrigin::Given => DynvoxPoseOrigin::Given,
                PoseOrigin::Relocalized => DynvoxPoseOrigin::Relocalized,
            },
            motion_covariance: motion_covariance(report),
            fused: report.fused,
            segment: report.segment.get(),
            disparities: report.stereo.valid,
            inliers: report.egomotion.map_or(0, |egomotion| egomotion.inliers),
            blocks: report.blocks.used,
            // Three ways for a block to be missing from the map; C callers only ask whether one is.
            blocks_peak: report.blocks.peak,
            blocks_capacity: report.blocks.capacity,
            blocks_refused: allocation.refused + allocation.beyond + allocation.unlisted,
            blocks_stored: allocation.eviction.stored,
            blocks_lost: allocation.eviction.lost,
            voxels_reset: report.prune.voxels_reset,
            input_digest: report.digests.input,
            digest: report.digest,
            inertial: report.into(),
            work: report.work.into(),
            fused_blocks_deferred: report.deferred.fused_blocks,
            pruned_blocks_deferred: report.deferred.pruned_blocks,
            world_moved: report.world_moved,
        }
    }
}

/// The covariance of a report's motion, row by row; 0 without one.
fn motion_covariance(report: &Report) -> [f64; 36] {
    let covariance = report.egomotion.and_then(|egomotion| egomotion.covariance);
    let mut rows = [0.0; 36];
    if let Some(covariance) = covariance {
        let matrix = covariance.matrix();
        rows.iter_mut().zip(matrix.iter().flatten()).for_each(|(to, from)| *to = *from);
    }
    rows
}
