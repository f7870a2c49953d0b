//! Runs the core on a data set: owns the slab, feeds the frames, takes the times, watches memory, collects what the report shows.

mod copy;
mod course;
mod error;
mod gathered;
mod kept;
mod lidar;
mod objects;
pub(crate) mod pictures;
mod plan;
mod progress;
mod reader;
mod record;
mod resident;
mod run;
mod shelf;
mod slab;
mod snapshot;
mod threads;
mod tracks;

pub use error::RunError;
pub use kept::KeptObject;
pub use lidar::{ErrorPictures, LidarRecord, Reference, evaluable};
pub use objects::ObjectsRecord;
pub use plan::{HOST_OVERHEAD_BYTES, Plan, frame_indices, frame_interval_s};
pub use progress::Progress;
pub use reader::{AHEAD, read_ahead};
pub use record::{FrameRow, Keyframe, RunRecord, StageStatistics};
pub use resident::resident_bytes;
pub use run::run;
pub use shelf::{MeshOutput, Shelf, ShelfUse, Streaming};
pub use slab::HostSlab;
pub use snapshot::{Begun, ResumeError, Snapshots, Stopped};
pub use threads::{StageTime, Threads};
pub use tracks::{TrackRecord, TrackRow};
