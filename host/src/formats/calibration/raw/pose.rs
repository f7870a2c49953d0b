//! Rigid motions as calibration files write them.

use super::{Placement, tree::Node};
use crate::formats::FormatError;
use nalgebra::{Matrix3, Vector3};

/// A rigid motion: `x -> r x + t_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation.
    pub r: Matrix3<f64>,
    /// Translation, in the file's unit.
    pub t_m: Vector3<f64>,
}

impl Pose {
    /// Reads a matrix of 4 x 4 or 3 x 4 numbers.
    pub fn from_matrix(node: Node<'_>) -> Result<Self, FormatError> {
        let numbers = node.numbers()?;
        let rows: Vec<&[f64]> = numbers.chunks_exact(4).collect();
        let [a, b, c, rest @ ..] = rows.as_slice() else {
            return Err(short(node, numbers.len()));
        };
        if !matches!(numbers.len(), 12 | 16) || rest.iter().any(|row| **row != [0.0, 0.0, 0.0, 1.0])
        {
            return Err(short(node, numbers.len()));
        }
        let row = |row: &[f64]| [row[0], row[1], row[2]];
        Ok(Self {
            r: Matrix3::from_row_slice([row(a), row(b), row(c)].as_flattened()),
            t_m: Vector3::new(a[3], b[3], c[3]),
        })
    }

    /// Reads a rotation (matrix or vector) and a translation.
    pub fn from_parts(rotation: Node<'_>, translation: Node<'_>) -> Result<Self, FormatError> {
        Ok(Self { r: rotation_of(rotation)?, t_m: Vector3::from(translation.array::<3>()?) })
    }

    /// A quaternion x, y, z, w and a translation; `None` where its length is not 1.
    pub fn from_quaternion(quaternion: [f64; 4], t: [f64; 3]) -> Option<Self> {
        Some(Self { r: rotation(quaternion)?, t_m: Vector3::from(t) })
    }

    /// The motion back.
    pub fn inverse(&self) -> Self {
        let r = self.r.transpose();
        Self { r, t_m: -(r * self.t_m) }
    }

    /// This motion after another.
    pub fn after(&self, first: &Self) -> Self {
        Self { r: self.r * first.r, t_m: self.r * first.t_m + self.t_m }
    }

    /// Placement by the motion of left camera coordinates to right ones.
    pub fn placement(&self) -> Placement {
        Placement::Motion { r_right_left: self.r, t_right_left_m: self.t_m }
    }
}

fn short(node: Node<'_>, found: usize) -> FormatError {
    node.refuse(
        &format!("{} has {found} numbers, which are no rigid motion of 4 x 4 or 3 x 4", node.key()),
        "Copy the matrix whole; its last row is 0 0 0 1",
    )
}

/// A rotation matrix, or a rotation vector as of `cv2.Rodrigues`.
pub fn rotation_of(node: Node<'_>) -> Result<Matrix3<f64>, FormatError> {
    let numbers = node.numbers()?;
    match *numbers.as_slice() {
        [x, y, z] => Ok(about(Vector3::new(x, y, z))),
        _ => Ok(Matrix3::from_row_slice(&node.array::<9>()?)),
    }
}

/// The rotation about a vector by its length, rad (Rodrigues' formula).
pub fn about(vector: Vector3<f64>) -> Matrix3<f64> {
    let angle = vector.norm();
    let axis = if angle > 1e-300 { vector / angle } else { Vector3::zeros() };
    let cross = axis.cross_matrix();
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    Matrix3::identity() + cross * sine + cross * cross * (1.0 - cosine)
}

/// The matrix of a quaternion; `None` where its length is not 1.
fn rotation([x, y, z, w]: [f64; 4]) -> Option<Matrix3<f64>> {
    let square = x * x + y * y + z * z + w * w;
    ((square - 1.0).abs() < 1e-3).then(|| {
        let s = 2.0 / square;
        Matrix3::new(
            1.0 - s * (y * y + z * z),
            s * (x * y - z * w),
            s * (x * z + y * w),
            s * (x * y + z * w),
            1.0 - s * (x * x + z * z),
            s * (y * z - x * w),
            s * (x * z - y * w),
            s * (y * z + x * w),
            1.0 - s * (x * x + y * y),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_and_its_inverse_leave_nothing() {
        let pose =
            Pose { r: about(Vector3::new(0.1, -0.2, 0.3)), t_m: Vector3::new(1.0, 2.0, 3.0) };
        let none = pose.after(&pose.inverse());
        assert!((none.r - Matrix3::identity()).norm() < 1e-12 && none.t_m.norm() < 1e-12);
        let half = [0.0, 0.0, (0.25f64).sin(), (0.25f64).cos()];
        let turned = Pose::from_quaternion(half, [0.0; 3]).unwrap();
        assert!((turned.r - about(Vector3::new(0.0, 0.0, 0.5))).norm() < 1e-12);
    }
}
