//! The street near the camera at one frame: segments, cars and their shadows.

use std::sync::Arc;

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

use super::config::CarKind;
use super::matrix_pose::MatrixPose;
use super::mesh::{Mesh, Point};
use super::scene::{Scene, SceneObject, Sunlight};
use super::segment::Segment;
use super::shadow::{GroundLight, ShadowMap, ShadowTile, SunAxes};
use super::surface::Tone;

/// Cars farther than this from the lit square's middle throw no shadow into it, m.
const SHADOWED_M: f64 = 90.0;

/// Viewpoint of a scene, and its light.
pub struct StreetView<'a> {
    /// Pose of the camera in the street.
    pub t_street_camera: &'a Transform,
    /// A point of the street near the camera.
    pub anchor: Point,
    /// Axes of the sunlight.
    pub sun: SunAxes,
}

/// Poses what `segments` and `cars` hold and draws the shadows.
pub fn street_scene(
    bodies: &[Arc<Mesh>; 5],
    segments: &[Arc<Segment>],
    cars: &[(CarKind, Tone, Transform)],
    StreetView { t_street_camera, anchor, sun }: StreetView<'_>,
) -> Scene {
    let t_camera_street = t_street_camera.inverse();
    // Segments first, then cars: the number of an object is its position.
    let mut objects = Vec::new();
    for segment in segments {
        objects.extend(segment.meshes.iter().map(|mesh| {
            SceneObject::new(Arc::clone(mesh), &segment.t_street_segment, &t_camera_street)
        }));
    }
    for (number, (kind, coat, t_street_car)) in cars.iter().enumerate() {
        let body = Arc::clone(&bodies[*kind as usize]);
        objects.push(SceneObject {
            coat: *coat,
            instance: number as u8 + 1,
            ..SceneObject::new(body, t_street_car, &t_camera_street)
        });
    }
    // Positions in the shadow map are relative to the anchor, near the camera.
    let anchor_camera = Scene::anchored(t_street_camera, anchor);
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
        shadow.lay(&ShadowTile::new(&sun, core::iter::once((&**mesh, pose))));
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
    Scene { objects, anchor_camera, sunlight: Some(Sunlight { shadow, ground }) }
}
