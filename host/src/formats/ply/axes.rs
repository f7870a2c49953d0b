//! Which way the axes of a mesh point.

use serde::{Deserialize, Serialize};

/// The axes of a mesh file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Axes {
    /// The first camera's: x right, y down, z forward.
    #[default]
    Camera,
    /// z up, as maps and robots have it: x right (east), y forward (north), z up.
    Enu,
}

impl Axes {
    /// Both.
    pub(super) const ALL: [Self; 2] = [Self::Camera, Self::Enu];

    /// Returns the header's description of the axes.
    pub(super) const fn description(self) -> &'static str {
        match self {
            Self::Camera => "x right, y down, z forward",
            Self::Enu => "x right, y forward, z up",
        }
    }

    /// A point or direction in the camera's axes, in these.
    pub(super) fn of_camera(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Camera => [x, y, z],
            Self::Enu => [x, z, -y],
        }
    }

    /// A point or direction in these axes, in the camera's.
    pub(super) fn to_camera(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Camera => [x, y, z],
            Self::Enu => [x, -z, y],
        }
    }
}
