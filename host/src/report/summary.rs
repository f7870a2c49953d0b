//! `summary.json`: the figures of a run under fixed keys. A key is absent where its value is
//! unknown.

use super::bounds::CapacitySummary;
use super::inertial::InertialSummary;
use super::rig::RigSummary;
use crate::evaluate::masks::MovingFigures;
use crate::evaluate::objects::{ObjectFigures, TrackErrors};
use crate::evaluate::reference::ReferenceFigures;
use crate::evaluate::surfaces::SurfaceFigures;
use crate::evaluate::trajectory::WithoutBoresight;
use crate::observe::{
    BlockTotals, BlocksSection, LoopSection, ReconstructedObject, TrackRecord, TrajectorySection,
    state_name,
};
use crate::run::{Continued, Incomplete, RunRecord, SkippedFrames, StageStatistics};
use serde::Serialize;
use std::collections::BTreeMap;

/// The summary.
#[derive(Debug, Serialize)]
pub struct Summary {
    dataset: String,
    profile: String,
    threads: usize,
    frames: usize,
    seconds: f64,
    fps: f64,
    digest: String,
    /// Reason why the results are incomplete, if they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    incomplete: Option<Incomplete>,
    /// Old map that the run went on with.
    #[serde(skip_serializing_if = "Option::is_none")]
    continued: Option<Continued>,
    slab_bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    rss_peak_bytes: Option<u64>,
    stages: BTreeMap<&'static str, StageSummary>,
    egomotion: EgomotionSummary,
    /// Loops that were closed; absent where the camera found none.
    #[serde(skip_serializing_if = "Option::is_none")]
    loops: Option<LoopSection>,
    /// Error of the calibration that the run found.
    #[serde(skip_serializing_if = "Option::is_none")]
    rig: Option<RigSummary>,
    /// Inertial unit against the camera's path.
    #[serde(skip_serializing_if = "Option::is_none")]
    inertial: Option<InertialSummary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lidar: Option<ReferenceFigures>,
    /// Every track, by number.
    objects: Vec<ObjectSummary>,
    /// Tracks against ground truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    objects_truth: Option<ObjectFigures>,
    /// Masks of what moves against exact ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    masks_truth: Option<MovingFigures>,
    /// Use of each bound, and the least capacity that would have held the run.
    capacity: CapacitySummary,
    map: MapSummary,
    prune: PruneSummary,
    evict: EvictSummary,
    health: HealthSummary,
    input: InputSummary,
}

#[derive(Debug, Serialize)]
struct InputSummary {
    /// Sentences that say what is doubtful about the images.
    warnings: Vec<String>,
    /// Frames left out because they could not be read or mapped.
    skipped: SkippedFrames,
    /// Frames of a stream that came while the mapper was busy.
    dropped: u64,
}

#[derive(Debug, Serialize)]
struct StageSummary {
    median_ms: f64,
    p99_ms: f64,
    cpu_median_ms: f64,
}

#[derive(Debug, Serialize)]
struct EgomotionSummary {
    #[serde(skip_serializing_if = "Option::is_none")]
    t_err_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    r_err_deg_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rpe_t_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rpe_r_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ate_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    without_boresight: Option<WithoutBoresight>,
    extrapolated_frames: usize,
    /// Reasons of these frames, with their numbers.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    extrapolated_because: BTreeMap<String, usize>,
    segments: u32,
    /// `stereo`, `icp` or `file`.
    source: &'static str,
    /// `ok`, or `tracking failure` where the depth tracker lost a frame.
    status: &'static str,
    tracking_failures: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    first_failure: Option<usize>,
}

#[derive(Debug, Serialize)]
struct ObjectSummary {
    id: u32,
    class: &'static str,
    first_frame: usize,
    last_frame: usize,
    frames: usize,
    /// The more frequent of static and dynamic.
    state: &'static str,
    /// Frames it was seen in, by state: uncertain, static, dynamic.
    frames_in_state: [usize; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_m_s: Option<f64>,
    blocks: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    me_t_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    me_r_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    truth: Option<TrackErrors>,
    /// The mesh of the track's object fused most often, against the true surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    surface: Option<SurfaceFigures>,
}

impl ObjectSummary {
    fn new(track: &TrackRecord, objects: &[ReconstructedObject]) -> Self {
        let errors = track.errors.as_ref();
        Self {
            id: track.id,
            class: track.class.name(),
            first_frame: track.first_frame,
            last_frame: track.last_frame,
            frames: track.frames,
            state: state_name(track.state),
            frames_in_state: track.states,
            speed_m_s: track.speed_m_s,
            blocks: track.blocks,
            me_t_m: errors.and_then(|errors| errors.me_t_m),
            me_r_deg: errors.and_then(|errors| errors.me_r_deg),
            truth: errors.cloned(),
            // An object may have been reconstructed in several segments: the longest counts.
            surface: objects
                .iter()
                .filter(|object| object.id == track.id)
                .max_by_key(|object| object.frames)
                .and_then(|object| object.surface),
        }
    }
}

#[derive(Debug, Serialize)]
struct MapSummary {
    blocks: usize,
    blocks_peak: u32,
    bytes: u64,
    triangles: u64,
    /// Triangles of objects in `map.ply`.
    object_triangles: u64,
    /// Triangles of the static map in the volume that moving objects swept.
    #[serde(skip_serializing_if = "Option::is_none")]
    swept_triangles: Option<u64>,
    /// Reason why the map is empty or poor, with the next step.
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<String>,
}

#[derive(Debug, Serialize)]
struct PruneSummary {
    visited: u64,
    voxels_reset: u64,
    blocks_freed: u64,
    carried_over_most: u32,
    early: u64,
    voxels_erased: u64,
}

#[derive(Debug, Serialize)]
struct EvictSummary {
    /// Evicted and stored.
    stored: u64,
    /// Evicted and lost.
    lost: u64,
    /// Loaded from the store.
    loaded: u64,
    /// Evicted with nothing in them.
    empty: u64,
    /// Stored at the end of the run.
    end: u64,
    disk_records: u64,
    disk_bytes: u64,
}

#[derive(Debug, Serialize)]
struct HealthSummary {
    blocks_refused: u64,
    blocks_lost: u64,
    blocks_unreadable: u64,
    matches_dropped: u64,
    probes_most: u32,
    history_frames_most: usize,
    rss_limit_bytes: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    disk_failure: Option<String>,
    depth_values_refused: u64,
    detections_refused: u64,
    tracks_refused: u64,
    internal_faults: u64,
    worst_severity: &'static str,
}

impl Summary {
    /// Collects the figures of a run.
    pub fn new(run: &RunRecord) -> Self {
        let sections = &run.sections;
        let stage = |of: StageStatistics| StageSummary {
            median_ms: of.median_ms,
            p99_ms: of.p99_ms,
            cpu_median_ms: of.cpu_median_ms,
        };
        Self {
            dataset: run.plan.dataset.name().to_owned(),
            profile: run.plan.profile.clone(),
            threads: run.plan.threads,
            frames: run.frames.len(),
            seconds: run.seconds,
            fps: run.fps(),
            digest: format!("{:016x}", run.digest()),
            incomplete: run.incomplete.clone(),
            continued: run.continued,
            slab_bytes: run.plan.capacity.bytes(),
            rss_peak_bytes: run.rss_peak_bytes,
            stages: run
                .frames
                .stage_statistics()
                .into_iter()
                .map(|(name, of)| (name, stage(of)))
                .collect(),
            egomotion: EgomotionSummary::new(&sections.trajectory),
            loops: sections.trajectory.loops.clone(),
            rig: super::rig::summary(run),
            inertial: sections.inertial.as_ref().map(InertialSummary::new),
            lidar: sections.reference.as_ref().and_then(|reference| reference.figures.clone()),
            objects: sections
                .tracks
                .tracks
                .iter()
                .map(|track| ObjectSummary::new(track, &sections.objects.objects))
                .collect(),
            objects_truth: sections.tracks.figures.clone(),
            masks_truth: sections.tracks.masks.clone(),
            capacity: super::bounds::summary(run),
            map: MapSummary {
                blocks: sections.blocks.blocks,
                blocks_peak: sections.blocks.totals.peak,
                bytes: sections.blocks.map_bytes(),
                triangles: sections.blocks.mesh.static_triangles(),
                object_triangles: sections.blocks.mesh.object_triangles,
                swept_triangles: sections.objects.swept_triangles,
                warning: super::poor_map::sentence(run),
            },
            prune: PruneSummary::new(&sections.blocks.totals),
            evict: EvictSummary::new(&sections.blocks),
            health: HealthSummary::new(run),
            input: InputSummary {
                warnings: run.plan.warnings.clone(),
                skipped: run.skipped.clone(),
                dropped: run.dropped,
            },
        }
    }
}

impl EgomotionSummary {
    fn new(trajectory: &TrajectorySection) -> Self {
        let (errors, failures) = (trajectory.errors.as_ref(), trajectory.failures);
        Self {
            t_err_percent: errors.and_then(|errors| errors.t_err_percent),
            r_err_deg_per_m: errors.and_then(|errors| errors.r_err_deg_per_m),
            rpe_t_m: errors.map(|errors| errors.rpe_t_m),
            rpe_r_deg: errors.map(|errors| errors.rpe_r_deg),
            ate_m: errors.map(|errors| errors.ate_m),
            without_boresight: errors.and_then(|errors| errors.without_boresight),
            extrapolated_frames: trajectory.extrapolated_frames,
            extrapolated_because: trajectory.extrapolated_because.iter().cloned().collect(),
            segments: trajectory.segments,
            source: trajectory.source,
            status: if failures.is_some() { "tracking failure" } else { "ok" },
            tracking_failures: failures.map_or(0, |failures| failures.frames),
            first_failure: failures.map(|failures| failures.first),
        }
    }
}

impl PruneSummary {
    fn new(totals: &BlockTotals) -> Self {
        Self {
            visited: totals.prune_visited,
            voxels_reset: totals.voxels_reset,
            blocks_freed: totals.blocks_freed,
            carried_over_most: totals.carried_over_most,
            early: totals.early,
            voxels_erased: totals.voxels_erased,
        }
    }
}

impl EvictSummary {
    fn new(blocks: &BlocksSection) -> Self {
        Self {
            stored: blocks.totals.stored,
            lost: blocks.totals.lost,
            loaded: blocks.totals.loaded,
            empty: blocks.totals.empty,
            end: u64::from(blocks.store.end.stored),
            disk_records: blocks.store.records,
            disk_bytes: blocks.store.bytes,
        }
    }
}

impl HealthSummary {
    fn new(run: &RunRecord) -> Self {
        let (blocks, health) = (&run.sections.blocks, &run.sections.health);
        Self {
            blocks_refused: blocks.totals.refused,
            blocks_lost: blocks.lost(),
            blocks_unreadable: blocks.store.unreadable,
            matches_dropped: health.matches_dropped,
            probes_most: blocks.totals.probes_most,
            history_frames_most: blocks.totals.history_frames_most,
            rss_limit_bytes: run.plan.rss_limit_bytes,
            disk_failure: blocks.store.failure.clone(),
            depth_values_refused: health.depth_values_refused,
            detections_refused: u64::from(health.detections.refused()),
            tracks_refused: health.tracks_refused,
            internal_faults: health.internal_faults,
            worst_severity: health.worst.name(),
        }
    }
}
