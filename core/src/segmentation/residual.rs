//! Residual of a match: its distance from where a static point would be, in sigmas.
//!
//! A point triangulated in the previous frame is moved by the camera's motion and projected: the
//! prediction `p` of (u, v, disparity). The residual `r` has the covariance
//!
//! `C = S + J S J' + A Q A' + w w'`
//!
//! where S is that of a match in one frame, J the derivative of p by the match before, A that of
//! the projection by the point, Q what the camera's motion errs by at the point (translation and
//! rotation), and w what a disparity error common to both frames (offset and lens) does to r.
//! `r' C^-1 r` is chi-square distributed with 3 degrees of freedom for static points.

use super::SegmentationConfig;
use crate::{
    geometry::{StereoRig, Transform},
    scene_flow::Match,
};
use nalgebra::{Cholesky, Matrix3, Vector3};

/// Error of a match coordinate, one sigma, px.
const NOISE_PX: f32 = 0.35;
/// Error of a disparity, one sigma, px.
const DISPARITY_NOISE_PX: f32 = 0.45;
/// Error of the camera's translation in a frame, one sigma, m.
const CAMERA_M: f32 = 0.02;
/// Error of the camera's rotation in a frame, one sigma, rad.
const CAMERA_RAD: f32 = 0.0005;
/// Squared Mahalanobis distance from the static prediction beyond which a match is a candidate:
/// chi-square, 3 degrees of freedom, 0.1 %.
pub(super) const CANDIDATE_CHI_SQUARE: f32 = 16.27;
/// Smallest disparity a point is triangulated from, px.
const DISPARITY_MIN_PX: f64 = 1.0;
/// Nearest depth a point is predicted at, m.
const DEPTH_MIN_M: f64 = 1.0;

/// Camera, rig and settings with which residuals are computed in a frame.
pub(super) struct StaticModel<'a> {
    pub config: &'a SegmentationConfig,
    pub rig: &'a StereoRig,
    /// Disparity errors common to both frames, px: the offset and, at the image's left and right
    /// edge, the lens.
    pub bias_px: [f64; 2],
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    /// Variances of u, v and disparity.
    noise: Vector3<f64>,
}

/// A match whose point is known in both frames.
#[derive(Clone, Copy)]
pub(super) struct Residual {
    /// Squared Mahalanobis distance from the static prediction; an upper bound of it where the
    /// bound suffices.
    pub chi_square: f64,
    /// Difference from the prediction: u, v and disparity, px.
    pub residual_px: Vector3<f64>,
    /// Position of the point in the current camera, m.
    pub point_m: Vector3<f64>,
    /// Motion of the point relative to the static prediction, m.
    pub motion_m: Vector3<f64>,
    /// Error of that along the depth, one sigma, m.
    pub depth_sigma_m: f64,
}

impl<'a> StaticModel<'a> {
    pub fn new(
        config: &'a SegmentationConfig,
        rig: &'a StereoRig,
        t_current_previous: &Transform,
        bias_px: [f64; 2],
    ) -> Self {
        // Variances, px².
        let square = |sigma: f32| f64::from(sigma) * f64::from(sigma);
        Self {
            config,
            rig,
            bias_px,
            rotation: t_current_previous.quaternion().to_rotation_matrix().into_inner(),
            translation: t_current_previous.translation(),
            noise: Vector3::new(square(NOISE_PX), square(NOISE_PX), square(DISPARITY_NOISE_PX)),
        }
    }

    /// A match from the centre of the image: u, v and disparity, px.
    fn centered(&self, left: [f32; 2], right: [f32; 2]) -> Option<Vector3<f64>> {
        let disparity = f64::from(left[0]) - f64::from(right[0]);
        let at = Vector3::new(
            f64::from(left[0]) - self.rig.center_u_px,
            f64::from(left[1]) - self.rig.center_v_px,
            disparity,
        );
        // False for NaN as well.
        (disparity >= DISPARITY_MIN_PX && at.x.is_finite() && at.y.is_finite()).then_some(at)
    }

    /// The point of a match, m.
    fn point(&self, at: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(at.x, at.y, self.rig.focal_px) * (self.rig.baseline_m / at.z)
    }

    /// Returns the current position of a match's point, m.
    pub fn current_point(&self, m: &Match) -> Option<Vector3<f64>> {
        Some(self.point(&self.centered(m.current_left, m.current_right)?))
    }

    /// The residual of a match; `None` where it cannot be triangulated.
    pub fn residual(&self, m: &Match) -> Option<Residual> {
        let before = self.centered(m.previous_left, m.previous_right)?;
        let now = self.centered(m.current_left, m.current_right)?;
        let previous = self.point(&before);
        let predicted = self.predicted(&previous)?;
        // The prediction in left column, row and disparity, as the match is measured.
        let per_m = self.rig.focal_px / predicted.z;
        let projected =
            Vector3::new(predicted.x * per_m, predicted.y * per_m, self.rig.baseline_m * per_m);
        let r = now - projected;
        let point_m = self.point(&now);
        // The other terms only add to the covariance: what lies within these bounds needs no more.
        let bound = r.component_div(&self.noise).dot(&r);
        let (chi_square, depth_variance) = if bound > f64::from(CANDIDATE_CHI_SQUARE) {
            let [own, shared] = self.covariance(&before, &previous, &predicted);
            let covariance = own + shared;
            let solved = Cholesky::new(covariance).map(|factor| factor.solve(&r))?;
            (r.dot(&solved), covariance.m33)
        } else {
            (bound, self.noise.z)
        };
        let depth_sigma_m = libm::sqrt(depth_variance) * point_m.z / now.z;
        Some(Residual {
            chi_square,
            residual_px: r,
            point_m,
            motion_m: point_m - predicted,
            depth_sigma_m,
        })
    }

    /// The residual of a match, and the part of its covariance that it shares with the matches
    /// beside it: what the camera's motion and both disparities err by.
    pub fn residual_and_shared(&self, m: &Match) -> Option<(Residual, Matrix3<f64>)> {
        let before = self.centered(m.previous_left, m.previous_right)?;
        let previous = self.point(&before);
        let [_, shared] = self.covariance(&before, &previous, &self.predicted(&previous)?);
        Some((self.residual(m)?, shared))
    }

    /// Predicts the current position of a point of the frame before, if it is in front of the
    /// camera.
    fn predicted(&self, previous: &Vector3<f64>) -> Option<Vector3<f64>> {
        let predicted = self.rotation * previous + self.translation;
        (predicted.z > DEPTH_MIN_M).then_some(predicted)
    }

    /// The covariance of a residual: the match's own part, and the part shared with the matches
    /// beside it.
    fn covariance(
        &self,
        before: &Vector3<f64>,
        previous: &Vector3<f64>,
        predicted: &Vector3<f64>,
    ) -> [Matrix3<f64>; 2] {
        let (focal, per_px) = (self.rig.focal_px, self.rig.baseline_m / before.z);
        let by_match = Matrix3::new(
            per_px,
            0.0,
            -previous.x / before.z,
            0.0,
            per_px,
            -previous.y / before.z,
            0.0,
            0.0,
            -previous.z / before.z,
        );
        // The chain: pixels to the previous point, carried by the motion, back to pixels.
        let (per_m, z) = (focal / predicted.z, predicted.z);
        let by_point = Matrix3::new(
            per_m,
            0.0,
            -per_m * predicted.x / z,
            0.0,
            per_m,
            -per_m * predicted.y / z,
            0.0,
            0.0,
            -per_m * self.rig.baseline_m / z,
        );
        let noise = Matrix3::from_diagonal(&self.noise);
        let jacobian = by_point * self.rotation * by_match;
        let square = |sigma: f32| f64::from(sigma) * f64::from(sigma);
        // A turn of the camera moves a point across its direction by its distance.
        let rotated =
            Matrix3::identity() * predicted.norm_squared() - predicted * predicted.transpose();
        let camera = Matrix3::identity() * square(CAMERA_M) + rotated * square(CAMERA_RAD);
        // Errors of the lenses grow with the fourth power of the distance from the middle.
        let side = before.x / self.rig.center_u_px;
        let [offset_px, lens_px] = self.bias_px;
        let bias =
            (jacobian.column(2) - Vector3::z()) * (offset_px + lens_px * side * side * side * side);
        // A match's own noise is independent; camera and calibration are shared by neighbours.
        let own = noise + jacobian * noise * jacobian.transpose();
        [own, by_point * camera * by_point.transpose() + bias * bias.transpose()]
    }
}
