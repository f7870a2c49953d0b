//! Traffic: the pose of every car at a time, by closed forms, so that any frame can be asked for
//! alone.

use dynvox_core::geometry::Transform;

use super::config::{
    CarKind, Lane, MovingTraffic, ScriptedCar, SpeedProfile, StreetConfig, Traffic,
};
use super::layout;
use super::path::RoadSpan;
use super::random::Rng;
use super::segment::choose_car;
use super::surface::Tone;

/// Over how many metres a car changes from one strip to another.
const CHANGE_M: f64 = 13.0;

/// A car of the traffic at one time.
pub struct Driver {
    /// Number for ever.
    pub id: u32,
    /// Body.
    pub kind: CarKind,
    /// Paint.
    pub paint: Tone,
    /// Pose in the street.
    pub t_street_car: Transform,
    /// Speed, m/s.
    pub speed_m_s: f64,
}

/// Way and speed at a time.
fn travelled(profile: &SpeedProfile, time_s: f64, rate_hz: f64) -> (f64, f64) {
    match *profile {
        SpeedProfile::Constant { speed_m_s } => (speed_m_s * time_s, speed_m_s),
        SpeedProfile::Starting { frame, speed_m_s, acceleration_m_s2 } => {
            let since = (time_s - f64::from(frame) / rate_hz).max(0.0);
            // The time to reach the speed, and half of it is what the start costs in way.
            let reached = speed_m_s / acceleration_m_s2;
            if since < reached {
                (0.5 * acceleration_m_s2 * since * since, acceleration_m_s2 * since)
            } else {
                (speed_m_s * (since - 0.5 * reached), speed_m_s)
            }
        }
        SpeedProfile::Stopping { frame, speed_m_s, deceleration_m_s2 } => {
            let begin = f64::from(frame) / rate_hz;
            let braking = (time_s - begin).max(0.0);
            let stand = speed_m_s / deceleration_m_s2;
            if time_s < begin {
                (speed_m_s * time_s, speed_m_s)
            } else if braking < stand {
                (
                    speed_m_s * (begin + braking) - 0.5 * deceleration_m_s2 * braking * braking,
                    speed_m_s - deceleration_m_s2 * braking,
                )
            } else {
                (speed_m_s * (begin + 0.5 * stand), 0.0)
            }
        }
    }
}

/// Returns the positions along the street, m, at which a scripted car begins and, if it stops,
/// ends.
pub fn ends_m(car: &ScriptedCar, rate_hz: f64) -> (f64, f64) {
    let sign = if layout::is_oncoming(car.lane) { -1.0 } else { 1.0 };
    let way = match car.profile {
        SpeedProfile::Stopping { .. } => travelled(&car.profile, 1e12, rate_hz).0,
        _ => 0.0,
    };
    (car.start_m, car.start_m + sign * way)
}

/// Lateral position and its slope over the way driven.
fn lateral(car: &ScriptedCar, way_m: f64, rate_hz: f64) -> (f64, f64) {
    let from = layout::lateral_m(car.lane);
    let Some(to_lane) = car.to_lane else { return (from, 0.0) };
    let to = layout::lateral_m(to_lane);
    let begin = match car.profile {
        SpeedProfile::Stopping { .. } => travelled(&car.profile, 1e12, rate_hz).0 - CHANGE_M,
        _ => 0.0,
    };
    let x = ((way_m - begin) / CHANGE_M).clamp(0.0, 1.0);
    let smooth = x * x * x * (x * (6.0 * x - 15.0) + 10.0);
    let slope = 30.0 * x * x * (x - 1.0) * (x - 1.0) / CHANGE_M;
    (from + (to - from) * smooth, (to - from) * slope)
}

/// A stretch of the street at a moment.
pub struct Road<'a> {
    /// The street.
    pub config: &'a StreetConfig,
    /// Line of the street, at least as far as the stretch.
    pub span: &'a RoadSpan<'a>,
    /// Time since the first frame, s.
    pub time_s: f64,
    /// Begin of the stretch along the street, m.
    pub from_m: f64,
    /// End of the stretch along the street, m.
    pub to_m: f64,
}

/// All cars of the traffic on a stretch.
pub fn drivers(road: &Road<'_>) -> Vec<Driver> {
    let &Road { config, span, time_s, from_m, to_m } = road;
    let Traffic::Moving(moving) = &config.traffic else { return Vec::new() };
    let mut drivers = Vec::new();
    for (number, car) in moving.cars.iter().enumerate() {
        let sign = if layout::is_oncoming(car.lane) { -1.0 } else { 1.0 };
        let (way, speed_m_s) = travelled(&car.profile, time_s, config.rate_hz);
        let (lateral_m, slope) = lateral(car, way, config.rate_hz);
        let at = car.start_m + sign * way;
        if !(from_m..to_m).contains(&at) {
            continue;
        }
        let facing_rad = if sign < 0.0 { core::f64::consts::PI } else { 0.0 };
        let yaw = facing_rad + libm::atan(slope * sign);
        let paint = choose_car(&mut Rng::new(config.seed, number as i64, 0x5C21)).1;
        let t_street_car = span.t_street_local(at, lateral_m, yaw);
        drivers.push(Driver {
            id: number as u32 + 1,
            kind: car.kind,
            paint,
            t_street_car,
            speed_m_s,
        });
    }
    flow(road, moving, Lane::Oncoming, &mut drivers);
    flow(road, moving, Lane::Overtaking, &mut drivers);
    drivers
}

/// Speed of the oncoming cars of the flow, m/s.
const ONCOMING_SPEED_M_S: f64 = 8.0;
/// Speed of the overtaking cars of the flow, m/s.
const OVERTAKING_SPEED_M_S: f64 = 13.0;

/// The endless flow in one lane: car j stands in slot j of a belt that moves with the lane's speed.
fn flow(road: &Road<'_>, moving: &MovingTraffic, lane: Lane, drivers: &mut Vec<Driver>) {
    let &Road { config, span, time_s, from_m, to_m } = road;
    let (gap, speed, sign, first_id) = match lane {
        Lane::Oncoming => (moving.oncoming_gap_m, ONCOMING_SPEED_M_S, -1.0, layout::ONCOMING_IDS),
        _ => (moving.overtaking_gap_m, OVERTAKING_SPEED_M_S, 1.0, layout::OVERTAKING_IDS),
    };
    if gap <= 0.0 {
        return;
    }
    let shift = sign * speed * time_s;
    let mut slot = libm::floor((from_m - shift) / gap) as i64 - 1;
    while (slot as f64) * gap + shift < to_m {
        let mut rng = Rng::new(config.seed ^ u64::from(first_id), slot, 7);
        let at = (slot as f64 + rng.between(0.0, 0.7)) * gap + shift;
        let (kind, paint) = choose_car(&mut rng);
        let offset_m = rng.between(-0.15, 0.15);
        if (from_m..to_m).contains(&at) {
            let facing_rad = if sign < 0.0 { core::f64::consts::PI } else { 0.0 };
            let t_street_car =
                span.t_street_local(at, layout::lateral_m(lane) + offset_m, facing_rad);
            let id = first_id + slot.rem_euclid(1_000_000) as u32;
            drivers.push(Driver { id, kind, paint, t_street_car, speed_m_s: speed });
        }
        slot += 1;
    }
}
