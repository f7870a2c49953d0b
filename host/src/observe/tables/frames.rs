//! `frames.csv`: one row a frame. Empty cells are values that are unknown.

use super::{csv_text, rounded};
use crate::observe::{FrameRow, StageTime};
use dynvox_core::egomotion::icp::IcpReport;
use dynvox_core::{Report, Stage, StageDigests};
use serde::{Deserialize, Serialize};
use std::io;

/// What happened in the frame.
#[derive(Serialize)]
struct FrameColumns {
    frame: usize,
    time_s: f64,
    digest: String,
    step_ms: f64,
    step_cpu_ms: f64,
    severity: &'static str,
    motion: &'static str,
    segment: u32,
    matches: u32,
    inliers: u32,
    residual_px: f64,
    right_ahead_m: Option<f64>,
    right_ahead_sigma_m: Option<f64>,
    rig_offset_px: Option<f64>,
    rig_offset_sigma_px: Option<f64>,
    rig_offset_applied_px: f64,
    icp_points: Option<u32>,
    icp_pairs: Option<u32>,
    icp_residual_m: Option<f64>,
    icp_held: Option<f64>,
    features_dropped: u32,
    stereo_density: f64,
    disparity_mean_px: Option<f64>,
    depth_refused: u32,
    rss_bytes: Option<u64>,
}

/// The map.
#[derive(Serialize)]
struct BlockColumns {
    blocks_used: u32,
    blocks_peak: u32,
    blocks_visible: u32,
    blocks_made: u32,
    blocks_refused: u32,
    blocks_out: u32,
    blocks_lost: u32,
    blocks_empty: u32,
    blocks_back: u32,
    probes_most: u32,
    prune_visited: u32,
    prune_voxels_reset: u32,
    prune_blocks_freed: u32,
    prune_carried_over: u32,
    prune_early: u32,
    prune_voxels_erased: u32,
    history_frames: usize,
}

/// Detections, tracks, objects.
#[derive(Serialize)]
struct ObjectColumns {
    detections_given: u32,
    detections_taken: u32,
    detections_refused: u32,
    tracks: u32,
    uncertain: u32,
    #[serde(rename = "static")]
    still: u32,
    dynamic: u32,
    objects: u32,
    object_blocks: u32,
    matches_withheld: u32,
}

/// Wall time of each stage, and CPU time of all threads.
#[derive(Serialize)]
struct TimeColumns {
    stereo_ms: f64,
    stereo_cpu_ms: f64,
    scene_flow_ms: f64,
    scene_flow_cpu_ms: f64,
    egomotion_ms: f64,
    egomotion_cpu_ms: f64,
    instances_ms: f64,
    instances_cpu_ms: f64,
    segmentation_ms: f64,
    segmentation_cpu_ms: f64,
    allocate_ms: f64,
    allocate_cpu_ms: f64,
    fuse_ms: f64,
    fuse_cpu_ms: f64,
    prune_ms: f64,
    prune_cpu_ms: f64,
    raycast_ms: f64,
    raycast_cpu_ms: f64,
}

/// Digests of the stages, as text.
#[derive(Serialize)]
struct DigestColumns {
    input_digest: String,
    disparity_digest: String,
    matches_digest: String,
    egomotion_digest: String,
    tracks_digest: String,
    background_digest: String,
    objects_digest: String,
}

/// What a comparison reads of a row.
#[derive(Deserialize)]
pub struct FrameDigests {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Segment of the map.
    #[serde(default)]
    pub segment: u32,
    /// Digest of all stages.
    pub digest: String,
    /// Digest of the decoded input.
    pub input_digest: String,
    /// Digest of the disparity.
    pub disparity_digest: String,
    /// Digest of the matches.
    pub matches_digest: String,
    /// Digest of the camera's motion.
    pub egomotion_digest: String,
    /// Digest of the tracks.
    pub tracks_digest: String,
    /// Digest of the static map.
    pub background_digest: String,
    /// Digests of the objects: `id:digest` with `;` between two, or `-`.
    pub objects_digest: String,
    /// Share of pixels with a disparity.
    #[serde(default)]
    pub stereo_density: f64,
    /// Their mean disparity, px.
    #[serde(default)]
    pub disparity_mean_px: Option<f64>,
    /// Blocks in use.
    #[serde(default)]
    pub blocks_used: u32,
}

/// The row of a frame, with the header before the first.
///
/// # Errors
/// A value cannot be written as a cell.
pub fn frame_row(row: &FrameRow, first: bool) -> io::Result<Vec<u8>> {
    let columns = (
        frame_columns(row),
        block_columns(row),
        object_columns(row),
        time_columns(row),
        digest_columns(&row.report.digests),
    );
    csv_text(first, std::iter::once(columns))
}

/// Reads the digests of every row.
///
/// # Errors
/// A column is missing, or a row cannot be read.
pub fn read_frame_digests(text: &str) -> Result<Vec<FrameDigests>, csv::Error> {
    csv::Reader::from_reader(text.as_bytes()).deserialize().collect()
}

fn frame_columns(row: &FrameRow) -> FrameColumns {
    let (matches, inliers, residual_px) = row.matches();
    let icp = row.report.icp.as_ref();
    let right_ahead = row.report.egomotion.and_then(|motion| motion.right_ahead);
    let known = Some(&row.report.self_calibration).filter(|rig| rig.known);
    FrameColumns {
        frame: row.frame,
        time_s: row.time_s,
        digest: hex(row.report.digest),
        step_ms: rounded(row.step_ms, 4),
        step_cpu_ms: rounded(row.times.cpu_ms, 4),
        severity: row.severity().name(),
        motion: row.motion(),
        segment: row.report.segment,
        matches,
        inliers,
        residual_px: rounded(residual_px, 4),
        right_ahead_m: right_ahead.map(|ahead| rounded(ahead.distance_m, 4)),
        right_ahead_sigma_m: right_ahead.map(|ahead| rounded(ahead.sigma_m, 4)),
        rig_offset_px: known.map(|rig| rounded(rig.offset_px, 4)),
        rig_offset_sigma_px: known.map(|rig| rounded(rig.offset_sigma_px, 4)),
        rig_offset_applied_px: rounded(row.report.self_calibration.applied_offset_px, 4),
        icp_points: icp.map(|icp: &IcpReport| icp.points),
        icp_pairs: icp.map(|icp| icp.pairs),
        icp_residual_m: icp.map(|icp| rounded(icp.residual_rms_m, 4)),
        icp_held: icp.map(|icp| rounded(icp.eigen_share, 5)),
        features_dropped: row.report.dropped_features(),
        stereo_density: rounded(f64::from(row.report.stereo.density()), 4),
        disparity_mean_px: row.disparity_mean_px.map(|mean_px| rounded(mean_px, 4)),
        depth_refused: row.depth_refused,
        rss_bytes: row.rss_bytes,
    }
}

fn block_columns(row: &FrameRow) -> BlockColumns {
    let Report { blocks, allocation, prune, .. } = &row.report;
    BlockColumns {
        blocks_used: blocks.used,
        blocks_peak: blocks.peak,
        blocks_visible: blocks.visible,
        blocks_made: allocation.made,
        blocks_refused: row.blocks_refused(),
        blocks_out: allocation.eviction.stored,
        blocks_lost: allocation.eviction.lost,
        blocks_empty: allocation.eviction.empty,
        blocks_back: allocation.eviction.loaded,
        probes_most: allocation.probes_most,
        prune_visited: prune.visited,
        prune_voxels_reset: prune.voxels_reset,
        prune_blocks_freed: prune.blocks_freed,
        prune_carried_over: prune.carried_over,
        prune_early: prune.early,
        prune_voxels_erased: prune.voxels_erased,
        history_frames: row.history_frames,
    }
}

fn object_columns(row: &FrameRow) -> ObjectColumns {
    let instances = &row.report.instances;
    let [uncertain, still, dynamic] = row.track_states;
    ObjectColumns {
        detections_given: instances.detections.given,
        detections_taken: instances.detections.accepted,
        detections_refused: instances.detections.refused(),
        tracks: instances.tracks.tracks,
        uncertain,
        still,
        dynamic,
        objects: instances.objects.objects,
        object_blocks: instances.objects.blocks,
        matches_withheld: instances.matches_excluded,
    }
}

fn time_columns(row: &FrameRow) -> TimeColumns {
    let of = |stage: Stage, value: fn(&StageTime) -> f64| {
        rounded(value(&row.times.stages[stage as usize]), 4)
    };
    let wall = |stage: Stage| of(stage, |time| time.wall_ms);
    let cpu = |stage: Stage| of(stage, |time| time.cpu_ms);
    TimeColumns {
        stereo_ms: wall(Stage::Stereo),
        stereo_cpu_ms: cpu(Stage::Stereo),
        scene_flow_ms: wall(Stage::SceneFlow),
        scene_flow_cpu_ms: cpu(Stage::SceneFlow),
        egomotion_ms: wall(Stage::Egomotion),
        egomotion_cpu_ms: cpu(Stage::Egomotion),
        instances_ms: wall(Stage::Instances),
        instances_cpu_ms: cpu(Stage::Instances),
        segmentation_ms: wall(Stage::Segmentation),
        segmentation_cpu_ms: cpu(Stage::Segmentation),
        allocate_ms: wall(Stage::Allocate),
        allocate_cpu_ms: cpu(Stage::Allocate),
        fuse_ms: wall(Stage::Fuse),
        fuse_cpu_ms: cpu(Stage::Fuse),
        prune_ms: wall(Stage::Prune),
        prune_cpu_ms: cpu(Stage::Prune),
        raycast_ms: wall(Stage::Raycast),
        raycast_cpu_ms: cpu(Stage::Raycast),
    }
}

fn digest_columns(digests: &StageDigests) -> DigestColumns {
    DigestColumns {
        input_digest: hex(digests.input),
        disparity_digest: hex(digests.disparity),
        matches_digest: hex(digests.matches),
        egomotion_digest: hex(digests.egomotion),
        tracks_digest: hex(digests.tracks),
        background_digest: hex(digests.background),
        objects_digest: digests.objects.to_string(),
    }
}

fn hex(digest: u64) -> String {
    format!("{digest:016x}")
}
