//! A finished run as a viewer shows it, read from the run folder and bounded: so many triangles,
//! frames and pictures, however long the run.

mod block_history;
mod cluster;
pub mod glb;
mod mesh;
mod pictures;
mod planning;
mod read;
mod simplify;
mod surface_errors;
mod tables;
pub mod tiles;

pub use block_history::BlockHistory;
pub use mesh::IndexedMesh;
pub use pictures::{OVERVIEW, PICTURES_FOLDER, PICTURES_INDEX, PictureIndex, PictureKind};
pub use planning::{
    FREE_GREY, OCCUPIED_GREY, PLANNING_FOLDER, PlanningCell, PlanningWindow, WindowScales,
};
pub use read::object_files;
pub use surface_errors::SurfaceErrorMap;
pub use tables::{FrameColumns, TrackColumns};

use dynvox_core::geometry::Transform;

/// Name of the folder of objects in the run folder.
pub const OBJECTS_FOLDER: &str = "objects";
/// Triangles of all meshes together, unless something else is asked for.
pub const MAX_TRIANGLES: usize = 500_000;

/// A cell and those around it.
fn neighbourhood([x, y, z]: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(move |code| [x + code % 3 - 1, y + code / 3 % 3 - 1, z + code / 9 - 1])
}

/// A frame.
#[derive(Clone, Debug)]
pub struct SceneFrame {
    /// Columns of the frame in `frames.csv`.
    pub row: FrameColumns,
    /// The left camera's pose.
    pub t_world_camera: Transform,
    /// Tracks seen in it.
    pub tracks: Vec<TrackColumns>,
}

/// A reconstructed object.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// Name of its files: the track's number; `7-2` for the second object of track 7.
    pub name: String,
    /// Number of its track.
    pub id: u32,
    /// Poses of the object in the frames it was fused in, by number of the frame.
    pub t_world_object: Vec<(usize, Transform)>,
    /// Mesh in the object's own frame.
    pub mesh: IndexedMesh,
}

/// A finished run.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The frames, by number.
    pub frames: Vec<SceneFrame>,
    /// True poses of the left camera, where they are known.
    pub truth: Vec<Transform>,
    /// The static map.
    pub static_map: IndexedMesh,
    /// Triangles of the static map on disk.
    pub static_triangles: u64,
    /// Frames in which blocks were last seen, and the blocks that pruning removed.
    pub blocks: BlockHistory,
    /// Errors of the map's surface, where it was compared with a reference.
    pub errors: SurfaceErrorMap,
    /// The planner's window.
    pub planning: PlanningWindow,
    /// The objects, by track.
    pub objects: Vec<SceneObject>,
    /// Index of the frames that have pictures.
    pub pictures: PictureIndex,
}
