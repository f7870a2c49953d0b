//! Ground floors: homes and shops.

use super::{
    BOARDS, DOORS, House, Opening, Storey, floor_front, sill_and_surround, tone_of, window,
};
use crate::synth::mesh::{Mesh, Parallelogram, Point};
use crate::synth::random::Rng;
use crate::synth::surface::{Kind, Surface, Tone, tone};

/// Ground floor of a home: windows, a door, a plinth.
pub fn home_floor(mesh: &mut Mesh, rng: &mut Rng, house: &House, height: f64, frame: Tone) {
    let columns = libm::floor(house.width / rng.between(2.4, 3.0)).max(1.0) as usize;
    let spacing = house.width / columns as f64;
    // One of the columns is the door's.
    let door_at = rng.below(columns);
    let (width, window_height) =
        ((spacing - 0.9).min(rng.between(1.0, 1.5)).max(0.7), rng.between(1.4, 1.7));
    let mut openings = Vec::new();
    for column in 0..columns {
        let middle = (column as f64 + 0.5) * spacing;
        // A door, its step, and in half of the houses a canopy.
        if column == door_at {
            let (half, head) = (0.55, -2.45);
            let door = Surface::new(Kind::Door, tone_of(rng.pick(&DOORS)), rng.seed())
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
    // The wall is cut at the door and the windows.
    floor_front(mesh, house, house.wall, Storey { top: -height, bottom: 0.1 }, &openings);
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

/// Ground floor of a shop: panes, a door, a sign, at times an awning.
pub fn shop_floor(mesh: &mut Mesh, rng: &mut Rng, house: &House, height: f64, frame: Tone) {
    let bays = libm::floor(house.width / 3.6).max(1.0) as usize;
    let spacing = house.width / bays as f64;
    let door_at = rng.below(bays);
    let head = -(height - 0.95);
    let mut openings = Vec::new();
    for bay in 0..bays {
        let (left, right) = (bay as f64 * spacing + 0.3, (bay + 1) as f64 * spacing - 0.3);
        let shop = Surface::new(Kind::Shop, tone(44, 44, 44), rng.seed()).with(frame);
        // The door is the right part of its bay.
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
    floor_front(mesh, house, house.base, Storey { top: -height, bottom: 0.1 }, &openings);
    // The sign above the panes, with letters painted on.
    let letters = if rng.chance(0.6) { tone(238, 234, 220) } else { tone(236, 200, 84) };
    let sign = Surface::new(Kind::Board, tone_of(rng.pick(&BOARDS)), rng.seed()).with(letters);
    let board = mesh.surface(sign.sized(house.width - 0.6, 0.62));
    let (low, high) =
        (Point::new(0.3, -height + 0.14, 0.0), Point::new(house.width - 0.3, -height + 0.76, 0.12));
    mesh.cuboid(house.trim, low, high, &[4, 5]);
    let (across, down) = (Point::new(high.x - low.x, 0.0, 0.0), Point::new(0.0, 0.62, 0.0));
    mesh.sheet(
        board,
        Point::z(),
        Parallelogram::new(Point::new(low.x, low.y, 0.12), across, down),
        [0.0; 3],
    );
    if rng.chance(0.5) {
        awning(mesh, rng, house, head - 0.02);
    }
}

fn awning(mesh: &mut Mesh, rng: &mut Rng, house: &House, y: f64) {
    let mut cloth =
        // Cloth is thin and seen from both sides.
        Surface::new(Kind::Fence, tone_of(rng.pick(&BOARDS)), rng.seed()).with(tone(230, 226, 216));
    cloth.two_sided = true;
    let cloth = mesh.surface(cloth);
    let (origin, across) = (Point::new(0.4, y, 0.02), Point::new(house.width - 0.8, 0.0, 0.0));
    mesh.sheet(
        cloth,
        Point::new(0.0, -1.0, 1.0),
        Parallelogram::new(origin, across, Point::new(0.0, 0.5, 1.15)),
        [0.0; 3],
    );
    mesh.sheet(
        cloth,
        Point::z(),
        Parallelogram::new(origin + Point::new(0.0, 0.5, 1.15), across, Point::new(0.0, 0.2, 0.0)),
        [0.0; 3],
    );
}
