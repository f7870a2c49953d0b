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
    ("icp.held_min", "0.0005"),
    ("icp.step_max_rad", "0.35"),
    ("icp.explained_min", "0.5"),
    ("icp.explained_px", "5"),
    ("objects.max_weight", "200"),
    ("volume.colour_band", "0.25"),
    ("planning.margin_px", "0.5"),
    ("street.camera_height_m", "1.65"),
    ("street.lidar_noise_m", "0"),
    ("street.traffic.oncoming_speed_m_s", "8"),
    ("street.traffic.overtaking_speed_m_s", "13"),
];

/// The value of a key that is a constant now; `None` for other keys.
pub fn constant(key: &str) -> Option<&'static str> {
    CONSTANTS.iter().find(|(name, _)| *name == key).map(|(_, value)| *value)
}
