//! Roofs, flat and pitched, with chimneys and dormers.

use super::{House, ROOFS, ledge, tone_of, window};
use crate::synth::mesh::{Mesh, Parallelogram, Point};
use crate::synth::random::Rng;
use crate::synth::surface::{Kind, Surface, Tone, scaled, tone};

/// Closes a house above the height `top`.
pub fn roof(mesh: &mut Mesh, rng: &mut Rng, house: &House, top: f64, frame: Tone) {
    ledge(mesh, house, top + 0.12, 0.18, 0.3);
    // A flat roof behind a parapet.
    if rng.chance(0.3) {
        return flat_roof(mesh, rng, house, top);
    }
    let tiles = mesh.surface(Surface::new(
        Kind::Tiles,
        scaled(tone_of(rng.pick(&ROOFS)), rng.between(0.7, 1.2)),
        rng.seed(),
    ));
    let rise = 0.5 * house.depth * rng.between(0.6, 0.95);
    let pitch = Pitch { top, rise, tiles };
    pitched_roof(mesh, house, &pitch);
    if rng.chance(0.7) {
        chimney(mesh, rng, house, &pitch);
    }
    // Dormers need some 4.5 m of roof each.
    let dormers = if rng.chance(0.5) { libm::floor(house.width / 4.5) as usize } else { 0 };
    for k in 0..dormers {
        let middle = (k as f64 + 0.5) * house.width / dormers as f64;
        let pane = window(mesh, rng, frame, 0.9, 1.1);
        dormer(mesh, house, &pitch, middle, pane);
    }
}

/// Measures and tiles of a pitched roof, m.
struct Pitch {
    /// Height of the wall below it.
    top: f64,
    /// Height of the ridge above that.
    rise: f64,
    tiles: u16,
}

impl Pitch {
    /// Rise over run.
    fn slope(&self, house: &House) -> f64 {
        self.rise / (0.5 * house.depth)
    }
}

fn flat_roof(mesh: &mut Mesh, rng: &mut Rng, house: &House, top: f64) {
    let (width, depth) = (house.width, house.depth);
    let parapet = rng.between(0.4, 0.9);
    // The parapet hides the deck from the street.
    mesh.cuboid(
        house.wall,
        Point::new(0.0, top - parapet, -0.25),
        Point::new(width, top, 0.0),
        &[3],
    );
    mesh.cuboid(
        house.trim,
        Point::new(0.0, top - parapet - 0.1, -0.3),
        Point::new(width, top - parapet, 0.06),
        &[],
    );
    let deck = mesh.surface(Surface::new(Kind::Plain, tone(90, 90, 90), rng.seed()));
    mesh.sheet(
        deck,
        -Point::y(),
        Parallelogram::new(
            Point::new(0.0, top, 0.0),
            Point::new(width, 0.0, 0.0),
            Point::new(0.0, 0.0, -depth),
        ),
        [0.0; 3],
    );
}

fn pitched_roof(mesh: &mut Mesh, house: &House, pitch: &Pitch) {
    let (width, depth, slope) = (house.width, house.depth, pitch.slope(house));
    let &Pitch { top, rise, tiles } = pitch;
    // The roof reaches over the walls on the street's side only.
    let over = 0.45;
    let eave = Point::new(0.0, top + over * slope, over);
    let up = Point::new(0.0, -rise - over * slope, -0.5 * depth - over);
    mesh.sheet(
        tiles,
        Point::new(0.0, -1.0, 0.5),
        Parallelogram::new(eave, Point::new(width, 0.0, 0.0), up),
        [0.0; 3],
    );
    let eave_back = Point::new(0.0, top, -depth);
    let up_back = Point::new(0.0, -rise, 0.5 * depth);
    mesh.sheet(
        tiles,
        Point::new(0.0, -1.0, -0.5),
        Parallelogram::new(eave_back, Point::new(width, 0.0, 0.0), up_back),
        [0.0; 3],
    );
    // A gutter along the eave.
    let (low, high) = (eave + Point::new(0.0, 0.0, -0.08), eave + Point::new(width, 0.1, 0.04));
    mesh.cuboid(house.trim, low, high, &[]);
    // Gables close the roof at both ends.
    for x in [0.0, width] {
        let corner = |y: f64, z: f64| (Point::new(x, y, z), [z as f32, y as f32, 0.0]);
        let gable = [corner(top, 0.0), corner(top, -depth), corner(top - rise, -0.5 * depth)];
        mesh.polygon(house.wall, Point::new(x - 0.5 * width, 0.0, 0.0), &gable);
    }
}

fn chimney(mesh: &mut Mesh, rng: &mut Rng, house: &House, pitch: &Pitch) {
    let (width, depth) = (house.width, house.depth);
    let &Pitch { top, rise, .. } = pitch;
    let x = rng.between(0.5, width - 1.3);
    let brick = mesh.surface(
        Surface::new(Kind::Brick, tone(134, 84, 70), rng.seed()).with(tone(150, 146, 138)),
    );
    let (low, high) = (
        Point::new(x, top - rise - 1.0, -0.5 * depth - 0.3),
        Point::new(x + 0.8, top - rise + 0.8, -0.5 * depth + 0.3),
    );
    mesh.cuboid(brick, low, high, &[3]);
}

fn dormer(mesh: &mut Mesh, house: &House, pitch: &Pitch, middle: f64, pane: u16) {
    let (top, slope, tiles) = (pitch.top, pitch.slope(house), pitch.tiles);
    // The dormer's face stands half a metre behind the wall.
    let (front, base) = (-0.5, top - 0.5 * slope);
    let head = base - 1.5;
    let (low, high) = (
        Point::new(middle - 0.65, head, front - 2.2),
        Point::new(middle + 0.65, base + 0.1, front),
    );
    mesh.cuboid(house.wall, low, high, &[3, 4]);
    let (across, down) = (Point::new(0.9, 0.0, 0.0), Point::new(0.0, 1.1, 0.0));
    mesh.sheet(
        pane,
        Point::z(),
        Parallelogram::new(Point::new(middle - 0.45, head + 0.2, front + 0.02), across, down),
        [0.0; 3],
    );
    mesh.cuboid(
        tiles,
        low + Point::new(-0.12, -0.15, 0.0),
        Point::new(middle + 0.77, head, front + 0.2),
        &[],
    );
}
