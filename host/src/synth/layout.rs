//! Layout across the street: lateral positions in metres to the right of the camera's lane's
//! middle, and numbers of cars.

use super::config::{Lane, StreetConfig, Traffic};
use super::random::hash;

/// Width of a driving lane, m.
pub const LANE_M: f64 = 3.2;
/// Edge of the carriageway on the left, parking strip included.
pub const KERB_LEFT_M: f64 = -10.2;
/// Edge of the carriageway on the right.
pub const KERB_RIGHT_M: f64 = 3.8;
/// Height of the kerb and of everything beyond it, m.
pub const KERB_HEIGHT_M: f64 = 0.12;
/// Width of a kerb stone, m.
pub const KERB_WIDTH_M: f64 = 0.16;
/// House fronts on the left.
pub const FRONT_LEFT_M: f64 = -13.3;
/// House fronts on the right.
pub const FRONT_RIGHT_M: f64 = 6.9;
/// Middle of a pedestrian crossing within its segment, m.
pub const CROSSING_M: f64 = 12.0;

/// Numbers of oncoming cars start here; scripted cars are numbered from 1.
pub const ONCOMING_IDS: u32 = 1_000_000;
/// Numbers of overtaking cars start here.
pub const OVERTAKING_IDS: u32 = 2_000_000;
/// Numbers of parked cars start here.
pub const PARKED_IDS: u32 = 10_000_000;

/// Middle of a lane.
pub const fn lateral_m(lane: Lane) -> f64 {
    match lane {
        Lane::Ego => 0.0,
        Lane::Overtaking => -LANE_M,
        Lane::Oncoming => -2.0 * LANE_M,
        Lane::ParkedRight => 2.75,
        Lane::ParkedLeft => -9.15,
    }
}

/// Middle of a parking strip.
pub const fn parking_m(right: bool) -> f64 {
    lateral_m(if right { Lane::ParkedRight } else { Lane::ParkedLeft })
}

/// Returns true if cars in a lane drive against the camera.
pub const fn is_oncoming(lane: Lane) -> bool {
    matches!(lane, Lane::Oncoming | Lane::ParkedLeft)
}

/// Returns true if a segment has a pedestrian crossing.
pub fn crossing(seed: u64, segment: i64) -> bool {
    let candidate = |segment: i64| hash(seed ^ 0xC055, segment, 0).is_multiple_of(5);
    segment > 0 && candidate(segment) && !candidate(segment - 1)
}

/// Stretches of parking strip kept free for scripted cars: right side or not, from, to.
pub fn cleared_m(config: &StreetConfig) -> Vec<(bool, f64, f64)> {
    let Traffic::Moving(moving) = &config.traffic else { return Vec::new() };
    let mut cleared = Vec::new();
    for car in &moving.cars {
        let (at, stop) = super::traffic::ends_m(car, config.rate_hz);
        for (lane, at_m) in [(Some(car.lane), at), (car.to_lane, stop)] {
            match lane {
                // 18 m to either side: the way of a car that parks or pulls out.
                Some(Lane::ParkedRight) => cleared.push((true, at_m - 18.0, at_m + 18.0)),
                Some(Lane::ParkedLeft) => cleared.push((false, at_m - 18.0, at_m + 18.0)),
                _ => {}
            }
        }
    }
    cleared
}
