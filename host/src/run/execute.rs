//! One run: frames in, map, trajectory and figures out.

use super::disk_store::MeshOutput;
use super::error::RunError;
use super::session::Course;
use super::state::Gathered;
use super::{HostSlab, Plan, RunFolder, RunRecord, Stopped, resident_bytes};
use crate::observe::{LidarAtWork, LidarRecord, ObjectsRecord};

use dynvox_core::MotionSource;
use dynvox_core::geometry::Transform;
use dynvox_core::memory::Region;
use dynvox_core::volume::PruneReport;
use std::time::Instant;

/// Maps the planned frames, or of a run that was `stopped` those that are left, and writes the mesh into the folder.
pub fn run(plan: &Plan, folder: &RunFolder, stopped: Option<Stopped>) -> Result<RunRecord, RunError> {
    plan.check()?;
    let slab_bytes = plan.capacity.bytes();
    let mut slab = HostSlab::map(slab_bytes).ok_or_else(|| RunError::NoMemory { bytes: slab_bytes, profile: plan.profile.clone() })?;
    let (drive, output) = drive(plan, slab.bytes_mut(), folder, stopped)?;
    // The mapper is gone: its slab serves to read the map piece by piece.
    let (mesh, shelf) = output.finish(slab.bytes_mut(), (&plan.capacity, &plan.config), folder)?;
    let Drive {
        mut gathered,
        mut objects,
        lidar,
        overview_png,
        regions,
        blocks,
        finish,
        shelf_failure,
        mut since,
    } = drive;
    objects.swept_triangles = gathered.objects.swept_triangles(&folder.file("map.ply"))?;
    let mapping = gathered.spent.mapping();
    gathered.spent.until_now(&mut since);
    let Gathered { rows, keyframes, exact, spent, .. } = gathered;
    let truth = plan.dataset.truth().map(|truth| from_first(truth, &plan.indices));
    let poses: Vec<Transform> = rows.iter().map(|row| row.report.t_world_camera).collect();
    Ok(RunRecord {
        name: plan.dataset.name().to_owned(),
        notes: plan.dataset.notes().to_vec(),
        motion_source: match (&plan.poses, plan.config.mapper.egomotion) {
            (Some(_), _) => "file",
            (None, MotionSource::Stereo) => "stereo",
            (None, MotionSource::Icp) => "icp",
        },
        profile: plan.profile.clone(),
        capacity: plan.capacity,
        threads: plan.threads,
        size: plan.dataset.size(),
        rig: plan.dataset.rig(),
        config_toml: plan.config_toml.clone(),
        errors: truth.as_ref().and_then(|truth| crate::evaluate::trajectory::errors(truth, &poses)),
        truth,
        exact: exact.figures(),
        lidar,
        regions,
        slab_bytes,
        rss_peak_bytes: resident_bytes().map(|(_, peak)| peak),
        blocks,
        streaming: plan.streaming,
        shelf,
        shelf_failure,
        rss_limit_bytes: plan.rss_limit_bytes,
        finish,
        mesh,
        seconds: spent.whole.as_secs_f64(),
        mapping_seconds: mapping.as_secs_f64(),
        rows,
        objects,
        keyframes,
        overview_png,
    })
}

/// What a drive leaves besides the mesh.
struct Drive {
    gathered: Gathered,
    objects: ObjectsRecord,
    lidar: Option<LidarRecord>,
    overview_png: Vec<u8>,
    regions: Vec<Region>,
    blocks: usize,
    finish: PruneReport,
    shelf_failure: Option<String>,
    /// Up to when time is in `gathered`.
    since: Instant,
}

/// Maps the planned frames in `slab`.
fn drive(plan: &Plan, slab: &mut [u8], folder: &RunFolder, stopped: Option<Stopped>) -> Result<(Drive, MeshOutput), RunError> {
    let mut course = match stopped {
        None => Course::begin(plan, folder, slab)?,
        Some(stopped) => Course::resume(plan, folder, slab, stopped)?,
    };
    course.frames()?;
    let finish = course.finish()?;
    let overview_png = course.overview();
    let Course { mut mapper, shelf, mut gathered, lidar, since, .. } = course;
    let (regions, blocks) = (mapper.footprint().regions().to_vec(), mapper.background().pool().len());
    let failed_before = shelf.failure().is_some();
    let output = MeshOutput::begin(&mut mapper, shelf, folder)?;
    let shelf_failure = output.failure();
    if let Some(failure) = shelf_failure.as_ref().filter(|_| !failed_before) {
        eprintln!("warning: at the end: map.blocks takes no more ({failure}). The rest of the map is lost");
    }
    let drive = Drive {
        objects: gathered.objects.finish(&gathered.rows),
        gathered,
        lidar: lidar.map(LidarAtWork::finish),
        overview_png,
        regions,
        blocks,
        finish,
        shelf_failure,
        since,
    };
    Ok((drive, output))
}

/// Poses of the chosen frames, seen from the first of them.
pub(super) fn from_first(poses: &[Transform], indices: &[usize]) -> Vec<Transform> {
    let chosen: Vec<Transform> = indices.iter().filter_map(|&index| poses.get(index).copied()).collect();
    let Some(first) = chosen.first().map(Transform::inverse) else { return Vec::new() };
    chosen.iter().map(|pose| first * pose).collect()
}
