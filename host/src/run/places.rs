//! Places of a run as a file of its folder, and frames that are placed among them.

use super::error::{RunError, failed_step};
use super::frames::{each_frame, with_mapper};
use super::{FolderError, RunFolder, Threads};
use crate::request::Plan;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::{Mapper, PoseOrigin, Report, SAVED_PLACES_HEADER_BYTES, saved_keyframes};
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::Path;

/// Name of the file: the keyframes of a run with `--keyframes`.
pub const PLACES_FILE: &str = "map.places";

/// Writes the keyframes of a mapper that has some.
pub(super) fn write(mapper: &mut Mapper<'_>, folder: &RunFolder) -> Result<(), FolderError> {
    if mapper.keyframes() == 0 {
        return Ok(());
    }
    folder.write(PLACES_FILE, |out| mapper.save_places(&mut |piece: &[u8]| out.write_all(piece)))
}

/// Number of keyframes in the file of a run's folder.
///
/// # Errors
/// There is no such file, or it holds something else.
pub fn keyframes_in(folder: &Path) -> Result<u32, RunError> {
    let path = folder.join(PLACES_FILE);
    let unusable = |reason: String| RunError::Places { path: path.clone(), reason };
    let mut header = [0; SAVED_PLACES_HEADER_BYTES];
    File::open(&path)
        .and_then(|mut file| file.read_exact(&mut header))
        .map_err(|error| unusable(error.to_string()))?;
    saved_keyframes(&header).ok_or_else(|| unusable("it does not hold places of a map".to_owned()))
}

/// Frame that is placed in an old map.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PlacedFrame {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Time of the frame, ns.
    pub time_ns: u64,
    /// Segment of the old map.
    pub segment: MapSegment,
    /// Left camera to that segment's world.
    pub t_world_camera: Transform,
    /// True if a place was recognised in this frame; otherwise the camera's motion led on from the
    /// last one.
    pub recognized: bool,
}

/// Frames of a recording in an old map.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Localized {
    /// Keyframes of the old map.
    pub keyframes: u32,
    /// Frames read.
    pub frames: usize,
    /// Frames that are placed in the old map, in order.
    pub placed: Vec<PlacedFrame>,
}

impl Localized {
    fn add(&mut self, frame: usize, time_ns: u64, report: &Report, own: MapSegment) {
        self.frames += 1;
        if report.segment < own && report.pose != PoseOrigin::Extrapolated {
            self.placed.push(PlacedFrame {
                frame,
                time_ns,
                segment: report.segment,
                t_world_camera: report.t_world_camera,
                recognized: report.pose == PoseOrigin::Relocalized,
            });
        }
    }
}

/// Places the frames of a plan in the map of an old run's folder. The folder is only read.
///
/// # Errors
/// The plan cannot be run, the places cannot be used, or a frame cannot be read or mapped.
pub fn localize(plan: &Plan, old: &Path) -> Result<Localized, RunError> {
    let threads = Threads::new(plan.threads)
        .map_err(|source| RunError::Threads { count: plan.threads, source })?;
    with_mapper(plan, |mapper| {
        let keyframes = load(mapper, &old.join(PLACES_FILE))?;
        // Segments begun by this recording come after those of the old map.
        let own = mapper.segment();
        let mut localized = Localized { keyframes, ..Localized::default() };
        each_frame(plan, |index, frame| {
            let report = mapper.step(frame, &threads).map_err(|error| failed_step(index, error))?;
            let elapsed_ns = || (plan.dataset.time_s(index) * 1e9).round() as u64;
            let time_ns = frame.time_ns.unwrap_or_else(elapsed_ns);
            localized.add(index, time_ns, &report, own);
            Ok(())
        })?;
        Ok(localized)
    })
}

/// Loads places from a file into a new mapper.
fn load(mapper: &mut Mapper<'_>, path: &Path) -> Result<u32, RunError> {
    let unusable = |reason: String| RunError::Places { path: path.to_path_buf(), reason };
    let mut file = File::open(path).map(BufReader::new).map_err(|e| unusable(e.to_string()))?;
    let mut source = |piece: &mut [u8]| -> io::Result<()> { file.read_exact(piece) };
    mapper.load_places(&mut source).map_err(|error| unusable(error.to_string()))
}
