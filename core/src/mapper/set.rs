//! Settings by their dotted keys, as text: for callers without a configuration language.

use super::{Config, MapperConfig};
use crate::{
    egomotion::{EgomotionConfig, icp::IcpConfig},
    objects::ObjectsConfig,
    planning::PlanningConfig,
    rectify::self_calibration::RigConfig,
    scene_flow::SceneFlowConfig,
    segmentation::SegmentationConfig,
    settings::{About, Setting, Value, find},
    stereo::StereoConfig,
    tracking::TrackingConfig,
    view::{MeshConfig, RaycastConfig},
    volume::VolumeConfig,
};
use core::fmt;

/// Reason why a setting cannot be set. Nothing has changed.
///
/// ```
/// use dynvox_core::{Config, SetError, geometry::StereoRig};
///
/// let rig =
///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut config = Config::for_rig(rig);
/// assert_eq!(config.set("volume.voxel", "0.1"), Err(SetError::Key));
/// assert_eq!(config.set("volume.voxel_size_m", "small"), Err(SetError::Value));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SetError {
    /// There is no such key.
    Key,
    /// The text is not a value of this setting.
    Value,
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Key => "there is no such setting",
            Self::Value => "the text is not a value of this setting",
        })
    }
}

impl core::error::Error for SetError {}

impl Config {
    /// Sets one setting by its dotted key, as it stands in a run's `config.toml`. Numbers are
    /// decimal; names of choices stand bare (`depth`); `volume.class_weight` takes its numbers with
    /// commas between them. The calibration has no keys. Whether the value is in its range,
    /// [`Config::validate`] says.
    ///
    /// ```
    /// use dynvox_core::{Config, SetError, geometry::StereoRig};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut config = Config::for_rig(rig);
    /// config.set("volume.voxel_size_m", "0.1")?;
    /// config.set("mapper.egomotion", "icp")?;
    /// assert_eq!(config.volume.voxel_size_m, 0.1);
    /// assert_eq!(config.set("volume.voxels", "1"), Err(SetError::Key));
    /// assert_eq!(config.set("volume.far_m", "wide"), Err(SetError::Value));
    /// # Ok::<(), SetError>(())
    /// ```
    ///
    /// # Errors
    /// There is no such key, or the text is not a value of it.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SetError> {
        self.value(key).ok_or(SetError::Key)?.set(value.trim()).ok_or(SetError::Value)
    }

    /// Borrows the field of a key.
    pub(super) fn value(&mut self, key: &str) -> Option<Value<'_>> {
        // A key without a dot has no section, and so no setting.
        let (section, _) = key.split_once('.')?;
        match section {
            "rig" => find(RigConfig::CHECKS, &mut self.rig_settings, key),
            "stereo" => find(StereoConfig::CHECKS, &mut self.stereo, key),
            "scene_flow" => find(SceneFlowConfig::CHECKS, &mut self.scene_flow, key),
            "egomotion" => find(EgomotionConfig::CHECKS, &mut self.egomotion, key),
            "icp" => find(IcpConfig::CHECKS, &mut self.icp, key),
            "mapper" => find(MapperConfig::CHECKS, &mut self.mapper, key),
            "tracking" => find(TrackingConfig::CHECKS, &mut self.tracking, key),
            "segmentation" => find(SegmentationConfig::CHECKS, &mut self.segmentation, key),
            "objects" => find(ObjectsConfig::CHECKS, &mut self.objects, key),
            "volume" => find(VolumeConfig::CHECKS, &mut self.volume, key),
            "raycast" => find(RaycastConfig::CHECKS, &mut self.raycast, key),
            "mesh" => find(MeshConfig::CHECKS, &mut self.mesh, key),
            "planning" => find(PlanningConfig::CHECKS, &mut self.planning, key),
            _ => None,
        }
    }

    /// The rows of all settings, section by section, for pages that list them.
    ///
    /// ```
    /// use dynvox_core::Config;
    ///
    /// let row = Config::settings().find(|row| row.key == "volume.near_m").unwrap();
    /// assert_eq!((row.unit, row.range.to_string().as_str()), ("m", "must be above 0"));
    /// ```
    pub fn settings() -> impl Iterator<Item = About> {
        let rows = RigConfig::SETTINGS.iter().map(Setting::about);
        rows.chain(StereoConfig::SETTINGS.iter().map(Setting::about))
            .chain(SceneFlowConfig::SETTINGS.iter().map(Setting::about))
            .chain(EgomotionConfig::SETTINGS.iter().map(Setting::about))
            .chain(IcpConfig::SETTINGS.iter().map(Setting::about))
            .chain(MapperConfig::SETTINGS.iter().map(Setting::about))
            .chain(TrackingConfig::SETTINGS.iter().map(Setting::about))
            .chain(SegmentationConfig::SETTINGS.iter().map(Setting::about))
            .chain(ObjectsConfig::SETTINGS.iter().map(Setting::about))
            .chain(VolumeConfig::SETTINGS.iter().map(Setting::about))
            .chain(RaycastConfig::SETTINGS.iter().map(Setting::about))
            .chain(MeshConfig::SETTINGS.iter().map(Setting::about))
            .chain(PlanningConfig::SETTINGS.iter().map(Setting::about))
    }
}
