//! Plain values of the interface.

use crate::{
    DynvoxStatus,
    given::{output, read},
};
use core::ffi::c_char;
use dynvox_core::{Capacity, Config, Report, Severity, geometry::StereoRig, geometry::Transform};

/// Size of a mapper. Numbers as in dynvox's own table of profiles.
pub type DynvoxProfile = u32;
/// Below 8 MiB, images up to 320 x 96, no colour.
pub const DYNVOX_PROFILE_TINY: DynvoxProfile = 0;
/// Below 64 MiB, images up to 640 x 192, no colour.
pub const DYNVOX_PROFILE_SMALL: DynvoxProfile = 1;
/// Below 256 MiB, images up to 1280 x 384, colour.
pub const DYNVOX_PROFILE_ONBOARD: DynvoxProfile = 2;
/// Below 2 GiB, images up to 1920 x 1088, colour.
pub const DYNVOX_PROFILE_DESKTOP: DynvoxProfile = 3;

pub(crate) fn capacity(profile: DynvoxProfile) -> Result<Capacity, DynvoxStatus> {
    let (_, capacity) = Capacity::PROFILES.get(profile as usize).ok_or(DynvoxStatus::Unknown)?;
    Ok(*capacity)
}

/// Two identical pinhole cameras, rectified.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxRig {
    /// Focal length, px.
    pub focal_px: f64,
    /// Principal point, px from the centre of the upper left pixel.
    pub center_u_px: f64,
    /// Principal point, px from the centre of the upper left pixel.
    pub center_v_px: f64,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
}

/// The settings that are changed most often. dynvox_config_default fills it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxConfig {
    /// The cameras.
    pub rig: DynvoxRig,
    /// Distance between voxels, m.
    pub voxel_size_m: f32,
    /// Distance from a surface up to which voxels are kept, m.
    pub truncation_m: f32,
    /// Nearest depth fused, m.
    pub near_m: f32,
    /// Farthest depth fused, m.
    pub far_m: f32,
    /// Voxels seen at most this often are reset when they leave the window; 0 is off.
    pub prune_weight: u8,
    /// Length of the window, frames.
    pub prune_lag: u32,
    /// Whether detections are tracked and kept out of the static map.
    pub dynamic: bool,
}

impl DynvoxConfig {
    pub(crate) fn resolved(&self) -> Config {
        let DynvoxRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        let mut config = Config::for_rig(StereoRig { focal_px, center_u_px, center_v_px, baseline_m });
        config.volume.voxel_size_m = self.voxel_size_m;
        config.volume.truncation_m = self.truncation_m;
        config.volume.near_m = self.near_m;
        config.volume.far_m = self.far_m;
        config.volume.prune_weight = self.prune_weight;
        config.volume.prune_lag = self.prune_lag;
        config.tracking.dynamic = self.dynamic;
        config
    }
}

/// Writes all defaults for a rig.
///
/// # Safety
/// `rig` is null or points to a rig, `config` is null or points to a configuration.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_default(rig: *const DynvoxRig, config: *mut DynvoxConfig) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let (rig, config) = match unsafe { (read(rig), output(config)) } {
        (Ok(rig), Ok(config)) => (rig, config),
        (Err(status), _) | (_, Err(status)) => return status,
    };
    let DynvoxRig { focal_px, center_u_px, center_v_px, baseline_m } = rig;
    let defaults = Config::for_rig(StereoRig { focal_px, center_u_px, center_v_px, baseline_m });
    let value = DynvoxConfig {
        rig,
        voxel_size_m: defaults.volume.voxel_size_m,
        truncation_m: defaults.volume.truncation_m,
        near_m: defaults.volume.near_m,
        far_m: defaults.volume.far_m,
        prune_weight: defaults.volume.prune_weight,
        prune_lag: defaults.volume.prune_lag,
        dynamic: defaults.tracking.dynamic,
    };
    // SAFETY: not null and aligned, as checked; of the right type, as promised.
    unsafe { config.write(value) };
    DynvoxStatus::Ok
}

/// Writes the first problem of a configuration as text that ends in a zero byte, truncated to `len` bytes; the empty text without a
/// problem.
///
/// # Safety
/// `config` is null or points to a configuration, `text` is null or to `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_problem(config: *const DynvoxConfig, text: *mut c_char, len: usize) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let config = match unsafe { read(config) } {
        Ok(config) => config,
        Err(status) => return status,
    };
    if text.is_null() {
        return DynvoxStatus::Null;
    }
    let Some(most) = len.checked_sub(1) else { return DynvoxStatus::TooSmall };
    let problems = config.resolved().validate();
    let parts = problems.first().map_or(["", "", ""], |problem| [problem.key, " ", problem.rule]);
    let mut written = 0;
    for byte in parts.into_iter().flat_map(str::bytes).take(most) {
        // SAFETY: below `len`.
        unsafe { text.add(written).write(byte as c_char) };
        written += 1;
    }
    // SAFETY: at most `len - 1`.
    unsafe { text.add(written).write(0) };
    DynvoxStatus::Ok
}

/// Pose of a camera: a rotation as a quaternion of length 1 and a translation, camera to world. Camera axes: x right, y down, z forward.
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
    /// The upper left pixel; `stride` times `height - 1` and `width` pixels must be readable from here on. Null: there is no such image.
    pub pixels: *const u8,
    /// Pixels from one row to the next.
    pub stride: usize,
}

/// Something a detector saw in the left image.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxDetection {
    /// 0 other, 1 car, 2 bus, 3 truck, 4 van, 5 train, 6 person, 7 rider, 8 bicycle, 9 motorcycle, 10 animal.
    pub class_code: u8,
    /// How sure the detector is, 0 to 1.
    pub score: f32,
    /// First column of the box, px; may lie beside the image.
    pub left: i32,
    /// First row of the box, px; may lie beside the image.
    pub top: i32,
    /// Columns of the box, px.
    pub width: u32,
    /// Rows of the box, px.
    pub height: u32,
    /// `width` times `height` bytes, row by row; a pixel belongs to the object unless its byte is 0.
    pub mask: *const u8,
}

/// A rectified stereo pair and what is known of it. Everything is read during the call alone.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxFrame {
    /// Of every image, px.
    pub width: usize,
    /// Of every image, px.
    pub height: usize,
    /// Left grey image.
    pub left: DynvoxImage,
    /// Right grey image.
    pub right: DynvoxImage,
    /// Left image in colour, or null pixels.
    pub colour: DynvoxImage,
    /// Detections in any order; null without detections.
    pub detections: *const DynvoxDetection,
    /// How many.
    pub detection_count: usize,
    /// Where the camera is, for those who know; null lets the mapper find out.
    pub t_world_camera: *const DynvoxPose,
}

/// How much a step's events matter.
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

/// What one step did.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxReport {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// The worst that happened.
    pub severity: DynvoxSeverity,
    /// Where the left camera is.
    pub t_world_camera: DynvoxPose,
    /// Whether the frame went into the map.
    pub fused: bool,
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
    /// Blocks that left in this step and were kept by the store.
    pub blocks_kept: u32,
    /// Blocks that left in this step and are lost.
    pub blocks_lost: u32,
    /// Voxels that pruning reset.
    pub voxels_pruned: u32,
    /// Digest of what went in: the same pictures give the same number everywhere.
    pub input_digest: u64,
    /// Digest of all that came of the step: the same frames and configuration give the same number everywhere.
    pub digest: u64,
}

impl From<&Report> for DynvoxReport {
    fn from(report: &Report) -> Self {
        let allocation = &report.allocation;
        Self {
            frame: report.frame,
            severity: match report.severity() {
                Severity::Info => DynvoxSeverity::Info,
                Severity::Recovered => DynvoxSeverity::Recovered,
                Severity::MapAffected => DynvoxSeverity::MapAffected,
            },
            t_world_camera: (&report.t_world_camera).into(),
            fused: report.fused,
            disparities: report.stereo.valid,
            inliers: report.egomotion.map_or(0, |egomotion| egomotion.inliers),
            blocks: report.blocks.used,
            blocks_peak: report.blocks.peak,
            blocks_capacity: report.blocks.capacity,
            blocks_refused: allocation.refused + allocation.beyond + allocation.unlisted,
            blocks_kept: allocation.eviction.kept,
            blocks_lost: allocation.eviction.lost,
            voxels_pruned: report.prune.voxels_reset,
            input_digest: report.digests.input,
            digest: report.digest,
        }
    }
}
