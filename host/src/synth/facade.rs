//! Houses. In a house's frame x runs along the street front from its left corner, y down from the
//! pavement, z towards the street.

use super::mesh::{Mesh, Point};
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

fn of((red, green, blue): (u8, u8, u8)) -> Tone {
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

/// What the parts of one house share.
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
    let seed = rng.seed();
    let style = rng.unit();
    let wall_tone = of(rng.pick(&WALLS));
    let brick_tone = of(rng.pick(&BRICKS));
    let wall = match style {
        s if s < 0.55 => Surface::new(Kind::Plaster, wall_tone, seed),
        s if s < 0.87 => Surface::new(Kind::Brick, brick_tone, seed)
            .with(scaled(tone(176, 168, 156), rng.between(0.6, 1.0))),
        _ => Surface::new(Kind::Stone, scaled(wall_tone, 0.75), seed).with(tone(120, 112, 102)),
    };
    let trim_tone = of(rng.pick(&TRIMS));
    let shop = width > 6.5 && rng.chance(0.3);
    let base_surface = if rng.chance(0.5) {
        Surface::new(Kind::Stone, scaled(tone(150, 144, 134), rng.between(0.7, 1.1)), seed ^ 7)
            .with(tone(96, 92, 86))
    } else {
        Surface::new(Kind::Plaster, scaled(wall_tone, 0.5), seed ^ 7)
    };
    let shutter_tone = of(rng.pick(&DOORS));
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
    let floors = [2, 3, 3, 4, 4, 5][rng.below(6)];
    let ground_height = rng.between(3.3, 3.9);
    let floor_height = rng.between(2.9, 3.3);
    let frame_tone = of(rng.pick(&FRAMES));
    if shop {
        shop_floor(mesh, rng, &house, ground_height, frame_tone);
    } else {
        home_floor(mesh, rng, &house, ground_height, frame_tone);
    }
    let mut roofline = -ground_height;
    let window = (rng.between(0.95, 1.4), rng.between(1.45, 1.9));
    let columns = libm::floor(width / rng.between(2.3, 3.1)).max(1.0) as usize;
    let balcony_mask = if rng.chance(0.45) { rng.seed() } else { 0 };
    let cornices = rng.chance(0.5);
    for floor in 1..floors {
        let bottom = roofline;
        roofline -= floor_height;
        upper_floor(
            mesh,
            rng,
            &house,
            (roofline, bottom),
            (columns, window, frame_tone),
            balcony_mask >> (floor % 2),
        );
        if cornices || floor == 1 {
            ledge(mesh, &house, bottom, 0.07, 0.16);
        }
    }
    side_and_back_walls(mesh, &house, roofline);
    roof(mesh, rng, &house, roofline, frame_tone);
    rain_pipe(mesh, rng, width, roofline, seed ^ 3);
}

fn side_and_back_walls(mesh: &mut Mesh, house: &House, roofline: f64) {
    for x in [0.0, house.width] {
        let outward = Point::new(x - 0.5 * house.width, 0.0, 0.0);
        let down = Point::new(0.0, -roofline, 0.0);
        mesh.sheet(
            house.wall,
            outward,
            Point::new(x, roofline, 0.0),
            Point::new(0.0, 0.0, -house.depth),
            down,
            [0.0, roofline, 0.0],
        );
    }
    let back = Point::new(0.0, roofline, -house.depth);
    mesh.sheet(
        house.wall,
        -Point::z(),
        back,
        Point::new(house.width, 0.0, 0.0),
        Point::new(0.0, -roofline, 0.0),
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
    mesh.bar(pipe, (Point::new(x, roofline, 0.09), 0.05), (Point::new(x, -0.05, 0.09), 0.05), 6);
    mesh.slight = false;
}

/// One floor's front: wall around the openings, then each opening with reveals, pane and sill.
fn floor_front(
    mesh: &mut Mesh,
    house: &House,
    wall: u16,
    (top, bottom): (f64, f64),
    openings: &[Opening],
) {
    let mut panel = |left: f64, right: f64, top: f64, bottom: f64| {
        if right - left > 1e-6 && bottom - top > 1e-6 {
            let (u, v) = (Point::new(right - left, 0.0, 0.0), Point::new(0.0, bottom - top, 0.0));
            mesh.sheet(wall, Point::z(), Point::new(left, top, 0.0), u, v, [left, top, 0.0]);
        }
    };
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
    let (across, down) = (Point::new(width, 0.0, 0.0), Point::new(0.0, height, 0.0));
    mesh.sheet(wall, Point::x(), Point::new(left, top, 0.0), inward, down, [left, top, 0.0]);
    mesh.sheet(wall, -Point::x(), Point::new(right, top, 0.0), inward, down, [right, top, 0.0]);
    mesh.sheet(wall, Point::y(), Point::new(left, top, 0.0), across, inward, [left, top, 0.0]);
    mesh.sheet(
        house.trim,
        -Point::y(),
        Point::new(left, bottom, 0.0),
        across,
        inward,
        [left, bottom, 0.0],
    );
    mesh.sheet(pane, Point::z(), Point::new(left, top, -house.reveal_m), across, down, [0.0; 3]);
}

fn sill_and_surround(mesh: &mut Mesh, house: &House, opening: &Opening) {
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

fn upper_floor(
    mesh: &mut Mesh,
    rng: &mut Rng,
    house: &House,
    (top, bottom): (f64, f64),
    (columns, (width, height), frame): (usize, (f64, f64), Tone),
    balconies: u32,
) {
    let spacing = house.width / columns as f64;
    let width = width.min(spacing - 0.6);
    let mut openings = Vec::new();
    for column in 0..columns {
        let middle = (column as f64 + 0.5) * spacing;
        let balcony = balconies >> (column % 16) & 5 == 5 && spacing > 2.2;
        let sill = if balcony { bottom - 0.12 } else { bottom - 0.85 };
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
            self::balcony(mesh, rng, house, middle, bottom);
        } else {
            sill_and_surround(mesh, house, &opening);
        }
    }
    floor_front(mesh, house, house.wall, (top, bottom), &openings);
}

fn balcony(mesh: &mut Mesh, rng: &mut Rng, house: &House, middle: f64, floor: f64) {
    let (half, out) = (1.05, 1.0);
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
    let top = floor - 1.1;
    if rng.chance(0.35) {
        let edges = [
            (
                Point::new(middle - half, top, out - 0.05),
                Point::new(middle + half, floor - 0.12, out),
            ),
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
            mesh.cuboid(house.wall, low, high, &[]);
        }
        return;
    }
    mesh.slight = true;
    let bars = 11;
    for k in 0..=bars {
        let x = middle - half + 0.03 + (2.0 * half - 0.06) * f64::from(k) / f64::from(bars);
        mesh.cuboid(
            rail,
            Point::new(x - 0.012, top, out - 0.04),
            Point::new(x + 0.012, floor - 0.12, out - 0.016),
            &[2, 3, 4],
        );
    }
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
    mesh.cuboid(
        rail,
        Point::new(middle - half, top - 0.05, out - 0.06),
        Point::new(middle + half, top, out),
        &[],
    );
    mesh.slight = false;
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

fn home_floor(mesh: &mut Mesh, rng: &mut Rng, house: &House, height: f64, frame: Tone) {
    let columns = libm::floor(house.width / rng.between(2.4, 3.0)).max(1.0) as usize;
    let spacing = house.width / columns as f64;
    let door_at = rng.below(columns);
    let (width, window_height) =
        ((spacing - 0.9).min(rng.between(1.0, 1.5)).max(0.7), rng.between(1.4, 1.7));
    let mut openings = Vec::new();
    for column in 0..columns {
        let middle = (column as f64 + 0.5) * spacing;
        if column == door_at {
            let (half, head) = (0.55, -2.45);
            let door = Surface::new(Kind::Door, of(rng.pick(&DOORS)), rng.seed())
                .with(frame)
                .sized(2.0 * half, 2.35);
            let pane = mesh.surface(door);
            openings.push(Opening {
                left: middle - half,
                right: middle + half,
                top: head,
                bottom: -0.1,
                pane,
            });
            let step = mesh.surface(Surface::new(Kind::Plain, tone(140, 138, 132), rng.seed()));
            mesh.cuboid(
                step,
                Point::new(middle - 0.8, -0.1, 0.0),
                Point::new(middle + 0.8, 0.1, 0.35),
                &[4],
            );
            if rng.chance(0.5) {
                mesh.cuboid(
                    house.trim,
                    Point::new(middle - 0.85, -2.75, 0.0),
                    Point::new(middle + 0.85, -2.62, 0.7),
                    &[4],
                );
            }
        } else {
            let pane = window(mesh, rng, frame, width, window_height);
            let (left, right) = (middle - 0.5 * width, middle + 0.5 * width);
            let opening = Opening { left, right, top: -1.0 - window_height, bottom: -1.0, pane };
            sill_and_surround(mesh, house, &opening);
            openings.push(opening);
        }
    }
    floor_front(mesh, house, house.wall, (-height, 0.1), &openings);
    // The plinth stands out a little; it is cut at the door.
    let door = openings[door_at];
    for (left, right) in [(0.0, door.left - 0.12), (door.right + 0.12, house.width)] {
        if right - left > 0.1 {
            mesh.cuboid(
                house.base,
                Point::new(left, -0.6, 0.0),
                Point::new(right, 0.1, 0.05),
                &[4, 3],
            );
        }
    }
}

fn shop_floor(mesh: &mut Mesh, rng: &mut Rng, house: &House, height: f64, frame: Tone) {
    let bays = libm::floor(house.width / 3.6).max(1.0) as usize;
    let spacing = house.width / bays as f64;
    let door_at = rng.below(bays);
    let head = -(height - 0.95);
    let mut openings = Vec::new();
    for bay in 0..bays {
        let (left, right) = (bay as f64 * spacing + 0.3, (bay + 1) as f64 * spacing - 0.3);
        let shop = Surface::new(Kind::Shop, tone(44, 44, 44), rng.seed()).with(frame);
        if bay == door_at {
            let split = right - 1.1;
            let pane = mesh.surface(shop.sized(split - left - 0.1, -0.5 - head));
            openings.push(Opening { left, right: split - 0.1, top: head, bottom: -0.5, pane });
            let pane = mesh
                .surface(Surface { seed: rng.seed(), ..shop }.sized(right - split, -0.06 - head));
            openings.push(Opening { left: split, right, top: head, bottom: -0.06, pane });
        } else {
            let pane = mesh.surface(shop.sized(right - left, -0.5 - head));
            openings.push(Opening { left, right, top: head, bottom: -0.5, pane });
        }
    }
    floor_front(mesh, house, house.base, (-height, 0.1), &openings);
    let letters = if rng.chance(0.6) { tone(238, 234, 220) } else { tone(236, 200, 84) };
    let sign = Surface::new(Kind::Board, of(rng.pick(&BOARDS)), rng.seed()).with(letters);
    let board = mesh.surface(sign.sized(house.width - 0.6, 0.62));
    let (low, high) =
        (Point::new(0.3, -height + 0.14, 0.0), Point::new(house.width - 0.3, -height + 0.76, 0.12));
    mesh.cuboid(house.trim, low, high, &[4, 5]);
    let (across, down) = (Point::new(high.x - low.x, 0.0, 0.0), Point::new(0.0, 0.62, 0.0));
    mesh.sheet(board, Point::z(), Point::new(low.x, low.y, 0.12), across, down, [0.0; 3]);
    if rng.chance(0.5) {
        awning(mesh, rng, house, head - 0.02);
    }
}

fn awning(mesh: &mut Mesh, rng: &mut Rng, house: &House, y: f64) {
    let mut cloth =
        Surface::new(Kind::Fence, of(rng.pick(&BOARDS)), rng.seed()).with(tone(230, 226, 216));
    cloth.two_sided = true;
    let cloth = mesh.surface(cloth);
    let (origin, across) = (Point::new(0.4, y, 0.02), Point::new(house.width - 0.8, 0.0, 0.0));
    mesh.sheet(
        cloth,
        Point::new(0.0, -1.0, 1.0),
        origin,
        across,
        Point::new(0.0, 0.5, 1.15),
        [0.0; 3],
    );
    mesh.sheet(
        cloth,
        Point::z(),
        origin + Point::new(0.0, 0.5, 1.15),
        across,
        Point::new(0.0, 0.2, 0.0),
        [0.0; 3],
    );
}

fn roof(mesh: &mut Mesh, rng: &mut Rng, house: &House, top: f64, frame: Tone) {
    ledge(mesh, house, top + 0.12, 0.18, 0.3);
    let (width, depth) = (house.width, house.depth);
    if rng.chance(0.3) {
        let parapet = rng.between(0.4, 0.9);
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
            Point::new(0.0, top, 0.0),
            Point::new(width, 0.0, 0.0),
            Point::new(0.0, 0.0, -depth),
            [0.0; 3],
        );
        return;
    }
    let tiles = mesh.surface(Surface::new(
        Kind::Tiles,
        scaled(of(rng.pick(&ROOFS)), rng.between(0.7, 1.2)),
        rng.seed(),
    ));
    let rise = 0.5 * depth * rng.between(0.6, 0.95);
    let over = 0.45;
    let slope = rise / (0.5 * depth);
    let eave = Point::new(0.0, top + over * slope, over);
    let up = Point::new(0.0, -rise - over * slope, -0.5 * depth - over);
    mesh.sheet(tiles, Point::new(0.0, -1.0, 0.5), eave, Point::new(width, 0.0, 0.0), up, [0.0; 3]);
    let eave_back = Point::new(0.0, top, -depth);
    let up_back = Point::new(0.0, -rise, 0.5 * depth);
    mesh.sheet(
        tiles,
        Point::new(0.0, -1.0, -0.5),
        eave_back,
        Point::new(width, 0.0, 0.0),
        up_back,
        [0.0; 3],
    );
    let (low, high) = (eave + Point::new(0.0, 0.0, -0.08), eave + Point::new(width, 0.1, 0.04));
    mesh.cuboid(house.trim, low, high, &[]);
    for x in [0.0, width] {
        let corner = |y: f64, z: f64| (Point::new(x, y, z), [z as f32, y as f32, 0.0]);
        let gable = [corner(top, 0.0), corner(top, -depth), corner(top - rise, -0.5 * depth)];
        mesh.polygon(house.wall, Point::new(x - 0.5 * width, 0.0, 0.0), &gable);
    }
    if rng.chance(0.7) {
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
    let dormers = if rng.chance(0.5) { libm::floor(width / 4.5) as usize } else { 0 };
    for k in 0..dormers {
        let middle = (k as f64 + 0.5) * width / dormers as f64;
        let (front, base) = (-0.5, top - 0.5 * slope);
        let head = base - 1.5;
        let pane = window(mesh, rng, frame, 0.9, 1.1);
        let (low, high) = (
            Point::new(middle - 0.65, head, front - 2.2),
            Point::new(middle + 0.65, base + 0.1, front),
        );
        mesh.cuboid(house.wall, low, high, &[3, 4]);
        let (across, down) = (Point::new(0.9, 0.0, 0.0), Point::new(0.0, 1.1, 0.0));
        mesh.sheet(
            pane,
            Point::z(),
            Point::new(middle - 0.45, head + 0.2, front + 0.02),
            across,
            down,
            [0.0; 3],
        );
        mesh.cuboid(
            tiles,
            low + Point::new(-0.12, -0.15, 0.0),
            Point::new(middle + 0.77, head, front + 0.2),
            &[],
        );
    }
}
