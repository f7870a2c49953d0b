//! `summary.json`: the figures of a run under fixed keys. A key is present as soon as the run knows its value.

use crate::evaluate::exact::ExactFigures;
use crate::evaluate::lidar::LidarFigures;
use crate::evaluate::objects::{ObjectFigures, TrackErrors};
use crate::evaluate::surfaces::SurfaceFigures;
use crate::observe::{KeptObject, TrackRecord, state_name};
use crate::run::RunRecord;
use dynvox_core::Report;
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
    slab_bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    rss_peak_bytes: Option<u64>,
    stages: BTreeMap<&'static str, StageSummary>,
    egomotion: EgomotionSummary,
    #[serde(skip_serializing_if = "Option::is_none")]
    exact: Option<ExactSummary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lidar: Option<LidarFigures>,
    /// Every track, by number.
    objects: Vec<ObjectSummary>,
    /// Tracks against truth, over all.
    #[serde(skip_serializing_if = "Option::is_none")]
    objects_truth: Option<ObjectFigures>,
    map: MapSummary,
    prune: PruneSummary,
    evict: EvictSummary,
    health: HealthSummary,
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
    held_frames: usize,
    /// `stereo`, `icp` or `file`.
    source: &'static str,
    /// `ok`, or `tracking failure` where the depth tracker was lost in a frame.
    status: &'static str,
    tracking_failures: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    first_failure: Option<usize>,
}

#[derive(Debug, Serialize)]
struct ExactSummary {
    #[serde(rename = "static")]
    still: ExactFigures,
}

#[derive(Debug, Serialize)]
struct ObjectSummary {
    id: u32,
    class: &'static str,
    first_frame: usize,
    last_frame: usize,
    frames: usize,
    /// The one it was in most, of static and dynamic.
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
    fn of(track: &TrackRecord, kept: &[KeptObject]) -> Self {
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
            surface: kept
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
    /// Of these, where something drove while it was seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    swept_triangles: Option<u64>,
}

#[derive(Debug, Serialize)]
struct PruneSummary {
    visited: u64,
    voxels_reset: u64,
    blocks_freed: u64,
    carried_over_most: u32,
    early: u64,
}

#[derive(Debug, Serialize)]
struct EvictSummary {
    out: u64,
    back: u64,
    /// Left with nothing in them worth keeping.
    empty: u64,
    /// Left at the end of the run, onto the disk as well.
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
    worst_severity: &'static str,
}

impl Summary {
    /// Collects the figures of a run.
    pub fn of(run: &RunRecord) -> Self {
        let sum = |of: fn(&Report) -> u32| run.rows.iter().map(|row| u64::from(of(&row.report))).sum::<u64>();
        let errors = run.errors.as_ref();
        let stages = run.stage_statistics();
        let failures = run.tracking_failures();
        Self {
            dataset: run.name.clone(),
            profile: run.profile.clone(),
            threads: run.threads,
            frames: run.rows.len(),
            seconds: run.seconds,
            fps: run.fps(),
            digest: format!("{:016x}", run.digest()),
            slab_bytes: run.slab_bytes,
            rss_peak_bytes: run.rss_peak_bytes,
            stages: stages
                .iter()
                .map(|(name, of)| (*name, StageSummary { median_ms: of.median_ms, p99_ms: of.p99_ms, cpu_median_ms: of.cpu_median_ms }))
                .collect(),
            egomotion: EgomotionSummary {
                t_err_percent: errors.and_then(|errors| errors.t_err_percent),
                r_err_deg_per_m: errors.and_then(|errors| errors.r_err_deg_per_m),
                rpe_t_m: errors.map(|errors| errors.rpe_t_m),
                rpe_r_deg: errors.map(|errors| errors.rpe_r_deg),
                ate_m: errors.map(|errors| errors.ate_m),
                held_frames: run.held_frames(),
                source: run.motion_source,
                status: if failures.is_some() { "tracking failure" } else { "ok" },
                tracking_failures: failures.map_or(0, |(count, ..)| count),
                first_failure: failures.map(|(_, first, _)| first),
            },
            exact: run.exact.map(|still| ExactSummary { still }),
            lidar: run.lidar.as_ref().and_then(|lidar| lidar.figures.clone()),
            objects: run.objects.tracks.iter().map(|track| ObjectSummary::of(track, &run.objects.kept)).collect(),
            objects_truth: run.objects.figures.clone(),
            map: MapSummary {
                blocks: run.blocks,
                blocks_peak: run.blocks_peak(),
                bytes: run.map_bytes(),
                triangles: run.mesh.triangles,
                swept_triangles: run.objects.swept_triangles,
            },
            prune: PruneSummary {
                visited: sum(|report| report.prune.visited) + u64::from(run.finish.visited),
                voxels_reset: sum(|report| report.prune.voxels_reset) + u64::from(run.finish.voxels_reset),
                blocks_freed: sum(|report| report.prune.blocks_freed) + u64::from(run.finish.blocks_freed),
                carried_over_most: run.rows.iter().map(|row| row.report.prune.carried_over).max().unwrap_or_default(),
                early: sum(|report| report.prune.early),
            },
            evict: EvictSummary {
                out: sum(|report| report.allocation.eviction.kept + report.allocation.eviction.lost),
                back: run.blocks_back(),
                empty: sum(|report| report.allocation.eviction.empty),
                end: u64::from(run.shelf.end.kept),
                disk_records: run.shelf.records,
                disk_bytes: run.shelf.bytes,
            },
            health: HealthSummary {
                blocks_refused: run.blocks_refused(),
                blocks_lost: run.blocks_lost(),
                blocks_unreadable: run.shelf.unreadable,
                probes_most: run.rows.iter().map(|row| row.report.allocation.probes_most).max().unwrap_or_default(),
                history_frames_most: run.rows.iter().map(|row| row.history_frames).max().unwrap_or_default(),
                rss_limit_bytes: run.rss_limit_bytes,
                disk_failure: run.shelf_failure.clone(),
                depth_values_refused: run.rows.iter().map(|row| u64::from(row.depth_refused)).sum(),
                detections_refused: sum(|report| report.instances.detections.refused()),
                tracks_refused: sum(|report| report.instances.tracks.refused + report.instances.objects.refused),
                matches_dropped: sum(Report::dropped_features),
                worst_severity: run.worst().name(),
            },
        }
    }
}
