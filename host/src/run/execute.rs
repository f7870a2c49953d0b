//! One run: frames in; map, trajectory and figures out.

use super::checkpoint::Checkpoint;
use super::closed_map;
use super::disk_store::MeshOutput;
use super::ending::Incomplete;
use super::error::RunError;
use super::frames::slab_of;
use super::places::{self, PLACES_FILE};
use super::record::RunRecord;
use super::saved::Saved;
use super::session::Session;
use super::state::RunState;
use super::{RunFolder, resident_bytes};
use crate::formats::{CLOSED_MAP_FILE, MAP_FILE, Mesh, MeshAxes};
use crate::observe::{
    ClosedLoops, Finished, ObservedRun, Observer, RECORDING_FILE, ReferencePlan, Sections,
};
use crate::owned::check_overlap;
use crate::request::Plan;
use crate::scene::PICTURES_FOLDER;
use dynvox_core::memory::Region;
use dynvox_core::volume::PruneReport;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Maps the planned frames, or of an interrupted run those that are left, and writes the mesh into
/// the folder. What stops the run after its first frame is in [`RunRecord::incomplete`], and the
/// record is of what was mapped until then.
///
/// # Errors
/// The plan cannot be run, or not even its first frame can be mapped.
pub fn run(
    plan: Plan,
    folder: &RunFolder,
    checkpoint: Option<Checkpoint>,
) -> Result<RunRecord, RunError> {
    plan.check()?;
    check_outputs(&plan, folder.target())?;
    let mut slab = slab_of(&plan)?;
    let exports = &plan.request.exports;
    let instances = Saved::begin(exports.instances.as_deref(), "--save-instances")?;
    let disparity = Saved::begin(exports.disparity.as_deref(), "--save-disparity")?;
    let map_disparity = Saved::begin(exports.map_disparity.as_deref(), "--save-map-disparity")?;
    let scene =
        Saved::begin(exports.scene.as_ref().map(|scene| scene.folder.as_path()), "--export")?;
    let observed = ObservedRun {
        plan: &plan,
        folder: folder.path().to_path_buf(),
        instances_folder: instances.path(),
        disparity_folder: disparity.path(),
        map_disparity_folder: map_disparity.path(),
        scene_folder: scene.path(),
        reference: ReferencePlan::of_run(&plan),
    };
    let Mapped { mut state, mut since, regions, blocks, pruned, loops, output, mut incomplete } =
        map(&observed, slab.bytes_mut(), folder, checkpoint)?;
    sync(&mut state, folder, &mut incomplete);
    // The mapper is removed: its slab serves to read the map piece by piece.
    let (written, store) = output.finish(
        slab.bytes_mut(),
        (&plan.capacity, &plan.config),
        (folder, plan.request.exports.objects),
    );
    let mesh = written.unwrap_or_else(|error| {
        Incomplete::add_missing(&mut incomplete, MAP_FILE, &error.to_string());
        Mesh::default()
    });
    let mesh_path = folder.file(MAP_FILE);
    let finished = Finished { regions, blocks, pruned, mesh, mesh_path, store, loops };
    let sections = std::mem::take(&mut state.observers).finish(&observed, &finished)?;
    add_unwritten(&mut incomplete, &sections);
    if incomplete.is_none() {
        let options = [
            "the folder of --save-instances",
            "the folder of --save-disparity",
            "the folder of --save-map-disparity",
            "the folder of --export",
        ];
        for (saved, option) in [instances, disparity, map_disparity, scene].into_iter().zip(options)
        {
            if let Err(error) = saved.commit() {
                Incomplete::add_missing(&mut incomplete, option, &error.to_string());
            }
        }
    }
    let mapping_seconds = state.timers.mapping().as_secs_f64();
    state.timers.add_since(&mut since);
    Ok(RunRecord {
        frames: state.frames,
        continued: state.continued,
        skipped: state.skipped,
        dropped: plan.dataset.stream().map_or(0, |stream| stream.dropped),
        incomplete,
        sections,
        seconds: state.timers.total.as_secs_f64(),
        mapping_seconds,
        rss_peak_bytes: resident_bytes().map(|(_, peak)| peak),
        plan,
    })
}

/// Refuses outputs that contain an input of the plan or lie within one.
///
/// # Errors
/// The first such input.
pub fn check_outputs(plan: &Plan, target: &Path) -> Result<(), RunError> {
    let inputs = plan.request.inputs();
    let saved = plan.request.saved_folders().map(PathBuf::as_path);
    saved.chain([target]).try_for_each(|output| check_overlap(output, &inputs))?;
    Ok(())
}

/// Writes the last rows; files that the disk refuses are missing.
fn sync(state: &mut RunState, folder: &RunFolder, incomplete: &mut Option<Incomplete>) {
    if state.sync(folder.path()).is_empty() {
        return;
    }
    // What was kept for this moment is enough for the last rows.
    folder.release_reserve();
    for (name, error) in state.sync(folder.path()) {
        Incomplete::add_missing(incomplete, &name, &error.to_string());
    }
}

/// Adds the files that observers could not write.
fn add_unwritten(incomplete: &mut Option<Incomplete>, sections: &Sections) {
    for name in &sections.objects.unwritten {
        Incomplete::add_missing(
            incomplete,
            &format!("objects/{name}.ply"),
            "an object could not be written",
        );
    }
    for (name, failure) in [
        (PICTURES_FOLDER, &sections.gallery_failure),
        (RECORDING_FILE, &sections.recording_failure),
    ] {
        if let Some(failure) = failure {
            Incomplete::add_missing(incomplete, name, failure);
        }
    }
}

/// A run whose frames are mapped, without its mapper.
struct Mapped {
    state: RunState,
    since: Instant,
    regions: Vec<Region>,
    blocks: usize,
    pruned: PruneReport,
    loops: ClosedLoops,
    output: MeshOutput,
    incomplete: Option<Incomplete>,
}

/// Maps the planned frames in `slab`.
fn map(
    run: &ObservedRun<'_>,
    slab: &mut [u8],
    folder: &RunFolder,
    checkpoint: Option<Checkpoint>,
) -> Result<Mapped, RunError> {
    let plan = run.plan;
    let mut session = match checkpoint {
        None => Session::begin(run, folder, slab)?,
        Some(checkpoint) => Session::resume(run, folder, slab, checkpoint)?,
    };
    let mut incomplete = session.frames()?.or_else(|| session.of_disk());
    // From here on frames are mapped, and no failure may lose them.
    let pruned = session.end().unwrap_or_else(|error| {
        incomplete.get_or_insert_with(|| Incomplete::of(&error, Some(0)));
        PruneReport::default()
    });
    let Session { mut mapper, store, state, since, .. } = session;
    let axes = plan.request.exports.axes;
    let axes = match state.observers.up_world() {
        Some(up) => MeshAxes::upright(axes, up),
        None => axes.into(),
    };
    if let Err(error) = places::write(&mut mapper, folder) {
        Incomplete::add_missing(&mut incomplete, PLACES_FILE, &error.to_string());
    }
    let closed_triangles = closed_map::write(&mapper, folder, axes).unwrap_or_else(|error| {
        Incomplete::add_missing(&mut incomplete, CLOSED_MAP_FILE, &error.to_string());
        None
    });
    Ok(Mapped {
        regions: mapper.footprint().regions().to_vec(),
        blocks: mapper.static_map().pool().len(),
        pruned,
        loops: ClosedLoops {
            counts: mapper.loops(),
            keyframes: mapper.corrected_keyframes().collect(),
            held: mapper.held_loops().collect(),
            fixes_given: plan.fixes.len(),
            triangles: closed_triangles,
        },
        output: MeshOutput::begin(
            &mut mapper,
            (store, plan.request.storage.streaming()),
            folder,
            (axes, plan.capacity.colour),
        ),
        incomplete,
        state,
        since,
    })
}
