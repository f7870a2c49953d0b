//! Settings of the loop.

use crate::problem::{Problems, require};

/// Where the camera's motion comes from, unless a frame brings its pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum MotionSource {
    /// From matches over two stereo pairs.
    #[default]
    Stereo,
    /// From depth against the map: the baseline of [`crate::egomotion::icp`].
    Icp,
}

/// Settings of the loop over frames.
///
/// ```
/// use dynvox_core::{Config, MotionSource, geometry::StereoRig};
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut config = Config::for_rig(rig);
/// (config.mapper.egomotion, config.mapper.fuse_every) = (MotionSource::Icp, 2);
/// assert!(config.validate().is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct MapperConfig {
    /// Where the camera's motion comes from; `stereo`.
    pub egomotion: MotionSource,
    /// Frames from one that is fused to the next: the camera and all tracks are followed in every
    /// frame, maps grow in each `fuse_every`-th alone, and pruning's lag counts those. 1 and more;
    /// 1.
    pub fuse_every: u32,
}

impl Default for MapperConfig {
    fn default() -> Self {
        Self { egomotion: MotionSource::Stereo, fuse_every: 1 }
    }
}

impl MapperConfig {
    /// Notes what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        require(problems, self.fuse_every >= 1, "mapper.fuse_every", "must be 1 or more");
    }
}
