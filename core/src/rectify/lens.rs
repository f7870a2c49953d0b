//! A camera's lens: from a ray to a raw pixel and back.

use super::{double_sphere, equidistant, extended_unified, radial_tangential};
use core::fmt;

/// How a lens bends rays, with the parameters as calibration tools name them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LensModel {
    /// Pinhole with radial and tangential distortion (Brown 1971), rational where `radial[3..]` is
    /// not 0. All zero: an ideal pinhole.
    RadialTangential {
        /// k1 to k6: the numerator's three coefficients, then the denominator's.
        radial: [f64; 6],
        /// p1, p2.
        tangential: [f64; 2],
    },
    /// Equidistant fisheye with an odd polynomial in the angle (Kannala and Brandt 2006): k1 to k4.
    Equidistant {
        /// Coefficients of the third, fifth, seventh and ninth power of the angle.
        radial: [f64; 4],
    },
    /// Double sphere (Usenko, Demmel and Cremers 2018).
    DoubleSphere {
        /// Distance of the two spheres' centres, above -1.
        xi: f64,
        /// Share of the second projection, 0 to 1.
        alpha: f64,
    },
    /// Extended unified camera model (Khomutenko, Garcia and Martinet 2016).
    ExtendedUnified {
        /// Share of the projection surface, 0 to 1.
        alpha: f64,
        /// Shape of the projection surface, above 0.
        beta: f64,
    },
}

impl LensModel {
    /// A pinhole without distortion.
    pub const IDEAL: Self = Self::RadialTangential { radial: [0.0; 6], tangential: [0.0; 2] };

    /// Name in tables and files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::RadialTangential { .. } => "radial_tangential",
            Self::Equidistant { .. } => "equidistant",
            Self::DoubleSphere { .. } => "double_sphere",
            Self::ExtendedUnified { .. } => "extended_unified",
        }
    }

    fn validate(&self) -> Result<(), LensProblem> {
        let share = |alpha: f64| (0.0..=1.0).contains(&alpha);
        let (finite, within) = match *self {
            Self::RadialTangential { radial, tangential } => {
                (radial.iter().chain(&tangential).all(|k| k.is_finite()), true)
            }
            Self::Equidistant { radial } => (radial.iter().all(|k| k.is_finite()), true),
            Self::DoubleSphere { xi, alpha } => {
                (xi.is_finite() && alpha.is_finite(), xi > -1.0 && share(alpha))
            }
            Self::ExtendedUnified { alpha, beta } => {
                (alpha.is_finite() && beta.is_finite(), beta > 0.0 && share(alpha))
            }
        };
        match (finite, within) {
            (false, _) => Err(LensProblem::DistortionNotFinite),
            (true, false) => Err(LensProblem::DistortionOutOfRange),
            (true, true) => Ok(()),
        }
    }
}

/// Why a lens cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LensProblem {
    /// A focal length is not a positive finite number.
    Focal,
    /// The principal point is not finite.
    Center,
    /// A distortion parameter is not finite.
    DistortionNotFinite,
    /// A parameter lies outside its model's range.
    DistortionOutOfRange,
}

impl fmt::Display for LensProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Focal => "a focal length is not a positive number",
            Self::Center => "the principal point is not finite",
            Self::DistortionNotFinite => "a distortion parameter is not finite",
            Self::DistortionOutOfRange => {
                "a distortion parameter lies outside the range of its model"
            }
        })
    }
}

impl core::error::Error for LensProblem {}

/// A lens: focal lengths, principal point and distortion of a raw camera.
///
/// Camera axes are x right, y down, z forward; pixels are measured from the centre of the first.
///
/// ```
/// use dynvox_core::rectify::{Lens, LensModel};
///
/// let lens = Lens::new([450.0, 450.0], [320.0, 240.0], LensModel::Equidistant { radial: [-0.01, 0.02, 0.0, 0.0] })?;
/// let pixel = lens.project([0.4, -0.2, 1.0]).expect("in front of the camera");
/// let [x, y, z] = lens.unproject(pixel).expect("within the field of view");
/// assert!((x / z - 0.4).abs() < 1e-9 && (y / z + 0.2).abs() < 1e-9);
/// # Ok::<(), dynvox_core::rectify::LensProblem>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    model: LensModel,
    /// The largest ray radius (radial-tangential: x over z; equidistant: angle, rad) up to which
    /// the distortion grows with the ray. Beyond it the polynomial folds back, and far rays would
    /// land among near ones.
    limit: f64,
}

impl Lens {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that cannot be.
    pub fn new(
        focal_px: [f64; 2],
        center_px: [f64; 2],
        model: LensModel,
    ) -> Result<Self, LensProblem> {
        if !focal_px.iter().all(|focal| focal.is_finite() && *focal > 0.0) {
            return Err(LensProblem::Focal);
        }
        if !center_px.iter().all(|center| center.is_finite()) {
            return Err(LensProblem::Center);
        }
        model.validate()?;
        let limit = match &model {
            LensModel::RadialTangential { radial, .. } => radial_tangential::limit(radial),
            LensModel::Equidistant { radial } => equidistant::limit(radial),
            LensModel::DoubleSphere { .. } | LensModel::ExtendedUnified { .. } => f64::INFINITY,
        };
        Ok(Self { focal_px, center_px, model, limit })
    }

    /// Focal lengths along u and v, px.
    pub fn focal_px(&self) -> [f64; 2] {
        self.focal_px
    }

    /// Principal point, px.
    pub fn center_px(&self) -> [f64; 2] {
        self.center_px
    }

    /// The distortion.
    pub fn model(&self) -> &LensModel {
        &self.model
    }

    /// The raw pixel a ray (any length but 0) meets, px, whether or not it lies in the image.
    /// `None` outside the lens's field of view.
    pub fn project(&self, ray: [f64; 3]) -> Option<[f64; 2]> {
        let [x, y] = match &self.model {
            LensModel::RadialTangential { radial, tangential } => {
                radial_tangential::distort(radial, tangential, self.limit, ray)?
            }
            LensModel::Equidistant { radial } => equidistant::distort(radial, self.limit, ray)?,
            LensModel::DoubleSphere { xi, alpha } => double_sphere::distort(*xi, *alpha, ray)?,
            LensModel::ExtendedUnified { alpha, beta } => {
                extended_unified::distort(*alpha, *beta, ray)?
            }
        };
        let pixel =
            [self.focal_px[0] * x + self.center_px[0], self.focal_px[1] * y + self.center_px[1]];
        pixel.iter().all(|value| value.is_finite()).then_some(pixel)
    }

    /// The ray a raw pixel sees, of length 1. `None` where no ray leads to that pixel.
    pub fn unproject(&self, pixel: [f64; 2]) -> Option<[f64; 3]> {
        let at = [
            (pixel[0] - self.center_px[0]) / self.focal_px[0],
            (pixel[1] - self.center_px[1]) / self.focal_px[1],
        ];
        let [x, y, z] = match &self.model {
            LensModel::RadialTangential { radial, tangential } => {
                radial_tangential::undistort(radial, tangential, self.limit, at)?
            }
            LensModel::Equidistant { radial } => equidistant::undistort(radial, self.limit, at)?,
            LensModel::DoubleSphere { xi, alpha } => double_sphere::undistort(*xi, *alpha, at)?,
            LensModel::ExtendedUnified { alpha, beta } => {
                extended_unified::undistort(*alpha, *beta, at)?
            }
        };
        let length = libm::sqrt(x * x + y * y + z * z);
        (length.is_finite() && length > 0.0).then(|| [x / length, y / length, z / length])
    }

    /// Pixels per radian on the optical axis: the focal length of the ideal pinhole that shows the
    /// middle at the same scale.
    pub(crate) fn middle_focal_px(&self) -> f64 {
        const STEP: f64 = 1e-4;
        let middle = self.project([0.0, 0.0, 1.0]).unwrap_or(self.center_px);
        let along = |ray: [f64; 3], axis: fn([f64; 2]) -> f64, otherwise: f64| {
            self.project(ray).map_or(otherwise, |pixel| (axis(pixel) - axis(middle)) / STEP)
        };
        let focal_u = along([STEP, 0.0, 1.0], |pixel| pixel[0], self.focal_px[0]);
        let focal_v = along([0.0, STEP, 1.0], |pixel| pixel[1], self.focal_px[1]);
        0.5 * (focal_u + focal_v)
    }
}
