//! Everything near the camera at one frame: what a renderer and a LiDAR see, of any world.

use std::sync::Arc;

use dynvox_core::geometry::Transform;
use nalgebra::Matrix3;

use super::matrix_pose::MatrixPose;
use super::mesh::{Mesh, Point};
use super::shadow::{GroundLight, ShadowMap};
use super::surface::Tone;

/// Paint of objects that have none of their own.
const NO_COAT: Tone = [0.5; 3];

/// A posed mesh.
pub struct SceneObject {
    /// The mesh.
    pub mesh: Arc<Mesh>,
    /// Mesh axes to the world's.
    pub rotation: Matrix3<f32>,
    /// Mesh to the left camera.
    pub to_camera: MatrixPose,
    /// Paint, for cars.
    pub coat: Tone,
    /// Instance in this frame, 0 for what stands for ever.
    pub instance: u8,
}

impl SceneObject {
    /// Poses a mesh before a camera; it has no paint of its own and is no instance.
    pub fn new(mesh: Arc<Mesh>, t_world_mesh: &Transform, t_camera_world: &Transform) -> Self {
        Self {
            mesh,
            rotation: MatrixPose::new(t_world_mesh).rotation.map(|value| value as f32),
            to_camera: MatrixPose::new(&(*t_camera_world * *t_world_mesh)),
            coat: NO_COAT,
            instance: 0,
        }
    }
}

/// Sunlight and skylight of a scene in the open.
pub struct Sunlight {
    /// Shadows of the sun.
    pub shadow: ShadowMap,
    /// Sky seen by the ground.
    pub ground: GroundLight,
}

/// Objects, light and the frames of reference of one frame.
pub struct Scene {
    /// All objects within reach.
    pub objects: Vec<SceneObject>,
    /// Camera to the world's axes around an anchor near it.
    pub anchor_camera: MatrixPose,
    /// Sunlight; `None` under a ceiling, where lamps throw no shadows.
    pub sunlight: Option<Sunlight>,
}

impl Scene {
    /// Camera to a world's axes around an anchor near it.
    pub fn anchored(t_world_camera: &Transform, anchor: Point) -> MatrixPose {
        let mut anchor_camera = MatrixPose::new(t_world_camera);
        anchor_camera.shift -= anchor;
        anchor_camera
    }
}
