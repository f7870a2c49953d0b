//! Turning both cameras of a raw rig so that their rows agree.
//!
//! Bouguet's way (described by Bradski and Kaehler, *Learning OpenCV*, 2008, chapter 12): each
//! camera turns by half of the rotation between them, then both turn alike so that the line between
//! them becomes their x axis. Each picture bends as little as the other.

use super::Lens;
use core::fmt;
use nalgebra::{Matrix3, Vector3};

/// Largest angle between the optical axes of two cameras that are worth rectifying, rad: 60
/// degrees.
pub const WIDEST_ANGLE_RAD: f64 = 1.047_197_551_196_597_6;
/// Largest entry of `R R' - 1` of what counts as a rotation: calibration files have six or seven
/// digits.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// A camera as it is: its lens and the size of its images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawCamera {
    /// The lens.
    pub lens: Lens,
    /// Width of its images, px.
    pub width: u32,
    /// Height of its images, px.
    pub height: u32,
}

/// Two cameras as they are, and the motion between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawRig {
    /// The left camera.
    pub left: RawCamera,
    /// The right camera.
    pub right: RawCamera,
    /// Rotation of left camera coordinates to right ones.
    pub r_right_left: Matrix3<f64>,
    /// The left camera's centre in right camera coordinates, m.
    pub t_right_left_m: Vector3<f64>,
}

/// Rotations that rectify a pair, raw camera coordinates to rectified ones, and the distance of the
/// cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Rotation of the left camera.
    pub r_rectified_left: Matrix3<f64>,
    /// Rotation of the right camera.
    pub r_rectified_right: Matrix3<f64>,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
}

/// Reason why a raw rig cannot be rectified.
///
/// ```
/// use dynvox_core::rectify::{
///     Lens, LensModel, RawCamera, RawRig, Rectification, RectifyProblem, Sizing,
/// };
/// use nalgebra::{Matrix3, Vector3};
///
/// let lens = Lens::new([450.0; 2], [320.0, 240.0], LensModel::IDEAL)?;
/// let camera = RawCamera { lens, width: 640, height: 480 };
/// let rig = RawRig {
///     left: camera,
///     right: camera,
///     r_right_left: Matrix3::identity(),
///     t_right_left_m: Vector3::new(0.1, 0.0, 0.0), // the right camera on the left
/// };
/// let sizing = Sizing::Automatic { max_width: 640, max_height: 480 };
/// assert_eq!(Rectification::new(&rig, sizing), Err(RectifyProblem::Exchanged));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RectifyProblem {
    /// The rotation between the cameras, or a given one, is not a rotation.
    NotARotation,
    /// The translation is not finite, or 0.
    NoBaseline,
    /// The right camera stands to the left of the left one.
    Exchanged,
    /// The cameras stand above or behind each other rather than side by side.
    NotSideBySide,
    /// The optical axes differ by more than [`WIDEST_ANGLE_RAD`].
    Diverging,
    /// There is hardly anything that both cameras see.
    NoCommonView,
    /// A raw image is narrower than 2 px or wider than 4,096 px, or its rows are as many.
    RawSize,
    /// The rectified size or focal length is not usable.
    RectifiedSize,
}

impl fmt::Display for RectifyProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotARotation => "a rotation of the calibration is not a rotation matrix",
            Self::NoBaseline => "the distance between the cameras is 0 or not a number",
            Self::Exchanged => "the right camera stands to the left of the left one",
            Self::NotSideBySide => "the cameras do not stand side by side",
            Self::Diverging => "the cameras look more than 60 degrees apart",
            Self::NoCommonView => "the cameras share hardly any field of view",
            Self::RawSize => "raw images must be 2 to 4,096 px wide and high",
            Self::RectifiedSize => "the rectified size or focal length is not usable",
        })
    }
}

impl core::error::Error for RectifyProblem {}

/// The nearest matrix with exactly orthogonal columns (one step of Newton's iteration for the polar
/// factor).
///
/// # Errors
/// [`RectifyProblem::NotARotation`] when it is too far from one.
pub(super) fn rotation(matrix: &Matrix3<f64>) -> Result<Matrix3<f64>, RectifyProblem> {
    // How far the matrix times its transpose is from the identity.
    let excess = matrix * matrix.transpose() - Matrix3::identity();
    let near = excess.iter().all(|entry| libm::fabs(*entry) <= ROTATION_TOLERANCE);
    // A mirror image has a determinant of -1.
    let upright = matrix.determinant() > 0.0;
    if near && upright {
        Ok(matrix - excess * matrix * 0.5)
    } else {
        Err(RectifyProblem::NotARotation)
    }
}

impl RawRig {
    /// Angle between the two cameras, rad.
    ///
    /// ```
    /// use dynvox_core::rectify::{Lens, LensModel, RawCamera, RawRig};
    /// use nalgebra::{Matrix3, Vector3};
    ///
    /// let lens = Lens::new([450.0; 2], [320.0, 240.0], LensModel::IDEAL)?;
    /// let camera = RawCamera { lens, width: 640, height: 480 };
    /// let rig = RawRig {
    ///     left: camera,
    ///     right: camera,
    ///     r_right_left: Matrix3::identity(),
    ///     t_right_left_m: Vector3::new(-0.1, 0.0, 0.0),
    /// };
    /// assert_eq!(rig.angle_rad(), 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn angle_rad(&self) -> f64 {
        let [sine, cosine] = sine_and_cosine(&self.r_right_left);
        libm::atan2(sine, cosine)
    }

    /// The rotations that rectify the pair.
    ///
    /// # Errors
    /// See [`RectifyProblem`].
    pub(crate) fn align(&self) -> Result<Alignment, RectifyProblem> {
        let r_right_left = rotation(&self.r_right_left)?;
        let to_right = -(r_right_left.transpose() * self.t_right_left_m);
        let baseline_m = libm::sqrt(to_right.dot(&to_right));
        if !(baseline_m.is_finite() && baseline_m > 0.0) {
            return Err(RectifyProblem::NoBaseline);
        }
        if self.angle_rad() > WIDEST_ANGLE_RAD {
            return Err(RectifyProblem::Diverging);
        }
        // Each camera turns half of the way, so that both lose equally little of their view.
        let half = half_way(&r_right_left);
        let along = half * to_right / baseline_m;
        // More aside than along: one camera stands above or ahead of the other.
        let aside = libm::sqrt(along.y * along.y + along.z * along.z);
        if libm::fabs(along.x) < aside {
            return Err(RectifyProblem::NotSideBySide);
        }
        // The right camera stands on the left: the images or the calibrations are exchanged.
        if along.x < 0.0 {
            return Err(RectifyProblem::Exchanged);
        }
        let r_rectified_left = turn_onto_x(&along) * half;
        Ok(Alignment {
            r_rectified_left,
            r_rectified_right: r_rectified_left * r_right_left.transpose(),
            baseline_m,
        })
    }
}

/// Sine and cosine of a rotation's angle.
fn sine_and_cosine(r: &Matrix3<f64>) -> [f64; 2] {
    let axis = axis_by_sine(r);
    [libm::sqrt(axis.dot(&axis)), 0.5 * (r.trace() - 1.0)]
}

/// A rotation's axis, as long as the sine of its angle.
fn axis_by_sine(r: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12) * 0.5
}

/// The rotation about the same axis by half the angle, which is below 90 degrees.
fn half_way(r: &Matrix3<f64>) -> Matrix3<f64> {
    let [sine, cosine] = sine_and_cosine(r);
    let half = 0.5 * libm::atan2(sine, cosine);
    let axis = if sine > 1e-300 { axis_by_sine(r) / sine } else { Vector3::zeros() };
    about(&axis, libm::sin(half), libm::cos(half))
}

/// The smallest rotation that carries a unit vector with positive x onto the x axis.
fn turn_onto_x(from: &Vector3<f64>) -> Matrix3<f64> {
    // The axis is the cross product of the vector with (1, 0, 0).
    let aside = libm::sqrt(from.y * from.y + from.z * from.z);
    let axis =
        if aside > 1e-300 { Vector3::new(0.0, from.z, -from.y) / aside } else { Vector3::zeros() };
    about(&axis, aside, from.x)
}

/// Rodrigues' formula; a zero axis leaves everything where it is.
fn about(axis: &Vector3<f64>, sine: f64, cosine: f64) -> Matrix3<f64> {
    let cross = axis.cross_matrix();
    Matrix3::identity() + cross * sine + cross * cross * (1.0 - cosine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rectify::LensModel;

    fn rig(r_right_left: Matrix3<f64>, t_right_left_m: Vector3<f64>) -> RawRig {
        let lens = Lens::new([500.0; 2], [320.0, 240.0], LensModel::IDEAL).unwrap();
        let camera = RawCamera { lens, width: 640, height: 480 };
        RawRig { left: camera, right: camera, r_right_left, t_right_left_m }
    }

    fn turned(x: f64, y: f64, z: f64) -> Matrix3<f64> {
        let axis = Vector3::new(x, y, z);
        let angle = axis.norm();
        about(&(axis / angle), angle.sin(), angle.cos())
    }

    #[test]
    fn rows_agree_for_a_rig_that_is_off_in_every_way() {
        let r_right_left = turned(0.03, -0.1, 0.05);
        let raw = rig(r_right_left, Vector3::new(-0.5, 0.03, -0.02));
        let aligned = raw.align().unwrap();
        // Points near and far, on both sides.
        for point in [Vector3::new(0.3, -0.4, 2.0), Vector3::new(-3.0, 1.0, 9.0)] {
            let left = aligned.r_rectified_left * point;
            let right = aligned.r_rectified_right * (r_right_left * point + raw.t_right_left_m);
            assert!((left - right - Vector3::new(aligned.baseline_m, 0.0, 0.0)).norm() < 1e-12);
        }
        // The length of the way between the cameras, in all three axes.
        assert!((aligned.baseline_m - (0.25f64 + 0.0009 + 0.0004).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn both_cameras_turn_by_the_same_angle_where_they_only_squint() {
        let raw = rig(turned(0.0, 0.1, 0.0), turned(0.0, 0.05, 0.0) * Vector3::new(-0.5, 0.0, 0.0));
        let aligned = raw.align().unwrap();
        let angle = |r: &Matrix3<f64>| (0.5 * (r.trace() - 1.0)).acos();
        assert!((angle(&aligned.r_rectified_left) - 0.05).abs() < 1e-9);
        assert!((angle(&aligned.r_rectified_right) - 0.05).abs() < 1e-9);
        assert!((raw.angle_rad() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_rectified_says_why() {
        let straight = Vector3::new(-0.5, 0.0, 0.0);
        let refused = |r, t| rig(r, t).align().unwrap_err();
        let identity = Matrix3::identity();
        // Zeros, not a number, and a mirror image.
        assert_eq!(refused(Matrix3::zeros(), straight), RectifyProblem::NotARotation);
        assert_eq!(refused(identity * f64::NAN, straight), RectifyProblem::NotARotation);
        assert_eq!(refused(-identity, straight), RectifyProblem::NotARotation);
        assert_eq!(refused(identity, Vector3::zeros()), RectifyProblem::NoBaseline);
        assert_eq!(refused(identity, Vector3::new(f64::NAN, 0.0, 0.0)), RectifyProblem::NoBaseline);
        assert_eq!(refused(identity, -straight), RectifyProblem::Exchanged);
        assert_eq!(refused(identity, Vector3::new(0.0, -0.5, 0.1)), RectifyProblem::NotSideBySide);
        assert_eq!(refused(turned(0.0, 1.2, 0.0), straight), RectifyProblem::Diverging);
    }
}
