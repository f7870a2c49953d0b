//! Sources of images.

use super::Worlds;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A source of images.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The synthetic street, as the settings below `street` say.
    #[default]
    Street,
    /// A synthetic room, as the settings below `room` say.
    Room,
    /// A synthetic yard, as the settings below `room` say.
    Yard,
    /// A synthetic town, as the settings below `town` and `street` say.
    Town,
    /// PGM or PPM images on standard input, left and right in turn.
    Stream,
    /// A recording: a folder, or a file of ROS.
    Recording(PathBuf),
}

impl Source {
    /// Returns true for what is rendered: it knows what it shows.
    pub fn is_synthetic(&self) -> bool {
        matches!(self, Self::Street | Self::Room | Self::Yard | Self::Town)
    }

    /// Worlds whose settings belong to a run on this source.
    pub(super) fn worlds(&self) -> Worlds {
        match self {
            Self::Street => Worlds::STREET,
            Self::Room | Self::Yard => Worlds::ROOM,
            Self::Town => Worlds::TOWN,
            Self::Stream | Self::Recording(_) => Worlds::NONE,
        }
    }
}
