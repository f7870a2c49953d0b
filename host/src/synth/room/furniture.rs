//! Furniture. Each piece stands on y = 0 with its back at z = 0 and its front towards +z, its
//! middle at x = 0; y points down.

use crate::synth::mesh::{BarEnd, Mesh, Parallelogram, Point};
use crate::synth::random::Rng;
use crate::synth::surface::{Indoor, Kind, Surface, scaled, tone};

const WOODS: [(u8, u8, u8); 5] =
    [(150, 108, 70), (110, 76, 50), (186, 150, 108), (208, 198, 182), (84, 62, 48)];
const CLOTHS: [(u8, u8, u8); 6] =
    [(120, 60, 54), (70, 84, 110), (150, 140, 120), (76, 96, 76), (176, 150, 96), (98, 92, 104)];

/// Builder of one piece, which returns its width, m.
pub type Fitting = fn(&mut Mesh, &mut Rng) -> f64;

/// Pieces that stand along walls.
pub const ALONG_WALLS: [Fitting; 5] = [shelf, sideboard, sofa, desk, wardrobe];

/// A wood of a random tone.
fn wood(mesh: &mut Mesh, rng: &mut Rng) -> u16 {
    let (red, green, blue) = rng.pick(&WOODS);
    let tone = scaled(tone(red, green, blue), rng.between(0.75, 1.15));
    mesh.surface(Surface::new(Kind::Indoor(Indoor::Wood), tone, rng.seed()))
}

/// A cloth of two random tones.
fn cloth(mesh: &mut Mesh, rng: &mut Rng) -> u16 {
    let mut pick = || {
        let (red, green, blue) = rng.pick(&CLOTHS);
        scaled(tone(red, green, blue), rng.between(0.7, 1.3))
    };
    let (first, second) = (pick(), pick());
    let surface = Surface::new(Kind::Indoor(Indoor::Cloth), first, rng.seed()).with(second);
    mesh.surface(surface)
}

/// A flat picture in the plane of a wall, its middle at a height; it stands out by 25 mm.
pub fn picture(mesh: &mut Mesh, rng: &mut Rng, middle_m: [f64; 2]) {
    let (wide, tall) = (rng.between(0.45, 1.1), rng.between(0.4, 0.8));
    let frame = mesh.surface(Surface::new(Kind::Plain, tone(60, 48, 40), rng.seed()));
    let painted = Surface::new(Kind::Indoor(Indoor::Picture), [0.5; 3], rng.seed())
        .with(scaled(tone(120, 96, 60), rng.between(0.3, 1.2)))
        .sized(wide, tall);
    let painted = mesh.surface(painted);
    let [x, y] = middle_m;
    let low = Point::new(x - 0.5 * wide, y - 0.5 * tall, 0.0);
    mesh.cuboid(frame, low, low + Point::new(wide, tall, 0.025), &[4, 5]);
    face(mesh, painted, low + Point::z() * 0.025, [wide, tall]);
}

/// A sheet that looks along +z, painted from its upper left corner.
fn face(mesh: &mut Mesh, surface: u16, origin: Point, [wide, tall]: [f64; 2]) {
    let (u, v) = (Point::x() * wide, Point::y() * tall);
    mesh.sheet(surface, Point::z(), Parallelogram::new(origin, u, v), [0.0; 3]);
}

/// A box on its bottom, its back at `back_m`.
fn block(mesh: &mut Mesh, surface: u16, [x, bottom, back]: [f64; 3], size: [f64; 3]) {
    let [wide, tall, deep] = size;
    let low = Point::new(x - 0.5 * wide, bottom - tall, back);
    mesh.cuboid(surface, low, low + Point::new(wide, tall, deep), &[]);
}

/// A shelf with folders.
fn shelf(mesh: &mut Mesh, rng: &mut Rng) -> f64 {
    let (wide, tall, deep) = (rng.between(0.8, 1.3), rng.between(1.7, 2.1), 0.30);
    let board = wood(mesh, rng);
    let half = 0.5 * wide;
    // Two sides and a back; the floor hides the bottom.
    for side in [-half, half - 0.02] {
        let low = Point::new(side, -tall, 0.0);
        mesh.cuboid(board, low, Point::new(side + 0.02, 0.0, deep), &[3]);
    }
    face(mesh, board, Point::new(-half, -tall, 0.01), [wide, tall]);
    let rows = libm::floor(tall / 0.34) as usize;
    for row in 0..=rows {
        let y = -(row as f64) * tall / rows as f64;
        mesh.cuboid(board, Point::new(-half, y, 0.0), Point::new(half, y + 0.02, deep), &[]);
        // A row of folders on each but the top.
        if row < rows && rng.chance(0.85) {
            // Whole folders only, so that the last one is not cut.
            let count = libm::floor((wide - 0.06) / 0.036 * rng.between(0.5, 1.0));
            let folders = Surface::new(
                Kind::Indoor(Indoor::Folders),
                scaled(tone(140, 110, 92), rng.between(0.7, 1.3)),
                rng.seed(),
            );
            let folders = mesh.surface(folders.with(tone(222, 206, 160)));
            let (length, height) = (count * 0.036, rng.between(0.2, 0.27));
            let low = Point::new(0.03 - half, y - height, 0.06);
            mesh.cuboid(board, low, low + Point::new(length, height, 0.19), &[3, 4, 5]);
            face(mesh, folders, low + Point::z() * 0.19, [length, height]);
        }
    }
    wide
}

/// A sideboard with jars on it.
fn sideboard(mesh: &mut Mesh, rng: &mut Rng) -> f64 {
    let (wide, tall, deep) = (rng.between(1.1, 1.6), rng.between(0.7, 0.95), 0.45);
    let board = wood(mesh, rng);
    block(mesh, board, [0.0, 0.0, 0.0], [wide, tall, deep]);
    // Two doors stand out, with a knob each.
    let (front, knob) = (wood(mesh, rng), wood(mesh, rng));
    for side in [-0.25, 0.25] {
        block(mesh, front, [side * wide, -0.06, deep], [0.46 * wide, tall - 0.12, 0.02]);
        let x = side * 0.25 * wide;
        block(mesh, knob, [x, -0.5 * tall, deep + 0.02], [0.03, 0.03, 0.03]);
    }
    jars(mesh, rng, wide, -tall);
    wide
}

/// A few boxes and jars in a row on a top.
fn jars(mesh: &mut Mesh, rng: &mut Rng, wide: f64, top: f64) {
    let mut x = -0.4 * wide;
    while x < 0.4 * wide {
        if rng.chance(0.5) {
            let size = [rng.between(0.08, 0.26), rng.between(0.1, 0.3), rng.between(0.08, 0.2)];
            let surface = cloth(mesh, rng);
            block(mesh, surface, [x, top, 0.1], size);
        } else {
            let jar = cloth(mesh, rng);
            let (radius, tall) = (rng.between(0.04, 0.09), rng.between(0.15, 0.35));
            let foot = Point::new(x, top, 0.2);
            let neck = BarEnd::new(foot - Point::y() * tall, 0.6 * radius);
            mesh.bar(jar, BarEnd::new(foot, radius), neck, 14);
        }
        x += rng.between(0.22, 0.45);
    }
}

/// A sofa with cushions.
fn sofa(mesh: &mut Mesh, rng: &mut Rng) -> f64 {
    let wide = rng.between(1.5, 2.0);
    let cover = cloth(mesh, rng);
    // Seat, back and two arms of one cloth; cushions of others.
    block(mesh, cover, [0.0, 0.0, 0.0], [wide, 0.42, 0.8]);
    block(mesh, cover, [0.0, -0.42, 0.0], [wide, 0.42, 0.2]);
    for side in [-0.5, 0.5] {
        block(mesh, cover, [side * (wide - 0.16), 0.0, 0.0], [0.16, 0.62, 0.8]);
    }
    for at in [-0.25, 0.22] {
        let cushion = cloth(mesh, rng);
        block(mesh, cushion, [at * wide, -0.42, 0.2], [0.42, 0.36, 0.13]);
    }
    wide
}

/// A desk with a screen and jars on it.
fn desk(mesh: &mut Mesh, rng: &mut Rng) -> f64 {
    let (wide, tall, deep) = (rng.between(1.2, 1.5), 0.74, 0.68);
    let board = wood(mesh, rng);
    block(mesh, board, [0.0, 0.03 - tall, 0.0], [wide, 0.03, deep]);
    // Legs are thin: they test depth at narrow parts.
    let leg = wood(mesh, rng);
    for x in [-0.5, 0.5] {
        for z in [0.05, deep - 0.1] {
            block(
                mesh,
                leg,
                [x * (wide - 0.1), 0.03 - tall + tall - 0.03, z],
                [0.05, tall - 0.03, 0.05],
            );
        }
    }
    // A dark case around a bright picture.
    let case = mesh.surface(Surface::new(Kind::Plain, tone(40, 42, 46), rng.seed()));
    block(mesh, case, [0.2, -tall, 0.1], [0.55, 0.42, 0.04]);
    picture_of_screen(mesh, rng, Point::new(-0.06, -tall - 0.41, 0.141));
    jars(mesh, rng, 0.6 * wide, -tall);
    wide
}

/// Image on a screen, 0.52 m wide.
fn picture_of_screen(mesh: &mut Mesh, rng: &mut Rng, origin: Point) {
    let shown = Surface::new(Kind::Indoor(Indoor::Picture), [0.5; 3], rng.seed())
        .with(tone(30, 30, 34))
        .sized(0.52, 0.36);
    let shown = mesh.surface(shown);
    face(mesh, shown, origin, [0.52, 0.36]);
}

/// A wardrobe.
fn wardrobe(mesh: &mut Mesh, rng: &mut Rng) -> f64 {
    let (wide, tall, deep) = (rng.between(0.9, 1.4), rng.between(1.9, 2.2), 0.58);
    let board = wood(mesh, rng);
    block(mesh, board, [0.0, 0.0, 0.0], [wide, tall, deep]);
    let front = wood(mesh, rng);
    for side in [-0.25, 0.25] {
        block(mesh, front, [side * wide, -0.08, deep], [0.47 * wide, tall - 0.16, 0.02]);
    }
    wide
}

/// A chair that stands free, its middle at the origin.
pub fn chair(mesh: &mut Mesh, rng: &mut Rng) {
    let board = wood(mesh, rng);
    let seat = cloth(mesh, rng);
    block(mesh, seat, [0.0, -0.43, -0.21], [0.42, 0.05, 0.42]);
    block(mesh, board, [0.0, -0.55, -0.21], [0.40, 0.36, 0.03]);
    for x in [-0.18, 0.18] {
        block(mesh, board, [x, 0.0, -0.21], [0.04, 0.91, 0.03]);
        block(mesh, board, [x, 0.0, 0.17], [0.04, 0.43, 0.04]);
    }
}

/// A low table on a rug, its middle at the origin.
pub fn table(mesh: &mut Mesh, rng: &mut Rng) {
    let board = wood(mesh, rng);
    let (wide, deep) = (rng.between(0.7, 1.0), rng.between(0.45, 0.6));
    block(mesh, board, [0.0, -0.41, -0.5 * deep], [wide, 0.04, deep]);
    for x in [-0.5, 0.5] {
        for z in [-0.5, 0.5] {
            let at = [x * (wide - 0.08), 0.0, z * (deep - 0.08) - 0.03];
            block(mesh, board, at, [0.06, 0.41, 0.06]);
        }
    }
    let folder = cloth(mesh, rng);
    block(mesh, folder, [0.1, -0.45, -0.1], [0.24, 0.03, 0.17]);
}
