//! Everything near the camera at one frame.

use std::sync::Arc;

use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Vector3};

use super::config::CarKind;
use super::mesh::{Mesh, Point};
use super::piece::Piece;
use super::shadow::{GroundLight, ShadowMap, ShadowTile, SunAxes};
use super::surface::Tone;

/// Cars farther than this from the lit square's middle throw no shadow into it, m.
const SHADOWED_M: f64 = 90.0;

/// A rotation and a shift, ready for many points.
#[derive(Clone, Copy)]
pub struct Placed {
    /// Rotation.
    pub turn: Matrix3<f64>,
    /// Shift.
    pub shift: Point,
}

impl Placed {
    /// The same motion as a matrix.
    pub fn new(motion: &Transform) -> Self {
        Self {
            turn: Matrix3::from(motion.rotation_matrix()).transpose(),
            shift: Vector3::from(motion.translation_m),
        }
    }

    /// Moves a point.
    pub fn point(&self, point: Point) -> Point {
        self.turn * point + self.shift
    }
}

/// Where a mesh comes from.
#[derive(Clone)]
pub enum Source {
    /// Thing `1` of a piece.
    Piece(Arc<Piece>, usize),
    /// A car body.
    Body(CarKind),
}

/// A mesh in its place.
pub struct Thing {
    /// The mesh.
    pub source: Source,
    /// Mesh axes to the street's.
    pub turn: Matrix3<f32>,
    /// Mesh to the left camera.
    pub to_camera: Placed,
    /// Paint, for cars.
    pub coat: Tone,
    /// Instance in this frame, 0 for what is no car.
    pub instance: u8,
}

impl Thing {
    /// The mesh itself.
    pub fn mesh<'a>(&'a self, bodies: &'a [Mesh; 5]) -> &'a Mesh {
        match &self.source {
            Source::Piece(piece, number) => &piece.things[*number],
            Source::Body(kind) => &bodies[*kind as usize],
        }
    }
}

/// Things, light and the frames of reference of one frame.
pub struct Scene {
    /// All things within reach.
    pub things: Vec<Thing>,
    /// Camera to the street's axes around the anchor.
    pub anchor_camera: Placed,
    /// Sunlight.
    pub shadow: ShadowMap,
    /// Sky seen by the ground.
    pub ground: GroundLight,
}

impl Scene {
    /// Places what `pieces` and `cars` hold and draws the shadows. `anchor` is a point of the street near the camera.
    pub fn new(
        bodies: &[Mesh; 5],
        pieces: &[Arc<Piece>],
        cars: &[(CarKind, Tone, Transform)],
        t_street_camera: &Transform,
        (anchor, sun): (Point, SunAxes),
    ) -> Self {
        let t_camera_street = t_street_camera.inverse();
        let thing = |source, t_street_mesh: &Transform, coat, instance| {
            let turn = Placed::new(t_street_mesh).turn.map(|value| value as f32);
            Thing {
                source,
                turn,
                to_camera: Placed::new(&(t_camera_street * t_street_mesh)),
                coat,
                instance,
            }
        };
        let mut things = Vec::new();
        for piece in pieces {
            for number in 0..piece.things.len() {
                things.push(thing(Source::Piece(Arc::clone(piece), number), &piece.t_street_piece, [0.5; 3], 0));
            }
        }
        for (number, (kind, coat, t_street_car)) in cars.iter().enumerate() {
            things.push(thing(Source::Body(*kind), t_street_car, *coat, number as u8 + 1));
        }
        let mut anchor_camera = Placed::new(t_street_camera);
        anchor_camera.shift -= anchor;
        let ahead = anchor_camera.turn * Vector3::z();
        let focus = anchor + anchor_camera.shift + ahead * 40.0;
        let mut shadow = ShadowMap::new(sun, anchor, focus);
        let mut ground = GroundLight::new(anchor, focus);
        for piece in pieces {
            shadow.lay(&piece.shadow);
        }
        for (kind, _, t_street_car) in cars {
            let placed = Placed::new(t_street_car);
            if (placed.shift - focus).norm() > SHADOWED_M {
                continue;
            }
            let mesh = &bodies[*kind as usize];
            shadow.lay(&ShadowTile::new(&sun, core::iter::once((mesh, placed))));
            let (low, high) = mesh.bounds_m();
            let half = (0.5 * (high.x - low.x) - 0.12, 0.5 * (high.z - low.z));
            ground.cover(placed.shift - anchor, placed.turn * Vector3::x(), placed.turn * Vector3::z(), half);
        }
        Self { things, anchor_camera, shadow, ground }
    }
}
