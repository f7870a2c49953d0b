//! Results for other programs.

use crate::formats::Axes;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Results of a run for other programs.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Exports {
    /// Objects in `map.ply`.
    pub objects: MapObjects,
    /// Axes of meshes in world coordinates.
    pub axes: Axes,
    /// Record the run as an MCAP file.
    pub record: bool,
    /// New folder that every frame's instance masks are saved to.
    pub instances: Option<PathBuf>,
    /// New folder that the disparity which the finished map shows at every frame's pose is saved
    /// to.
    pub map_disparity: Option<PathBuf>,
}

/// Choice of the poses of objects in `map.ply`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum MapObjects {
    /// The static map only.
    None,
    /// Each object where it was last seen.
    #[default]
    Last,
    /// Each object at every pose it was seen in: a file many times larger.
    All,
}
