//! Everything near the camera at one frame.

use std::sync::Arc;

use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Vector3};

use super::config::CarKind;
use super::mesh::{Mesh, Point};
use super::segment::Segment;
use super::shadow::{GroundLight, ShadowMap, ShadowTile, SunAxes};
use super::surface::Tone;

/// Cars farther than this from the lit square's middle throw no shadow into it, m.
const SHADOWED_M: f64 = 90.0;

/// A rotation and a shift, ready for many points.
#[derive(Clone, Copy)]
pub struct MatrixPose {
    /// Rotation.
    pub rotation: Matrix3<f64>,
    /// Shift.
    pub shift: Point,
}

impl MatrixPose {
    /// Takes the motion as a matrix.
    pub fn new(motion: &Transform) -> Self {
        Self {
            rotation: Matrix3::from(motion.rotation_matrix()).transpose(),
            shift: Vector3::from(motion.translation_m),
        }
    }

    /// Moves a point.
    pub fn point(&self, point: Point) -> Point {
        self.rotation * point + self.shift
    }
}

/// Origin of a mesh.
#[derive(Clone)]
pub enum Source {
    /// Mesh `1` of a segment.
    Segment(Arc<Segment>, usize),
    /// A car body.
    Body(CarKind),
}

/// A posed mesh.
pub struct SceneObject {
    /// The mesh.
    pub source: Source,
    /// Mesh axes to the street's.
    pub rotation: Matrix3<f32>,
    /// Mesh to the left camera.
    pub to_camera: MatrixPose,
    /// Paint, for cars.
    pub coat: Tone,
    /// Instance in this frame, 0 for what is no car.
    pub instance: u8,
}

impl SceneObject {
    /// The mesh itself.
    pub fn mesh<'a>(&'a self, bodies: &'a [Mesh; 5]) -> &'a Mesh {
        match &self.source {
            Source::Segment(segment, number) => &segment.meshes[*number],
            Source::Body(kind) => &bodies[*kind as usize],
        }
    }
}

/// Objects, light and the frames of reference of one frame.
pub struct Scene {
    /// All objects within reach.
    pub objects: Vec<SceneObject>,
    /// Camera to the street's axes around the anchor.
    pub anchor_camera: MatrixPose,
    /// Sunlight.
    pub shadow: ShadowMap,
    /// Sky seen by the ground.
    pub ground: GroundLight,
}

/// Viewpoint of a scene, and its light.
pub struct StreetView<'a> {
    /// Pose of the camera in the street.
    pub t_street_camera: &'a Transform,
    /// A point of the street near the camera.
    pub anchor: Point,
    /// Axes of the sunlight.
    pub sun: SunAxes,
}

impl Scene {
    /// Poses what `segments` and `cars` hold and draws the shadows.
    pub fn new(
        bodies: &[Mesh; 5],
        segments: &[Arc<Segment>],
        cars: &[(CarKind, Tone, Transform)],
        StreetView { t_street_camera, anchor, sun }: StreetView<'_>,
    ) -> Self {
        let t_camera_street = t_street_camera.inverse();
        let object = |source, t_street_mesh: &Transform, coat, instance| {
            let rotation = MatrixPose::new(t_street_mesh).rotation.map(|value| value as f32);
            SceneObject {
                source,
                rotation,
                to_camera: MatrixPose::new(&(t_camera_street * t_street_mesh)),
                coat,
                instance,
            }
        };
        // Segments first, then cars: the number of an object is its position.
        let mut objects = Vec::new();
        for segment in segments {
            for number in 0..segment.meshes.len() {
                objects.push(object(
                    Source::Segment(Arc::clone(segment), number),
                    &segment.t_street_segment,
                    [0.5; 3],
                    0,
                ));
            }
        }
        for (number, (kind, coat, t_street_car)) in cars.iter().enumerate() {
            objects.push(object(Source::Body(*kind), t_street_car, *coat, number as u8 + 1));
        }
        // Positions in the shadow map are relative to the anchor, near the camera.
        let mut anchor_camera = MatrixPose::new(t_street_camera);
        anchor_camera.shift -= anchor;
        let ahead = anchor_camera.rotation * Vector3::z();
        let focus = anchor + anchor_camera.shift + ahead * 40.0;
        let mut shadow = ShadowMap::new(sun, anchor, focus);
        let mut ground = GroundLight::new(anchor, focus);
        // Segments bring their shadow, drawn once; cars move and are drawn in each frame.
        for segment in segments {
            shadow.lay(&segment.shadow);
        }
        for (kind, _, t_street_car) in cars {
            let pose = MatrixPose::new(t_street_car);
            if (pose.shift - focus).norm() > SHADOWED_M {
                continue;
            }
            let mesh = &bodies[*kind as usize];
            shadow.lay(&ShadowTile::new(&sun, core::iter::once((mesh, pose))));
            // Contact shadows under the cars, which the map's texels are too coarse for.
            let (low, high) = mesh.bounds_m();
            let half = [0.5 * (high.x - low.x) - 0.12, 0.5 * (high.z - low.z)];
            ground.cover(
                pose.shift - anchor,
                pose.rotation * Vector3::x(),
                pose.rotation * Vector3::z(),
                half,
            );
        }
        Self { objects, anchor_camera, shadow, ground }
    }
}
