//! A yard: lawn between houses, a hedge and a fence, with trees and a bench.

use super::config::RoomConfig;
use super::extent::Extent;
use super::sides::{Side, Standing};
use crate::synth::mesh::{Mesh, Parallelogram, Point};
use crate::synth::random::Rng;
use crate::synth::surface::{Kind, Surface, tone};
use crate::synth::{facade, furniture};
use dynvox_core::geometry::Transform;

/// Half the side of the ground, m.
const GROUND_M: f64 = 40.0;

/// All meshes of a yard.
pub fn yard(config: &RoomConfig, extent: &Extent) -> Standing {
    let mut standing = Standing::default();
    let mut ground = Mesh::default();
    let mut rng = Rng::new(config.seed, 0x9A2D, 0);
    let lawn = Surface::new(Kind::Yard, tone(104, 112, 70), rng.seed());
    let lawn = ground.surface(lawn.with(tone(130, 122, 106)));
    // The lawn reaches beyond houses and fences, to where haze hides its end.
    let origin = Point::new(-GROUND_M, 0.0, -GROUND_M);
    let (u, v) = (Point::x() * (2.0 * GROUND_M), Point::z() * (2.0 * GROUND_M));
    ground.sheet(lawn, -Point::y(), Parallelogram::new(origin, u, v), [0.0; 3]);
    standing.add(ground, &Transform::IDENTITY);
    for (number, side) in Side::all(extent).iter().enumerate() {
        let mut rng = Rng::new(config.seed, 0x9A2E, number as i64);
        // Houses stand on two sides or three, and bound the yard with hedges or fences.
        if number.is_multiple_of(2) || (number == 1 && rng.chance(0.5)) {
            house(&mut standing, &mut rng, side);
        } else {
            border(&mut standing, &mut rng, side);
        }
        plants(&mut standing, &mut rng, side);
    }
    standing
}

fn house(standing: &mut Standing, rng: &mut Rng, side: &Side) {
    let mut mesh = Mesh::default();
    let width = side.length_m + 4.0;
    facade::house(&mut mesh, rng, width);
    standing.add(mesh, &side.t_room_side(-0.5 * width, 0.0));
}

/// A hedge or a fence; both are built along z.
fn border(standing: &mut Standing, rng: &mut Rng, side: &Side) {
    let mut mesh = Mesh::default();
    let length = side.length_m + 2.0;
    if rng.chance(0.5) {
        furniture::hedge(&mut mesh, rng, length);
    } else {
        furniture::fence(&mut mesh, rng, length);
    }
    // From along z to along the side.
    let along = Transform::new([0.0, 0.5 * core::f64::consts::PI, 0.0], [0.0; 3]);
    standing.add(mesh, &(side.t_room_side(-0.5 * length, 0.0) * along));
}

/// Trees and a bench within a side's strip.
fn plants(standing: &mut Standing, rng: &mut Rng, side: &Side) {
    let half = 0.5 * side.length_m;
    let trees = 1 + rng.below(2);
    for number in 0..trees {
        let mut mesh = Mesh::default();
        furniture::tree(&mut mesh, rng);
        let part = (number as f64 + 0.5) / trees as f64;
        let along = half * (1.6 * part - 0.8) + rng.between(-0.6, 0.6);
        standing.add(mesh, &side.t_room_side(along, rng.between(1.0, 1.5)));
    }
    if rng.chance(0.6) {
        let mut mesh = Mesh::default();
        furniture::bench(&mut mesh, rng);
        let turned = Transform::new([0.0, 0.5 * core::f64::consts::PI, 0.0], [0.0; 3]);
        standing.add(mesh, &(side.t_room_side(0.6 * half, 0.9) * turned));
    }
}
