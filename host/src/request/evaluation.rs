//! Evaluation of a run against a reference depth.

use crate::input::FrameSource;
use serde::{Deserialize, Serialize};

/// Evaluation of the map.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Evaluation {
    /// The reference; without one some frames of the synthetic street are compared.
    pub reference: Option<Reference>,
    /// Frames after which the map is evaluated at a frame's pose.
    pub delay: usize,
}

/// A reference depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Reference {
    /// LiDAR scans, of the frames that have one: `velodyne/` next to the images, or the synthetic
    /// street's.
    Lidar,
    /// The synthetic street's exact depth.
    Exact,
}

impl Reference {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lidar => "lidar",
            Self::Exact => "exact",
        }
    }

    /// Positions of the frames that have the reference and are followed by at least `delay` more.
    pub fn positions(
        self,
        dataset: &dyn FrameSource,
        indices: &[usize],
        delay: usize,
    ) -> Vec<usize> {
        let in_time = indices.iter().enumerate().take(indices.len().saturating_sub(delay));
        in_time.filter(|&(_, &index)| self.is_there(dataset, index)).map(|(at, _)| at).collect()
    }

    /// Returns true if a frame has it.
    fn is_there(self, dataset: &dyn FrameSource, index: usize) -> bool {
        match self {
            Self::Lidar => dataset.has_lidar(index),
            Self::Exact => dataset.has_exact_depth(),
        }
    }
}
