//! Many maps as one: sums of voxels in tiles of the world, which can be added in any order.
//!
//! A voxel's running average cannot be added to another's without its rounding. Its sums can: weight times distance, and weight, as integers.
//! Integer addition is associative and commutative, so maps of many recordings, merged by any number of workers in any order, give the same
//! bits. Data flows: a run's blocks -> [`submap`] (sums in the world's lattice) -> [`merge`] -> [`write_mesh`]; [`Manifest`] says which runs
//! there are to do, and no more than one folder each is what they leave.
//!
//! **Memory.** A merge holds one block of each input; a submap a cache of blocks and a list of block coordinates; a mesh a cube of blocks.

mod block_sums;
mod error;
mod manifest;
mod merge;
mod mesh;
mod resample;
mod tile_file;
mod tile_folder;

pub use block_sums::{BlockSums, WEIGHT_MAX};
pub use error::FleetError;
pub use manifest::{Identity, Job, JobState, MANIFEST_FILE, Manifest, RECORDINGS_EXAMPLE, Recording, Recordings};
pub use merge::{Merged, digest, merge};
pub use mesh::{MeshedMap, write_mesh};
pub use resample::{Submap, submap};
pub use tile_file::Lattice;
