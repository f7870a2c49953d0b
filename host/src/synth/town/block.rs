//! One block of a town: the ground up to the middle of the streets around it, four rows of houses
//! or a square, and what stands and parks along its kerbs.
//!
//! A block's frame has its origin in the block's middle. Each side is built as the one towards z,
//! and turned into its place.

use std::sync::Arc;

use dynvox_core::geometry::Transform;

use super::config::{TownConfig, TownTwins};
use crate::synth::config::{CarKind, StreetConfig};
use crate::synth::layout::{self, KERB_HEIGHT_M, KERB_WIDTH_M};
use crate::synth::matrix_pose::MatrixPose;
use crate::synth::mesh::{Mesh, Parallelogram, Point};
use crate::synth::random::{Rng, hash};
use crate::synth::segment::{ParkedCar, Segment, choose_car};
use crate::synth::shadow::{ShadowTile, SunAxes};
use crate::synth::surface::{Kind, Surface, tone};
use crate::synth::{facade, furniture};

/// Distance from street to street, m.
pub const PITCH_M: f64 = 64.0;

const QUARTER_RAD: f64 = 0.5 * core::f64::consts::PI;
/// Distance from a block's middle to the middle of its streets, m.
const STREET_M: f64 = 0.5 * PITCH_M;
/// Distance to its kerbs, m: the lane, half of the line and the parking strip fit between.
const KERB_M: f64 = STREET_M - layout::KERB_RIGHT_M - 0.5 * layout::LANE_M;
/// Distance to the fronts of its houses, m.
const FRONT_M: f64 = KERB_M - 3.0;
/// Depth of the deepest house, m.
const DEEPEST_M: f64 = 12.0;
/// Width of a house where all are the same, m: five fill a row.
const TWIN_M: f64 = 0.4 * FRONT_M;
/// Parking spaces of one side, and the way from its corner to the middle of the first, m.
const SPACES: (i64, f64) = (7, 9.0);
/// Length of a parking space, m.
const SPACE_M: f64 = 6.0;

/// A block by its column and row in the grid; the loop goes round those from 0 to `blocks` - 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockNumber {
    /// Column, along x.
    pub column: i32,
    /// Row, along z.
    pub row: i32,
}

impl BlockNumber {
    /// Middle of the block in the town, m.
    pub fn middle(self) -> Point {
        let at = |number: i32| (f64::from(number) + 0.5) * PITCH_M;
        Point::new(at(self.column), 0.0, at(self.row))
    }

    fn counter(self) -> i64 {
        // Numbers begin at -1, and a town has at most 18 columns.
        i64::from(self.row + 1) * 64 + i64::from(self.column + 1)
    }
}

/// All that blocks are built from.
pub struct Plan<'a> {
    /// Seed of houses, share of parked cars.
    pub street: &'a StreetConfig,
    /// Size of the loop, twins, recording.
    pub town: &'a TownConfig,
    /// Axes of the sunlight.
    pub sun: &'a SunAxes,
}

impl Plan<'_> {
    /// Builds a block.
    pub fn block(&self, number: BlockNumber) -> Segment {
        let (model, _) = self.model(number);
        let t_town_block = self.t_town_block(number);
        let mut meshes = vec![self.ground(model)];
        let square = self.is_square(model);
        for side in 0..4 {
            let mut built = Vec::new();
            if square {
                self.green(model, side, &mut built);
            } else {
                self.houses(model, side, &mut built);
            }
            self.street_furniture(model, side, &mut built);
            for mut mesh in built {
                mesh.move_by(0, &t_block_side(side));
                meshes.push(mesh.finish());
            }
        }
        // The ground, first of the meshes, shades nothing.
        let pose = MatrixPose::new(&t_town_block);
        let shadow = ShadowTile::new(self.sun, meshes.iter().skip(1).map(|mesh| (mesh, pose)));
        Segment {
            meshes: meshes.into_iter().map(Arc::new).collect(),
            t_street_segment: t_town_block,
            parked: self.parked(number),
            shadow,
        }
    }

    fn t_town_block(&self, number: BlockNumber) -> Transform {
        let (_, turned) = self.model(number);
        let yaw_rad = if turned { 2.0 * QUARTER_RAD } else { 0.0 };
        Transform::new([0.0, yaw_rad, 0.0], number.middle())
    }

    /// The block that one is built like, and true if it is turned by half a turn.
    fn model(&self, number: BlockNumber) -> (BlockNumber, bool) {
        let last = self.town.blocks as i32 - 1;
        let opposite = BlockNumber { column: last - number.column, row: last - number.row };
        let twin = self.town.twins == TownTwins::Streets && opposite.counter() < number.counter();
        if twin { (opposite, true) } else { (number, false) }
    }

    /// True for the block north of the loop that has no houses.
    fn is_square(&self, number: BlockNumber) -> bool {
        let blocks = self.town.blocks;
        let at = Rng::new(self.street.seed, 0x70_3E, 1).below(blocks as usize) as i32;
        // With twins the opposite one is built like the one further south.
        let row = if self.town.twins == TownTwins::Streets { -1 } else { blocks as i32 };
        number == BlockNumber { column: at, row }
    }

    fn rng(&self, number: BlockNumber, purpose: i64) -> Rng {
        Rng::new(self.street.seed ^ 0x70_3E, number.counter(), purpose)
    }

    /// Lawn, pavements, kerbs and half of the streets, side after side like the blades of a
    /// windmill, so that nothing lies twice.
    fn ground(&self, number: BlockNumber) -> Mesh {
        let mut mesh = Mesh::default();
        let seed = self.rng(number, 1).seed();
        let paint =
            |kind, (red, green, blue), seed| Surface::new(kind, tone(red, green, blue), seed);
        let lawn = mesh.surface(paint(Kind::Yard, (104, 112, 70), seed).with(tone(130, 122, 106)));
        let slabs =
            mesh.surface(paint(Kind::Pavement, (150, 146, 140), 5).with(tone(104, 100, 96)));
        let kerb = mesh.surface(paint(Kind::Kerb, (162, 160, 156), 9).with(tone(90, 88, 84)));
        let roads: Vec<u16> = (0..4)
            .map(|side| mesh.surface(paint(Kind::Road, (98, 98, 100), seed ^ side)))
            .collect();
        let up = -KERB_HEIGHT_M;
        let inner = FRONT_M - 0.5;
        let (x, z) = ([-inner, inner], [-inner, inner]);
        level(&mut mesh, lawn, &Area { x, z, y: up, lane_m: 0.0 });
        for (side, &road) in roads.iter().enumerate() {
            let first = mesh.vertices.len();
            // From the houses outwards: slabs, kerb stone and its face, road.
            let edge = KERB_M - KERB_WIDTH_M;
            let strip = |z: [f64; 2]| Area { x: [-z[0], z[1]], z, y: up, lane_m: 0.0 };
            level(&mut mesh, slabs, &strip([inner, edge]));
            level(&mut mesh, kerb, &strip([edge, KERB_M]));
            let face = Parallelogram::new(
                Point::new(-KERB_M, up, KERB_M),
                Point::x() * (2.0 * KERB_M),
                Point::y() * KERB_HEIGHT_M,
            );
            mesh.sheet(kerb, Point::z(), face, [0.0; 3]);
            // Markings go by the distance from the lane's middle.
            let lane_m = STREET_M - 0.5 * layout::LANE_M;
            let half = Area { x: [-KERB_M, KERB_M], z: [KERB_M, STREET_M], y: 0.0, lane_m };
            level(&mut mesh, road, &half);
            // A quarter of the crossing, in two strips of what lies between markings.
            let wide = 0.5 * (STREET_M - KERB_M);
            for from in [KERB_M, KERB_M + wide] {
                let (x, z) = ([KERB_M, STREET_M], [from, from + wide]);
                level(&mut mesh, road, &Area { x, z, y: 0.0, lane_m: from - 1.8 });
            }
            mesh.move_by(first, &t_block_side(side));
        }
        mesh.finish()
    }

    /// The row of houses of a side. Rows towards z and against it reach over the whole block,
    /// the others fill what is between.
    fn houses(&self, number: BlockNumber, side: usize, meshes: &mut Vec<Mesh>) {
        let mut rng = self.rng(number, 10 + side as i64);
        // Rows that meet at a corner must not stand in each other.
        let half_m = if side.is_multiple_of(2) { FRONT_M } else { FRONT_M - DEEPEST_M };
        if self.town.twins == TownTwins::Houses {
            let count = libm::floor(2.0 * half_m / TWIN_M + 1e-9);
            // The same random numbers give the same house.
            for house in 0..count as i32 {
                let mut mesh = Mesh::default();
                facade::house(&mut mesh, &mut Rng::new(self.street.seed, 0x70_3E, 2), TWIN_M);
                let left_m = (f64::from(house) - 0.5 * count) * TWIN_M;
                mesh.move_by(0, &on_pavement(left_m, FRONT_M, 0.0));
                meshes.push(mesh);
            }
            return;
        }
        let mut from_m = -half_m;
        while from_m < half_m - 1e-9 {
            // What would be left is too narrow for another house.
            let wide_m = rng.between(7.0, 12.5);
            let to_m = if from_m + wide_m + 7.0 > half_m { half_m } else { from_m + wide_m };
            let mut mesh = Mesh::default();
            // One plot in ten is a garden behind a hedge.
            if rng.chance(0.1) {
                furniture::hedge(&mut mesh, &mut rng, to_m - from_m - 0.2);
                mesh.move_by(0, &on_pavement(from_m + 0.1, FRONT_M - 0.4, QUARTER_RAD));
                let mut tree = Mesh::default();
                furniture::tree(&mut tree, &mut rng);
                tree.move_by(0, &on_pavement(0.5 * (from_m + to_m), FRONT_M - 4.0, 0.0));
                meshes.push(tree);
            } else {
                facade::house(&mut mesh, &mut rng, to_m - from_m);
                mesh.move_by(0, &on_pavement(from_m, FRONT_M, 0.0));
            }
            meshes.push(mesh);
            from_m = to_m;
        }
    }

    /// A quarter of the square: a hedge or a fence with a way in, trees and benches.
    fn green(&self, number: BlockNumber, side: usize, meshes: &mut Vec<Mesh>) {
        let mut rng = self.rng(number, 10 + side as i64);
        // The way in is left free.
        for from_m in [1.0 - FRONT_M, 4.0] {
            let mut mesh = Mesh::default();
            let length_m = FRONT_M - 5.0;
            if rng.chance(0.5) {
                furniture::hedge(&mut mesh, &mut rng, length_m);
            } else {
                furniture::fence(&mut mesh, &mut rng, length_m);
            }
            mesh.move_by(0, &on_pavement(from_m, FRONT_M - 0.5, QUARTER_RAD));
            meshes.push(mesh);
        }
        for tree in 0..4 {
            let mut mesh = Mesh::default();
            furniture::tree(&mut mesh, &mut rng);
            let along_m = -15.0 + 8.0 * f64::from(tree) + rng.between(-2.0, 2.0);
            mesh.move_by(0, &on_pavement(along_m, rng.between(16.0, 21.0), 0.0));
            meshes.push(mesh);
        }
        let mut mesh = Mesh::default();
        furniture::bench(&mut mesh, &mut rng);
        mesh.move_by(0, &on_pavement(rng.between(-9.0, 9.0), 14.0, QUARTER_RAD));
        meshes.push(mesh);
    }

    /// Lamps, trees, signs and what else stands at the kerb.
    fn street_furniture(&self, number: BlockNumber, side: usize, meshes: &mut Vec<Mesh>) {
        let mut rng = self.rng(number, 20 + side as i64);
        // Each has 4.8 m of kerb for itself.
        for post in 0..10 {
            let mut mesh = Mesh::default();
            let along_m = 4.8 * (f64::from(post) - 4.5) + rng.between(-1.0, 1.0);
            if post % 5 == 2 {
                furniture::lamp(&mut mesh, &mut rng);
            } else {
                match rng.below(10) {
                    0 | 1 => furniture::tree(&mut mesh, &mut rng),
                    2 | 3 => furniture::sign(&mut mesh, &mut rng),
                    4 => furniture::bin(&mut mesh, &mut rng),
                    5 => furniture::cabinet(&mut mesh, &mut rng),
                    6 => furniture::bench(&mut mesh, &mut rng),
                    7 => furniture::bollard(&mut mesh, &mut rng),
                    _ => continue,
                }
            }
            // Signs face those who come along.
            let yaw_rad = QUARTER_RAD + rng.between(-0.08, 0.08);
            mesh.move_by(0, &on_pavement(along_m, KERB_M - 0.55, yaw_rad));
            meshes.push(mesh);
        }
    }

    /// Cars that are parked around a block in this recording, by number.
    pub fn parked(&self, number: BlockNumber) -> Vec<ParkedCar> {
        let t_town_block = self.t_town_block(number);
        let mut cars = Vec::new();
        let seed = hash(self.street.seed, 0x70_3F, i64::from(self.town.recording));
        for side in 0..4 {
            for space in 0..SPACES.0 {
                let counter = (number.counter() * 4 + side as i64) * SPACES.0 + space;
                let mut rng = Rng::new(seed, counter, 0);
                if !rng.chance(self.street.parked_density) {
                    continue;
                }
                let (kind, paint) = choose_car(&mut rng);
                // A van needs its whole space.
                let play_m = if kind == CarKind::Van { 0.2 } else { 0.45 };
                let along_m =
                    SPACES.1 - KERB_M + SPACE_M * space as f64 + rng.between(-play_m, play_m);
                let across_m = KERB_M + layout::KERB_RIGHT_M - layout::parking_m(true)
                    + rng.between(-0.1, 0.1);
                let yaw_rad = QUARTER_RAD + rng.between(-0.025, 0.025);
                let t_side_car = Transform::new([0.0, yaw_rad, 0.0], [along_m, 0.0, across_m]);
                cars.push(ParkedCar {
                    id: layout::PARKED_IDS + counter as u32,
                    kind,
                    paint,
                    t_street_car: (t_town_block * t_block_side(side) * t_side_car).normalized(),
                });
            }
        }
        cars
    }
}

/// Frame of a side: x along its street, in the direction of cars that have it on their right, z out
/// of the block; the origin is the block's middle.
fn t_block_side(side: usize) -> Transform {
    Transform::new([0.0, side as f64 * QUARTER_RAD, 0.0], [0.0; 3])
}

/// Frame on the pavement of a side, turned by `yaw_rad`.
fn on_pavement(along_m: f64, across_m: f64, yaw_rad: f64) -> Transform {
    Transform::new([0.0, yaw_rad, 0.0], [along_m, -KERB_HEIGHT_M, across_m])
}

/// A level rectangle, m.
struct Area {
    x: [f64; 2],
    z: [f64; 2],
    y: f64,
    /// Position across the side at which texture begins.
    lane_m: f64,
}

fn level(mesh: &mut Mesh, surface: u16, area: &Area) {
    let &Area { x: [left, right], z: [near, far], y, lane_m } = area;
    // Texture runs along the street and, across it, towards the houses.
    let sheet = Parallelogram::new(
        Point::new(left, y, far),
        Point::x() * (right - left),
        Point::z() * (near - far),
    );
    mesh.sheet(surface, -Point::y(), sheet, [left + KERB_M, lane_m - far, y]);
}
