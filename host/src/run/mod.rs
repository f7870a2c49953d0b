//! Runs the core on a data set: owns the slab, feeds the frames, takes the times, checks limits, writes checkpoints.

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
pub mod settings;
mod state;
pub mod store;
mod threads;
mod view;

pub use checkpoint::{Checkpoint, CheckpointPlan, ResumeError, RunManifest};
pub use disk_store::{BLOCKS_FILE, DiskStore, MeshOutput, Streaming};
pub use error::RunError;
pub use execute::run;
pub use folder::{FolderError, RunFolder, write_whole};
pub use plan::{HOST_OVERHEAD_BYTES, Plan, frame_indices, frame_interval_s};
pub use progress::Progress;
pub use reader::{AHEAD, read_ahead};
pub use record::{RunHeader, RunRecord, StageStatistics};
pub use resident::resident_bytes;
pub use threads::Threads;
