//! A room: walls, floor, ceiling, a door, pictures and furniture along the walls.

use super::config::RoomConfig;
use super::extent::Extent;
use super::furniture;
use super::sides::{Side, Standing};
use crate::synth::mesh::{Mesh, Parallelogram, Point};
use crate::synth::random::Rng;
use crate::synth::surface::{Indoor, Kind, Surface, scaled, tone};
use dynvox_core::geometry::Transform;

/// Light tones of walls.
const WALLS: [(u8, u8, u8); 5] =
    [(214, 208, 196), (196, 204, 206), (218, 206, 182), (206, 196, 200), (190, 202, 186)];
/// Dark tones of patterns on walls.
const PATTERNS: [(u8, u8, u8); 4] = [(120, 92, 80), (82, 104, 120), (110, 116, 84), (140, 84, 80)];
/// Contrast of a bare wall and of rough plaster.
const CONTRAST: (f64, f64) = (0.05, 1.0);
/// Width and height of the door, m.
const DOOR_M: [f64; 2] = [0.9, 2.05];
/// Height of the skirting, m.
const SKIRTING_M: f64 = 0.09;
/// Room behind furniture for a picture, m.
const BEHIND_M: f64 = 0.03;
/// Distance of furniture from corners, m.
const CORNER_M: f64 = 0.85;

/// All meshes of a room.
pub fn room(config: &RoomConfig, extent: &Extent) -> Standing {
    let mut standing = Standing::default();
    let mut rng = Rng::new(config.seed, 0x200A, 0);
    flat(&mut standing, &mut rng, extent);
    let sides = Side::all(extent);
    // Each side has a generator of its own: a change of one leaves the others.
    for (number, side) in sides.iter().enumerate() {
        let mut rng = Rng::new(config.seed, 0x200B, number as i64);
        let is_bare = rng.chance(config.bare_walls);
        wall(&mut standing, &mut rng, side, extent, is_bare);
        if number == 0 {
            door(&mut standing, &mut rng, side);
        }
        if !extent.is_corridor {
            furnish(&mut standing, &mut rng, side, number == 0);
        }
        if !is_bare {
            pictures(&mut standing, &mut rng, side);
        }
    }
    // The middle is free where people cross it.
    if !extent.is_corridor && config.people < 2 {
        let mut mesh = Mesh::default();
        furniture::table(&mut mesh, &mut rng);
        standing.add(mesh, &Transform::IDENTITY);
    }
    standing
}

/// Floor with a rug, and ceiling.
fn flat(standing: &mut Standing, rng: &mut Rng, extent: &Extent) {
    let [x, z] = extent.half_m;
    // Boards run along the room, as they are laid.
    let mut mesh = Mesh::default();
    let boards = scaled(tone(168, 128, 88), rng.between(0.7, 1.1));
    let boards = mesh.surface(Surface::new(Kind::Indoor(Indoor::Boards), boards, rng.seed()));
    let area = |y: f64, x: f64, z: f64| {
        let (u, v) = (Point::z() * (2.0 * z), Point::x() * (2.0 * x));
        Parallelogram::new(Point::new(-x, y, -z), u, v)
    };
    mesh.sheet(boards, -Point::y(), area(0.0, x, z), [0.0; 3]);
    let rug = Surface::new(Kind::Indoor(Indoor::Rug), tone(150, 70, 60), rng.seed());
    let rug = mesh.surface(rug.with(tone(206, 190, 160)));
    // The rug lies where people walk; it is thicker than a depth's rounding.
    let [a, b] = extent.round_m.map(|half| half.max(0.6));
    mesh.sheet(rug, -Point::y(), area(-0.008, a, b), [0.0; 3]);
    standing.add(mesh, &Transform::IDENTITY);
    // A ceiling has little texture, as real ones.
    let mut ceiling = Mesh::default();
    let plaster = Surface::new(Kind::Indoor(Indoor::Wall), tone(226, 224, 218), rng.seed());
    let plaster = ceiling.surface(plaster.sized(0.35, 1.0));
    ceiling.sheet(plaster, Point::y(), area(-extent.height_m, x, z), [0.0; 3]);
    let lamp = ceiling.surface(Surface::new(Kind::Plain, tone(236, 230, 210), rng.seed()));
    for along in [-0.4, 0.4] {
        let low = Point::new(-0.3, -extent.height_m, along * z - 0.15);
        ceiling.cuboid(lamp, low, low + Point::new(0.6, 0.07, 0.3), &[2]);
    }
    standing.add(ceiling, &Transform::IDENTITY);
}

/// A wall with its skirting.
fn wall(standing: &mut Standing, rng: &mut Rng, side: &Side, extent: &Extent, is_bare: bool) {
    let mut mesh = Mesh::default();
    let tone_of = |(red, green, blue): (u8, u8, u8)| tone(red, green, blue);
    let (light, dark) = (tone_of(rng.pick(&WALLS)), tone_of(rng.pick(&PATTERNS)));
    let (kind, seed) = (rng.below(3), rng.seed());
    // A bare wall takes its draws as well, so that `bare_walls` changes nothing else.
    let surface = match (is_bare, kind) {
        (true, _) => Surface::new(Kind::Indoor(Indoor::Wall), light, seed).sized(CONTRAST.0, 1.0),
        (_, 0) => Surface::new(Kind::Indoor(Indoor::Wall), light, seed).sized(CONTRAST.1, 1.0),
        (_, 1) => Surface::new(Kind::Brick, scaled(tone(170, 120, 96), 0.9), seed)
            .with(tone(176, 170, 160)),
        _ => Surface::new(Kind::Indoor(Indoor::Wallpaper), light, seed).with(dark),
    };
    let surface = mesh.surface(surface);
    let half = 0.5 * side.length_m;
    let (u, v) = (Point::x() * side.length_m, Point::y() * extent.height_m);
    let origin = Point::new(-half, -extent.height_m, 0.0);
    mesh.sheet(surface, Point::z(), Parallelogram::new(origin, u, v), [0.0; 3]);
    let skirting = mesh.surface(Surface::new(Kind::Plain, tone(180, 172, 160), rng.seed()));
    mesh.cuboid(
        skirting,
        Point::new(-half, -SKIRTING_M, 0.0),
        Point::new(half, 0.0, 0.015),
        &[0, 1, 3, 4],
    );
    standing.add(mesh, &side.t_room_side(0.0, 0.0));
}

/// A door near the right end of a side.
fn door(standing: &mut Standing, rng: &mut Rng, side: &Side) {
    let [wide, tall] = DOOR_M;
    let mut mesh = Mesh::default();
    let leaf = Surface::new(Kind::Door, tone(150, 110, 76), rng.seed())
        .with(tone(120, 86, 60))
        .sized(wide, tall);
    let (leaf, frame) = (
        mesh.surface(leaf),
        mesh.surface(Surface::new(Kind::Plain, tone(210, 204, 192), rng.seed())),
    );
    let half = 0.5 * wide;
    // Two jambs and a lintel stand out of the wall; the leaf is set back between them.
    for x in [-half - 0.07, half] {
        mesh.cuboid(frame, Point::new(x, -tall, 0.0), Point::new(x + 0.07, 0.0, 0.05), &[3, 4]);
    }
    let lintel = Point::new(-half - 0.07, -tall - 0.07, 0.0);
    mesh.cuboid(frame, lintel, lintel + Point::new(wide + 0.14, 0.07, 0.05), &[4]);
    let (u, v) = (Point::x() * wide, Point::y() * tall);
    let area = Parallelogram::new(Point::new(-half, -tall, 0.02), u, v);
    mesh.sheet(leaf, Point::z(), area, [0.0; 3]);
    standing.add(mesh, &side.t_room_side(door_at_m(side), 0.0));
}

/// Position of the door along its side, m.
fn door_at_m(side: &Side) -> f64 {
    (0.5 * side.length_m - 0.75).max(0.0)
}

/// Furniture along a side, from its left corner to its right one, or to the door.
fn furnish(standing: &mut Standing, rng: &mut Rng, side: &Side, has_door: bool) {
    let kept = if has_door { 0.6 } else { CORNER_M };
    let end = if has_door { door_at_m(side) } else { 0.5 * side.length_m } - kept;
    let mut at = CORNER_M - 0.5 * side.length_m;
    while at < end - 0.8 {
        let mut mesh = Mesh::default();
        let width = rng.pick(&furniture::ALONG_WALLS)(&mut mesh, rng);
        // What does not fit is left out: the gap stays.
        if at + width < end + 0.3 {
            standing.add(mesh, &side.t_room_side(at + 0.5 * width, BEHIND_M));
        }
        at += width + rng.between(0.1, 0.7);
        // A chair in a gap, away from the wall.
        if rng.chance(0.4) && at + 0.5 < end {
            let mut mesh = Mesh::default();
            furniture::chair(&mut mesh, rng);
            standing.add(mesh, &side.t_room_side(at + 0.25, 0.45));
            at += 0.6;
        }
    }
}

/// Pictures above the furniture.
fn pictures(standing: &mut Standing, rng: &mut Rng, side: &Side) {
    let mut at = 0.7 - 0.5 * side.length_m;
    while at < 0.5 * side.length_m - 1.6 {
        let mut mesh = Mesh::default();
        furniture::picture(&mut mesh, rng, [0.0, -1.65]);
        standing.add(mesh, &side.t_room_side(at, 0.0));
        at += rng.between(1.2, 2.2);
    }
}
