//! Runs the core on a data set: owns the slab, feeds the frames, takes the times, checks limits,
//! writes checkpoints.

mod bench;
mod checkpoint;
mod closed_map;
mod disk_store;
mod ending;
mod error;
mod execute;
mod folder;
mod frames;
mod machine;
mod map_objects;
mod mask_effect;
mod places;
mod progress;
mod reader;
mod record;
mod resident;
mod retired;
mod saved;
mod session;
pub mod settings;
mod spans;
mod state;
pub mod store;
mod threads;
mod unit_times;
mod version;
mod view;

pub use bench::{Bench, StageBench, Tail, bench};
pub use checkpoint::{Checkpoint, ResumeError, RunManifest, fingerprint};
pub use disk_store::{BLOCKS_FILE, DiskStore, MeshOutput};
pub use ending::{Incomplete, IncompleteCause, SkippedFrame, SkippedFrames};
pub use error::{RunError, step_reason};
pub use execute::{check_outputs, run};
pub use folder::{
    FolderError, PREVIOUS_SNAPSHOT_FILE, RunFolder, SNAPSHOT_FILE, has_snapshot, replace_whole,
    write_whole,
};
pub use frames::{each_frame, with_mapper};
pub use machine::Machine;
pub use places::{
    Continued, Localized, PLACES_FILE, PlacedFrame, Remembered, keyframes_in, localize,
    localize_among, remember,
};
pub use progress::Progress;
pub use reader::{AHEAD, ReadFrame, inertial_samples, read_ahead, stereo_frame};
pub use record::{RunRecord, StageStatistics};
pub use resident::resident_bytes;
pub use spans::{Cost, Spans};
pub use threads::Threads;
pub use unit_times::UnitTime;
pub use version::program;
