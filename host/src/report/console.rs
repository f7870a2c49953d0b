//! The last lines of a run on the console.

use super::bounds;
use super::poor_map;
use super::rig;
use super::text::{MIB, lost_because, motion_error, moving_masks, states_in_time};
use crate::evaluate::reference::{PairFigures, ReferenceFigures};
use crate::evaluate::trajectory::{TrajectoryErrors, WithoutBoresight};
use crate::formats::{
    CLOSED_MAP_FILE, MAP_FILE, REPORT_FILE, SEGMENT_GAP_M, TIMED_CLOSED_TRAJECTORY_FILE,
    TIMED_TRAJECTORY_FILE,
};
use crate::observe::{LoopSection, MavlinkSection, Sections};
use crate::run::{Continued, RunRecord};
use std::path::Path;

/// Files of a run to open first, and where.
const FIRST_FILES: [(&str, &str); 3] = [
    (REPORT_FILE, "in a browser: the map to turn, pictures, figures"),
    (MAP_FILE, "in MeshLab, CloudCompare or Blender: the map"),
    (TIMED_TRAJECTORY_FILE, "in evo or a text editor: the camera's path"),
];

/// Sentence on where a recording lies in the map that it goes on with.
fn old_map(old: &Continued) -> String {
    let own = old.own_segment.get();
    match old.placed_from {
        Some(frame) => format!(
            "continued from frame {frame} on; frames before it are in segment {own} of the map"
        ),
        None => format!(
            "WARNING: none of its {} places was recognised. This recording stands alone, in \
             segment {own} of the map",
            old.keyframes
        ),
    }
}

/// Sentence on the loops that a run closed.
fn loop_sentence(loops: &LoopSection) -> String {
    let LoopSection { closures, refused, fixes, fixes_given, taken_out, .. } = loops;
    let fixes = match fixes_given {
        0 => String::new(),
        given => format!(", {fixes} of {given} fixes taken"),
    };
    let found = format!(
        "{closures} places seen again ({refused} more refused){fixes}, {taken_out} taken out again"
    );
    if loops.moved == 0 {
        return format!("{found}; no pose changed");
    }
    let closed_map = format!(" and {CLOSED_MAP_FILE}");
    let ate = loops.ate_m.map(|ate_m| format!("; absolute trajectory error then {ate_m:.3} m"));
    format!(
        "{found}; positions move by up to {:.3} m, the last one by {:.3} m{}: see \
         {TIMED_CLOSED_TRAJECTORY_FILE}{}. {MAP_FILE} is as it was driven",
        loops.largest_correction_m,
        loops.end_correction_m,
        ate.unwrap_or_default(),
        if loops.triangles.is_some() { closed_map.as_str() } else { "" }
    )
}

/// The figures of a run whose folder is `folder`, line by line.
pub fn summary_lines(run: &RunRecord, folder: &Path) -> String {
    let mut lines = vec![("frames", format!("{} at {:.1} fps", run.frames.len(), run.fps()))];
    lines.extend(ending_lines(run));
    lines.extend(run.continued.map(|old| ("old map", old_map(&old))));
    let Sections { trajectory, reference, tracks, .. } = &run.sections;
    lines.extend(trajectory.errors.iter().flat_map(trajectory_lines));
    lines.extend(trajectory.loops.iter().map(|loops| ("loops", loop_sentence(loops))));
    lines.extend(
        reference
            .iter()
            .filter_map(|reference| reference.figures.as_ref())
            .flat_map(reference_lines),
    );
    // Figures against ground truth, where there is one.
    if let Some(figures) = &tracks.figures {
        lines.push(("tracks, 20 m", states_in_time(&figures.late_near)));
        lines.push((
            "tracks, 20 to 32 m",
            format!("{}; {} state flips", states_in_time(&figures.late_far), figures.flips),
        ));
        let error = |of| motion_error(of).unwrap_or_else(|| "-".to_owned());
        let [near, far] = [&figures.moving_near, &figures.moving_far].map(error);
        lines.push((
            "motion error",
            format!("per frame of moving objects: {near} within 20 m; {far} at 20 to 32 m"),
        ));
    }
    lines.extend(tracks.masks.iter().map(|masks| ("moving objects", moving_masks(masks))));
    lines.extend(block_lines(run));
    lines.extend(poor_map::sentence(run).map(|sentence| ("map WARNING", sentence)));
    lines.push(("memory", bounds::sentence(run)));
    lines.extend(run.sections.mavlink.map(|MavlinkSection { sent, failed }| {
        ("MAVLink", format!("{sent} obstacle messages sent, {failed} refused by the system"))
    }));
    lines.extend(run.sections.inertial.as_ref().map(|found| {
        let name = if found.is_doubted() { "inertial WARNING" } else { "inertial unit" };
        (name, found.sentence())
    }));
    lines.extend(pose_lines(run));
    // A miscalibrated rig is the one finding that makes all others doubtful.
    lines.push((
        if rig::is_warning(run) { "calibration WARNING" } else { "calibration" },
        rig::sentence(run),
    ));
    lines.push(("digest", format!("{:016x}", run.digest())));
    lines.push(("results", folder.display().to_string()));
    // Where to look first. A run that ended early may lack some.
    let is_first = [true, false, false];
    let there = FIRST_FILES.iter().filter(|(name, _)| folder.join(name).is_file());
    lines.extend(there.zip(is_first).map(|((name, why), is_first)| {
        let label = if is_first { "open" } else { "" };
        (label, format!("{}  {why}", folder.join(name).display()))
    }));
    lines.iter().map(|(name, value)| format!("{name:<22}{value}\n")).collect()
}

fn ending_lines(run: &RunRecord) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    if let Some(incomplete) = &run.incomplete {
        let left = incomplete
            .frames_left
            .map_or_else(String::new, |left| format!(" ({left} frames left)"));
        lines.push(("INCOMPLETE", format!("{}{left}", incomplete.reason)));
    }
    if run.skipped.count > 0 {
        lines.push(("frames left out", format!("{}; summary.json lists them", run.skipped.count)));
    }
    if run.dropped > 0 {
        lines.push(("frames dropped", format!("{} came while the mapper was busy", run.dropped)));
    }
    lines
}

fn trajectory_lines(errors: &TrajectoryErrors) -> Vec<(&'static str, String)> {
    // Segments need a path of some length; a short run has figures by frame only.
    let over_segments = errors.t_err_percent.zip(errors.r_err_deg_per_m);
    let over_segments = over_segments
        .map(|(percent, deg_per_m)| format!("{percent:.3} %, {deg_per_m:.4} deg/m over segments"));
    let per_frame = format!(
        "{:.2} cm, {:.4} deg per frame; ATE {:.3} m",
        100.0 * errors.rpe_t_m,
        errors.rpe_r_deg,
        errors.ate_m
    );
    let without =
        errors.without_boresight.map(|WithoutBoresight { angle_deg, t_err_percent, rpe_t_m }| {
            format!(
                "{t_err_percent:.3} %, {:.2} cm without a boresight angle of {angle_deg:.2} deg",
                100.0 * rpe_t_m
            )
        });
    // The label stands before the first line only.
    let labels = std::iter::once("trajectory error").chain(std::iter::repeat(""));
    labels.zip(over_segments.into_iter().chain([per_frame]).chain(without)).collect()
}

fn reference_lines(figures: &ReferenceFigures) -> Vec<(&'static str, String)> {
    let percent = |share: Option<f64>| {
        share.map_or("-".to_owned(), |share| format!("{:.1} %", 100.0 * share))
    };
    let name = if figures.source == "exact" { "exact depth" } else { "LiDAR" };
    let line = |label: &'static str, PairFigures { input, fused, .. }: &PairFigures| {
        let [input, map] = [input, fused].map(|of| {
            format!("{} accurate, {} complete", percent(of.accuracy), percent(of.completeness))
        });
        (label, format!("against {name} ({}): input {input}; map {map}", figures.rule))
    };
    let mut lines = vec![line("static map", &figures.still)];
    lines.extend(figures.dynamic.iter().filter(|of| of.frames > 0).map(|of| line("objects", of)));
    // Accuracy where both show something favours what shows little: these figures do not.
    if let [Some(input), Some(map)] =
        [&figures.still.input, &figures.still.fused].map(|of| of.accuracy_alone)
    {
        lines.push((
            "",
            format!(
                "of all that each shows: input {:.1} %, map {:.1} % accurate",
                100.0 * input,
                100.0 * map
            ),
        ));
    }
    if let Some(depth) = figures.map_depth_error {
        let (error_cm, depth_m) = (100.0 * depth.median_error_m, depth.median_depth_m);
        let surface = depth.median_surface_m.map_or_else(String::new, |surface_m| {
            format!("; {:.1} cm from its surface", 100.0 * surface_m)
        });
        lines.push((
            "",
            format!(
                "median depth error of the static map {error_cm:.1} cm at {depth_m:.1} m{surface}"
            ),
        ));
    }
    lines
}

fn block_lines(run: &RunRecord) -> Vec<(&'static str, String)> {
    let blocks = &run.sections.blocks;
    let (totals, store) = (&blocks.totals, &blocks.store);
    let mut lines = vec![(
        "map",
        format!(
            "{} triangles, peak {} of {} blocks",
            blocks.mesh.static_triangles(),
            totals.peak,
            run.plan.capacity.blocks
        ),
    )];
    // Each loss comes with what to change.
    if totals.refused > 0 {
        let advice = "Give more bytes with --memory, or a larger volume.voxel_size_m";
        lines
            .push(("", format!("blocks refused: {}; the map has holes. {advice}", totals.refused)));
    }
    if store.records > 0 {
        let mib = store.bytes as f64 / MIB;
        lines.push((
            "",
            format!(
                "blocks on disk: {} written, {} loaded back, {mib:.1} MiB",
                store.records, totals.loaded
            ),
        ));
    }
    if blocks.lost() > 0 {
        lines.push(("", format!("blocks lost: {}; {}", blocks.lost(), lost_because(run))));
    }
    lines
}

/// Reasons with their numbers of frames: "6 frozen image, 2 too few matches".
fn reasons(counted: &[(String, usize)]) -> String {
    counted
        .iter()
        .map(|(reason, frames)| format!("{frames} {reason}"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn pose_lines(run: &RunRecord) -> Vec<(&'static str, String)> {
    let trajectory = &run.sections.trajectory;
    match trajectory.failures {
        Some(failures) => {
            vec![
            (
                "tracking failure",
                format!("in {} of {} frames, first in frame {}: \
                         {}", failures.frames, run.frames.len(), failures.first, failures.cause),
            ),
            ("", "their poses are extrapolated, and they are not in the map. --egomotion stereo \
                  follows fast motion".to_owned()),
        ]
        }
        None if trajectory.extrapolated_frames > 0 => {
            let frames = trajectory.extrapolated_frames;
            let reasons = reasons(&trajectory.extrapolated_because);
            let extrapolated = ("poses extrapolated", format!("in {frames} frames: {reasons}"));
            // Above, so that two segments do not look like one map.
            let apart = format!(
                "{}: the camera was lost, and where one lies in another is not known. Files show \
                 each {SEGMENT_GAP_M} m above the one before",
                trajectory.segments
            );
            [extrapolated]
                .into_iter()
                .chain((trajectory.segments > 1).then_some(("segments of the map", apart)))
                .collect()
        }
        None => Vec::new(),
    }
}
