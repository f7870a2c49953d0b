//! What an autopilot and a navigation stack read of the window.

use crate::reach::COLUMNS;
use core::hint::black_box;
use dynvox_core::{Mapper, digest::Digest};
use dynvox_onboard::{
    Band, Vehicle, costs, heights,
    mavlink::{Sender, obstacle_distance, obstacle_distance_3d},
    points, sectors,
};

const BAND: Band =
    Band { body_m: 0.5, near_m: 1.0, far_m: 8.0, up_m: 0.5, down_m: 0.5, stale_frames: 30 };
const SENDER: Sender = Sender { system: 1, component: 196, sequence: 0 };

/// Tells all directions, and adds the messages' bytes to a digest.
// Never inlined, here and below: the script beside counts the bytes of what is named `onboard`, and
// what one part needs of the stack must not lie below another.
#[inline(never)]
pub fn messages(mapper: &Mapper<'_>, digest: &mut Digest) {
    let vehicle = Vehicle::new(mapper.t_world_camera(), black_box(true));
    let around = sectors(mapper.planning(), &vehicle, black_box(&BAND));
    digest.bytes(obstacle_distance(&around, black_box(1_000), SENDER).bytes());
    for point_m in points(&around) {
        digest.bytes(obstacle_distance_3d(point_m, &around, 1, SENDER).bytes());
    }
}

/// Writes costs, then heights, and adds them to a digest.
#[inline(never)]
pub fn columns(mapper: &Mapper<'_>, digest: &mut Digest) {
    let vehicle = Vehicle::new(mapper.t_world_camera(), black_box(true));
    let mut cost = [0; COLUMNS];
    let map = costs(mapper.planning(), &vehicle, black_box(&BAND), &mut cost);
    digest.u64(map.map_or(0, |map| map.width as u64));
    digest.bytes(&cost);
    let mut ground_m = [0.0; COLUMNS];
    heights(mapper.planning(), &vehicle, &mut ground_m);
    let known = ground_m.iter().filter(|height_m| !height_m.is_nan());
    known.for_each(|height_m| digest.f64(f64::from(*height_m)));
}
