//! Houses. In a house's frame x runs along the street front from its left corner, y down from the
//! pavement, z towards the street.

mod balcony;
mod ground_floor;
mod roof;

use ground_floor::{home_floor, shop_floor};
use roof::roof;

use super::mesh::{BarEnd, Mesh, Parallelogram, Point};
use super::random::Rng;
use super::surface::{Kind, Surface, Tone, scaled, tone};

const WALLS: [(u8, u8, u8); 12] = [
    (226, 214, 188),
    (212, 182, 140),
    (232, 226, 214),
    (198, 160, 128),
    (206, 196, 178),
    (176, 186, 178),
    (222, 198, 150),
    (188, 150, 138),
    (206, 212, 210),
    (170, 164, 152),
    (232, 216, 168),
    (184, 176, 190),
];
const BRICKS: [(u8, u8, u8); 5] =
    [(150, 84, 66), (164, 104, 80), (132, 74, 62), (178, 138, 104), (140, 100, 84)];
const TRIMS: [(u8, u8, u8); 5] =
    [(236, 234, 228), (214, 204, 184), (150, 146, 140), (96, 92, 90), (228, 222, 206)];
const FRAMES: [(u8, u8, u8); 5] =
    [(240, 240, 238), (238, 236, 232), (92, 66, 48), (66, 72, 78), (58, 84, 70)];
const DOORS: [(u8, u8, u8); 6] =
    [(96, 44, 34), (48, 70, 60), (44, 54, 84), (84, 66, 48), (120, 116, 108), (40, 40, 42)];
const ROOFS: [(u8, u8, u8); 4] = [(136, 72, 54), (112, 66, 56), (84, 84, 90), (120, 84, 66)];
const BOARDS: [(u8, u8, u8); 6] =
    [(170, 40, 36), (36, 84, 60), (40, 56, 104), (224, 196, 90), (60, 56, 54), (212, 208, 200)];

fn tone_of(rgb: (u8, u8, u8)) -> Tone {
    let (red, green, blue) = rgb;
    tone(red, green, blue)
}

/// An opening in one floor's wall, in the house's frame, m.
#[derive(Clone, Copy)]
struct Opening {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    pane: u16,
}

/// Heights of a storey, top and bottom, in the house's frame, m.
#[derive(Clone, Copy)]
struct Storey {
    top: f64,
    bottom: f64,
}

/// Windows of the upper storeys.
struct Windows {
    /// Number in a storey.
    columns: usize,
    width: f64,
    height: f64,
    frame: Tone,
    /// Bits that say which have a balcony.
    balconies: u32,
}

/// Measures and surfaces that the parts of one house share.
struct House {
    width: f64,
    depth: f64,
    wall: u16,
    base: u16,
    trim: u16,
    reveal_m: f64,
    surrounds: bool,
    shutters: Option<u16>,
}

/// Builds a house `width` m wide with its front in the plane z = 0.
pub fn house(mesh: &mut Mesh, rng: &mut Rng, width: f64) {
    // Draws come in a fixed order: another order is another street for every seed.
    let seed = rng.seed();
    let (house, shop) = materials(mesh, rng, width, seed);
    let floors = [2, 3, 3, 4, 4, 5][rng.below(6)];
    let ground_height = rng.between(3.3, 3.9);
    let floor_height = rng.between(2.9, 3.3);
    let frame_tone = tone_of(rng.pick(&FRAMES));
    if shop {
        shop_floor(mesh, rng, &house, ground_height, frame_tone);
    } else {
        home_floor(mesh, rng, &house, ground_height, frame_tone);
    }
    // The y axis points down: higher is smaller.
    let mut roofline = -ground_height;
    let mut windows = Windows {
        width: rng.between(0.95, 1.4),
        height: rng.between(1.45, 1.9),
        columns: libm::floor(width / rng.between(2.3, 3.1)).max(1.0) as usize,
        frame: frame_tone,
        balconies: 0,
    };
    let balcony_mask = if rng.chance(0.45) { rng.seed() } else { 0 };
    let cornices = rng.chance(0.5);
    // Floors grow upwards from the ground floor.
    for floor in 1..floors {
        let bottom = roofline;
        roofline -= floor_height;
        // Balconies alternate from floor to floor, as in many houses.
        windows.balconies = balcony_mask >> (floor % 2);
        upper_floor(mesh, rng, &house, Storey { top: roofline, bottom }, &windows);
        if cornices || floor == 1 {
            ledge(mesh, &house, bottom, 0.07, 0.16);
        }
    }
    side_and_back_walls(mesh, &house, roofline);
    roof(mesh, rng, &house, roofline, frame_tone);
    rain_pipe(mesh, rng, width, roofline, seed ^ 3);
}

/// Draws a house's measures and what covers it, and whether a shop is in it.
fn materials(mesh: &mut Mesh, rng: &mut Rng, width: f64, seed: u32) -> (House, bool) {
    // Shares of plaster, brick and stone.
    let style = rng.unit();
    let wall_tone = tone_of(rng.pick(&WALLS));
    let brick_tone = tone_of(rng.pick(&BRICKS));
    let wall = match style {
        s if s < 0.55 => Surface::new(Kind::Plaster, wall_tone, seed),
        s if s < 0.87 => Surface::new(Kind::Brick, brick_tone, seed)
            .with(scaled(tone(176, 168, 156), rng.between(0.6, 1.0))),
        _ => Surface::new(Kind::Stone, scaled(wall_tone, 0.75), seed).with(tone(120, 112, 102)),
    };
    let trim_tone = tone_of(rng.pick(&TRIMS));
    // A shop needs width for its panes.
    let shop = width > 6.5 && rng.chance(0.3);
    let base_surface = if rng.chance(0.5) {
        Surface::new(Kind::Stone, scaled(tone(150, 144, 134), rng.between(0.7, 1.1)), seed ^ 7)
            .with(tone(96, 92, 86))
    } else {
        Surface::new(Kind::Plaster, scaled(wall_tone, 0.5), seed ^ 7)
    };
    let shutter_tone = tone_of(rng.pick(&DOORS));
    // Shutters belong to homes.
    let shuttered = !shop && rng.chance(0.25);
    let house = House {
        width,
        depth: rng.between(9.0, 12.0),
        wall: mesh.surface(wall),
        base: mesh.surface(base_surface),
        trim: mesh.surface(Surface::new(Kind::Plain, trim_tone, seed ^ 1)),
        reveal_m: rng.between(0.10, 0.24),
        surrounds: rng.chance(0.55),
        shutters: shuttered
            .then(|| mesh.surface(Surface::new(Kind::Fence, shutter_tone, seed ^ 2))),
    };
    (house, shop)
}

fn side_and_back_walls(mesh: &mut Mesh, house: &House, roofline: f64) {
    // The two gables' walls; their upper triangles come with the roof.
    for x in [0.0, house.width] {
        let outward = Point::new(x - 0.5 * house.width, 0.0, 0.0);
        let down = Point::new(0.0, -roofline, 0.0);
        mesh.sheet(
            house.wall,
            outward,
            Parallelogram::new(
                Point::new(x, roofline, 0.0),
                Point::new(0.0, 0.0, -house.depth),
                down,
            ),
            [0.0, roofline, 0.0],
        );
    }
    // The back, which other streets' cameras may see.
    let back = Point::new(0.0, roofline, -house.depth);
    mesh.sheet(
        house.wall,
        -Point::z(),
        Parallelogram::new(
            back,
            Point::new(house.width, 0.0, 0.0),
            Point::new(0.0, -roofline, 0.0),
        ),
        [0.0, roofline, 0.0],
    );
}

fn rain_pipe(mesh: &mut Mesh, rng: &mut Rng, width: f64, roofline: f64, seed: u32) {
    let pipe = mesh.surface(Surface::new(
        Kind::Plain,
        scaled(tone(120, 120, 118), rng.between(0.5, 1.4)),
        seed,
    ));
    let x = if rng.chance(0.5) { 0.18 } else { width - 0.18 };
    mesh.slight = true;
    mesh.bar(
        pipe,
        BarEnd::new(Point::new(x, roofline, 0.09), 0.05),
        BarEnd::new(Point::new(x, -0.05, 0.09), 0.05),
        6,
    );
    mesh.slight = false;
}

/// One floor's front: wall around the openings, then each opening with reveals, pane and sill.
fn floor_front(
    mesh: &mut Mesh,
    house: &House,
    wall: u16,
    Storey { top, bottom }: Storey,
    openings: &[Opening],
) {
    // Strips too thin to be seen would only make degenerate triangles.
    let mut panel = |left: f64, right: f64, top: f64, bottom: f64| {
        if right - left > 1e-6 && bottom - top > 1e-6 {
            let (u, v) = (Point::new(right - left, 0.0, 0.0), Point::new(0.0, bottom - top, 0.0));
            mesh.sheet(
                wall,
                Point::z(),
                Parallelogram::new(Point::new(left, top, 0.0), u, v),
                [left, top, 0.0],
            );
        }
    };
    // Openings come from left to right: wall before, above and below each, then what is left.
    let mut left = 0.0;
    for opening in openings {
        panel(left, opening.left, top, bottom);
        panel(opening.left, opening.right, top, opening.top);
        panel(opening.left, opening.right, opening.bottom, bottom);
        left = opening.right;
    }
    panel(left, house.width, top, bottom);
    for opening in openings {
        recess(mesh, house, wall, opening);
    }
}

fn recess(mesh: &mut Mesh, house: &House, wall: u16, opening: &Opening) {
    let &Opening { left, right, top, bottom, pane } = opening;
    let (width, height, inward) =
        (right - left, bottom - top, Point::new(0.0, 0.0, -house.reveal_m));
    // Left and right reveal, then lintel, sill and the pane set back.
    let (across, down) = (Point::new(width, 0.0, 0.0), Point::new(0.0, height, 0.0));
    mesh.sheet(
        wall,
        Point::x(),
        Parallelogram::new(Point::new(left, top, 0.0), inward, down),
        [left, top, 0.0],
    );
    mesh.sheet(
        wall,
        -Point::x(),
        Parallelogram::new(Point::new(right, top, 0.0), inward, down),
        [right, top, 0.0],
    );
    mesh.sheet(
        wall,
        Point::y(),
        Parallelogram::new(Point::new(left, top, 0.0), across, inward),
        [left, top, 0.0],
    );
    mesh.sheet(
        house.trim,
        -Point::y(),
        Parallelogram::new(Point::new(left, bottom, 0.0), across, inward),
        [left, bottom, 0.0],
    );
    mesh.sheet(
        pane,
        Point::z(),
        Parallelogram::new(Point::new(left, top, -house.reveal_m), across, down),
        [0.0; 3],
    );
}

fn sill_and_surround(mesh: &mut Mesh, house: &House, opening: &Opening) {
    // Small parts are left out far away, where they are less than a pixel.
    mesh.slight = true;
    let &Opening { left, right, top, bottom, .. } = opening;
    let at = |x0: f64, y0: f64, x1: f64, y1: f64, out: f64| {
        (Point::new(x0, y0, 0.0), Point::new(x1, y1, out))
    };
    let (low, high) = at(left - 0.08, bottom, right + 0.08, bottom + 0.08, 0.09);
    mesh.cuboid(house.trim, low, high, &[4]);
    if house.surrounds {
        let (low, high) = at(left - 0.14, top - 0.2, right + 0.14, top, 0.05);
        mesh.cuboid(house.trim, low, high, &[4]);
        for (a, b) in [(left - 0.14, left), (right, right + 0.14)] {
            let (low, high) = at(a, top, b, bottom, 0.04);
            mesh.cuboid(house.trim, low, high, &[4, 2, 3]);
        }
    }
    if let Some(shutter) = house.shutters {
        let half = 0.5 * (right - left);
        for (a, b) in [(left - half - 0.02, left - 0.02), (right + 0.02, right + half + 0.02)] {
            // A shutter that would hang beyond the house's edge is left out.
            if a > 0.05 && b < house.width - 0.05 {
                let (low, high) = at(a, top, b, bottom, 0.06);
                mesh.cuboid(shutter, low, high, &[4]);
            }
        }
    }
    mesh.slight = false;
}

fn window(mesh: &mut Mesh, rng: &mut Rng, frame: Tone, width: f64, height: f64) -> u16 {
    mesh.surface(
        Surface::new(Kind::Window, tone(34, 40, 46), rng.seed()).with(frame).sized(width, height),
    )
}

fn upper_floor(mesh: &mut Mesh, rng: &mut Rng, house: &House, storey: Storey, windows: &Windows) {
    let Storey { top, bottom } = storey;
    let &Windows { columns, width, height, frame, balconies } = windows;
    // Windows are spread evenly and leave at least 60 cm of wall between them.
    let spacing = house.width / columns as f64;
    let width = width.min(spacing - 0.6);
    let mut openings = Vec::new();
    for column in 0..columns {
        let middle = (column as f64 + 0.5) * spacing;
        // Balconies only where two neighbours would not touch.
        let balcony = balconies >> (column % 16) & 5 == 5 && spacing > 2.2;
        let sill = if balcony { bottom - 0.12 } else { bottom - 0.85 };
        // The head stays below the next floor.
        let head = (bottom - 0.85 - height).max(top + 0.3);
        let pane = window(mesh, rng, frame, width, sill - head);
        let opening = Opening {
            left: middle - 0.5 * width,
            right: middle + 0.5 * width,
            top: head,
            bottom: sill,
            pane,
        };
        openings.push(opening);
        if balcony {
            balcony::balcony(mesh, rng, house, middle, bottom);
        } else {
            sill_and_surround(mesh, house, &opening);
        }
    }
    floor_front(mesh, house, house.wall, storey, &openings);
}

/// A band of trim over the whole front.
fn ledge(mesh: &mut Mesh, house: &House, y: f64, out: f64, height: f64) {
    mesh.cuboid(
        house.trim,
        Point::new(0.0, y - 0.5 * height, 0.0),
        Point::new(house.width, y + 0.5 * height, out),
        &[4],
    );
}
