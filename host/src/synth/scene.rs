//! Everything near the camera at one frame.

use std::sync::Arc;

use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Vector3};

use super::config::CarKind;
use super::mesh::{Mesh, Point};
use super::piece::Piece;
use super::shadow::{GroundLight, ShadowMap};
use super::surface::Tone;

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
        Self { turn: motion.rotation.to_rotation_matrix().into_inner(), shift: motion.translation.vector }
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
    /// Mesh to the street's axes around the anchor.
    pub to_anchor: Placed,
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
        (anchor, to_sun): (Point, Point),
    ) -> Self {
        let t_camera_street = t_street_camera.inverse();
        let thing = |source, t_street_mesh: &Transform, coat, instance| {
            let mut to_anchor = Placed::new(t_street_mesh);
            to_anchor.shift -= anchor;
            Thing { source, to_anchor, to_camera: Placed::new(&(t_camera_street * t_street_mesh)), coat, instance }
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
        let mut shadow = ShadowMap::new(to_sun, anchor, focus);
        let mut ground = GroundLight::new(anchor, focus);
        for thing in &things {
            let mesh = thing.mesh(bodies);
            if !shadow.may_see(thing.to_anchor.point(mesh.middle_m), mesh.radius_m) {
                continue;
            }
            let places: Vec<Point> = mesh.vertices.iter().map(|vertex| thing.to_anchor.point(vertex.place_m)).collect();
            for triangle in &mesh.triangles {
                shadow.draw(triangle.corners.map(|corner| places[corner as usize]));
            }
            if thing.instance > 0 {
                let (low, high) = mesh.bounds_m();
                let half = (0.5 * (high.x - low.x) - 0.12, 0.5 * (high.z - low.z));
                ground.cover(thing.to_anchor.shift, thing.to_anchor.turn * Vector3::x(), thing.to_anchor.turn * Vector3::z(), half);
            }
        }
        Self { things, anchor_camera, shadow, ground }
    }
}
