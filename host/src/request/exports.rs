//! Results for other programs.

use super::SceneExport;
use crate::formats::Axes;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt::{Display, Formatter};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

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
    /// New folder that every frame's disparity is saved to.
    pub disparity: Option<PathBuf>,
    /// New folder that the disparity which the finished map shows at every frame's pose is saved
    /// to.
    pub map_disparity: Option<PathBuf>,
    /// Address that obstacle messages are sent to after every frame.
    pub mavlink: Option<UdpAddress>,
    /// Send the obstacles as points, too.
    pub mavlink_points: bool,
    /// Scene for programs of photogrammetry.
    pub scene: Option<SceneExport>,
}

/// Address of a receiver of datagrams: `udp:127.0.0.1:14550`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UdpAddress(pub SocketAddr);

impl FromStr for UdpAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let address = text.strip_prefix("udp:").and_then(|address| address.parse().ok());
        address.map(Self).ok_or_else(|| {
            format!(
                "`{text}` is no address: write udp:127.0.0.1:14550, with the number of the host"
            )
        })
    }
}

impl Display for UdpAddress {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "udp:{}", self.0)
    }
}

impl Serialize for UdpAddress {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for UdpAddress {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }
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
