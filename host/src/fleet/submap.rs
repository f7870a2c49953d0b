//! Submap: the blocks of a run in its own lattice, and the path of its camera.
//!
//! Where the camera was lost, a run begins another segment of its map high above, whose place is
//! not known: only the first segment is kept.
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
use dynvox_core::volume::{
    BLOCK_SIDE, BLOCK_VOXELS, BlockCoord, BlockStore, EvictedBlock, LoadedBlock,
};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Version of what a map consists of: its blocks, those that are added to them, and what is known
/// of it.
pub const VERSION: u32 = 2;
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
        let into = LoadedBlock {
            coord,
            sdf: &mut source.sdf,
            weight: &mut source.weight,
            colour: source.colour.as_deref_mut(),
        };
        (store.holds(coord) && store.load(into)).then_some(source)
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

/// All blocks of a store, tile by tile, ascending within a tile.
pub fn blocks(store: &mut BlockFile<File>) -> Vec<BlockCoord> {
    store.tiles().into_iter().flat_map(|tile| store.blocks_of(tile)).collect()
}

/// The first segment of a run's map.
struct FirstSegment {
    camera: Camera,
    left_out_frames: usize,
    /// Blocks are of later segments where their y, which points down, is less.
    top: i16,
}

impl FirstSegment {
    /// `None` where segments lie at one height.
    fn of(camera: &Camera, block_m: f64) -> Option<Self> {
        let (first, later): (Vec<CameraPose>, Vec<CameraPose>) =
            // Segment 0 is the map before the camera was lost; later ones lie above it.
            camera.poses.iter().partition(|pose| pose.segment == 0);
        let height = |pose: &CameraPose| pose.t_map_camera.translation_m[1];
        let top_m = first.iter().map(height).fold(f64::INFINITY, f64::min);
        let bottom_m = later.iter().map(height).fold(f64::NEG_INFINITY, f64::max);
        let top = if later.is_empty() {
            i16::MIN
        } else {
            (0.5 * (top_m + bottom_m) / block_m).floor() as i16
        };
        let camera = Camera { poses: first, ..*camera };
        (bottom_m < top_m).then_some(Self { camera, left_out_frames: later.len(), top })
    }
}

/// Keeps the newest record of each block of a run's first segment in a new folder, and the blocks
/// that its camera saw to be free. Returns their number.
///
/// # Errors
/// The folder exists, a block cannot be read, segments cannot be told apart, or the disk refuses.
/// Nothing half-written stays behind.
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
    // Segments after a loss stand apart, above the first: only the first is kept.
    let apart = FirstSegment::of(camera, f64::from(lattice.voxel_size_m) * BLOCK_SIDE as f64);
    let FirstSegment { camera, left_out_frames, top } = apart.ok_or_else(|| {
        FleetError::content(
            out,
            "is not made: the camera was lost, and climbed where the map went \
                                  on. End the run before, with --frames",
        )
    })?;
    for coord in blocks(store).into_iter().filter(|coord| coord.y >= top) {
        let source = Source::load(store, coord, lattice.colour).ok_or_else(|| {
            FleetError::content(
                out,
                format!("is not made: block {coord:?} of the run cannot be read"),
            )
        })?;
        let block = EvictedBlock {
            coord,
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
            coord,
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
        let camera = |(frame, rows): (usize, [f64; 12])| {
            Some(CameraPose { frame, segment: 0, t_map_camera: transform(&rows)? })
        };
        let cameras =
            SubmapHeader::read(folder)?.cameras.into_iter().map(camera).collect::<Option<_>>();
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
        // One block twice: its newer values count.
        let (mut store, _) = BlockFile::open(&root.path().join("run.blocks"), 0.1, 0.5).unwrap();
        for (x, weight) in [(3, 1), (-2, 5), (3, 9)] {
            let (sdf, weight) = ([-7; BLOCK_VOXELS], [weight; BLOCK_VOXELS]);
            assert!(store.store(EvictedBlock {
                coord: BlockCoord { x, y: 0, z: 0 },
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
            segment: 0,
            t_map_camera: Transform::from_translation([1.0, 2.0, 3.0]),
        };
        // Two blocks, although three were stored.
        let camera = Camera { rig, size: (100, 40), poses: vec![pose] };
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
        // A byte of the head, one of a block, and the last one.
        let whole = std::fs::read(&path).unwrap();
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
        // Blocks of 0.8 m: one about the camera, one 30 m above it on a hill, one about the camera
        // 100 m up.
        for y in [1, -37, -120] {
            let (sdf, weight) = ([-7; BLOCK_VOXELS], [9; BLOCK_VOXELS]);
            assert!(store.store(EvictedBlock {
                coord: BlockCoord { x: 3, y, z: 0 },
                sdf: &sdf,
                weight: &weight,
                colour: None
            }));
        }
        let lattice = Lattice { voxel_size_m: 0.1, truncation_m: 0.5, colour: false };
        let rig =
            StereoRig { focal_px: 100.0, center_u_px: 50.0, center_v_px: 20.0, baseline_m: 0.5 };
        let pose = |frame: usize, segment: u32, y: f64| CameraPose {
            frame,
            segment,
            t_map_camera: Transform::from_translation([0.0, y, 0.0]),
        };
        let camera = |poses: &[CameraPose]| Camera { rig, size: (100, 40), poses: poses.to_vec() };
        let two = [pose(0, 0, 0.0), pose(1, 0, -2.0), pose(2, 1, -98.0)];
        let out = root.path().join("map");
        assert_eq!(keep(&mut store, &lattice, &camera(&two), &out).unwrap(), 2);
        assert_eq!(
            (Submap::cameras(&out).unwrap().len(), Submap::left_out_frames(&out).unwrap()),
            (2, 1)
        );
        let mixed = keep(
            &mut store,
            &lattice,
            &camera(&[pose(0, 0, 0.0), pose(1, 1, 1.0)]),
            &root.path().join("mixed"),
        );
        assert!(mixed.unwrap_err().to_string().contains("the camera was lost, and climbed"));
        assert!(!root.path().join("mixed").exists());
    }
}
