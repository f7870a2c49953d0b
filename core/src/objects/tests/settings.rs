//! Settings that make no sense are named.

use super::*;
use crate::problem::Problems;

type Spoil = fn(&mut InstancesConfig);

#[test]
fn each_setting_out_of_its_range_is_named() {
    let named = |spoil: Spoil| {
        let mut config = InstancesConfig::default();
        spoil(&mut config);
        let mut problems = Problems::new();
        config.validate(&mut problems);
        problems.iter().map(|problem| problem.key.strip_prefix("instances.").unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(named(|_| {}), [""; 0]);
    let spoilt: [(Spoil, &str); 41] = [
        (|c| c.frame_interval_s = 0.0, "frame_interval_s"),
        (|c| c.score_min = f32::NAN, "score_min"),
        (|c| c.area_min_px = 1 << 21, "area_min_px"),
        (|c| c.track_area_min_px = 1 << 21, "track_area_min_px"),
        (|c| c.delete_permille = 999, "delete_permille"),
        (|c| c.association_min = -0.1, "association_min"),
        (|c| c.forget_frames = 0, "forget_frames"),
        (|c| c.large_share = 1.1, "large_share"),
        (|c| c.motion.matches_min = 5, "motion.matches_min"),
        (|c| c.motion.matches_again = 5, "motion.matches_again"),
        (|c| c.motion.matches_enough = 10_001, "motion.matches_enough"),
        (|c| c.motion.samples = 0, "motion.samples"),
        (|c| c.motion.inlier_px = 0.0, "motion.inlier_px"),
        (|c| c.motion.noise_px = -1.0, "motion.noise_px"),
        (|c| c.motion.extent_m = 0.0, "motion.extent_m"),
        (|c| c.motion.independent_matches = 2, "motion.independent_matches"),
        (|c| c.motion.turn_rad_s = 0.0, "motion.turn_rad_s"),
        (|c| c.motion.tilt_rad_s = f32::INFINITY, "motion.tilt_rad_s"),
        (|c| c.motion.tilt_acceleration_rad_s2 = 0.0, "motion.tilt_acceleration_rad_s2"),
        (|c| c.motion.speed_m_s = 0.0, "motion.speed_m_s"),
        (|c| c.motion.acceleration_m_s2 = 0.0, "motion.acceleration_m_s2"),
        (|c| c.motion.turn_acceleration_rad_s2 = 0.0, "motion.turn_acceleration_rad_s2"),
        (|c| c.motion.bias_px = -0.1, "motion.bias_px"),
        (|c| c.motion.lens_px = -0.1, "motion.lens_px"),
        (|c| c.motion.camera_rad = f32::NAN, "motion.camera_rad"),
        (|c| c.state.dynamic_m_s = 0.2, "state.dynamic_m_s"),
        (|c| c.state.static_m_s = 0.0, "state.static_m_s"),
        (|c| c.state.slow_m_s = 0.2, "state.slow_m_s"),
        (|c| c.state.sigmas = -1.0, "state.sigmas"),
        (|c| c.state.static_sigmas = -1.0, "state.static_sigmas"),
        (|c| c.state.confirm_frames = 0, "state.confirm_frames"),
        (|c| c.state.change_frames = 101, "state.change_frames"),
        (|c| c.volume.voxel_size_m = 0.0, "volume.voxel_size_m"),
        (|c| c.volume.truncation_m = 0.05, "volume.truncation_m"),
        (|c| c.volume.far_m = 0.0, "volume.far_m"),
        (|c| c.volume.extent_m = 0.0, "volume.extent_m"),
        (|c| c.volume.max_weight = 0, "volume.max_weight"),
        (|c| c.volume.prune_weight = 200, "volume.prune_weight"),
        (|c| c.volume.prune_frames = 0, "volume.prune_frames"),
        (|c| c.volume.far_m = f32::NAN, "volume.far_m"),
        (|c| c.delete_permille = 4001, "delete_permille"),
    ];
    for (spoil, key) in spoilt {
        assert!(named(spoil).contains(&key), "{key}: {:?}", named(spoil));
    }
}
