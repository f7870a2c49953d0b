//! Keys of former settings, which files of earlier versions still have.

/// Keys that are constants now, and the value they stay at.
pub const CONSTANTS: &[(&str, &str)] = &[
    ("stereo.support_texture", "10"),
    ("stereo.candidate_step", "5"),
    ("stereo.plausible_window", "5"),
    ("stereo.plausible_threshold", "5"),
    ("stereo.plausible_min", "5"),
    ("stereo.redundant_threshold", "1"),
    ("stereo.beta", "0.02"),
    ("stereo.sigma", "1"),
    ("stereo.plane_slope_max", "0.7"),
    ("stereo.match_texture", "1"),
    ("stereo.gap_discontinuity", "3"),
    ("scene_flow.disparity_tolerance_px", "5"),
    ("scene_flow.flow_tolerance_px", "5"),
    ("scene_flow.bucket_px", "50"),
    ("icp.min_eigen_share", "0.0005"),
    ("icp.step_max_rad", "0.35"),
    ("icp.explained_min", "0.5"),
    ("icp.explained_px", "5"),
    ("tracking.delete_permille", "1200"),
    ("tracking.small_permille", "1375"),
    ("tracking.motion.matches_enough", "60"),
    ("tracking.motion.inlier_px", "2"),
    ("tracking.motion.noise_px", "0.3"),
    ("tracking.motion.extent_m", "5"),
    ("tracking.motion.independent_matches", "30"),
    ("tracking.motion.yaw_rad_s", "0.2"),
    ("tracking.motion.tilt_rad_s", "0.03"),
    ("tracking.motion.acceleration_m_s2", "3"),
    ("tracking.motion.yaw_acceleration_rad_s2", "0.4"),
    ("tracking.motion.tilt_acceleration_rad_s2", "0.03"),
    ("tracking.state.sigmas", "2.5"),
    ("tracking.state.static_sigmas", "1"),
    ("tracking.state.change_frames", "2"),
    ("tracking.state.static_frames", "5"),
    ("segmentation.noise_px", "0.35"),
    ("segmentation.disparity_noise_px", "0.45"),
    ("segmentation.camera_m", "0.02"),
    ("segmentation.camera_rad", "0.0005"),
    ("segmentation.candidate_chi_square", "16.27"),
    ("segmentation.members_min", "8"),
    ("segmentation.far_members_min", "5"),
    ("segmentation.sparse_from_m", "25"),
    ("segmentation.candidate_share_min", "0.85"),
    ("segmentation.motion_min_m", "0.1"),
    ("segmentation.confirm_frames", "2"),
    ("segmentation.predict_frames", "3"),
    ("tracking.segmentation.noise_px", "0.35"),
    ("tracking.segmentation.disparity_noise_px", "0.45"),
    ("tracking.segmentation.camera_m", "0.02"),
    ("tracking.segmentation.camera_rad", "0.0005"),
    ("tracking.segmentation.candidate_chi_square", "16.27"),
    ("tracking.segmentation.members_min", "8"),
    ("tracking.segmentation.far_members_min", "5"),
    ("tracking.segmentation.sparse_from_m", "25"),
    ("tracking.segmentation.candidate_share_min", "0.85"),
    ("tracking.segmentation.motion_min_m", "0.1"),
    ("tracking.segmentation.confirm_frames", "2"),
    ("tracking.segmentation.predict_frames", "3"),
    ("objects.max_weight", "200"),
    ("volume.colour_band", "0.25"),
    ("volume.prune_distance", "two voxels where volume.prune_rule is support"),
    ("planning.margin_px", "0.5"),
    ("street.camera_height_m", "1.65"),
    ("street.lidar_noise_m", "0"),
    ("street.traffic.oncoming_speed_m_s", "8"),
    ("street.traffic.overtaking_speed_m_s", "13"),
];

/// The value of a key that is a constant now; `None` for other keys.
///
/// ```
/// use dynvox_core::settings::{CONSTANTS, constant};
///
/// let (key, value) = CONSTANTS[0];
/// assert_eq!(constant(key), Some(value));
/// assert_eq!(constant("volume.voxel_size_m"), None, "still a setting");
/// ```
pub fn constant(key: &str) -> Option<&'static str> {
    CONSTANTS.iter().find(|(name, _)| *name == key).map(|(_, value)| *value)
}
