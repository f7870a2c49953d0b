//! Names of the stages.

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
    /// What moves or could: detections, tracks, motions, volumes of objects.
    Instances,
    /// Moving objects found by their motion.
    Segmentation,
    /// Blocks made and marked visible.
    Allocate,
    /// Depth and colour averaged into voxels.
    Fuse,
    /// Noise taken out of blocks that leave the window.
    Prune,
    /// The map seen from a pose.
    Raycast,
}

impl Stage {
    /// All stages, in pipeline order.
    pub const ALL: [Self; 10] = [
        Self::Rectify,
        Self::Stereo,
        Self::SceneFlow,
        Self::Egomotion,
        Self::Instances,
        Self::Segmentation,
        Self::Allocate,
        Self::Fuse,
        Self::Prune,
        Self::Raycast,
    ];

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rectify => "rectify",
            Self::Stereo => "stereo",
            Self::SceneFlow => "scene_flow",
            Self::Egomotion => "egomotion",
            Self::Instances => "instances",
            Self::Segmentation => "segmentation",
            Self::Allocate => "allocate",
            Self::Fuse => "fuse",
            Self::Prune => "prune",
            Self::Raycast => "raycast",
        }
    }
}
