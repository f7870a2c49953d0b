//! Submap: the blocks of a run in its own lattice, and the path of its camera.
//!
//! Where the camera was lost, a run begins another segment of its map, whose place is not known:
//! only the first segment is kept.
//!
//! Values are taken over as they are: a map is carried into the world once, when it is known where
//! it lies. A folder holds `map.blocks`, and `submap.json`, whose checksum covers every record: a
//! map that was changed or cut off is refused.

use super::FleetError;
use super::distance_field::DistanceField;
use super::free_space::{Camera, CameraPose, free_blocks};
use super::manifest::{rows_of, transform};
use super::tile_file::Lattice;
use crate::formats::bounds::MANIFEST_TEXT;
use crate::formats::read_text_within;
use crate::owned::DraftFolder;
use crate::run::store::{BlockFile, Position};
use crate::run::{BLOCKS_FILE, write_whole};
use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::{
    BLOCK_SIDE, BLOCK_VOXELS, BlockCoord, BlockKey, BlockStore, EvictedBlock, LoadedBlock,
};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Version of what a map consists of: its blocks, those that are added to them, and what is known
/// of it.
pub const VERSION: u32 = 3;
/// Name of what is known of a map.
const HEAD_FILE: &str = "submap.json";

/// Header of a submap's file.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SubmapHeader {
    voxel_size_m: f32,
    truncation_m: f32,
    colour: bool,
    position: Position,
    /// Number of the frame in the data set, and the rows of the camera in the map.
    cameras: Vec<(usize, [f64; 12])>,
    /// Times of these frames, s; empty in maps of older versions, and where a time is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    times_s: Vec<f64>,
    /// Frames of later segments.
    left_out_frames: usize,
}

/// A run's map in its own lattice.
pub struct Submap {
    /// Lattice of the map's voxels.
    pub lattice: Lattice,
    /// File of the map's blocks.
    pub store: BlockFile<File>,
}

/// One block of a run.
pub struct Source {
    pub sdf: [i16; BLOCK_VOXELS],
    pub weight: [u8; BLOCK_VOXELS],
    pub colour: Option<Box<[[u8; BLOCK_VOXELS]; 3]>>,
}

impl Source {
    /// Reads a block; `None` where it is not stored.
    pub fn load(store: &mut BlockFile<File>, coord: BlockCoord, colour: bool) -> Option<Box<Self>> {
        let mut source = Box::new(Self {
            sdf: [0; BLOCK_VOXELS],
            weight: [0; BLOCK_VOXELS],
            colour: colour.then(|| Box::new([[0; BLOCK_VOXELS]; 3])),
        });
        let key = BlockKey::in_first(coord);
        let into = LoadedBlock {
            key,
            sdf: &mut source.sdf,
            weight: &mut source.weight,
            colour: source.colour.as_deref_mut(),
        };
        (store.holds(key) && store.load(into)).then_some(source)
    }
}

/// The voxel of its block at a lattice point.
pub fn voxel_of(point: [i32; 3]) -> usize {
    let [x, y, z] = point.map(|side| (side & 7) as usize);
    x + BLOCK_SIDE * (y + BLOCK_SIDE * z)
}

/// The lattice point of a block's voxel.
pub fn lattice_point(coord: BlockCoord, voxel: usize) -> [i32; 3] {
    let offset =
        [voxel % BLOCK_SIDE, voxel / BLOCK_SIDE % BLOCK_SIDE, voxel / BLOCK_SIDE / BLOCK_SIDE];
    let blocks = [coord.x, coord.y, coord.z];
    std::array::from_fn(|axis| i32::from(blocks[axis]) * BLOCK_SIDE as i32 + offset[axis] as i32)
}

/// All blocks of a store's first segment, tile by tile, ascending within a tile.
pub fn blocks(store: &mut BlockFile<File>) -> Vec<BlockCoord> {
    let tiles = store.tiles().into_iter().filter(|tile| tile.segment == MapSegment::FIRST);
    tiles.flat_map(|tile| store.blocks_of(tile)).map(|key| key.coord).collect()
}

/// Keeps the newest record of each block of a run's first segment in a new folder, and the blocks
/// that its camera saw to be free. Returns their number.
///
/// # Errors
/// The folder exists, a block cannot be read, or the disk refuses. Nothing half-written stays
/// behind.
pub fn keep(
    store: &mut BlockFile<File>,
    lattice: &Lattice,
    camera: &Camera,
    out: &Path,
) -> Result<u64, FleetError> {
    if out.exists() {
        return Err(FleetError::Exists { path: out.to_path_buf() });
    }
    let draft = DraftFolder::begin(out).map_err(FleetError::io(out))?;
    let path = draft.path().join(BLOCKS_FILE);
    let (mut kept, _) = BlockFile::open(&path, lattice.voxel_size_m, lattice.truncation_m)?;
    // Where segments after a loss lie in the first is not known: only the first is kept.
    let (first, later): (Vec<CameraPose>, Vec<CameraPose>) =
        camera.poses.iter().partition(|pose| pose.segment == MapSegment::FIRST);
    let (camera, left_out_frames) = (Camera { poses: first, ..*camera }, later.len());
    for coord in blocks(store) {
        let source = Source::load(store, coord, lattice.colour).ok_or_else(|| {
            FleetError::content(
                out,
                format!("is not made: block {coord:?} of the run cannot be read"),
            )
        })?;
        let block = EvictedBlock {
            key: BlockKey::in_first(coord),
            sdf: &source.sdf,
            weight: &source.weight,
            colour: source.colour.as_deref(),
        };
        if !kept.store(block) {
            return Err(not_stored(&kept, &path));
        }
    }
    // Free space is found by the map itself: rays from the camera to its surfaces.
    let field = DistanceField::of(&mut kept, lattice, 1);
    let colour = lattice.colour.then(|| Box::new([[0; BLOCK_VOXELS]; 3]));
    for (coord, views) in
        free_blocks(&field, &camera).into_iter().filter(|(coord, _)| !field.holds(*coord))
    {
        // A free block has the largest distance everywhere, and as weight its number of views.
        let (sdf, weight) = ([i16::MAX; BLOCK_VOXELS], [views; BLOCK_VOXELS]);
        if !kept.store(EvictedBlock {
            key: BlockKey::in_first(coord),
            sdf: &sdf,
            weight: &weight,
            colour: colour.as_deref(),
        }) {
            return Err(not_stored(&kept, &path));
        }
    }
    let head = SubmapHeader {
        voxel_size_m: lattice.voxel_size_m,
        truncation_m: lattice.truncation_m,
        colour: lattice.colour,
        position: kept.position().map_err(FleetError::io(&path))?,
        cameras: camera.poses.iter().map(|of| (of.frame, rows_of(&of.t_map_camera))).collect(),
        times_s: camera.poses.iter().map(|of| of.time_s).collect::<Option<_>>().unwrap_or_default(),
        left_out_frames,
    };
    // The head is written last: without it the folder is no map.
    let text = serde_json::to_string(&head).unwrap_or_default();
    let head_path = draft.path().join(HEAD_FILE);
    write_whole(&head_path, |file| file.write_all(text.as_bytes()))
        .map_err(|error| FleetError::content(&head_path, error.to_string()))?;
    draft.rename(out).map_err(FleetError::io(out))?;
    Ok(kept.records())
}

/// Explains why a store took no block.
pub fn not_stored(store: &BlockFile<File>, path: &Path) -> FleetError {
    let source = store.failure().map_or_else(
        || std::io::ErrorKind::Other.into(),
        |error| std::io::Error::other(error.to_string()),
    );
    FleetError::Io { path: path.to_path_buf(), source }
}

impl Submap {
    /// Opens the map in a folder.
    ///
    /// # Errors
    /// The folder is no map, or not as it was written.
    pub fn open(folder: &Path) -> Result<Self, FleetError> {
        let SubmapHeader { voxel_size_m, truncation_m, colour, position, .. } =
            SubmapHeader::read(folder)?;
        let store =
            BlockFile::reopen(&folder.join(BLOCKS_FILE), voxel_size_m, truncation_m, &position)
                .map_err(|_| {
                    FleetError::content(folder, "is damaged. Remove the folder and make it again")
                })?;
        Ok(Self { lattice: Lattice { voxel_size_m, truncation_m, colour }, store })
    }

    /// Reads the camera's poses of a run folder, each in its segment.
    ///
    /// # Errors
    /// The folder is no map.
    pub fn cameras(folder: &Path) -> Result<Vec<CameraPose>, FleetError> {
        let SubmapHeader { cameras, times_s, .. } = SubmapHeader::read(folder)?;
        let times_s = times_s.into_iter().map(Some).chain(std::iter::repeat(None));
        let camera = |((frame, rows), time_s): ((usize, [f64; 12]), Option<f64>)| {
            let (segment, t_map_camera) = (MapSegment::FIRST, transform(&rows)?);
            Some(CameraPose { frame, time_s, segment, t_map_camera })
        };
        let cameras = cameras.into_iter().zip(times_s).map(camera).collect::<Option<_>>();
        cameras.ok_or_else(|| {
            FleetError::content(folder, "is damaged. Remove the folder and make it again")
        })
    }
}

impl Submap {
    /// Frames of the run whose place in the map in a folder is not known, for the camera was lost
    /// before.
    ///
    /// # Errors
    /// The folder is no map.
    pub fn left_out_frames(folder: &Path) -> Result<usize, FleetError> {
        Ok(SubmapHeader::read(folder)?.left_out_frames)
    }
}

impl SubmapHeader {
    fn read(folder: &Path) -> Result<Self, FleetError> {
        let path = folder.join(HEAD_FILE);
        let text = read_text_within(&path, &MANIFEST_TEXT)?;
        serde_json::from_str(&text)
            .map_err(|error| FleetError::content(&path, format!("is no map of a run: {error}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::geometry::{StereoRig, Transform};

    #[test]
    fn a_kept_map_has_the_newest_values_and_a_changed_one_is_refused() {
        let root = tempfile::TempDir::new().unwrap();
        let (mut store, _) = BlockFile::open(&root.path().join("run.blocks"), 0.1, 0.5).unwrap();
        // One block twice: its newer values count.
        for (x, weight) in [(3, 1), (-2, 5), (3, 9)] {
            let (sdf, weight) = ([-7; BLOCK_VOXELS], [weight; BLOCK_VOXELS]);
            assert!(store.store(EvictedBlock {
                key: BlockKey::in_first(BlockCoord { x, y: 0, z: 0 }),
                sdf: &sdf,
                weight: &weight,
                colour: None
            }));
        }
        let lattice = Lattice { voxel_size_m: 0.1, truncation_m: 0.5, colour: false };
        let out = root.path().join("map");
        let rig =
            StereoRig { focal_px: 100.0, center_u_px: 50.0, center_v_px: 20.0, baseline_m: 0.5 };
        let pose = CameraPose {
            frame: 7,
            time_s: Some(1_711_197_319.25),
            segment: MapSegment::FIRST,
            t_map_camera: Transform::from_translation([1.0, 2.0, 3.0]),
        };
        let camera = Camera { rig, size: (100, 40), poses: vec![pose] };
        // Two blocks, although three were stored.
        assert_eq!(keep(&mut store, &lattice, &camera, &out).unwrap(), 2);
        assert!(matches!(
            keep(&mut store, &lattice, &camera, &out),
            Err(FleetError::Exists { .. })
        ));
        let mut map = Submap::open(&out).unwrap();
        assert_eq!((map.lattice, blocks(&mut map.store).len()), (lattice, 2));
        assert_eq!(Submap::cameras(&out).unwrap(), [pose]);
        let source = Source::load(&mut map.store, BlockCoord { x: 3, y: 0, z: 0 }, false).unwrap();
        assert_eq!((source.sdf[5], source.weight[5]), (-7, 9));
        let path = out.join(BLOCKS_FILE);
        let whole = std::fs::read(&path).unwrap();
        // A byte of the head, one of a block, and the last one.
        for at in [20, whole.len() / 2, whole.len() - 1] {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            std::fs::write(&path, bytes).unwrap();
            assert!(
                Submap::open(&out).err().unwrap().to_string().contains("is damaged"),
                "byte {at}"
            );
        }
    }

    #[test]
    fn only_the_first_segment_of_a_map_is_kept() {
        let root = tempfile::TempDir::new().unwrap();
        let (mut store, _) = BlockFile::open(&root.path().join("run.blocks"), 0.1, 0.5).unwrap();
        let second = MapSegment::new(1);
        // Two segments share a lattice: one block of either lies where the other has one as well.
        for (segment, x, distance) in
            [(MapSegment::FIRST, 3, -7), (second, 3, 5), (second, 4, 5), (MapSegment::FIRST, 9, -7)]
        {
            let (sdf, weight) = ([distance; BLOCK_VOXELS], [9; BLOCK_VOXELS]);
            assert!(store.store(EvictedBlock {
                key: BlockKey { segment, coord: BlockCoord { x, y: 0, z: 0 } },
                sdf: &sdf,
                weight: &weight,
                colour: None
            }));
        }
        let lattice = Lattice { voxel_size_m: 0.1, truncation_m: 0.5, colour: false };
        let rig =
            StereoRig { focal_px: 100.0, center_u_px: 50.0, center_v_px: 20.0, baseline_m: 0.5 };
        // The camera climbed before it was lost: no height tells its segments apart.
        let pose = |frame: usize, segment: MapSegment, y: f64| CameraPose {
            frame,
            time_s: None,
            segment,
            t_map_camera: Transform::from_translation([0.0, y, 0.0]),
        };
        let poses = vec![
            pose(0, MapSegment::FIRST, 0.0),
            pose(1, MapSegment::FIRST, -120.0),
            pose(2, second, -100.0),
        ];
        let out = root.path().join("map");
        let camera = Camera { rig, size: (100, 40), poses };
        assert_eq!(keep(&mut store, &lattice, &camera, &out).unwrap(), 2);
        assert_eq!(
            (Submap::cameras(&out).unwrap().len(), Submap::left_out_frames(&out).unwrap()),
            (2, 1)
        );
        let mut map = Submap::open(&out).unwrap();
        let kept = blocks(&mut map.store);
        assert_eq!(kept.iter().map(|coord| coord.x).collect::<Vec<_>>(), [3, 9]);
        let source = Source::load(&mut map.store, kept[0], false).unwrap();
        assert_eq!(source.sdf[5], -7, "the first segment's, not the newest record's");
    }
}
