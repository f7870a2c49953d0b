//! One segment of street, generated from the seed and its number: ground, houses, furniture, parked
//! cars.

use std::sync::Arc;

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

use super::config::{CarKind, StreetConfig};
use super::furniture;
use super::matrix_pose::MatrixPose;
use super::mesh::{Mesh, Point};
use super::path::{Centerline, SEGMENT_M};
use super::random::Rng;
use super::shadow::{ShadowTile, SunAxes};
use super::surface::{Kind, Surface, Tone, tone};
use super::{facade, layout};

/// Part of the street that is generated together and kept while the camera is near.
pub struct Segment {
    /// Static meshes, in the street's frame moved to the segment's start.
    pub meshes: Vec<Arc<Mesh>>,
    /// The segment's start: x right of, z along the street there.
    pub t_street_segment: Transform,
    /// Parked cars.
    pub parked: Vec<ParkedCar>,
    /// Shadow that its meshes cast.
    pub shadow: ShadowTile,
}

/// A parked car.
pub struct ParkedCar {
    /// Number that stays the car's for ever.
    pub id: u32,
    /// Body of the car.
    pub kind: CarKind,
    /// Paint of the car.
    pub paint: Tone,
    /// Pose of the parked car on the street.
    pub t_street_car: Transform,
}

const PAINTS: [(u8, u8, u8); 14] = [
    (212, 214, 216),
    (176, 180, 184),
    (120, 124, 130),
    (60, 62, 68),
    (34, 36, 40),
    (150, 34, 34),
    (40, 62, 112),
    (64, 96, 140),
    (228, 228, 224),
    (84, 96, 84),
    (120, 44, 52),
    (196, 186, 160),
    (92, 104, 122),
    (190, 120, 40),
];

/// A body and a paint, as one sees them on streets.
pub fn choose_car(rng: &mut Rng) -> (CarKind, Tone) {
    let kind = match rng.below(12) {
        0..=3 => CarKind::Hatchback,
        4..=5 => CarKind::Saloon,
        6..=8 => CarKind::Estate,
        9..=10 => CarKind::Offroad,
        _ => CarKind::Van,
    };
    let (red, green, blue) = rng.pick(&PAINTS);
    (kind, tone(red, green, blue))
}

/// Generates segment `number`.
pub fn segment(
    config: &StreetConfig,
    centerline: &Centerline,
    sun: &SunAxes,
    number: i64,
) -> Segment {
    let builder = Builder::new(config, centerline, number);
    let mut meshes = builder.ground();
    // Each side, and each kind of furniture, has a generator of its own: a change of one leaves the
    // others.
    for side in [Side::Left, Side::Right] {
        builder.houses(side, &mut meshes);
        builder.street_furniture(side, &mut meshes);
    }
    let pose = MatrixPose::new(&builder.t_street_segment);
    // The ground, first of the meshes, shades nothing.
    let shadow = ShadowTile::new(sun, meshes.iter().skip(1).map(|mesh| (mesh, pose)));
    Segment {
        meshes: meshes.into_iter().map(Arc::new).collect(),
        t_street_segment: builder.t_street_segment,
        parked: builder.parked(),
        shadow,
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

impl Side {
    fn sign(self) -> f64 {
        if self == Self::Left { -1.0 } else { 1.0 }
    }

    fn kerb_m(self) -> f64 {
        if self == Self::Left { layout::KERB_LEFT_M } else { layout::KERB_RIGHT_M }
    }

    fn front_m(self) -> f64 {
        if self == Self::Left { layout::FRONT_LEFT_M } else { layout::FRONT_RIGHT_M }
    }
}

/// A stretch of one side of the street, from a position along the segment to another, m.
#[derive(Clone, Copy)]
struct Plot {
    side: Side,
    from: f64,
    to: f64,
}

/// A position in the segment, and a heading there.
struct Site {
    along_m: f64,
    lateral_m: f64,
    yaw_rad: f64,
}

struct Builder<'a> {
    config: &'a StreetConfig,
    number: i64,
    start_m: f64,
    span: super::path::RoadSpan<'a>,
    t_street_segment: Transform,
}

impl<'a> Builder<'a> {
    fn new(config: &'a StreetConfig, centerline: &'a Centerline, number: i64) -> Self {
        let span = centerline.span(number, number);
        let start_m = number as f64 * SEGMENT_M;
        let t_street_segment = span.t_street_local(start_m, 0.0, 0.0);
        Self { config, number, start_m, span, t_street_segment }
    }

    fn rng(&self, purpose: i64) -> Rng {
        Rng::new(self.config.seed, self.number, purpose)
    }

    /// Frame in the segment, `along_m` from its start.
    fn local(&self, along_m: f64, lateral_m: f64, yaw_rad: f64) -> Transform {
        self.t_street_segment.inverse()
            * self.span.t_street_local(self.start_m + along_m, lateral_m, yaw_rad)
    }

    /// Strips of ground, swept along the line in steps of one metre.
    fn ground(&self) -> Vec<Mesh> {
        let mut rng = self.rng(1);
        let seed = rng.seed();
        let crossing = if layout::crossing(self.config.seed, self.number) { 1.0 } else { 0.0 };
        let mut mesh = Mesh::default();
        let road = mesh.surface(
            Surface::new(Kind::Road, tone(98, 98, 100), self.number as u32).sized(crossing, 0.0),
        );
        let slabs = mesh
            .surface(Surface::new(Kind::Pavement, tone(150, 146, 140), 5).with(tone(104, 100, 96)));
        let kerb =
            mesh.surface(Surface::new(Kind::Kerb, tone(162, 160, 156), 9).with(tone(90, 88, 84)));
        let yard = mesh
            .surface(Surface::new(Kind::Yard, tone(104, 112, 70), seed).with(tone(130, 122, 106)));
        let up = -layout::KERB_HEIGHT_M;
        let (left, right) = (layout::KERB_LEFT_M, layout::KERB_RIGHT_M);
        let (out_left, out_right) = (layout::FRONT_LEFT_M - 0.5, layout::FRONT_RIGHT_M + 0.5);
        // Strips: surface, from (lateral, y) to (lateral, y).
        let strips = [
            (yard, (out_left - 45.0, up), (out_left, up)),
            (slabs, (out_left, up), (left - layout::KERB_WIDTH_M, up)),
            (kerb, (left - layout::KERB_WIDTH_M, up), (left, up)),
            (kerb, (left, up), (left, 0.0)),
            (road, (left, 0.0), (right, 0.0)),
            (kerb, (right, 0.0), (right, up)),
            (kerb, (right, up), (right + layout::KERB_WIDTH_M, up)),
            (slabs, (right + layout::KERB_WIDTH_M, up), (out_right, up)),
            (yard, (out_right, up), (out_right + 45.0, up)),
        ];
        let steps = SEGMENT_M as usize;
        let frames: Vec<Transform> = (0..=steps).map(|k| self.local(k as f64, 0.0, 0.0)).collect();
        // Each strip in steps of one metre, so that it follows bends and hills.
        for (surface, from, to) in strips {
            for k in 0..steps {
                let corner = |k: usize, (lateral, y): (f64, f64)| {
                    let point = frames[k].transform_point(Point::new(lateral, y, 0.0));
                    (point, [k as f32, (lateral + y) as f32, y as f32])
                };
                let upright = from.0 == to.0;
                let outward = if upright {
                    frames[k].rotate(Point::new(-from.0.signum(), 0.0, 0.0))
                } else {
                    -Point::y()
                };
                mesh.polygon(
                    surface,
                    outward,
                    &[corner(k, from), corner(k, to), corner(k + 1, to), corner(k + 1, from)],
                );
            }
        }
        vec![mesh.finish()]
    }

    fn houses(&self, side: Side, meshes: &mut Vec<Mesh>) {
        let mut rng = self.rng(if side == Side::Left { 10 } else { 20 });
        // Widths of the plots of one segment.
        let cuts: &[f64] = rng.pick(&[
            &[0.0, 10.0, 24.0][..],
            &[0.0, 8.0, 15.0, 24.0],
            &[0.0, 12.0, 24.0],
            &[0.0, 14.5, 24.0],
            &[0.0, 7.0, 13.0, 24.0],
            &[0.0, 9.0, 24.0],
        ]);
        for pair in cuts.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            // One plot in seven has no house.
            if rng.chance(0.14) {
                self.garden(Plot { side, from, to }, &mut rng, meshes);
                continue;
            }
            let setback = if rng.chance(0.2) { rng.between(1.0, 2.5) } else { 0.0 };
            // A house stands on the chord between its corners, even in a bend.
            let lateral = side.front_m() + side.sign() * setback;
            let corner = |along: f64| Point::from(self.local(along, lateral, 0.0).translation_m);
            let (a, b) = if side == Side::Right {
                (corner(from), corner(to))
            } else {
                (corner(to), corner(from))
            };
            let along = b - a;
            let mut mesh = Mesh::default();
            facade::house(&mut mesh, &mut rng, along.norm());
            let mut pose = Transform::new(
                Vector3::new(0.0, libm::atan2(-along.z, along.x), 0.0),
                Vector3::zeros(),
            );
            pose.translation_m = (a - Point::y() * layout::KERB_HEIGHT_M).into();
            mesh.move_by(0, &pose);
            meshes.push(mesh.finish());
            if setback > 0.0 {
                self.edge(Plot { side, from: from + 0.1, to: to - 2.5 }, &mut rng, meshes);
            }
        }
    }

    /// An empty plot: fence or hedge at the pavement, trees and a shed behind.
    fn garden(&self, plot: Plot, rng: &mut Rng, meshes: &mut Vec<Mesh>) {
        let Plot { side, from, to } = plot;
        self.edge(Plot { side, from: from + 0.1, to: to - 0.1 }, rng, meshes);
        for _ in 0..3 {
            let mut mesh = Mesh::default();
            furniture::tree(&mut mesh, rng);
            let (along, out) = (rng.between(from + 2.0, to - 2.0), rng.between(3.0, 9.0));
            self.stand(
                mesh,
                Site {
                    along_m: along,
                    lateral_m: side.front_m() + side.sign() * out,
                    yaw_rad: 0.0,
                },
                meshes,
            );
        }
        // Behind the garden, a house that shows its side.
        let mut mesh = Mesh::default();
        facade::house(&mut mesh, rng, to - from + 4.0);
        let yaw = side.sign() * -0.25 * core::f64::consts::PI * 2.0;
        let along = if side == Side::Right { from - 2.0 } else { to + 2.0 };
        self.stand(
            mesh,
            Site { along_m: along, lateral_m: side.front_m() + side.sign() * 13.0, yaw_rad: yaw },
            meshes,
        );
    }

    fn edge(&self, plot: Plot, rng: &mut Rng, meshes: &mut Vec<Mesh>) {
        let Plot { side, from, to } = plot;
        let mut mesh = Mesh::default();
        if rng.chance(0.5) {
            furniture::hedge(&mut mesh, rng, to - from);
        } else {
            furniture::fence(&mut mesh, rng, to - from);
        }
        let lateral = side.front_m() + side.sign() * 0.35;
        // The edge follows the chord between its ends, as houses do.
        let (a, b) = (
            Point::from(self.local(from, lateral, 0.0).translation_m),
            Point::from(self.local(to, lateral, 0.0).translation_m),
        );
        let along = b - a;
        let mut pose =
            Transform::new(Vector3::new(0.0, libm::atan2(along.x, along.z), 0.0), Vector3::zeros());
        pose.translation_m = (a - Point::y() * layout::KERB_HEIGHT_M).into();
        mesh.move_by(0, &pose);
        meshes.push(mesh.finish());
    }

    /// Puts a mesh on the pavement.
    fn stand(&self, mut mesh: Mesh, site: Site, meshes: &mut Vec<Mesh>) {
        let mut pose = self.local(site.along_m, site.lateral_m, site.yaw_rad);
        pose.translation_m[1] -= layout::KERB_HEIGHT_M;
        mesh.move_by(0, &pose);
        meshes.push(mesh.finish());
    }

    fn street_furniture(&self, side: Side, meshes: &mut Vec<Mesh>) {
        let mut rng = self.rng(if side == Side::Left { 11 } else { 21 });
        let lateral = side.kerb_m() + side.sign() * 0.55;
        let facing_rad = if side == Side::Left { core::f64::consts::PI } else { 0.0 };
        let trees = if rng.chance(0.75) { rng.below(3) } else { 0 };
        for k in 0..trees {
            let mut mesh = Mesh::default();
            furniture::tree(&mut mesh, &mut rng);
            self.stand(
                mesh,
                Site {
                    along_m: 6.0 + 11.0 * k as f64 + rng.between(-1.5, 1.5),
                    lateral_m: lateral,
                    yaw_rad: rng.between(0.0, 3.0),
                },
                meshes,
            );
        }
        // Lamps alternate between the two sides.
        if (self.number + i64::from(side == Side::Left)) % 2 == 0 {
            let mut mesh = Mesh::default();
            furniture::lamp(&mut mesh, &mut rng);
            self.stand(
                mesh,
                Site { along_m: 1.2, lateral_m: lateral, yaw_rad: facing_rad },
                meshes,
            );
        }
        // Two pieces at places that trees and lamps leave free.
        for _ in 0..2 {
            let mut mesh = Mesh::default();
            let along = rng.pick(&[2.4, 3.6, 10.8, 12.6, 21.2, 22.6]) + rng.between(-0.4, 0.4);
            match rng.below(6) {
                0 | 1 => furniture::sign(&mut mesh, &mut rng),
                2 => furniture::bin(&mut mesh, &mut rng),
                3 => furniture::cabinet(&mut mesh, &mut rng),
                4 => furniture::bench(&mut mesh, &mut rng),
                _ => furniture::bollard(&mut mesh, &mut rng),
            }
            // Signs on the left face those who come from ahead.
            self.stand(
                mesh,
                Site {
                    along_m: along,
                    lateral_m: lateral,
                    yaw_rad: facing_rad + rng.between(-0.08, 0.08),
                },
                meshes,
            );
        }
        // At times a row of bollards, which matching confuses.
        if rng.chance(0.3) {
            for k in 0..6 {
                let mut mesh = Mesh::default();
                furniture::bollard(&mut mesh, &mut rng);
                self.stand(
                    mesh,
                    Site {
                        along_m: 13.4 + 1.5 * f64::from(k),
                        lateral_m: side.kerb_m() + side.sign() * 0.4,
                        yaw_rad: 0.0,
                    },
                    meshes,
                );
            }
        }
    }

    fn parked(&self) -> Vec<ParkedCar> {
        let mut cars = Vec::new();
        let cleared = layout::cleared_m(self.config);
        // Four slots a side.
        for slot in 0..8 {
            let mut rng = self.rng(100 + slot);
            let side = if slot < 4 { Side::Left } else { Side::Right };
            let occupied = rng.chance(self.config.parked_density);
            let (kind, paint) = choose_car(&mut rng);
            let play = if kind == CarKind::Van { 0.2 } else { 0.45 };
            let along = 3.0 + 6.0 * (slot % 4) as f64 + rng.between(-play, play);
            let at = self.start_m + along;
            let lateral = layout::parking_m(side == Side::Right) + rng.between(-0.1, 0.1);
            let facing_rad = if side == Side::Left { core::f64::consts::PI } else { 0.0 };
            let yaw = facing_rad + rng.between(-0.025, 0.025);
            // Scripted cars need their space.
            let blocked = cleared.iter().any(|&(right, from, to)| {
                right == (side == Side::Right) && (from..to).contains(&at)
            });
            let on_crossing = layout::crossing(self.config.seed, self.number)
                && (along - layout::CROSSING_M).abs() < 5.0;
            if occupied && !blocked && !on_crossing {
                let id = layout::PARKED_IDS
                    + (self.number.rem_euclid(10_000_000) as u32) * 8
                    + slot as u32;
                cars.push(ParkedCar {
                    id,
                    kind,
                    paint,
                    t_street_car: self.span.t_street_local(at, lateral, yaw),
                });
            }
        }
        cars
    }
}
