//! Many maps as one: sums of voxels in tiles of the world, which can be added in any order.
//!
//! A voxel's running average cannot be added to another's without its rounding. Its sums can:
//! weight times distance, and weight, as integers. Integer addition is associative and commutative,
//! so maps of many recordings, merged by any number of workers in any order, give the same bits.
//! Data flows: a run's blocks -> [`keep`] (its map in its own lattice) -> [`Alignment`] (where it
//! lies in the world) -> [`resample`] (sums in the world's lattice) -> [`merge`] -> [`Averages`]
//! (one map of all epochs) -> [`write_mesh`]. [`Manifest`] says which runs there are to do, and no
//! more than two folders each is what they leave.
//!
//! **Memory.** A merge holds one block of each input; resampling a cache of blocks and a list of
//! block coordinates; alignment the distances of two maps; averages one block of each epoch; a mesh
//! a cube of blocks.

mod align;
mod averages;
mod block_sums;
mod changes;
mod coverage;
mod distance_field;
mod error;
mod free_space;
mod georeference;
mod manifest;
mod merge;
mod mesh;
mod part_frames;
mod parts;
mod pose_graph;
mod recordings;
mod register;
mod report;
mod resample;
mod resolve;
mod submap;
mod tile_file;
mod tile_folder;

pub use align::{ALIGNMENT_FILE, AlignedPair, AlignedRecording, Alignment, poses};
pub use averages::Averages;
pub use block_sums::{BlockSums, MAX_WEIGHT};
pub use changes::{Change, ChangeKind, changes};
pub use coverage::{Coverage, TileCoverage};
pub use error::FleetError;
pub use free_space::{Camera, CameraPose};
pub use georeference::{Prior, prior};
pub use manifest::{Given, Identity, Job, JobState, MANIFEST_FILE, Manifest};
pub use merge::{Merged, digest, merge};
pub use mesh::write_mesh;
pub use recordings::{RECORDINGS_EXAMPLE, Recording, Recordings};
pub use register::{Fit, Uncertainty};
pub use report::{RecordingPath, Report};
pub use resample::{Resampled, resample};
pub use submap::{Submap, keep};
pub use tile_file::Lattice;

/// Distance between two points.
fn distance_m(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Length of a path through points.
fn path_m(points_m: &[[f64; 3]]) -> f64 {
    points_m.windows(2).map(|ends| distance_m(&ends[0], &ends[1])).sum()
}
