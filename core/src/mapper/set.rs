//! Settings by their dotted keys, as text: for callers without a configuration language.

use super::{Config, MapperConfig, MotionSource};
use crate::{
    egomotion::{EgomotionConfig, icp::IcpConfig},
    geometry::{DisparityCorrection, RowCorrection},
    objects::ObjectsConfig,
    planning::PlanningConfig,
    rectify::self_calibration::{RigConfig, SelfCalibrationMode},
    scene_flow::SceneFlowConfig,
    stereo::{GapEnds, StereoConfig},
    tracking::{MotionConfig, Overlap, SegmentationConfig, StateConfig, TrackingConfig},
    view::{MeshConfig, RaycastConfig},
    volume::{DistanceAlong, ObservationWeight, VolumeConfig, WhenFull},
};
use core::fmt;

/// Why a setting cannot be set. Nothing has changed.
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
    /// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
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

    /// The value of a key.
    fn value(&mut self, key: &str) -> Option<&mut dyn Value> {
        let (section, name) = key.split_once('.')?;
        match section {
            "rig" => rig(&mut self.rig_settings, name),
            "stereo" => stereo(&mut self.stereo, name),
            "scene_flow" => scene_flow(&mut self.scene_flow, name),
            "egomotion" => egomotion(&mut self.egomotion, name),
            "icp" => icp(&mut self.icp, name),
            "mapper" => mapper(&mut self.mapper, name),
            "tracking" => tracking(&mut self.tracking, name),
            "objects" => objects(&mut self.objects, name),
            "volume" => volume(&mut self.volume, name),
            "raycast" => raycast(&mut self.raycast, name),
            "mesh" => mesh(&mut self.mesh, name),
            "planning" => planning(&mut self.planning, name),
            _ => None,
        }
    }
}

/// What text can set.
trait Value {
    /// Sets it; `None` where the text is not a value.
    fn set(&mut self, text: &str) -> Option<()>;
}

macro_rules! numbers {
    ($($number:ty),*) => {
        $(impl Value for $number {
            fn set(&mut self, text: &str) -> Option<()> {
                *self = text.parse().ok()?;
                Some(())
            }
        })*
    };
}
numbers!(u8, u16, u32, usize, f32, f64, bool);

impl<const N: usize> Value for [u8; N] {
    fn set(&mut self, text: &str) -> Option<()> {
        let mut values = [0; N];
        let mut texts = text.split(',');
        for value in &mut values {
            *value = texts.next()?.trim().parse().ok()?;
        }
        *self = values;
        texts.next().is_none().then_some(())
    }
}

macro_rules! choices {
    ($($choice:ident { $($name:literal = $variant:ident),* })*) => {
        $(impl Value for $choice {
            fn set(&mut self, text: &str) -> Option<()> {
                *self = match text {
                    $($name => Self::$variant,)*
                    _ => return None,
                };
                Some(())
            }
        })*
    };
}
choices! {
    MotionSource { "stereo" = Stereo, "icp" = Icp }
    Overlap { "mask" = Mask, "box" = Box }
    GapEnds { "surface" = Surface, "farther" = Farther }
    DistanceAlong { "ray" = Ray, "normal" = Normal }
    ObservationWeight { "one" = One, "nearest" = Nearest, "depth" = Depth, "band" = Band }
    WhenFull { "evict" = Evict, "refuse" = Refuse }
    SelfCalibrationMode { "apply" = Apply, "report" = Report, "off" = Off }
}

/// A function from a section and a name in it to the field. A field that is not listed does not
/// compile; a section within the section is listed with the function for it.
macro_rules! section {
    ($function:ident: $section:ident { $($field:ident),* $(,)? } $(and { $($inner:ident),* })?) => {
        fn $function<'c>(section: &'c mut $section, name: &str) -> Option<&'c mut dyn Value> {
            let $section { $($field,)* $($($inner,)*)? } = section;
            match name {
                $(stringify!($field) => Some($field),)*
                _ => {
                    $(let (within, rest) = name.split_once('.')?;
                    $(if within == stringify!($inner) {
                        return self::$inner($inner, rest);
                    })*)?
                    None
                }
            }
        }
    };
}

section!(rig: RigConfig { self_calibration, baseline_scale } and { disparity_correction, row_correction });
section!(disparity_correction: DisparityCorrection { offset_px, slope_px, quartic_px, row_quadratic_px });
section!(row_correction: RowCorrection { constant_px, column_px, row_px, column_quadratic_px, product_px, row_quadratic_px });
section!(stereo: StereoConfig {
    disparity_max, support_ratio, support_texture, candidate_step, plausible_window, plausible_threshold, plausible_min, redundant_distance,
    redundant_threshold, grid_size, beta, gamma, sigma, plane_radius_sigmas, plane_slope_max, match_texture, subpixel, consistency_threshold,
    speckle_similarity, speckle_size, lone_share, lone_gap, gap_width, gap_discontinuity, gap_ends,
    adaptive_mean, median,
});
section!(scene_flow: SceneFlowConfig {
    response_min, features_max, search_radius_px, stereo_tolerance_px, disparity_tolerance_px, flow_tolerance_px, support_min, refine,
    bucket_px, bucket_matches,
});
section!(egomotion: EgomotionConfig {
    samples, confidence, inlier_px, refined_inlier_px, matches_min, inlier_share_min, acceleration_max_m_s2, inlier_share_strong,
    right_ahead_max_m, sample_steps, refine_steps, side_knee, robust_px,
});
section!(icp: IcpConfig {
    levels, steps, distance_m, noise_px, pairs_min, held_min, step_max_m, step_max_rad, explained_min, explained_px,
});
section!(mapper: MapperConfig { egomotion, fuse_every });
section!(tracking: TrackingConfig {
    dynamic, frame_interval_s, score_min, area_min_px, track_area_min_px, delete_permille, small_permille, overlap, association_min,
    extent_frames, forget_frames, large_share,
} and { motion, state, segmentation });
section!(motion: MotionConfig {
    matches_min, matches_again, matches_enough, samples, inlier_px, noise_px, extent_m, independent_matches, yaw_rad_s, tilt_rad_s, speed_m_s,
    acceleration_m_s2, yaw_acceleration_rad_s2, tilt_acceleration_rad_s2, bias_px, lens_px, camera_rad,
});
section!(state: StateConfig {
    dynamic_m_s, static_m_s, slow_m_s, sigmas, static_sigmas, confirm_frames, confirm_static_frames, change_frames, static_frames,
    dynamic_frames,
});
section!(segmentation: SegmentationConfig {
    enabled, noise_px, disparity_noise_px, camera_m, camera_rad, candidate_chi_square, far_m, members_min, far_members_min, sparse_from_m,
    candidate_share_min, motion_min_m, confirm_frames, predict_frames, erase_frames,
});
section!(objects: ObjectsConfig {
    voxel_size_m, truncation_m, far_m, extent_m, observation_weight, max_weight, prune_weight, prune_frames,
});
section!(volume: VolumeConfig {
    voxel_size_m, truncation_m, near_m, far_m, max_weight, observation_weight, class_weight, colour_band, when_full, prune_weight, prune_lag,
    prune_distance, prune_blocks_per_frame, edge_reach_px, distance, behind_m, allocation_m,
});
section!(raycast: RaycastConfig { near_m, far_m, min_weight });
section!(mesh: MeshConfig { min_weight });
section!(planning: PlanningConfig {
    cell_voxels, up_x, up_y, up_z, below_m, near_m, far_m, margin_px, min_weight, camera_height_m, slope_max, ground_step_m, climb_m, low_m,
    high_m, level, unknown_is_obstacle, object_sigmas,
});
