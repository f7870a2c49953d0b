//! Lengths of the settings that follow from the cameras: a rig with a small baseline sees what is
//! near finely, and what is far not at all.
//!
//! `docs/scale.md` has the equations. Time: a handful of divisions and one square root, once.

use super::Config;
use crate::geometry::StereoRig;
use libm::{floor, round, sqrt};

/// Voxel sizes that a map may have, m, in steps of about two.
const VOXELS_M: [f32; 10] = [0.001, 0.002, 0.004, 0.01, 0.02, 0.04, 0.1, 0.2, 0.4, 1.0];
/// Voxel size of the defaults, m: a street seen from a car.
const STREET_VOXEL_M: f32 = 0.05;
/// Focal length times baseline per pixel of image width at which the defaults were chosen, m:
/// KITTI's cameras have 0.312.
const STREET_REACH_M: f32 = 0.3125;
/// Rigs whose reach is within these shares of KITTI's keep the defaults.
const STREET_SHARES: (f32, f32) = (0.5, 2.5);
/// Noise of a disparity that decides how far a map reaches, px, one sigma.
const DISPARITY_SIGMA_PX: f64 = 0.25;
/// Depth of a map is a multiple of so many voxels, so that it is a short number.
const DEPTH_STEP_VOXELS: f64 = 10.0;
/// Truncation, voxels.
const TRUNCATION_VOXELS: f64 = 15.0;
/// Farthest depth that follows from a rig, m: the planner's window takes no more.
const FAR_MAX_M: f64 = 500.0;
/// Smallest extent of an object, m: a person's arms.
const EXTENT_MIN_M: f32 = 1.0;
/// Number of settings that follow from a rig.
pub const SCALED_SETTINGS: usize = 15;

/// Lengths of the settings that follow from a rig: voxel size, and the depth that a map reaches.
///
/// ```
/// use dynvox_core::{Config, Scale, geometry::StereoRig};
///
/// // A small camera for desks: 6.3 cm between the lenses, 960 px wide.
/// let rig =
///     StereoRig { focal_px: 754.7, center_u_px: 489.4, center_v_px: 265.2, baseline_m: 0.063 };
/// let scale = Scale::for_rig(&rig, 960);
/// assert_eq!((scale.voxel_size_m(), scale.far_m()), (0.004, 3.36));
/// let mut config = Config::for_rig(rig);
/// scale.apply(&mut config);
/// assert_eq!((config.volume.voxel_size_m, config.volume.truncation_m), (0.004, 0.06));
/// assert!(config.validate().is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    voxel_size_m: f32,
    /// Depth that a map reaches, m; `None` is that of the defaults.
    far_m: Option<f32>,
}

impl Scale {
    /// The defaults: a street seen from a car, in voxels of 5 cm to a depth of 20 m.
    pub const STREET: Self = Self { voxel_size_m: STREET_VOXEL_M, far_m: None };

    /// The scale of a rig whose rectified images are `width_px` wide: the voxel size in proportion
    /// to focal length and baseline, and the depth at which the noise of depth is as large as the
    /// truncation. [`Scale::STREET`] for rigs like a car's.
    pub fn for_rig(rig: &StereoRig, width_px: usize) -> Self {
        let reach_m = rig.focal_px as f32 * rig.baseline_m as f32 / width_px.max(1) as f32;
        let share = reach_m / STREET_REACH_M;
        let (least, most) = STREET_SHARES;
        if share >= least && share < most {
            return Self::STREET;
        }
        Self::with_voxels(snapped(share * STREET_VOXEL_M), rig)
    }

    /// A scale by its voxel size, m, with the depth that a rig has at it.
    pub fn with_voxels(voxel_size_m: f32, rig: &StereoRig) -> Self {
        let voxel_m = decimal(voxel_size_m);
        let reach_m_px = rig.focal_px * rig.baseline_m;
        // Noise grows with the square of the depth: z² sigma / (f b).
        let depth_m = sqrt(TRUNCATION_VOXELS * voxel_m * reach_m_px / DISPARITY_SIGMA_PX);
        let steps = floor(depth_m / (DEPTH_STEP_VOXELS * voxel_m));
        let far_m = if steps >= 1.0 { steps } else { 1.0 } * DEPTH_STEP_VOXELS * voxel_m;
        let far_m = if far_m < FAR_MAX_M { far_m } else { FAR_MAX_M };
        Self { voxel_size_m, far_m: Some(far_m as f32) }
    }

    /// Distance between lattice points of the map, m.
    pub fn voxel_size_m(&self) -> f32 {
        self.voxel_size_m
    }

    /// Depth up to which the map is fused, m.
    pub fn far_m(&self) -> f32 {
        self.far_m.unwrap_or(crate::volume::VolumeConfig::default().far_m)
    }

    /// The settings that follow, by their keys. At [`Scale::STREET`] they are the defaults to the
    /// bit.
    pub fn settings(&self) -> [(&'static str, f32); SCALED_SETTINGS] {
        // Numbers of voxels, and shares of the depth: in double precision, so that a decimal
        // voxel size gives decimal lengths.
        let voxel_m = decimal(self.voxel_size_m);
        let voxels = |count: f64| (count * voxel_m) as f32;
        let far_m = self.far_m();
        let extent_m = voxels(60.0);
        [
            ("volume.voxel_size_m", self.voxel_size_m),
            ("volume.truncation_m", voxels(TRUNCATION_VOXELS)),
            ("volume.near_m", voxels(10.0)),
            ("volume.far_m", far_m),
            ("volume.behind_m", voxels(6.0)),
            ("volume.allocation_m", voxels(4.0)),
            ("objects.voxel_size_m", self.voxel_size_m),
            ("objects.truncation_m", voxels(6.0)),
            ("objects.far_m", far_m),
            ("objects.extent_m", if extent_m > EXTENT_MIN_M { extent_m } else { EXTENT_MIN_M }),
            ("segmentation.far_m", 2.25 * far_m),
            ("raycast.near_m", voxels(6.0)),
            ("raycast.far_m", 1.5 * far_m),
            ("planning.near_m", voxels(10.0)),
            ("planning.far_m", far_m),
        ]
    }

    /// Gives a configuration the settings that follow.
    pub fn apply(&self, config: &mut Config) {
        for (key, value) in self.settings() {
            if let Some(crate::settings::Value::F32(field)) = config.value(key) {
                *field = value;
            }
        }
    }
}

/// The decimal number that a length of single precision stands for, to a millionth of a metre.
fn decimal(length_m: f32) -> f64 {
    round(f64::from(length_m) * 1e6) / 1e6
}

/// The largest voxel size of the steps that is not above a length, m.
fn snapped(length_m: f32) -> f32 {
    VOXELS_M.iter().rev().copied().find(|step| *step <= length_m).unwrap_or(VOXELS_M[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig(focal_px: f64, baseline_m: f64) -> StereoRig {
        StereoRig { focal_px, center_u_px: 300.0, center_v_px: 200.0, baseline_m }
    }

    #[test]
    fn cars_keep_the_defaults_to_the_bit() {
        // KITTI, its fixture at a quarter of the size, and Cityscapes.
        for (focal_px, baseline_m, width) in
            [(718.856, 0.5372, 1226), (185.0, 0.54, 320), (2262.5, 0.209, 2048)]
        {
            let rig = rig(focal_px, baseline_m);
            let mut config = Config::for_rig(rig);
            Scale::for_rig(&rig, width).apply(&mut config);
            assert_eq!(config, Config::for_rig(rig), "{focal_px} px, {baseline_m} m");
        }
    }

    #[test]
    fn smaller_baselines_give_finer_maps_that_reach_less_far() {
        // From a small depth camera to a wide automotive rig.
        let scales = [0.025, 0.05, 0.11, 0.25].map(|baseline_m| {
            let rig = rig(450.0, baseline_m);
            Scale::for_rig(&rig, 752)
        });
        for pair in scales.windows(2) {
            assert!(
                pair[0].voxel_size_m() <= pair[1].voxel_size_m()
                    && pair[0].far_m() < pair[1].far_m(),
                "{scales:?}"
            );
        }
        assert_eq!(scales[2].voxel_size_m(), 0.01);
    }

    #[test]
    fn every_rig_gives_settings_that_are_valid() {
        let mut tried = 0;
        // Beyond any real rig on both sides, since users mistype units.
        for focal_px in [20.0, 200.0, 754.0, 4000.0] {
            for baseline_m in [0.0005, 0.01, 0.063, 0.24, 0.54, 3.0, 200.0] {
                for width in [32, 320, 1242, 8192] {
                    let rig = rig(focal_px, baseline_m);
                    let mut config = Config::for_rig(rig);
                    Scale::for_rig(&rig, width).apply(&mut config);
                    assert!(config.validate().is_empty(), "{focal_px} px, {baseline_m} m");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 4 * 7 * 4);
    }

    #[test]
    fn noise_at_the_farthest_depth_is_within_the_truncation() {
        let rig = rig(425.0, 0.05);
        let scale = Scale::for_rig(&rig, 848);
        let mut config = Config::for_rig(rig);
        scale.apply(&mut config);
        let far_m = f64::from(scale.far_m());
        let noise_m = far_m * far_m * DISPARITY_SIGMA_PX / (425.0 * 0.05);
        let truncation_m = f64::from(config.volume.truncation_m);
        // At most the truncation, and not far below it: the map reaches as far as it can.
        assert!(noise_m <= truncation_m && noise_m > 0.5 * truncation_m);
    }
}
