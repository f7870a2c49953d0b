//! A rectified stereo pair: where its cameras see a point, where a point is that they see, and how
//! either changes with the other.

use core::fmt;

/// Nearest depth at which a point can be seen, m.
pub const DEPTH_MIN_M: f64 = 0.05;
/// Smallest disparity a point is triangulated from, px.
pub const DISPARITY_MIN_PX: f64 = 0.1;

/// Projections of a point into both cameras, px from the principal point. Rectified cameras see it
/// in the same row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StereoObservation {
    /// Column in the left image.
    pub u_left_px: f64,
    /// Row in both images.
    pub v_px: f64,
    /// Column in the right image.
    pub u_right_px: f64,
}

impl StereoObservation {
    /// Left column minus right column.
    pub(crate) fn disparity_px(&self) -> f64 {
        self.u_left_px - self.u_right_px
    }
}

/// Two identical pinhole cameras, rectified, the right one `baseline_m` along +x of the left.
///
/// ```
/// use dynvox_core::geometry::StereoRig;
///
/// let kitti = StereoRig { focal_px: 718.9, center_u_px: 607.2, center_v_px: 185.2, baseline_m: 0.54 };
/// let depth_m = kitti.focal_baseline_px_m() / 38.8; // of a disparity of 38.8 px
/// assert!(kitti.validate().is_ok() && (depth_m - 10.0).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoRig {
    /// Focal length, px, equal in both directions.
    pub focal_px: f64,
    /// Column of the principal point, px from the centre of the leftmost pixel.
    pub center_u_px: f64,
    /// Row of the principal point, px from the centre of the topmost pixel.
    pub center_v_px: f64,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
}

/// Reason why a rig cannot be used.
///
/// ```
/// use dynvox_core::geometry::{RigProblem, StereoRig};
///
/// let rig =
///     StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.0 };
/// assert_eq!(rig.validate(), Err(RigProblem::Baseline));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RigProblem {
    /// The focal length is not a positive finite number.
    Focal,
    /// The principal point is not finite.
    Center,
    /// The baseline is not a positive finite number.
    Baseline,
}

impl fmt::Display for RigProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Focal => "the focal length must be a positive number of pixels",
            Self::Center => "the principal point must be finite",
            Self::Baseline => "the baseline must be a positive number of metres",
        })
    }
}

impl core::error::Error for RigProblem {}

impl StereoRig {
    /// Checks that every figure is finite and the focal length and baseline are positive.
    ///
    /// ```
    /// use dynvox_core::geometry::{RigProblem, StereoRig};
    ///
    /// let swapped = StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: -0.5 };
    /// assert_eq!(swapped.validate(), Err(RigProblem::Baseline));
    /// ```
    pub fn validate(&self) -> Result<(), RigProblem> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !positive(self.focal_px) {
            return Err(RigProblem::Focal);
        }
        if !(self.center_u_px.is_finite() && self.center_v_px.is_finite()) {
            return Err(RigProblem::Center);
        }
        if !positive(self.baseline_m) {
            return Err(RigProblem::Baseline);
        }
        Ok(())
    }

    /// Focal length times baseline: depth in metres of one pixel of disparity.
    ///
    /// ```
    /// use dynvox_core::geometry::StereoRig;
    ///
    /// let rig =
    ///     StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };
    /// let depth_m = 10.0;
    /// assert_eq!(rig.focal_baseline_px_m() / depth_m, 35.0); // px of disparity
    /// ```
    pub fn focal_baseline_px_m(&self) -> f64 {
        self.focal_px * self.baseline_m
    }

    /// A pixel by its distance from the principal point, px.
    pub(crate) fn centered(&self, [u, v]: [f32; 2]) -> [f64; 2] {
        [f64::from(u) - self.center_u_px, f64::from(v) - self.center_v_px]
    }

    /// Combines a pixel of the left and one of the right image; the row is the mean of both.
    pub(crate) fn observation(&self, left: [f32; 2], right: [f32; 2]) -> StereoObservation {
        let ([u_left_px, v_left], [u_right_px, v_right]) =
            (self.centered(left), self.centered(right));
        StereoObservation { u_left_px, v_px: 0.5 * (v_left + v_right), u_right_px }
    }

    /// The ray of a pixel of the left image, at depth 1.
    pub(crate) fn ray(&self, u_px: f64, v_px: f64) -> [f64; 3] {
        [(u_px - self.center_u_px) / self.focal_px, (v_px - self.center_v_px) / self.focal_px, 1.0]
    }

    /// Projects a point of the left camera's frame, m, into both cameras; `None` nearer than
    /// [`DEPTH_MIN_M`], behind the camera, or if the depth is not a number.
    pub(crate) fn project(&self, [x, y, z]: [f64; 3]) -> Option<StereoObservation> {
        (z > DEPTH_MIN_M).then(|| {
            let u_left_px = self.focal_px * x / z;
            StereoObservation {
                u_left_px,
                v_px: self.focal_px * y / z,
                u_right_px: u_left_px - self.focal_baseline_px_m() / z,
            }
        })
    }

    /// Change of [`StereoRig::project`] by the point, px/m: rows left column, row, right column.
    pub(crate) fn project_jacobian(&self, [x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
        let per_m = self.focal_px / z;
        [
            [per_m, 0.0, -per_m * (x / z)],
            [0.0, per_m, -per_m * y / z],
            [per_m, 0.0, -per_m * ((x - self.baseline_m) / z)],
        ]
    }

    /// The point both cameras see, in the left camera's frame, m; `None` where the disparity is
    /// below [`DISPARITY_MIN_PX`] or something is not finite.
    pub(crate) fn triangulate(&self, seen: &StereoObservation) -> Option<[f64; 3]> {
        let disparity = seen.disparity_px();
        // False for NaN as well.
        if !((DISPARITY_MIN_PX..f64::INFINITY).contains(&disparity) && seen.v_px.is_finite()) {
            return None;
        }
        let per_px = self.baseline_m / disparity;
        Some([seen.u_left_px * per_px, seen.v_px * per_px, self.focal_px * per_px])
    }

    /// The point of a pixel of the left image with a disparity, in the left camera's frame, m.
    pub(crate) fn pixel_point(&self, [u, v]: [usize; 2], disparity_px: f64) -> [f64; 3] {
        let per_px = self.baseline_m / disparity_px;
        let [x, y] = [u as f64 - self.center_u_px, v as f64 - self.center_v_px];
        [x * per_px, y * per_px, self.focal_px * per_px]
    }

    /// Change of [`StereoRig::triangulate`] by the observation, m/px: columns left column, row,
    /// right column. Of use only where the observation triangulates.
    pub(crate) fn triangulate_jacobian(&self, seen: &StereoObservation) -> [[f64; 3]; 3] {
        let disparity = seen.disparity_px();
        let per_px = self.baseline_m / disparity;
        let [x, y, z] =
            [seen.u_left_px, seen.v_px, self.focal_px].map(|part| part * per_px / disparity);
        [[per_px - x, 0.0, x], [-y, per_px, y], [-z, 0.0, z]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: StereoRig =
        StereoRig { focal_px: 721.5, center_u_px: 609.6, center_v_px: 172.9, baseline_m: 0.54 };
    const POINTS_M: [[f64; 3]; 4] =
        [[0.0, 0.0, 5.0], [1.0, -0.5, 3.0], [-7.0, 1.5, 24.0], [0.3, 0.2, 0.9]];

    fn columns(seen: &StereoObservation) -> [f64; 3] {
        [seen.u_left_px, seen.v_px, seen.u_right_px]
    }

    #[test]
    fn a_point_seen_is_where_it_was() {
        for point in POINTS_M {
            let found = RIG.triangulate(&RIG.project(point).unwrap()).unwrap();
            assert!(
                (0..3).all(|axis| (found[axis] - point[axis]).abs() < 1e-12),
                "{found:?} {point:?}"
            );
        }
        // A focal length to the right of the principal point the ray has 45 degrees.
        let [x, y, z] = RIG.ray(609.6 + 721.5, 172.9);
        assert!((x - 1.0).abs() < 1e-12 && y == 0.0 && z == 1.0);
    }

    #[test]
    fn what_is_behind_or_has_no_disparity_is_none() {
        for z in [0.0, -3.0, DEPTH_MIN_M, f64::NAN] {
            assert_eq!(RIG.project([1.0, 1.0, z]), None);
        }
        let seen = |u_right_px: f64| StereoObservation { u_left_px: 5.0, v_px: 1.0, u_right_px };
        // No disparity, a negative one, one too small, and none at all.
        for u_right_px in [5.0, 9.0, 4.95, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(RIG.triangulate(&seen(u_right_px)), None, "{u_right_px}");
        }
        assert_eq!(RIG.triangulate(&StereoObservation { v_px: f64::NAN, ..seen(1.0) }), None);
    }

    #[test]
    fn jacobians_are_the_finite_differences() {
        const STEP: f64 = 1e-5;
        for point in POINTS_M {
            let seen = RIG.project(point).unwrap();
            let (forward, back) = (RIG.project_jacobian(point), RIG.triangulate_jacobian(&seen));
            for by in 0..3 {
                // One coordinate moved by a step, of the point and then of its observation.
                let moved = |sign: f64| {
                    core::array::from_fn(|axis| {
                        if axis == by { point[axis] + sign * STEP } else { point[axis] }
                    })
                };
                let [high, low] =
                    [1.0, -1.0].map(|sign| columns(&RIG.project(moved(sign)).unwrap()));
                let [u_left_px, v_px, u_right_px] = columns(&seen);
                let shifted = |sign: f64| {
                    let [a, b, c] =
                        core::array::from_fn(|axis| if axis == by { sign * STEP } else { 0.0 });
                    let seen = StereoObservation {
                        u_left_px: u_left_px + a,
                        v_px: v_px + b,
                        u_right_px: u_right_px + c,
                    };
                    RIG.triangulate(&seen).unwrap()
                };
                let (far, near) = (shifted(1.0), shifted(-1.0));
                for row in 0..3 {
                    let expected = (high[row] - low[row]) / (2.0 * STEP);
                    // Relative to the derivative where that is large, absolute where it is small.
                    assert!(
                        (forward[row][by] - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                        "{point:?} {row} {by}"
                    );
                    let expected = (far[row] - near[row]) / (2.0 * STEP);
                    assert!(
                        (back[row][by] - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                        "{point:?} {row} {by}"
                    );
                }
            }
        }
    }
}
