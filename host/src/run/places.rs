//! Places of a run as a file of its folder, and frames that are placed among them.

use super::disk_store::BLOCKS_FILE;
use super::error::{RunError, failed_step};
use super::frames::{each_frame, with_mapper};
use super::{FolderError, RunFolder, Threads};
use crate::owned;
use crate::request::Plan;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::{Mapper, PoseOrigin, Report, SAVED_PLACES_HEADER_BYTES, saved_keyframes};
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
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
    localize_after(plan, |mapper| load(mapper, &old.join(PLACES_FILE), false))
}

/// Places the frames of a plan among keyframes that were remembered.
///
/// # Errors
/// The plan cannot be run, the keyframes cannot be used, or a frame cannot be read or mapped.
pub fn localize_among(plan: &Plan, remembered: &Remembered) -> Result<Localized, RunError> {
    localize_after(plan, |mapper| {
        let mut bytes = remembered.keyframes.as_slice();
        mapper
            .load_places(&mut |piece: &mut [u8]| bytes.read_exact(piece))
            .map_err(|error| RunError::Step { frame: 0, reason: error.to_string() })
    })
}

/// Places of a recording that was mapped without a folder.
#[derive(Clone, Debug, Default)]
pub struct Remembered {
    keyframes: Vec<u8>,
    /// Frames whose poses were estimated in the first segment, with these poses.
    pub poses: Vec<(usize, Transform)>,
}

/// Maps the frames of a plan and remembers its keyframes.
///
/// # Errors
/// The plan cannot be run, or a frame cannot be read or mapped.
pub fn remember(plan: &Plan) -> Result<Remembered, RunError> {
    let threads = threads_of(plan)?;
    with_mapper(plan, |mapper| {
        let mut remembered = Remembered::default();
        each_frame(plan, |index, frame| {
            let report = mapper.step(frame, &threads).map_err(|error| failed_step(index, error))?;
            if report.segment == MapSegment::FIRST && report.pose != PoseOrigin::Extrapolated {
                remembered.poses.push((index, report.t_world_camera));
            }
            Ok(())
        })?;
        let keyframes = &mut remembered.keyframes;
        let Ok(()) = mapper.save_places(&mut |piece: &[u8]| {
            keyframes.extend_from_slice(piece);
            Ok::<(), Infallible>(())
        });
        Ok(remembered)
    })
}

fn threads_of(plan: &Plan) -> Result<Threads, RunError> {
    Threads::new(plan.threads).map_err(|source| RunError::Threads { count: plan.threads, source })
}

fn localize_after(
    plan: &Plan,
    load: impl FnOnce(&mut Mapper<'_>) -> Result<u32, RunError>,
) -> Result<Localized, RunError> {
    let threads = threads_of(plan)?;
    with_mapper(plan, |mapper| {
        let keyframes = load(mapper)?;
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

/// Old map that a run goes on with.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Continued {
    /// Keyframes of the old map.
    pub keyframes: u32,
    /// Segment of the map that the recording is in until a place is recognised.
    pub own_segment: MapSegment,
    /// First frame that is placed in the old map; absent while none is.
    pub placed_from: Option<usize>,
}

impl Continued {
    /// Loads an old run's places into a new mapper, and copies its blocks into the new folder.
    pub(super) fn begin(
        mapper: &mut Mapper<'_>,
        old: &Path,
        folder: &RunFolder,
    ) -> Result<Self, RunError> {
        let keyframes = load(mapper, &old.join(PLACES_FILE), true)?;
        let path = old.join(BLOCKS_FILE);
        let copied = File::open(&path).and_then(|mut blocks| {
            let mut copy = owned::create_file(&folder.file(BLOCKS_FILE))?;
            io::copy(&mut blocks, &mut copy)
        });
        copied.map_err(|error| RunError::OldBlocks { path, reason: error.to_string() })?;
        Ok(Self { keyframes, own_segment: mapper.segment(), placed_from: None })
    }

    /// Takes note of a frame's segment.
    pub(super) fn add(&mut self, frame: usize, segment: MapSegment) {
        if segment < self.own_segment {
            self.placed_from.get_or_insert(frame);
        }
    }
}

/// Loads places from a file into a new mapper.
fn load(mapper: &mut Mapper<'_>, path: &Path, goes_on: bool) -> Result<u32, RunError> {
    let unusable = |reason: String| RunError::Places { path: path.to_path_buf(), reason };
    let mut file = File::open(path).map(BufReader::new).map_err(|e| unusable(e.to_string()))?;
    let mut source = |piece: &mut [u8]| -> io::Result<()> { file.read_exact(piece) };
    let loaded =
        if goes_on { mapper.continue_places(&mut source) } else { mapper.load_places(&mut source) };
    loaded.map_err(|error| unusable(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::{Memory, Request};
    use crate::run::{RunRecord, run};
    use std::fs;
    use tempfile::TempDir;

    /// Maps frames of a street from `start` on into `out`, after `old` if there is one.
    fn map_street(
        root: &Path,
        (out, old): (&str, Option<&str>),
        start: usize,
        count: usize,
    ) -> RunRecord {
        let mut request = Request::default();
        request.bounds.memory = Memory::Profile("tiny".to_owned());
        request.bounds.keyframes = 30;
        // All tests of the crate share one process, whose memory is theirs together.
        request.limits.rss_mib = Some(8 << 10);
        request.frames.start = start;
        request.frames.most = Some(count);
        request.settings.volume.voxel_size_m = 0.1;
        request.storage.keep_blocks = true;
        request.storage.continues = old.map(|old| root.join(old));
        let street = request.settings.street_mut();
        (street.width, street.height, street.frames) = (320, 96, 60);
        (street.speed_m_s, street.shake) = (3.0, 0.0);
        let folder = RunFolder::begin(&root.join(out), false).unwrap();
        let record = run(request.resolve().unwrap(), &folder, None).unwrap();
        assert!(record.incomplete.is_none(), "{:?}", record.incomplete);
        folder.commit(&[]).unwrap();
        record
    }

    fn files(folder: &Path) -> Vec<Vec<u8>> {
        [BLOCKS_FILE, PLACES_FILE].map(|name| fs::read(folder.join(name)).unwrap()).to_vec()
    }

    #[test]
    fn a_second_recording_goes_on_in_the_map_of_the_first() {
        let root = TempDir::new().unwrap();
        let first = map_street(root.path(), ("old", None), 0, 8);
        assert!(first.continued.is_none());
        let old = files(&root.path().join("old"));
        let second = map_street(root.path(), ("new", Some("old")), 2, 8);
        let continued = second.continued.unwrap();
        assert_eq!(continued.own_segment, MapSegment::new(1));
        let placed_from = continued.placed_from.expect("it sees what the first recording saw");
        assert!(placed_from < 8, "frame {placed_from}");
        let last = second.frames.last().unwrap();
        assert_eq!(last.report.segment, MapSegment::FIRST);
        // Frame 9 of a camera that moves 0.29 m in each, in the world of frame 0.
        let ahead_m = last.report.t_world_camera.translation_m[2];
        assert!(
            (ahead_m - 2.6).abs() < 0.15,
            "{ahead_m} m ahead of the first recording's beginning"
        );
        // Both maps are in the new folder, and the old one is as it was.
        assert_eq!(files(&root.path().join("old")), old);
        let new = files(&root.path().join("new"));
        assert!(new[0].starts_with(&old[0]) && new[0].len() > old[0].len());
        assert!(keyframes_in(&root.path().join("new")).unwrap() > continued.keyframes);
    }

    #[test]
    fn a_recording_elsewhere_stands_alone_and_says_so() {
        let root = TempDir::new().unwrap();
        map_street(root.path(), ("old", None), 0, 3);
        let elsewhere = map_street(root.path(), ("new", Some("old")), 50, 4);
        assert_eq!(elsewhere.continued.unwrap().placed_from, None);
        assert_eq!(elsewhere.frames.last().unwrap().report.segment, MapSegment::new(1));
        let old = files(&root.path().join("old"));
        assert!(files(&root.path().join("new"))[0].starts_with(&old[0]));
    }

    #[test]
    fn an_old_map_without_its_blocks_is_refused_by_name() {
        let root = TempDir::new().unwrap();
        map_street(root.path(), ("old", None), 0, 2);
        fs::remove_file(root.path().join("old").join(BLOCKS_FILE)).unwrap();
        let mut request = Request::default();
        request.bounds.memory = Memory::Profile("tiny".to_owned());
        request.bounds.keyframes = 30;
        request.storage.continues = Some(root.path().join("old"));
        let street = request.settings.street_mut();
        (street.width, street.height) = (320, 96);
        let folder = RunFolder::begin(&root.path().join("new"), false).unwrap();
        let error = run(request.resolve().unwrap(), &folder, None).err().unwrap().to_string();
        assert!(error.contains("map.blocks") && error.contains("--keep-blocks"), "{error}");
    }
}
