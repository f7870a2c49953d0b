//! Settings that make no sense are named.

use super::*;
use crate::settings::Problems;

type SpoilVolumes = fn(&mut ObjectsConfig);

#[test]
fn each_setting_of_the_volumes_out_of_its_range_is_named() {
    let named = |spoil: SpoilVolumes| {
        let mut config = ObjectsConfig::default();
        spoil(&mut config);
        let mut problems = Problems::new();
        config.validate(&mut problems);
        problems.iter().map(|problem| problem.key).collect::<Vec<_>>()
    };
    assert_eq!(named(|_| {}), [""; 0]);
    let spoilt: [(SpoilVolumes, &str); 7] = [
        (|c| c.voxel_size_m = 0.0, "objects.voxel_size_m"),
        (|c| c.truncation_m = 0.05, "objects.truncation_m"),
        (|c| c.far_m = 0.0, "objects.far_m"),
        (|c| c.extent_m = 0.0, "objects.extent_m"),
        (|c| c.prune_weight = 200, "objects.prune_weight"),
        (|c| c.prune_frames = 0, "objects.prune_frames"),
        (|c| c.far_m = f32::NAN, "objects.far_m"),
    ];
    for (spoil, key) in spoilt {
        assert!(named(spoil).contains(&key), "{key}: {:?}", named(spoil));
    }
}
