//! People: capsules with swinging limbs that walk on their own rounds.

use std::sync::Arc;

use dynvox_core::geometry::Transform;

use super::extent::Extent;
use crate::synth::frame::ObjectTruth;
use crate::synth::mesh::{Mesh, Point, Vertex};
use crate::synth::random::Rng;
use crate::synth::surface::{Indoor, Kind, Surface, Tone, tone};

const FULL_CIRCLE_RAD: f64 = 2.0 * core::f64::consts::PI;
/// Way of two steps, m.
const STRIDE_M: f64 = 1.35;
/// Widest swing of a leg and of an arm, rad.
const SWING_RAD: (f64, f64) = (0.42, 0.38);
/// Width, height and length of the box around a person who walks, m.
const BOX_M: [f64; 3] = [0.74, 1.86, 1.30];
/// Rings and corners around a capsule's cap.
const CAP: (u32, u32) = (4, 12);

const CLOTHES: [(u8, u8, u8); 8] = [
    (52, 70, 120),
    (140, 40, 46),
    (60, 100, 70),
    (196, 190, 176),
    (90, 84, 96),
    (184, 140, 60),
    (36, 40, 48),
    (130, 96, 130),
];

/// Joint of a body at which a part hangs.
#[derive(Clone, Copy)]
struct Joint {
    /// Position in the body, m: x right, y down from the floor, z forward.
    at_m: [f64; 3],
    /// Swing, as a share of the limb's widest.
    swing: f64,
    /// True for a leg.
    is_leg: bool,
}

/// The parts of a body and their joints.
const JOINTS: [Joint; 6] = [
    Joint { at_m: [0.0, -0.98, 0.0], swing: 0.0, is_leg: true },
    Joint { at_m: [0.0, -1.66, 0.01], swing: 0.0, is_leg: true },
    Joint { at_m: [-0.10, -0.90, 0.0], swing: 1.0, is_leg: true },
    Joint { at_m: [0.10, -0.90, 0.0], swing: -1.0, is_leg: true },
    Joint { at_m: [-0.26, -1.42, 0.0], swing: -1.0, is_leg: false },
    Joint { at_m: [0.26, -1.42, 0.0], swing: 1.0, is_leg: false },
];

/// A person: parts, and a round.
pub struct Person {
    parts: Vec<Arc<Mesh>>,
    round: Round,
}

/// Round of a person.
#[derive(Clone, Copy)]
struct Round {
    /// Half axes, m; of a way there and back: its distance from the middle, and half of it.
    half_m: [f64; 2],
    /// Rounds a second, negative against the camera's sense, Hz.
    hz: f64,
    /// Position at time 0, rounds.
    start: f64,
    is_straight: bool,
}

/// A person at a time.
pub struct Standing {
    /// Pose in the room.
    pub t_room_person: Transform,
    /// Meshes and their poses in the room.
    pub parts: Vec<(Arc<Mesh>, Transform)>,
    /// Speed, m/s.
    pub speed_m_s: f64,
}

impl Person {
    /// Person `number` of a seed, where a camera makes `round_hz` rounds a second, or none.
    pub fn new(seed: u64, number: u32, extent: &Extent, round_hz: f64, camera_walks: bool) -> Self {
        let mut rng = Rng::new(seed, 0x9E0_91E, i64::from(number));
        let parts = body(&mut rng).map(Arc::new).to_vec();
        let is_ahead = number.is_multiple_of(2);
        let others = f64::from(number / 2);
        let round = if extent.is_corridor {
            // On the other side, towards the camera first.
            Round {
                half_m: [-0.45, extent.half_m[1] - 1.0],
                hz: round_hz,
                start: 0.5 + 0.11 * f64::from(number),
                is_straight: true,
            }
        } else if !camera_walks {
            Round {
                half_m: extent.round_m.map(|half| half.max(1.0)),
                hz: if is_ahead { 0.1 } else { -0.1 },
                start: 0.07 + 0.25 * others + rng.between(0.0, 0.1),
                is_straight: false,
            }
        } else if is_ahead {
            // On the camera's own round, a sixth of it or more ahead.
            let start = 0.17 + 0.22 * others;
            Round { half_m: extent.round_m, hz: round_hz, start, is_straight: false }
        } else {
            // Inside it, the other way round.
            let half_m = extent.round_m.map(|half| 0.35 * half);
            Round { half_m, hz: -1.6 * round_hz, start: 0.5 + 0.5 * others, is_straight: false }
        };
        Self { parts, round }
    }

    /// The person at a time.
    pub fn at(&self, time_s: f64) -> Standing {
        let Round { half_m: [a, b], hz, start, is_straight } = self.round;
        let angle = FULL_CIRCLE_RAD * (hz * time_s + start);
        let rate = FULL_CIRCLE_RAD * hz;
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let (middle, velocity) = if is_straight {
            (Point::new(-a, 0.0, -b * cosine), Point::new(0.0, 0.0, b * sine * rate))
        } else {
            let middle = Point::new(a * sine, 0.0, -b * cosine);
            (middle, Point::new(a * cosine * rate, 0.0, b * sine * rate))
        };
        // People look where they go.
        let speed_m_s = velocity.norm();
        let heading = libm::atan2(velocity.x, velocity.z);
        let t_room_person = Transform::new([0.0, heading, 0.0], <[f64; 3]>::from(middle));
        // Steps follow the way on a round of the same length in a circle.
        let way_m = 0.5 * (a.abs() + b) * angle;
        let swing = libm::sin(FULL_CIRCLE_RAD * way_m / STRIDE_M) * (speed_m_s / 0.6).min(1.0);
        // Left and right swing against each other, arms against legs.
        let parts = self.parts.iter().zip(JOINTS).map(|(mesh, joint)| {
            let widest = if joint.is_leg { SWING_RAD.0 } else { SWING_RAD.1 };
            let t_person_part =
                Transform::new([widest * swing * joint.swing, 0.0, 0.0], joint.at_m);
            (Arc::clone(mesh), (t_room_person * t_person_part).normalized())
        });
        Standing { t_room_person, parts: parts.collect(), speed_m_s }
    }
}

impl Standing {
    /// Truth about person `number`.
    pub fn truth(&self, number: u32, t_world_place: &Transform) -> ObjectTruth {
        ObjectTruth {
            id: number + 1,
            class: "person",
            t_world_object: (*t_world_place * self.t_room_person).normalized(),
            dimensions_m: BOX_M,
            moving: true,
            speed_m_s: self.speed_m_s,
        }
    }
}

/// Trunk, head, legs and arms, each hanging from its joint.
fn body(rng: &mut Rng) -> [Mesh; 6] {
    // Patterns of two tones: a person of one tone could not be tracked.
    let mut cloth = || {
        let pick = |(red, green, blue): (u8, u8, u8)| tone(red, green, blue);
        (pick(rng.pick(&CLOTHES)), pick(rng.pick(&CLOTHES)), rng.seed())
    };
    let (shirt, trousers) = (cloth(), cloth());
    let skin = (tone(206, 164, 138), tone(60, 44, 34), rng.seed());
    // Limbs are capsules that overlap at their joints, so that no gap opens as they swing.
    let part = |(tone, second, seed): (Tone, Tone, u32), limbs: &[([f64; 3], [f64; 3], f64)]| {
        let mut mesh = Mesh::default();
        let surface =
            mesh.surface(Surface::new(Kind::Indoor(Indoor::Cloth), tone, seed).with(second));
        for &(from, to, radius_m) in limbs {
            capsule(&mut mesh, surface, [Point::from(from), Point::from(to)], radius_m);
        }
        mesh.finish()
    };
    let leg =
        [([0.0, 0.0, 0.0], [0.0, 0.78, 0.0], 0.085), ([0.0, 0.83, 0.02], [0.0, 0.83, 0.15], 0.05)];
    let arm =
        [([0.0, 0.0, 0.0], [0.0, 0.30, 0.0], 0.052), ([0.0, 0.30, 0.0], [0.0, 0.56, 0.06], 0.045)];
    [
        part(
            shirt,
            &[
                ([-0.07, -0.45, 0.0], [-0.05, 0.05, 0.0], 0.14),
                ([0.07, -0.45, 0.0], [0.05, 0.05, 0.0], 0.14),
            ],
        ),
        part(skin, &[([0.0, 0.0, 0.0], [0.0, -0.06, 0.0], 0.11)]),
        part(trousers, &leg),
        part(trousers, &leg),
        part(shirt, &arm),
        part(shirt, &arm),
    ]
}

/// Adds a capsule between the middles of its caps.
fn capsule(mesh: &mut Mesh, surface: u16, [from, to]: [Point; 2], radius_m: f64) {
    let axis = (to - from).normalize();
    let helper = if axis.y.abs() > 0.9 { Point::x() } else { Point::y() };
    let u = axis.cross(&helper).normalize();
    let v = axis.cross(&u);
    let (rings, sides) = CAP;
    // Any direction off the axis serves: capsules are round.
    let first = mesh.vertices.len() as u32;
    // Latitudes of the first cap, then of the second; the shaft is between them.
    for ring in 0..2 * rings + 2 {
        let latitude = if ring <= rings { ring } else { ring - 1 };
        let angle = (f64::from(latitude) / f64::from(2 * rings) - 0.5) * 0.5 * FULL_CIRCLE_RAD;
        let (along, across) = (libm::sin(angle), libm::cos(angle));
        let middle = if ring <= rings { from } else { to };
        for side in 0..=sides {
            let turn = FULL_CIRCLE_RAD * f64::from(side % sides) / f64::from(sides);
            let out = axis * along + (u * libm::cos(turn) + v * libm::sin(turn)) * across;
            let position_m = middle + out * radius_m;
            let around_m = FULL_CIRCLE_RAD * radius_m * f64::from(side) / f64::from(sides);
            let down_m = (position_m - from).dot(&axis);
            mesh.vertices.push(Vertex {
                position_m,
                surface_m: [around_m as f32, down_m as f32, 0.0],
                normal: [out.x as f32, out.y as f32, out.z as f32],
            });
        }
    }
    // The seam's corners come twice, because texture begins there anew.
    let row = sides + 1;
    for ring in 0..2 * rings + 1 {
        for side in 0..sides {
            let a = first + ring * row + side;
            // At the poles one of the two has no area.
            if ring > 0 {
                mesh.facing([a, a + 1, a + row], surface);
            }
            if ring < 2 * rings {
                mesh.facing([a + 1, a + row + 1, a + row], surface);
            }
        }
    }
}
