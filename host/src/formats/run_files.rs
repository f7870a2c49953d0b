//! Names of the files of a run folder that are read elsewhere than where they are written.

/// Table of the frames of a run.
pub const FRAMES_FILE: &str = "frames.csv";
/// The camera's path of a run, KITTI's rows.
pub const TRAJECTORY_FILE: &str = "trajectory_kitti.txt";
/// The same with times, as TUM has it.
pub const TIMED_TRAJECTORY_FILE: &str = "trajectory_tum.txt";
