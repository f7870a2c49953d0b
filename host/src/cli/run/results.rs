//! The files of a run folder that are written at the end, after the map and the objects. A file
//! that the disk refuses is missing, and the others are written.

use crate::formats::{REPORT_FILE, SETTINGS_FILE, SUMMARY_FILE, TRUE_TRAJECTORY_FILE, kitti_line};
use crate::report::{self, Summary};
use crate::run::{FolderError, Incomplete, RunFolder, RunRecord};
use crate::scene::{MAX_TRIANGLES, Scene, glb};
use maud::html;
use std::fs::File;
use std::io::{BufWriter, Result, Write};

/// Name of the map for viewers of glTF.
const GLB_FILE: &str = "map.glb";

/// Writes one file.
type Writer<'a> = Box<dyn Fn(&mut BufWriter<File>) -> Result<()> + 'a>;

/// Writes all files, the summary last: it names those that are missing.
///
/// # Errors
/// Not even the summary can be written.
pub fn write(folder: &RunFolder, run: &mut RunRecord) -> std::result::Result<Summary, FolderError> {
    folder.release_reserve();
    let mut incomplete = run.incomplete.take();
    for (name, write) in files(run) {
        if let Err(error) = folder.write(name, &write) {
            Incomplete::add_missing(&mut incomplete, name, &error.to_string());
        }
    }
    let scene = Scene::read(folder.path(), MAX_TRIANGLES);
    if let Ok(scene) = &scene
        && let Err(error) = folder.write(GLB_FILE, |out| glb::write(out, scene))
    {
        Incomplete::add_missing(&mut incomplete, GLB_FILE, &error.to_string());
    }
    run.incomplete = incomplete;
    let viewer = scene
        .and_then(|scene| report::viewer::fragment(folder.path(), run.plan.dataset.name(), &scene));
    let viewer =
        viewer.unwrap_or_else(|error| html! { p { b { "The report has no viewer: " (error) } } });
    if let Err(error) = folder.write(REPORT_FILE, |out| report::html::write(out, run, &viewer)) {
        Incomplete::add_missing(&mut run.incomplete, REPORT_FILE, &error.to_string());
    }
    folder.release_last_reserve();
    let summary = Summary::new(run);
    folder.write(SUMMARY_FILE, |out| Ok(serde_json::to_writer_pretty(out, &summary)?))?;
    Ok(summary)
}

/// Tables and text, by name.
fn files(run: &RunRecord) -> Vec<(&'static str, Writer<'_>)> {
    let sections = &run.sections;
    let mut files: Vec<(&'static str, Writer<'_>)> =
        vec![(SETTINGS_FILE, Box::new(|out| out.write_all(run.plan.config_toml.as_bytes())))];
    if let Ok(text) = report::bounds::capacity_toml(run) {
        files.push(("capacity.toml", Box::new(move |out| out.write_all(text.as_bytes()))));
    }
    if let Some(text) = report::rig::calibration_toml(run) {
        files.push(("calibration.toml", Box::new(move |out| out.write_all(text.as_bytes()))));
    }
    if let Some(truth) = &sections.trajectory.truth {
        files.push((
            TRUE_TRAJECTORY_FILE,
            Box::new(|out| {
                truth.iter().try_for_each(|pose| out.write_all(kitti_line(pose).as_bytes()))
            }),
        ));
    }
    if !sections.tracks.comparisons.is_empty() {
        files.push((
            "tracks_truth.csv",
            Box::new(|out| report::write_tracks_truth(out, &sections.tracks)),
        ));
    }
    if let Some(reference) = &sections.reference {
        files.push(("lidar.csv", Box::new(|out| report::write_reference(out, &reference.frames))));
        files.push((
            "surface_errors.csv",
            Box::new(|out| report::write_surface_errors(out, &reference.surface_errors)),
        ));
    }
    files
}
