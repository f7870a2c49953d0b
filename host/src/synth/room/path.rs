//! Paths of the camera in a room or yard, as closed forms of the time. In a room x points right, y
//! down and z forward; the origin is the middle of the floor.

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

use super::config::{RoomConfig, RoomKind, RoomPath};
use super::extent::Extent;
use crate::formats::GRAVITY_M_S2;
use crate::synth::mesh::Point;
use crate::synth::random::Rng;

const FULL_CIRCLE_RAD: f64 = 2.0 * core::f64::consts::PI;
/// Time from one side to the other and back, s.
const SWAY_S: f64 = 4.0;
/// Steps a second of a walk: the body bobs with each, and sways with every second one.
const STEP_HZ: f64 = 1.8;
/// Time that a turn at the end of a corridor takes, s.
const ABOUT_TURN_S: f64 = 2.4;
/// Time to either side by which speeds and accelerations are found, s.
const STEP_S: f64 = 2e-3;

/// Height of a camera in a hand, m.
const HAND_M: f64 = 1.45;
/// Pitch of a camera in a hand, rad: it looks down a little.
const LOOKS_DOWN_RAD: f64 = -0.10;
/// Height of a drone, m, and by how much it rises and sinks.
const DRONE_M: (f64, f64) = (1.35, 0.25);

/// Path of a camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraPath {
    path: RoomPath,
    /// Half axes of the round, m.
    round_m: [f64; 2],
    /// Rounds a second, Hz.
    round_hz: f64,
    turn_rad_s: f64,
    shake: f64,
    /// Phases of the small motions.
    phases: [f64; 8],
}

impl CameraPath {
    /// The path in a room of an extent.
    pub fn new(kind: RoomKind, config: &RoomConfig, extent: &Extent) -> Self {
        let mut rng = Rng::new(config.seed, 0x9A_7B, kind as i64);
        let round_m = extent.round_m;
        // Ramanujan's circumference of an ellipse; a way there and back has no width.
        let [a, b] = round_m;
        let way_m = match config.path {
            RoomPath::Corridor => 4.0 * b,
            _ => 0.5 * FULL_CIRCLE_RAD * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)).sqrt()),
        };
        Self {
            path: config.path,
            round_m,
            round_hz: config.speed_m_s / way_m,
            turn_rad_s: config.turn_deg_s.to_radians(),
            shake: config.shake,
            phases: core::array::from_fn(|_| rng.unit()),
        }
    }

    /// Rounds a second, Hz: after one the camera is back.
    pub fn round_hz(&self) -> f64 {
        self.round_hz
    }

    /// Pose of the left camera at a time, which may lie before 0.
    pub fn t_room_camera(&self, time_s: f64) -> Transform {
        let middle = self.way(time_s);
        let yaw = self.heading_rad(time_s) + self.sway_rad(time_s);
        let turn = |x: f64, y: f64, z: f64| Transform::new([x, y, z], [0.0; 3]);
        if self.path == RoomPath::Drone {
            let tilt = self.tilt(time_s);
            return (Transform { translation_m: middle.into(), ..tilt } * turn(0.0, yaw, 0.0))
                .normalized();
        }
        // A hand moves about the way; a drone's tilt is its way.
        let hand = self.hand(time_s);
        // Rotations in the order yaw, pitch, roll, of a hand that also shifts.
        let standing = Transform::new([0.0; 3], <[f64; 3]>::from(middle)) * turn(0.0, yaw, 0.0);
        (standing
            * Transform::new([0.0; 3], <[f64; 3]>::from(hand.shift_m))
            * turn(0.0, hand.yaw_rad, 0.0)
            * turn(hand.pitch_rad, 0.0, 0.0)
            * turn(0.0, 0.0, hand.roll_rad))
        .normalized()
    }

    /// Position along the way, without a hand's motions.
    fn way(&self, time_s: f64) -> Point {
        let [a, b] = self.round_m;
        let angle = FULL_CIRCLE_RAD * (self.round_hz * time_s);
        match self.path {
            RoomPath::Handheld => Point::new(a * libm::sin(angle), -HAND_M, -b * libm::cos(angle)),
            RoomPath::Drone => {
                // It gathers speed and brakes four times a round.
                let angle = angle + 0.12 * libm::sin(4.0 * angle);
                let height = DRONE_M.0 + DRONE_M.1 * libm::sin(2.0 * angle);
                Point::new(a * libm::sin(angle), -height, -b * libm::cos(angle))
            }
            RoomPath::Corridor => {
                let angle = FULL_CIRCLE_RAD * self.round_hz * (time_s + ABOUT_TURN_S);
                Point::new(-a, -HAND_M, -b * libm::cos(angle))
            }
            RoomPath::Stand | RoomPath::Turn => Point::new(0.0, -HAND_M, -0.2 * b),
        }
    }

    /// Heading along the way, rad, positive to the right.
    fn heading_rad(&self, time_s: f64) -> f64 {
        match self.path {
            RoomPath::Handheld | RoomPath::Drone => {
                // The way has no closed derivative where speed varies.
                let [before, after] = [-STEP_S, STEP_S].map(|by| self.way(time_s + by));
                let along = after - before;
                libm::atan2(along.x, along.z)
            }
            RoomPath::Corridor => {
                // About turns at both ends, one after half a round each.
                let halves = 2.0 * self.round_hz * (time_s + ABOUT_TURN_S);
                let nearest = libm::round(halves);
                let since_s = (halves - nearest) / (2.0 * self.round_hz);
                let share = (since_s / ABOUT_TURN_S + 0.5).clamp(0.0, 1.0);
                0.5 * FULL_CIRCLE_RAD * (nearest - 1.0 + smooth(share))
            }
            RoomPath::Stand | RoomPath::Turn => 0.3 + FULL_CIRCLE_RAD * self.phases[0],
        }
    }

    /// Turn to the side, rad.
    fn sway_rad(&self, time_s: f64) -> f64 {
        if self.path == RoomPath::Stand {
            return 0.0;
        }
        let widest_rad = self.turn_rad_s * SWAY_S / FULL_CIRCLE_RAD;
        widest_rad * libm::sin(FULL_CIRCLE_RAD * time_s / SWAY_S)
    }

    /// Rotation that lets a drone's thrust carry it along its way.
    fn tilt(&self, time_s: f64) -> Transform {
        let [before, here, after] = [-1.0, 0.0, 1.0].map(|by| self.way(time_s + by * STEP_S));
        let acceleration = (after - here * 2.0 + before) / (STEP_S * STEP_S);
        let thrust = acceleration - Point::new(0.0, GRAVITY_M_S2, 0.0);
        // From the way up to the thrust, about the axis across both.
        let up = -Point::y();
        let axis = up.cross(&thrust);
        let angle = libm::atan2(axis.norm(), up.dot(&thrust));
        // Without acceleration the axis is nothing, and so is the angle.
        let axis = axis * (angle / (axis.norm() + 1e-12));
        Transform::new(<[f64; 3]>::from(axis), [0.0; 3])
    }

    /// Shift and turn of the hand: steps where it walks, and its tremor.
    fn hand(&self, time_s: f64) -> Hand {
        let wave =
            |hz: f64, phase: usize| libm::sin(FULL_CIRCLE_RAD * (hz * time_s + self.phases[phase]));
        let walks = matches!(self.path, RoomPath::Handheld | RoomPath::Corridor);
        let step = if walks { self.shake } else { 0.0 };
        // Of a hand that stands, the tremor is all there is.
        let tremor = self.shake;
        // Two steps are one stride: sway and roll follow the stride, bob and nod the step.
        let stride = |phase: usize| wave(0.5 * STEP_HZ, phase);
        Hand {
            shift_m: Vector3::new(
                step * 0.020 * stride(1) + tremor * 0.0012 * wave(2.3, 4),
                step * 0.018 * wave(STEP_HZ, 2) + tremor * 0.0010 * wave(3.1, 5),
                step * 0.008 * wave(STEP_HZ, 3) + tremor * 0.0008 * wave(1.9, 6),
            ),
            yaw_rad: step * 0.020 * stride(4) + tremor * 0.0025 * wave(1.3, 7),
            pitch_rad: LOOKS_DOWN_RAD
                + step * 0.018 * wave(STEP_HZ, 5)
                + tremor * 0.0020 * wave(2.7, 1),
            roll_rad: step * 0.022 * stride(6) + tremor * 0.0020 * wave(1.7, 2),
        }
    }
}

/// Motion of a hand about the way.
struct Hand {
    shift_m: Vector3<f64>,
    yaw_rad: f64,
    pitch_rad: f64,
    roll_rad: f64,
}

/// A step from 0 to 1 whose speed and acceleration are 0 at both ends.
fn smooth(share: f64) -> f64 {
    share * share * share * (10.0 + share * (6.0 * share - 15.0))
}
