//! The map after all loops, as a file of the run's folder next to the map as it was driven.

use super::{FolderError, RunFolder};
use crate::formats::{CLOSED_MAP_FILE, MeshAxes, PlyWriter, ShownSegment};
use crate::owned;
use dynvox_core::Mapper;
use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::Slot;
use std::collections::BTreeSet;
use std::io;

/// Writes the mesh of the blocks in memory after all loops that were closed. Returns its triangles;
/// `None` where the camera came back to nothing: then it is the map as it was driven.
///
/// # Errors
/// The disk refuses; there is no file then.
pub(super) fn write(
    mapper: &Mapper<'_>,
    folder: &RunFolder,
    axes: MeshAxes,
) -> Result<Option<u64>, FolderError> {
    if !mapper.static_map().is_bent() {
        return Ok(None);
    }
    let path = folder.file(CLOSED_MAP_FILE);
    let written = PlyWriter::begin_with(&path, "the first camera", axes, has_colour(mapper))
        .and_then(|ply| triangles(mapper, ply));
    written.map(Some).map_err(|source| {
        // It may not exist.
        let _ = owned::remove_file(&path);
        FolderError::Write { path, source }
    })
}

fn triangles(mapper: &Mapper<'_>, mut ply: PlyWriter) -> io::Result<u64> {
    let volume = mapper.static_map();
    let keys = volume.pool().live().filter_map(|slot| volume.blocks().key(slot));
    let segments: BTreeSet<MapSegment> =
        keys.map(|key| volume.driven_segment(key.segment)).collect();
    for segment in segments {
        let mut shown = ShownSegment::new(segment, &mut ply);
        volume.closed_mesh(&mapper.config().mesh, segment, &mut shown);
    }
    Ok(ply.finish()?.triangles)
}

/// Returns true if the map has colour.
fn has_colour(mapper: &Mapper<'_>) -> bool {
    mapper.static_map().blocks().colour(Slot::new(0)).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{CLOSED_TRAJECTORY_FILE, MAP_FILE, TRAJECTORY_FILE, read_poses};
    use crate::input::masks::MaskChoice;
    use crate::input::{
        FrameInfo, FrameSource, InputError, LidarScan, SourceInfo, StereoImages, StreamState,
        StreetFrames,
    };
    use crate::request::{Memory, Request};
    use crate::run::run;
    use crate::synth::StreetConfig;
    use std::fs;
    use std::path::Path;
    use tempfile::TempDir;

    /// Frames from the first place to the last one.
    const WAY: usize = 22;

    fn street() -> StreetConfig {
        StreetConfig {
            width: 240,
            height: 80,
            frames: 2 * WAY as u32 + 11,
            speed_m_s: 12.0,
            shake: 0.0,
            ..StreetConfig::static_street()
        }
    }

    /// A street that is driven ahead and back, and its beginning ahead once more.
    struct ThereAndBack {
        street: StreetFrames,
        info: SourceInfo,
    }

    impl ThereAndBack {
        fn new() -> Self {
            let street = StreetFrames::new(street()).unwrap();
            // The street's own poses are not those of the way back.
            let info = SourceInfo { truth: None, ..street.info().clone() };
            Self { street, info }
        }

        /// The frame of the street that is shown.
        fn shown(index: usize) -> usize {
            let (turned, again) = (WAY - 1, 2 * (WAY - 1));
            if index > again { index - again } else { turned - turned.abs_diff(index) }
        }
    }

    impl FrameSource for ThereAndBack {
        fn info(&self) -> &SourceInfo {
            &self.info
        }

        fn frame_info(&self, index: usize) -> FrameInfo {
            self.street.frame_info(index)
        }

        fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
            self.street.frame(Self::shown(index))
        }

        fn stream(&self) -> Option<StreamState> {
            None
        }

        fn has_lidar(&self, _: usize) -> bool {
            false
        }

        fn lidar(&self, _: usize) -> Result<Option<LidarScan>, InputError> {
            Ok(None)
        }
    }

    /// Maps the first `count` frames.
    fn map(folder: &Path, count: usize) -> u32 {
        let mut request = Request::default();
        request.bounds.memory = Memory::Profile("tiny".to_owned());
        request.bounds.keyframes = 100;
        // All tests of the crate share one process, whose memory is theirs together.
        request.limits.rss_mib = Some(8 << 10);
        request.frames.most = Some(count);
        request.masks.source = MaskChoice::None;
        (request.settings.volume.voxel_size_m, request.settings.volume.far_m) = (0.04, 6.0);
        *request.settings.street_mut() = street();
        let begun = RunFolder::begin(folder, false).unwrap();
        let mut plan = request.resolve().unwrap();
        plan.dataset = Box::new(ThereAndBack::new());
        let record = run(plan, &begun, None).unwrap();
        assert!(record.incomplete.is_none(), "{:?}", record.incomplete);
        begun.commit(&[]).unwrap();
        record.sections.trajectory.loops.map_or(0, |loops| loops.closures)
    }

    /// Triangles of a map, by the head of its file.
    fn triangles(path: &Path) -> u32 {
        let bytes = fs::read(path).unwrap();
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(2000)]).into_owned();
        let count = head.lines().find_map(|line| line.strip_prefix("element face "));
        count.unwrap().parse().unwrap()
    }

    #[test]
    fn a_way_back_closes_and_its_map_has_each_wall_once() {
        let root = TempDir::new().unwrap();
        let folder = root.path().join("run");
        assert!(map(&folder, 2 * WAY + 11) > 0, "the camera comes back to where it was");
        let [driven, closed] = [MAP_FILE, CLOSED_MAP_FILE].map(|at| triangles(&folder.join(at)));
        println!("{driven} triangles as driven, {closed} after the loops");
        assert!(closed > driven / 2 && closed < driven / 100 * 93, "{closed} of {driven}");
        // The last frame is one of the first ones, seen a second time.
        let last = 2 * WAY + 10;
        let end_m = |name| {
            let poses = read_poses(&folder.join(name)).unwrap().poses;
            (poses[ThereAndBack::shown(last)].inverse() * poses[last]).distance_m()
        };
        let (driven_m, closed_m) = (end_m(TRAJECTORY_FILE), end_m(CLOSED_TRAJECTORY_FILE));
        println!("{driven_m} m apart as driven, {closed_m} m after the loops");
        assert!(closed_m < 0.6 * driven_m, "{closed_m} m, {driven_m} m as driven");
    }

    #[test]
    fn a_way_ahead_has_no_second_map() {
        let root = TempDir::new().unwrap();
        let folder = root.path().join("run");
        assert_eq!(map(&folder, 6), 0);
        assert!(folder.join(MAP_FILE).exists() && !folder.join(CLOSED_MAP_FILE).exists());
    }
}
