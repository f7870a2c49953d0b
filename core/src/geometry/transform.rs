//! Rigid motion.

use bytemuck::{Pod, Zeroable};
use core::ops::Mul;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// Largest deviation of a quaternion's squared length from 1 at which it still is a rotation: more
/// than three printed digits lose, less than any mistake makes.
const UNIT_TOLERANCE: f64 = 1e-2;
/// Angle below which the sine is its argument to the last bit, rad.
const SMALL_ANGLE_RAD: f64 = 1e-9;

/// A rigid transformation: first rotates, then moves. `t_world_camera` maps camera coordinates to
/// world coordinates.
///
/// 56 bytes without padding, so that tables, snapshots and other languages can hold it as it is.
///
/// ```
/// use dynvox_core::geometry::Transform;
///
/// let quarter_turn = Transform::new([0.0, core::f64::consts::FRAC_PI_2, 0.0], [0.0, 0.0, 1.0]);
/// let [x, _, z] = quarter_turn.transform_point([0.0, 0.0, 2.0]);
/// assert!((x - 2.0).abs() < 1e-12 && (z - 1.0).abs() < 1e-12);
/// let round_trip = quarter_turn.inverse() * quarter_turn;
/// assert!(round_trip.distance_m() < 1e-12 && round_trip.angle_rad() < 1e-7);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transform {
    /// The rotation as a unit quaternion: x, y, z, w.
    pub rotation: [f64; 4],
    /// The translation, m.
    pub translation_m: [f64; 3],
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Transform {
    /// Leaves every point where it is.
    pub const IDENTITY: Self = Self::from_translation([0.0; 3]);

    /// Moves without rotating.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let t_world_camera = Transform::from_translation([0.0, -1.5, 0.0]);
    /// assert_eq!(t_world_camera.transform_point([1.0, 2.0, 3.0]), [1.0, 0.5, 3.0]);
    /// ```
    pub const fn from_translation(translation_m: [f64; 3]) -> Self {
        Self { rotation: [0.0, 0.0, 0.0, 1.0], translation_m }
    }

    /// Rotates by a rotation vector (axis times angle, rad), then moves. Arrays and the vectors of
    /// most libraries are taken.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// // A quarter turn about y takes z to x.
    /// let turn = Transform::new([0.0, std::f64::consts::FRAC_PI_2, 0.0], [0.0; 3]);
    /// let [x, _, z]: [f64; 3] = turn.rotate([0.0, 0.0, 1.0]);
    /// assert!((x - 1.0).abs() < 1e-12 && z.abs() < 1e-12);
    /// ```
    pub fn new(rotation_rad: impl Into<[f64; 3]>, translation_m: impl Into<[f64; 3]>) -> Self {
        let [a, b, c] = rotation_rad.into();
        let angle = libm::sqrt(a * a + b * b + c * c);
        // sin(a / 2) / a has the limit 1 / 2 at 0, where it would divide 0 by 0.
        let (real, scale) = if angle > SMALL_ANGLE_RAD {
            (libm::cos(0.5 * angle), libm::sin(0.5 * angle) / angle)
        } else {
            (1.0, 0.5)
        };
        let rotation = [a * scale, b * scale, c * scale, real];
        Self { rotation, translation_m: translation_m.into() }.normalized()
    }

    /// The rotation of a matrix, given row by row, then a translation.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let rows = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    /// let turn = Transform::from_rotation_matrix(&rows, [0.0; 3]);
    /// let [x, y, _]: [f64; 3] = turn.rotate([1.0, 0.0, 0.0]);
    /// assert!(x.abs() < 1e-12 && (y - 1.0).abs() < 1e-12);
    /// ```
    pub fn from_rotation_matrix(rows: &[[f64; 3]; 3], translation_m: [f64; 3]) -> Self {
        let matrix = Rotation3::from_matrix_unchecked(Matrix3::from(*rows).transpose());
        Self {
            rotation: UnitQuaternion::from_rotation_matrix(&matrix).coords.into(),
            translation_m,
        }
    }

    /// The motion after a small step: a rotation vector, rad, and a translation, m, applied after
    /// it (a retraction of SE(3) to second order, whose derivative at 0 is that of the
    /// exponential).
    #[must_use]
    pub(crate) fn retract(&self, [a, b, c, x, y, z]: [f64; 6]) -> Self {
        (Self::new([a, b, c], [x, y, z]) * *self).normalized()
    }

    /// Rescales the quaternion to length 1: long products accumulate rounding errors.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let loose = Transform { rotation: [0.0, 0.0, 0.0, 1.001], translation_m: [0.0; 3] };
    /// assert_eq!(loose.normalized().rotation, [0.0, 0.0, 0.0, 1.0]);
    /// ```
    #[must_use]
    pub fn normalized(&self) -> Self {
        let [x, y, z, w] = self.rotation;
        let length = libm::sqrt(x * x + y * y + z * z + w * w);
        Self { rotation: [x / length, y / length, z / length, w / length], ..*self }
    }

    /// Undoes the motion.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let t_world_camera = Transform::from_translation([0.0, 0.0, 9.0]);
    /// assert_eq!(t_world_camera.inverse().transform_point([0.0, 0.0, 10.0]), [0.0, 0.0, 1.0]);
    /// ```
    #[must_use]
    pub fn inverse(&self) -> Self {
        let ([x, y, z, w], [tx, ty, tz]) = (self.rotation, self.translation_m);
        let rotation = [-x, -y, -z, w];
        Self { rotation, translation_m: rotate(rotation, [-tx, -ty, -tz]) }
    }

    /// Transforms a point, m.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let t_world_camera = Transform::from_translation([0.0, 0.0, 4.0]);
    /// let point_m: [f64; 3] = t_world_camera.transform_point([0.0, 0.0, 1.0]);
    /// assert_eq!(point_m, [0.0, 0.0, 5.0]);
    /// ```
    pub fn transform_point<P: Into<[f64; 3]> + From<[f64; 3]>>(&self, point_m: P) -> P {
        let ([x, y, z], [tx, ty, tz]) = (rotate(self.rotation, point_m.into()), self.translation_m);
        P::from([x + tx, y + ty, z + tz])
    }

    /// Rotates a direction, without the translation.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let moved = Transform::from_translation([7.0, 7.0, 7.0]);
    /// assert_eq!(moved.rotate([1.0, 0.0, 0.0]), [1.0, 0.0, 0.0], "directions do not move");
    /// ```
    pub fn rotate<V: Into<[f64; 3]> + From<[f64; 3]>>(&self, direction: V) -> V {
        V::from(rotate(self.rotation, direction.into()))
    }

    /// The rotation as a matrix, row by row.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let rows = Transform::IDENTITY.rotation_matrix();
    /// assert_eq!(rows, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    /// ```
    pub fn rotation_matrix(&self) -> [[f64; 3]; 3] {
        let [i, j, k, w] = self.rotation;
        // In nalgebra's order of operations, for its bits.
        let (ww, ii, jj, kk) = (w * w, i * i, j * j, k * k);
        let (ij, wk, wj) = (i * j * 2.0, w * k * 2.0, w * j * 2.0);
        let (ik, jk, wi) = (i * k * 2.0, j * k * 2.0, w * i * 2.0);
        [
            [ww + ii - jj - kk, ij - wk, wj + ik],
            [wk + ij, ww - ii + jj - kk, jk - wi],
            [ik - wj, wi + jk, ww - ii - jj + kk],
        ]
    }

    /// The upper three rows of the homogeneous matrix: rotation, and translation in the last
    /// column, m.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let [first, ..] = Transform::from_translation([4.0, 5.0, 6.0]).matrix_3x4(); // KITTI's first four numbers of a pose
    /// assert_eq!(first, [1.0, 0.0, 0.0, 4.0]);
    /// ```
    pub fn matrix_3x4(&self) -> [[f64; 4]; 3] {
        let ([[a, b, c], [d, e, f], [g, h, i]], [x, y, z]) =
            (self.rotation_matrix(), self.translation_m);
        [[a, b, c, x], [d, e, f, y], [g, h, i, z]]
    }

    /// Returns the distance by which the motion moves the origin, m.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// assert_eq!(Transform::from_translation([3.0, 0.0, 4.0]).distance_m(), 5.0);
    /// ```
    pub fn distance_m(&self) -> f64 {
        let [x, y, z] = self.translation_m;
        libm::sqrt(x * x + y * y + z * z)
    }

    /// The angle of the rotation, 0 to pi rad.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// let turn = Transform::new([0.0, 0.3, 0.0], [0.0; 3]);
    /// assert!((turn.angle_rad() - 0.3).abs() < 1e-12);
    /// ```
    pub fn angle_rad(&self) -> f64 {
        let [x, y, z, w] = self.rotation;
        2.0 * libm::atan2(libm::sqrt(x * x + y * y + z * z), libm::fabs(w))
    }

    /// The rotation as a vector: axis times angle, of at most half a turn, rad.
    pub(crate) fn rotation_vector(&self) -> [f64; 3] {
        let [x, y, z, w] = self.rotation;
        let sine = libm::sqrt(x * x + y * y + z * z);
        // Of a quaternion and its negative the one with the smaller angle.
        let half_angle = libm::atan2(if w < 0.0 { -sine } else { sine }, libm::fabs(w));
        // The limit is 2 at angle 0.
        let scale = if sine > 1e-12 { 2.0 * half_angle / sine } else { 2.0 };
        [x * scale, y * scale, z * scale]
    }

    /// Errors of a pose after this motion as a linear function of those before it: three rows of
    /// the rotation vector, rad, then three of the translation, m, in the axes of the frame moved
    /// to.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// // Ten metres after an error of yaw the way to the right is off by ten times as much.
    /// let ahead = Transform::from_translation([0.0, 0.0, -10.0]);
    /// assert_eq!(ahead.adjoint()[3][1], 10.0);
    /// ```
    #[inline]
    pub fn adjoint(&self) -> [[f64; 6]; 6] {
        let rotation = self.rotation_matrix();
        // An error of orientation swings the way driven since; the way starts at the camera before.
        let [x, y, z] = self.translation_m;
        let swing = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let turned: [[f64; 3]; 3] = swing.map(|row| {
            core::array::from_fn(|to| {
                row.iter().zip(rotation).map(|(factor, from)| factor * pick(&from, to)).sum()
            })
        });
        core::array::from_fn(|row| {
            core::array::from_fn(|column| match (row < 3, column < 3) {
                (true, true) => entry_of(&rotation, row, column),
                (true, false) => 0.0,
                (false, true) => entry_of(&turned, row - 3, column),
                (false, false) => entry_of(&rotation, row - 3, column - 3),
            })
        })
    }

    /// The motion of one of `parts` equal parts of a motion in which rotation and translation run
    /// side by side; 1 and more.
    #[must_use]
    pub(crate) fn part_of(&self, parts: u32) -> Self {
        let ([x, y, z, w], parts) = (self.rotation, f64::from(parts.max(1)));
        let sine = libm::sqrt(x * x + y * y + z * z);
        // Of a quaternion and its negative, which are the same rotation, the one with the smaller
        // angle.
        let half_angle = libm::atan2(if w < 0.0 { -sine } else { sine }, libm::fabs(w));
        let scale =
            if sine > SMALL_ANGLE_RAD { 2.0 * half_angle / (sine * parts) } else { 2.0 / parts };
        Self::new(
            [x * scale, y * scale, z * scale],
            self.translation_m.map(|metres| metres / parts),
        )
    }

    /// Returns true if all seven numbers are finite.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// assert!(Transform::IDENTITY.is_finite());
    /// assert!(!Transform::from_translation([f64::NAN, 0.0, 0.0]).is_finite());
    /// ```
    pub fn is_finite(&self) -> bool {
        self.rotation.iter().chain(&self.translation_m).all(|value| value.is_finite())
    }

    /// Returns true if the quaternion has length 1, up to rounding; `false` if it is not finite.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    ///
    /// assert!(Transform::IDENTITY.is_rotation());
    /// assert!(!Transform { rotation: [0.0; 4], ..Transform::IDENTITY }.is_rotation());
    /// ```
    pub fn is_rotation(&self) -> bool {
        let [x, y, z, w] = self.rotation;
        // False for NaN as well.
        libm::fabs(x * x + y * y + z * z + w * w - 1.0) < UNIT_TOLERANCE
    }

    /// The rotation, for arithmetic inside the core.
    pub(crate) fn quaternion(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::new_unchecked(Quaternion::from(self.rotation))
    }

    /// The translation, m, for arithmetic inside the core.
    pub(crate) fn translation(&self) -> Vector3<f64> {
        Vector3::from(self.translation_m)
    }
}

/// Rotates by a unit quaternion: v + 2 w (q x v) + 2 q x (q x v).
fn rotate([i, j, k, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |[x, y, z]: [f64; 3]| [j * z - k * y, k * x - i * z, i * y - j * x];
    let once = cross(v).map(|part| part * 2.0);
    let ([ax, ay, az], [bx, by, bz], [x, y, z]) = (once, cross(once), v);
    [ax * w + bx + x, ay * w + by + y, az * w + bz + z]
}

impl Mul for Transform {
    type Output = Self;

    /// First `other`, then `self`. Rounding takes a product's quaternion off length 1: see
    /// [`Transform::normalized`].
    fn mul(self, other: Self) -> Self {
        let ([a, b, c, w], [x, y, z, v]) = (self.rotation, other.rotation);
        Self {
            rotation: [
                w * x + a * v + b * z - c * y,
                w * y - a * z + b * v + c * x,
                w * z + a * y - b * x + c * v,
                w * v - a * x - b * y - c * z,
            ],
            translation_m: self.transform_point(other.translation_m),
        }
    }
}

impl Mul<&Transform> for Transform {
    type Output = Transform;

    fn mul(self, other: &Transform) -> Transform {
        self * *other
    }
}

impl Mul<Transform> for &Transform {
    type Output = Transform;

    fn mul(self, other: Transform) -> Transform {
        *self * other
    }
}

impl Mul<&Transform> for &Transform {
    type Output = Transform;

    fn mul(self, other: &Transform) -> Transform {
        *self * *other
    }
}

fn pick(row: &[f64; 3], at: usize) -> f64 {
    row.get(at).copied().unwrap_or_default()
}

fn entry_of(matrix: &[[f64; 3]; 3], row: usize, column: usize) -> f64 {
    matrix.get(row).map_or(0.0, |row| pick(row, column))
}

#[cfg(test)]
mod tests;
