//! Balconies.

use super::House;
use crate::synth::mesh::{Mesh, Point};
use crate::synth::random::Rng;
use crate::synth::surface::{Kind, Surface, scaled, tone};

/// Half of the width, m.
const HALF_M: f64 = 1.05;
/// Depth over the street, m.
const OUT_M: f64 = 1.0;

/// A slab over the street with a parapet or a railing, around the middle of an opening.
pub fn balcony(mesh: &mut Mesh, rng: &mut Rng, house: &House, middle: f64, floor: f64) {
    let (half, out) = (HALF_M, OUT_M);
    let slab = (
        Point::new(middle - half, floor - 0.12, 0.0),
        Point::new(middle + half, floor + 0.06, out),
    );
    mesh.cuboid(house.trim, slab.0, slab.1, &[4]);
    let rail = mesh.surface(Surface::new(
        Kind::Plain,
        scaled(tone(70, 72, 76), rng.between(0.5, 1.5)),
        rng.seed(),
    ));
    // Some balconies have walls instead of bars.
    if rng.chance(0.35) {
        parapet(mesh, house.wall, middle, floor);
    } else {
        mesh.slight = true;
        railing(mesh, rail, middle, floor);
        mesh.slight = false;
    }
}

fn parapet(mesh: &mut Mesh, wall: u16, middle: f64, floor: f64) {
    let (half, out, top) = (HALF_M, OUT_M, floor - 1.1);
    let edges = [
        (Point::new(middle - half, top, out - 0.05), Point::new(middle + half, floor - 0.12, out)),
        (
            Point::new(middle - half, top, 0.0),
            Point::new(middle - half + 0.05, floor - 0.12, out - 0.05),
        ),
        (
            Point::new(middle + half - 0.05, top, 0.0),
            Point::new(middle + half, floor - 0.12, out - 0.05),
        ),
    ];
    for (low, high) in edges {
        mesh.cuboid(wall, low, high, &[]);
    }
}

fn railing(mesh: &mut Mesh, rail: u16, middle: f64, floor: f64) {
    let (half, out, top) = (HALF_M, OUT_M, floor - 1.1);
    let bars = 11;
    // Bars of the front, evenly spaced.
    for k in 0..=bars {
        let x = middle - half + 0.03 + (2.0 * half - 0.06) * f64::from(k) / f64::from(bars);
        mesh.cuboid(
            rail,
            Point::new(x - 0.012, top, out - 0.04),
            Point::new(x + 0.012, floor - 0.12, out - 0.016),
            &[2, 3, 4],
        );
    }
    // Bars of the two ends, and their hand rails.
    for x in [middle - half, middle + half - 0.04] {
        for k in 0..5 {
            let z = 0.1 + 0.2 * f64::from(k);
            mesh.cuboid(
                rail,
                Point::new(x, top, z),
                Point::new(x + 0.024, floor - 0.12, z + 0.024),
                &[2, 3],
            );
        }
        mesh.cuboid(rail, Point::new(x, top - 0.05, 0.0), Point::new(x + 0.05, top, out), &[]);
    }
    // The front's hand rail, last.
    mesh.cuboid(
        rail,
        Point::new(middle - half, top - 0.05, out - 0.06),
        Point::new(middle + half, top, out),
        &[],
    );
}
