//! Names of the files of a run folder that are read elsewhere than where they are written.

/// Summary of a run: a folder that has it holds results.
pub const SUMMARY_FILE: &str = "summary.json";
/// The settings it was made with.
pub const SETTINGS_FILE: &str = "config.toml";
/// Mesh of the static map and of all objects.
pub const MAP_FILE: &str = "map.ply";
/// Mesh of the static map after the loops that were closed.
pub const CLOSED_MAP_FILE: &str = "map_closed.ply";
/// Table of the blocks that were made, pruned and evicted.
pub const BLOCKS_TABLE_FILE: &str = "blocks.csv";
/// Table of the tracks of a run.
pub const TRACKS_FILE: &str = "tracks.csv";
/// Table of the frames of a run.
pub const FRAMES_FILE: &str = "frames.csv";
/// The camera's path of a run, KITTI's rows.
pub const TRAJECTORY_FILE: &str = "trajectory_kitti.txt";
/// The true path, KITTI's rows.
pub const TRUE_TRAJECTORY_FILE: &str = "trajectory_truth_kitti.txt";
/// The path with times, as TUM has it.
pub const TIMED_TRAJECTORY_FILE: &str = "trajectory_tum.txt";
/// The path after the loops that were closed, KITTI's rows.
pub const CLOSED_TRAJECTORY_FILE: &str = "trajectory_closed_kitti.txt";
/// The path after the loops that were closed, with times, as TUM has it.
pub const TIMED_CLOSED_TRAJECTORY_FILE: &str = "trajectory_closed_tum.txt";
/// Name of the page that shows a run.
pub const REPORT_FILE: &str = "report.html";
