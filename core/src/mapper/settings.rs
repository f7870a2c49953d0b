//! Settings of the loop.

use crate::settings::{
    Problems, Range, Rule, Setting,
    Value::{Choice, F32, U32},
    check, choices, rules,
};

/// Source of the camera's motion, unless a frame brings its pose.
///
/// ```
/// use dynvox_core::{Config, MotionSource, geometry::StereoRig};
///
/// let rig =
///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut config = Config::for_rig(rig);
/// assert_eq!(config.set("mapper.egomotion", "icp"), Ok(()));
/// assert_eq!(config.mapper.egomotion, MotionSource::Icp);
/// ```
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

choices! { MotionSource { "stereo" = Stereo, "icp" = Icp } }

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
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct MapperConfig {
    /// Source of the camera's motion.
    pub egomotion: MotionSource,
    /// Frames from one that is fused to the next.
    pub fuse_every: u32,
    /// Share of the bound on work ([`crate::Capacity::work`]) that stereo, scene flow, fusion and
    /// pruning may do in a frame.
    pub work_budget: f32,
}

impl Default for MapperConfig {
    fn default() -> Self {
        Self { egomotion: MotionSource::Stereo, fuse_every: 1, work_budget: 1.0 }
    }
}

type Row = Setting<MapperConfig>;

impl MapperConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("mapper.egomotion", "", |c| Choice(&mut c.egomotion)).text(
            "Source of the camera's motion: matches over two stereo pairs, or depth against the \
             map.",
        ),
        Row::user("mapper.fuse_every", "frames", |c| U32(&mut c.fuse_every))
            .range(Range::AtLeast(1.0))
            .text(
                "Frames from one that is fused to the next. The camera and all tracks are followed \
                 in every frame; maps grow in each `fuse_every`-th only, and pruning's lag counts \
                 those.",
            ),
        Row::user("mapper.work_budget", "", |c| F32(&mut c.work_budget))
            .range(Range::AboveTo(0.0, 1.0))
            .text(
                "Share of the bound on work (`dynvox budget --work`) that stereo, scene flow, \
                 fusion and pruning may do in a frame. Below 1 fewer rows are matched and fewer \
                 features kept, and the nearest blocks are fused first; farther ones are left out \
                 and counted, and planners learn nothing beyond them.",
            ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Part of a bound that the budget allows.
    pub(super) fn budget_of(&self, bound: usize) -> usize {
        // Bounds are below 2^32, so that the product is exact to a unit; all of it stays all.
        (bound as f64 * f64::from(self.work_budget)) as usize
    }

    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
