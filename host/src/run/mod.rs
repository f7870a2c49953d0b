//! Runs the core on a data set: owns the slab, feeds the frames, takes the times, watches memory, collects what the report shows.

mod checkpoint;
mod disk_store;
mod error;
mod execute;
mod folder;
mod plan;
mod progress;
mod reader;
mod record;
mod resident;
mod session;
mod slab;
mod state;
pub mod store;
mod threads;

pub use checkpoint::{Begun, ResumeError, Snapshots, Stopped};
pub use disk_store::{MeshOutput, Shelf, ShelfUse, Streaming};
pub use error::RunError;
pub use execute::run;
pub use folder::{FolderError, RunFolder, write_whole};
pub use plan::{HOST_OVERHEAD_BYTES, Plan, frame_indices, frame_interval_s};
pub use progress::Progress;
pub use reader::{AHEAD, read_ahead};
pub use record::{FrameRow, Keyframe, RunRecord, StageStatistics};
pub use resident::resident_bytes;
pub use slab::HostSlab;
pub use threads::{StageTime, Threads};
