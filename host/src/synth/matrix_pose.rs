//! A pose as a matrix, for many points.

use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Vector3};

use super::mesh::Point;

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
