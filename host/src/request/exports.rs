//! Results for other programs.

use crate::formats::Axes;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What a run leaves behind for other programs.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Exports {
    /// Objects in `map.ply`.
    pub objects: MapObjects,
    /// Axes of meshes in world coordinates.
    pub axes: Axes,
    /// Whether the run is recorded as an MCAP file.
    pub record: bool,
    /// New folder that every frame's instance masks are saved to.
    pub instances: Option<PathBuf>,
    /// New folder that the disparity which the finished map shows at every frame's pose is saved
    /// to.
    pub map_disparity: Option<PathBuf>,
}

/// Which poses of objects are in `map.ply`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum MapObjects {
    /// None: the static map alone.
    None,
    /// Each object where it was last seen.
    #[default]
    Last,
    /// Each object at every pose it was seen in: a file many times larger.
    All,
}
