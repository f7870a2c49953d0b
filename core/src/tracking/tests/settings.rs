//! Settings that make no sense are named.

use super::*;
use crate::settings::Problems;
use std::vec::Vec;

type Spoil = fn(&mut TrackingConfig);

#[test]
fn each_setting_out_of_its_range_is_named() {
    let named = |spoil: Spoil| {
        let mut config = TrackingConfig::default();
        spoil(&mut config);
        let mut problems = Problems::new();
        config.validate(&mut problems);
        problems
            .iter()
            .map(|problem| problem.key.strip_prefix("tracking.").unwrap())
            .collect::<Vec<_>>()
    };
    assert_eq!(named(|_| {}), [""; 0]);
    let spoilt: [(Spoil, &str); 19] = [
        (|c| c.frame_interval_s = 0.0, "frame_interval_s"),
        (|c| c.instances.score_min = f32::NAN, "instances.score_min"),
        (|c| c.instances.area_min_px = 1 << 21, "instances.area_min_px"),
        (|c| c.instances.track_area_min_px = 1 << 21, "instances.track_area_min_px"),
        (|c| c.tracks.association_min = -0.1, "tracks.association_min"),
        (|c| c.tracks.extent_frames = 1001, "tracks.extent_frames"),
        (|c| c.tracks.forget_frames = 0, "tracks.forget_frames"),
        (|c| c.matches.large_share = 1.1, "matches.large_share"),
        (|c| c.motion.matches_min = 5, "motion.matches_min"),
        (|c| c.motion.matches_again = 5, "motion.matches_again"),
        (|c| c.motion.samples = 0, "motion.samples"),
        (|c| c.motion.speed_m_s = 0.0, "motion.speed_m_s"),
        (|c| c.motion.bias_px = -0.1, "motion.bias_px"),
        (|c| c.motion.lens_px = -0.1, "motion.lens_px"),
        (|c| c.motion.camera_rad = f32::NAN, "motion.camera_rad"),
        (|c| c.state.dynamic_m_s = 0.2, "state.dynamic_m_s"),
        (|c| c.state.static_m_s = 0.0, "state.static_m_s"),
        (|c| c.state.slow_m_s = 0.2, "state.slow_m_s"),
        (|c| c.state.confirm_frames = 0, "state.confirm_frames"),
    ];
    for (spoil, key) in spoilt {
        assert!(named(spoil).contains(&key), "{key}: {:?}", named(spoil));
    }
}
