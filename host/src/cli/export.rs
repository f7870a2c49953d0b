//! Options of what a run leaves behind for other programs.

use crate::formats::Axes;
use crate::run::{ExportOptions, MapObjects};

#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ExportArgs {
    /// Objects in map.ply next to the static map: none, last (each where it was last seen), all (at
    /// every pose it was seen in)
    #[arg(long, value_enum, value_name = "WHICH", default_value_t, help_heading = "Results")]
    map_objects: MapObjects,
    /// Axes of map.ply: camera (x right, y down, z forward) or enu (x right, y forward, z up)
    #[arg(long, value_enum, value_name = "AXES", default_value_t, help_heading = "Results")]
    axes: Axes,
    /// Record the run as run.mcap for Foxglove and rerun: images, disparity, poses, objects, points
    /// of the map, figures
    #[arg(long, conflicts_with = "snapshot_every", help_heading = "Results")]
    mcap: bool,
}

impl ExportArgs {
    /// The same for the plan of a run.
    pub fn options(&self) -> ExportOptions {
        ExportOptions { objects: self.map_objects, axes: self.axes, record: self.mcap }
    }
}
