//! Trees, hedges, lamps, signs and what else stands on pavements. Each is built around its foot at
//! the origin, y down.

use super::mesh::{BarEnd, Mesh, Parallelogram, Point};
use super::random::Rng;
use super::surface::{Kind, Surface, scaled, tone};

const TURN: f64 = 2.0 * core::f64::consts::PI;
const GREENS: [(u8, u8, u8); 4] = [(92, 116, 52), (78, 104, 50), (110, 124, 58), (84, 110, 66)];

/// Number of different sign faces.
pub const SIGNS: u32 = 5;

fn direction(rng: &mut Rng) -> Point {
    let (y, angle) = (rng.between(-1.0, 1.0), TURN * rng.unit());
    let flat = libm::sqrt(1.0 - y * y);
    Point::new(flat * libm::cos(angle), y, flat * libm::sin(angle))
}

/// A street tree: trunk, branches, and a crown of leaf sheets around a few dark hearts.
pub fn tree(mesh: &mut Mesh, rng: &mut Rng) {
    let height = rng.between(5.0, 8.0);
    let crown = rng.between(1.5, 2.2);
    let bark = mesh.surface(Surface::new(
        Kind::Bark,
        scaled(tone(104, 90, 74), rng.between(0.7, 1.2)),
        rng.seed(),
    ));
    let lean = Point::new(rng.between(-0.2, 0.2), 0.0, rng.between(-0.2, 0.2));
    let fork = lean - Point::y() * (0.42 * height);
    let radius = rng.between(0.09, 0.17);
    mesh.bar(bark, BarEnd::new(Point::zeros(), 1.25 * radius), BarEnd::new(fork, radius), 9);
    let (red, green, blue) = rng.pick(&GREENS);
    let green = scaled(tone(red, green, blue), rng.between(0.75, 1.15));
    // Four tones of green, from the shaded side to the lit one.
    let leaves: Vec<u16> = (0..4)
        .map(|k| {
            let surface =
                Surface::new(Kind::Leaves, scaled(green, 0.72 + 0.18 * f64::from(k)), rng.seed());
            mesh.surface(Surface { two_sided: true, ..surface })
        })
        .collect();
    let middle = lean - Point::y() * (height - crown);
    // Seven boughs, each with a branch that carries it.
    for _ in 0..7 {
        let toward = direction(rng);
        let blob = middle
            + Point::new(toward.x * 0.55 * crown, toward.y * 0.5 * crown, toward.z * 0.55 * crown);
        mesh.bar(bark, BarEnd::new(fork, 0.5 * radius), BarEnd::new(blob, 0.15 * radius), 5);
        let radius = crown * rng.between(0.45, 0.65);
        crown_part(mesh, rng, &leaves, &Bough { center: blob, crown: middle, radius_m: radius });
    }
}

/// A ragged ball of leaves, m.
struct Bough {
    center: Point,
    /// Middle of the whole crown.
    crown: Point,
    radius_m: f64,
}

/// One bough: leaf sheets on a ragged ball. Their normals lean outwards, so that the crown is lit
/// as a whole.
fn crown_part(
    mesh: &mut Mesh,
    rng: &mut Rng,
    leaves: &[u16],
    &Bough { center: blob, crown: middle, radius_m: radius }: &Bough,
) {
    for _ in 0..44 {
        let out = direction(rng);
        let point = blob + out * (radius * rng.between(0.55, 1.05));
        let size = rng.between(0.18, 0.36);
        let facing = (out + direction(rng) * 0.7).normalize();
        // Two axes of the sheet, square to the way it faces.
        let u = facing.cross(&direction(rng)).normalize();
        let v = facing.cross(&u);
        // Sheets on the shaded, inner side are darker.
        let lit = (point - middle).normalize().dot(&Point::new(0.0, -1.0, 0.0));
        let shade = ((lit + 1.0) * 1.4 + rng.between(0.0, 1.2)) as usize;
        let surface = leaves[shade.min(leaves.len() - 1)];
        let shift = [rng.between(0.0, 2.0), rng.between(0.0, 2.0)];
        let corner = |a: f64, b: f64| {
            (
                point + (u * a + v * b) * size,
                [(shift[0] + a * size) as f32, (shift[1] + b * size) as f32, 0.0],
            )
        };
        let (p, q) = (rng.between(0.5, 1.0), rng.between(0.5, 1.0));
        let first = mesh.vertices.len();
        mesh.polygon(
            surface,
            facing,
            &[corner(-1.0, -0.3 * p), corner(0.1, -q), corner(1.0, 0.2), corner(-0.2 * q, p)],
        );
        // Normals of the crown as a whole, not of the sheet: a tree is not lit leaf by leaf.
        let soft = (facing * 0.35 + (point - middle).normalize() + out * 0.5).normalize();
        for vertex in &mut mesh.vertices[first..] {
            vertex.normal = [soft.x as f32, soft.y as f32, soft.z as f32];
        }
    }
}

/// A clipped hedge along z, `length` m long.
pub fn hedge(mesh: &mut Mesh, rng: &mut Rng, length: f64) {
    let (red, green, blue) = rng.pick(&GREENS);
    let leaves = mesh.surface(Surface::new(
        Kind::Leaves,
        scaled(tone(red, green, blue), rng.between(0.6, 0.9)),
        rng.seed(),
    ));
    let height = rng.between(0.9, 1.5);
    // A bend every 70 cm, so that no part of a hedge repeats another.
    let steps = libm::ceil(length / 0.7) as usize;
    let edge = |rng: &mut Rng| {
        (rng.between(-0.06, 0.06), rng.between(-0.06, 0.06), rng.between(0.32, 0.42))
    };
    let mut near = edge(rng);
    for k in 0..steps {
        let (z0, z1) = (length * k as f64 / steps as f64, length * (k + 1) as f64 / steps as f64);
        let far = edge(rng);
        for side in [-1.0, 1.0] {
            let at = |z: f64, (x, y, w): (f64, f64, f64), h: f64| {
                let point = Point::new(side * w + 0.3 * x, -(height + y) * h, z);
                (point, [z as f32, point.y as f32, 0.0])
            };
            let corners =
                [at(z0, near, 0.0), at(z1, far, 0.0), at(z1, far, 1.0), at(z0, near, 1.0)];
            mesh.polygon(leaves, Point::new(side, 0.0, 0.0), &corners);
        }
        // The top, between the two sides.
        let at = |z: f64, (x, y, w): (f64, f64, f64), side: f64| {
            let point = Point::new(side * w + 0.3 * x, -(height + y), z);
            (point, [z as f32, point.x as f32, 0.0])
        };
        mesh.polygon(
            leaves,
            -Point::y(),
            &[at(z0, near, -1.0), at(z1, far, -1.0), at(z1, far, 1.0), at(z0, near, 1.0)],
        );
        near = far;
    }
    // Both ends are closed.
    for (z, out) in [(0.0, -1.0), (length, 1.0)] {
        let (u, v) = (Point::new(0.7, 0.0, 0.0), Point::new(0.0, height, 0.0));
        mesh.sheet(
            leaves,
            Point::new(0.0, 0.0, out),
            Parallelogram::new(Point::new(-0.35, -height, z), u, v),
            [0.0; 3],
        );
    }
}

/// A lamp post whose arm reaches along -x.
pub fn lamp(mesh: &mut Mesh, rng: &mut Rng) {
    let metal = mesh.surface(Surface::new(
        Kind::Plain,
        scaled(tone(108, 114, 116), rng.between(0.5, 1.2)),
        rng.seed(),
    ));
    let glass = mesh.surface(Surface::new(Kind::Plain, tone(220, 216, 200), rng.seed()));
    // Post, bend and arm.
    let top = Point::new(0.0, -6.4, 0.0);
    mesh.bar(
        metal,
        BarEnd::new(Point::zeros(), 0.11),
        BarEnd::new(Point::new(0.0, -1.1, 0.0), 0.10),
        10,
    );
    mesh.bar(metal, BarEnd::new(Point::new(0.0, -1.1, 0.0), 0.075), BarEnd::new(top, 0.05), 10);
    let bend = Point::new(-0.5, -6.9, 0.0);
    let end = Point::new(-1.5, -7.0, 0.0);
    mesh.bar(metal, BarEnd::new(top, 0.05), BarEnd::new(bend, 0.045), 8);
    mesh.bar(metal, BarEnd::new(bend, 0.045), BarEnd::new(end, 0.04), 8);
    mesh.cuboid(
        metal,
        end + Point::new(-0.55, -0.09, -0.13),
        end + Point::new(0.1, 0.02, 0.13),
        &[],
    );
    mesh.cuboid(glass, end + Point::new(-0.5, 0.02, -0.1), end + Point::new(0.0, 0.07, 0.1), &[2]);
}

/// A traffic sign that faces -z.
pub fn sign(mesh: &mut Mesh, rng: &mut Rng) {
    let metal = mesh.surface(Surface::new(Kind::Plain, tone(150, 152, 154), rng.seed()));
    let variant = rng.below(SIGNS as usize) as u32;
    let back = mesh.surface(Surface::new(Kind::Plain, tone(128, 130, 132), rng.seed()));
    let height = rng.between(2.2, 2.6);
    mesh.bar(
        metal,
        BarEnd::new(Point::zeros(), 0.034),
        BarEnd::new(Point::new(0.0, -height - 0.3, 0.0), 0.034),
        8,
    );
    let radius = 0.36;
    let face = mesh.surface(Surface::new(Kind::Sign, tone(255, 255, 255), variant));
    // Round, triangular, square: the face's corners follow what is painted on it.
    let (corners, start_rad) = match variant {
        0 | 1 => (20, 0.0),
        2 => (3, -0.25 * TURN),
        _ => (4, 0.125 * TURN),
    };
    let middle = Point::new(0.0, -height, -0.05);
    let ring = |offset: f64, z: f64| -> Vec<(Point, [f32; 3])> {
        (0..corners)
            .map(|k| {
                let angle = start_rad + TURN * f64::from(k) / f64::from(corners);
                let (x, y) = (libm::cos(angle), libm::sin(angle));
                let point = middle + Point::new(x * (radius + offset), y * (radius + offset), z);
                (point, [x as f32, y as f32, 0.0])
            })
            .collect()
    };
    // The back is a little behind the face, so that neither covers the other.
    mesh.polygon(face, -Point::z(), &ring(0.0, 0.0));
    mesh.polygon(back, Point::z(), &ring(0.0, 0.012));
}

/// A bollard.
pub fn bollard(mesh: &mut Mesh, rng: &mut Rng) {
    let dark = mesh.surface(Surface::new(Kind::Plain, tone(62, 64, 66), rng.seed()));
    let white = mesh.surface(Surface::new(Kind::Plain, tone(224, 224, 220), rng.seed()));
    mesh.bar(
        dark,
        BarEnd::new(Point::zeros(), 0.07),
        BarEnd::new(Point::new(0.0, -0.62, 0.0), 0.06),
        10,
    );
    mesh.bar(
        white,
        BarEnd::new(Point::new(0.0, -0.62, 0.0), 0.062),
        BarEnd::new(Point::new(0.0, -0.76, 0.0), 0.062),
        10,
    );
    mesh.bar(
        dark,
        BarEnd::new(Point::new(0.0, -0.76, 0.0), 0.06),
        BarEnd::new(Point::new(0.0, -0.88, 0.0), 0.045),
        10,
    );
}

/// A litter bin on a post.
pub fn bin(mesh: &mut Mesh, rng: &mut Rng) {
    let shell = rng.pick(&[(70, 92, 70), (150, 84, 40), (80, 84, 90)]);
    let shell =
        mesh.surface(Surface::new(Kind::Fence, tone(shell.0, shell.1, shell.2), rng.seed()));
    let dark = mesh.surface(Surface::new(Kind::Plain, tone(40, 40, 42), rng.seed()));
    mesh.bar(
        dark,
        BarEnd::new(Point::zeros(), 0.05),
        BarEnd::new(Point::new(0.0, -0.4, 0.0), 0.05),
        8,
    );
    mesh.bar(
        shell,
        BarEnd::new(Point::new(0.0, -0.3, 0.0), 0.19),
        BarEnd::new(Point::new(0.0, -0.95, 0.0), 0.22),
        12,
    );
    mesh.bar(
        dark,
        BarEnd::new(Point::new(0.0, -0.95, 0.0), 0.23),
        BarEnd::new(Point::new(0.0, -1.0, 0.0), 0.10),
        12,
    );
}

/// A cabinet of the telephone company.
pub fn cabinet(mesh: &mut Mesh, rng: &mut Rng) {
    let grey = mesh.surface(
        Surface::new(Kind::Door, scaled(tone(150, 156, 148), rng.between(0.7, 1.1)), rng.seed())
            .sized(1.1, 1.2),
    );
    mesh.cuboid(grey, Point::new(-0.22, -1.25, -0.6), Point::new(0.22, 0.0, 0.6), &[3]);
}

/// A bench that looks along -x.
pub fn bench(mesh: &mut Mesh, rng: &mut Rng) {
    let wood = mesh.surface(Surface::new(Kind::Fence, tone(140, 104, 70), rng.seed()));
    let iron = mesh.surface(Surface::new(Kind::Plain, tone(50, 52, 54), rng.seed()));
    mesh.cuboid(wood, Point::new(-0.25, -0.48, -0.85), Point::new(0.2, -0.43, 0.85), &[]);
    mesh.cuboid(wood, Point::new(0.2, -0.9, -0.85), Point::new(0.25, -0.55, 0.85), &[]);
    for z in [-0.7, 0.65] {
        mesh.cuboid(iron, Point::new(-0.2, -0.43, z), Point::new(-0.14, 0.0, z + 0.06), &[]);
        mesh.cuboid(iron, Point::new(0.19, -0.9, z), Point::new(0.25, 0.0, z + 0.06), &[]);
    }
}

/// A garden wall or fence along z.
pub fn fence(mesh: &mut Mesh, rng: &mut Rng, length: f64) {
    if rng.chance(0.5) {
        let wall = Surface::new(
            Kind::Brick,
            scaled(tone(150, 110, 90), rng.between(0.7, 1.2)),
            rng.seed(),
        )
        .with(tone(150, 146, 138));
        let wall = mesh.surface(wall);
        // A wall with a cap, or boards.
        mesh.cuboid(wall, Point::new(-0.12, -1.1, 0.0), Point::new(0.12, 0.1, length), &[3, 2]);
        let cap = mesh.surface(Surface::new(Kind::Plain, tone(160, 158, 150), rng.seed()));
        mesh.cuboid(
            cap,
            Point::new(-0.16, -1.18, -0.02),
            Point::new(0.16, -1.1, length + 0.02),
            &[],
        );
    } else {
        let boards = mesh.surface(Surface::new(
            Kind::Fence,
            scaled(tone(130, 106, 80), rng.between(0.6, 1.2)),
            rng.seed(),
        ));
        mesh.cuboid(boards, Point::new(-0.03, -1.5, 0.0), Point::new(0.03, 0.05, length), &[3]);
    }
}
