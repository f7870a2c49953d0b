//! The one configuration, and what can be wrong with it.

use super::MapperConfig;
use crate::{
    egomotion::{EgomotionConfig, icp::IcpConfig},
    geometry::{RigProblem, StereoRig},
    inertial::InertialUnit,
    objects::ObjectsConfig,
    planning::PlanningConfig,
    rectify::Rectification,
    rectify::self_calibration::RigConfig,
    scene_flow::SceneFlowConfig,
    segmentation::SegmentationConfig,
    settings::{Problems, require},
    stereo::StereoConfig,
    tracking::TrackingConfig,
    view::{MeshConfig, RaycastConfig},
    volume::VolumeConfig,
};

/// All settings of a mapper, apart from its capacity. Every default stands with its field, in the
/// struct of the stage it belongs to.
///
/// ```
/// use dynvox_core::{Config, geometry::StereoRig};
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut config = Config::for_rig(rig);
/// config.volume.voxel_size_m = 0.1;
/// assert!(config.validate().is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// The cameras.
    pub rig: StereoRig,
    /// Rectification of raw pairs to `rig`; `None` if they come rectified.
    pub rectification: Option<Rectification>,
    /// Inertial unit whose samples come with the frames; `None` without one.
    pub inertial: Option<InertialUnit>,
    /// Settings of the rig in addition to its calibration.
    pub rig_settings: RigConfig,
    /// Stereo matching.
    pub stereo: StereoConfig,
    /// Features and their matches over time.
    pub scene_flow: SceneFlowConfig,
    /// The camera's motion.
    pub egomotion: EgomotionConfig,
    /// The camera's motion from depth, where that is asked for.
    pub icp: IcpConfig,
    /// Settings of the loop over frames.
    pub mapper: MapperConfig,
    /// Instances and tracks.
    pub tracking: TrackingConfig,
    /// Moving objects that no detector found.
    pub segmentation: SegmentationConfig,
    /// The objects' maps.
    pub objects: ObjectsConfig,
    /// The map.
    pub volume: VolumeConfig,
    /// Views of the map.
    pub raycast: RaycastConfig,
    /// Settings of meshes.
    pub mesh: MeshConfig,
    /// Maps for planners, where the capacity has a window for them.
    pub planning: PlanningConfig,
}

impl Config {
    /// All defaults, for a rig.
    pub fn for_rig(rig: StereoRig) -> Self {
        Self {
            rig,
            rectification: None,
            inertial: None,
            rig_settings: RigConfig::default(),
            stereo: StereoConfig::default(),
            scene_flow: SceneFlowConfig::default(),
            egomotion: EgomotionConfig::default(),
            icp: IcpConfig::default(),
            mapper: MapperConfig::default(),
            tracking: TrackingConfig::default(),
            segmentation: SegmentationConfig::default(),
            objects: ObjectsConfig::default(),
            volume: VolumeConfig::default(),
            raycast: RaycastConfig::default(),
            mesh: MeshConfig::default(),
            planning: PlanningConfig::default(),
        }
    }

    /// The cameras with the baseline that is to be used.
    pub(crate) fn scaled_rig(&self) -> StereoRig {
        StereoRig { baseline_m: self.rig.baseline_m * self.rig_settings.baseline_scale, ..self.rig }
    }

    /// Everything wrong with it; empty when nothing is.
    ///
    /// ```
    /// use dynvox_core::{Config, geometry::StereoRig};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut config = Config::for_rig(rig);
    /// (config.mapper.fuse_every, config.mesh.min_weight) = (0, 0);
    /// let keys: Vec<_> = config.validate().iter().map(|problem| problem.key).collect();
    /// assert_eq!(keys, ["mapper.fuse_every", "mesh.min_weight"]);
    /// ```
    pub fn validate(&self) -> Problems {
        let mut problems = Problems::new();
        // The rig is checked once; each of its problems has a key of its own.
        let rig = self.rig.validate();
        require(
            &mut problems,
            rig != Err(RigProblem::Focal),
            "rig.focal_px",
            "must be a positive number",
        );
        require(
            &mut problems,
            rig != Err(RigProblem::Center),
            "rig.center_px",
            "must be finite numbers",
        );
        require(
            &mut problems,
            rig != Err(RigProblem::Baseline),
            "rig.baseline_m",
            "must be a positive number",
        );
        if let Some(unit) = &self.inertial {
            unit.validate(&mut problems);
        }
        self.rig_settings.validate(&mut problems);
        self.stereo.validate(&mut problems);
        self.scene_flow.validate(&mut problems);
        self.egomotion.validate(&mut problems);
        self.icp.validate(&mut problems);
        self.mapper.validate(&mut problems);
        self.tracking.validate(&mut problems);
        self.segmentation.validate(&mut problems);
        self.objects.validate(&mut problems);
        self.volume.validate(&mut problems);
        self.raycast.validate(&mut problems);
        self.mesh.validate(&mut problems);
        self.planning.validate(&mut problems);
        problems
    }
}
