//! The stages of a step in one table: the only place that names them.
//!
//! A stage has one name. It is the name of its field in [`crate::Report`] and in
//! [`crate::StageDigests`], of its folder in the core and of its regions in the slab, of
//! `stages.NAME` in `summary.json`, and of the columns `NAME_ms`, `NAME_cpu_ms` and `NAME_digest`
//! of `frames.csv`. Three stages change the static map: they share a folder, `volume`,
//! and a digest, `static_map`. [`StageNames`] tells such folders and digests.

/// A stage of the pipeline, as a name for measurements.
///
/// ```
/// let names: Vec<_> = dynvox_core::Stage::ALL.map(|stage| stage.name()).into();
/// assert!(names.contains(&"stereo") && names.contains(&"fuse"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Raw pair to rectified pair.
    Rectify,
    /// Disparity from the stereo pair.
    Stereo,
    /// Features and matches over four images.
    SceneFlow,
    /// Camera motion from the matches.
    Egomotion,
    /// Detections, their tracks, and the motion of each track.
    Tracking,
    /// Moving objects found by their motion.
    Segmentation,
    /// Volumes of objects: crops fused, objects begun and retired.
    Objects,
    /// Blocks made and marked visible.
    Allocate,
    /// Depth and colour averaged into voxels.
    Fuse,
    /// Noise taken out of blocks that leave the window.
    Prune,
    /// The map seen from a pose.
    Raycast,
}

/// Names of a stage: one row of the table of stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageNames {
    /// Name of the stage.
    pub name: &'static str,
    /// Folder of `core/src` that implements the stage.
    pub folder: &'static str,
    /// Field of [`crate::StageDigests`] that hashes what the stage changes; `None` where no field
    /// does: rectified images have a digest in their own report, a raycast changes nothing.
    pub digest: Option<&'static str>,
}

impl Stage {
    /// All stages, in pipeline order.
    pub const ALL: [Self; 11] = [
        Self::Rectify,
        Self::Stereo,
        Self::SceneFlow,
        Self::Egomotion,
        Self::Tracking,
        Self::Segmentation,
        Self::Objects,
        Self::Allocate,
        Self::Fuse,
        Self::Prune,
        Self::Raycast,
    ];

    /// The row of this stage in the table of stages.
    ///
    /// ```
    /// use dynvox_core::Stage;
    ///
    /// let names = Stage::Fuse.names();
    /// assert_eq!((names.name, names.folder), ("fuse", "volume"));
    /// assert_eq!(names.digest, Some("static_map"));
    /// ```
    pub const fn names(self) -> StageNames {
        let (name, folder, digest) = match self {
            Self::Rectify => ("rectify", "rectify", None),
            Self::Stereo => ("stereo", "stereo", Some("stereo")),
            Self::SceneFlow => ("scene_flow", "scene_flow", Some("scene_flow")),
            Self::Egomotion => ("egomotion", "egomotion", Some("egomotion")),
            Self::Tracking => ("tracking", "tracking", Some("tracking")),
            Self::Segmentation => ("segmentation", "segmentation", Some("tracking")),
            Self::Objects => ("objects", "objects", Some("objects")),
            Self::Allocate => ("allocate", "volume", Some("static_map")),
            Self::Fuse => ("fuse", "volume", Some("static_map")),
            Self::Prune => ("prune", "volume", Some("static_map")),
            Self::Raycast => ("raycast", "view", None),
        };
        StageNames { name, folder, digest }
    }

    /// Name in reports, tables and files.
    pub const fn name(self) -> &'static str {
        self.names().name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_stage_stands_once_and_at_its_own_index() {
        for (at, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, at, "{stage:?}");
            let alike = Stage::ALL.iter().filter(|other| other.name() == stage.name()).count();
            assert_eq!(alike, 1, "{stage:?}");
        }
    }
}
