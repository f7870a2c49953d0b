//! Lens models: a file each, with the formulas and a row of the table [`LENS_MODELS`].
//!
//! All else that depends on the model goes over its parameters by name: checks here, and the files,
//! tables and settings of this crate's users.

mod double_sphere;
mod equidistant;
mod extended_unified;
mod general;
mod radial_tangential;

pub use radial_tangential::MAX_STEPS;

use core::fmt;
use core::mem::discriminant;
use core::slice::from_mut;
use radial_tangential::Plane;

/// All models. Positions are stable: other languages number models by them.
pub static LENS_MODELS: &[LensKind] = &[
    radial_tangential::KIND,
    equidistant::KIND,
    double_sphere::KIND,
    extended_unified::KIND,
    general::KIND,
];

/// Row of the table of models.
#[derive(Clone, Copy, Debug)]
pub struct LensKind {
    /// Name in tables and files.
    pub name: &'static str,
    /// Model with the parameters of a typical lens.
    pub typical: LensModel,
}

/// Parameter, or list of parameters, of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensParameter {
    /// Name, as calibration tools have it.
    pub key: &'static str,
    /// Names of the values in calibration tools, for tables.
    pub label: &'static str,
    /// Values lie above this.
    above: f64,
    /// Values may equal `above`.
    closed: bool,
    /// Values lie at or below this.
    at_most: f64,
}

impl LensParameter {
    /// Parameter that may be any finite number.
    const fn any(key: &'static str, label: &'static str) -> Self {
        let (above, at_most) = (f64::NEG_INFINITY, f64::INFINITY);
        Self { key, label, above, closed: false, at_most }
    }

    /// Parameter above a bound.
    const fn above(key: &'static str, above: f64) -> Self {
        Self { above, ..Self::any(key, key) }
    }

    /// Parameter from 0.
    const fn from_zero(key: &'static str) -> Self {
        Self { above: 0.0, closed: true, ..Self::any(key, key) }
    }

    /// Angle of a sensor that still faces its lens, rad.
    const fn angle(key: &'static str, label: &'static str) -> Self {
        Self { above: -1.0, at_most: 1.0, ..Self::any(key, label) }
    }

    /// Parameter from 0 to 1.
    const fn share(key: &'static str) -> Self {
        Self { above: 0.0, closed: true, at_most: 1.0, ..Self::any(key, key) }
    }

    fn holds(&self, value: f64) -> bool {
        (value > self.above || (self.closed && value == self.above)) && value <= self.at_most
    }
}

/// Distortion of a lens, with the parameters as calibration tools name them.
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
    /// Unified model of Mei with OpenCV's whole distortion: radial, tangential, thin prism, tilted
    /// sensor.
    General {
        /// Distance of the viewpoint from the middle of the unit sphere, from 0 (pinhole).
        xi: f64,
        /// k1 to k6, as of [`LensModel::RadialTangential`].
        radial: [f64; 6],
        /// p1, p2.
        tangential: [f64; 2],
        /// s1 to s4.
        prism: [f64; 4],
        /// Tilt of the sensor about x, then y, rad.
        tilt: [f64; 2],
    },
}

impl LensModel {
    /// Pinhole without distortion.
    pub const IDEAL: Self = Self::RadialTangential { radial: [0.0; 6], tangential: [0.0; 2] };

    /// Name in tables and files.
    ///
    /// ```
    /// use dynvox_core::rectify::{LENS_MODELS, LensModel};
    ///
    /// let names: Vec<_> = LENS_MODELS.iter().map(|kind| kind.name).collect();
    /// assert!(names.contains(&LensModel::IDEAL.name()));
    /// ```
    pub fn name(&self) -> &'static str {
        let kind = |kind: &&LensKind| discriminant(&kind.typical) == discriminant(self);
        LENS_MODELS.iter().find(kind).map_or("", |kind| kind.name)
    }

    /// Visits the parameters in the order of calibration tools, to read or to set them.
    ///
    /// ```
    /// use dynvox_core::rectify::LensModel;
    ///
    /// let mut model = LensModel::DoubleSphere { xi: -0.2, alpha: 0.6 };
    /// let mut keys = Vec::new();
    /// model.visit_parameters(|parameter, values| keys.push((parameter.key, values.to_vec())));
    /// assert_eq!(keys, [("xi", vec![-0.2]), ("alpha", vec![0.6])]);
    /// ```
    pub fn visit_parameters(&mut self, mut visit: impl FnMut(LensParameter, &mut [f64])) {
        match self {
            Self::RadialTangential { radial, tangential } => {
                visit(LensParameter::any("radial", "k1 to k6"), radial);
                visit(LensParameter::any("tangential", "p1 p2"), tangential);
            }
            Self::Equidistant { radial } => visit(LensParameter::any("radial", "k1 to k4"), radial),
            Self::DoubleSphere { xi, alpha } => {
                visit(LensParameter::above("xi", -1.0), from_mut(xi));
                visit(LensParameter::share("alpha"), from_mut(alpha));
            }
            Self::ExtendedUnified { alpha, beta } => {
                visit(LensParameter::share("alpha"), from_mut(alpha));
                visit(LensParameter::above("beta", 0.0), from_mut(beta));
            }
            Self::General { xi, radial, tangential, prism, tilt } => {
                visit(LensParameter::from_zero("xi"), from_mut(xi));
                visit(LensParameter::any("radial", "k1 to k6"), radial);
                visit(LensParameter::any("tangential", "p1 p2"), tangential);
                visit(LensParameter::any("prism", "s1 to s4"), prism);
                visit(LensParameter::angle("tilt", "tx ty"), tilt);
            }
        }
    }

    /// Checks the parameters.
    pub(super) fn validate(&self) -> Result<(), LensProblem> {
        let (mut finite, mut within) = (true, true);
        let mut copy = *self;
        copy.visit_parameters(|parameter, values| {
            finite &= values.iter().all(|value| value.is_finite());
            within &= values.iter().all(|value| parameter.holds(*value));
        });
        match (finite, within) {
            (false, _) => Err(LensProblem::DistortionNotFinite),
            (true, false) => Err(LensProblem::DistortionOutOfRange),
            (true, true) => Ok(()),
        }
    }

    /// Largest ray radius up to which the distortion grows with the ray.
    pub(super) fn limit(&self) -> f64 {
        match self {
            Self::RadialTangential { radial, .. } | Self::General { radial, .. } => {
                radial_tangential::limit(radial)
            }
            Self::Equidistant { radial } => equidistant::limit(radial),
            _ => f64::INFINITY,
        }
    }

    /// Point at which a ray meets the image, in units of the focal length.
    pub(super) fn distort(&self, limit: f64, ray: [f64; 3]) -> Option<[f64; 2]> {
        match self {
            Self::RadialTangential { radial, tangential } => {
                let plane = Plane { radial, tangential, prism: &[0.0; 4] };
                radial_tangential::distort(&plane, limit, ray)
            }
            Self::Equidistant { radial } => equidistant::distort(radial, limit, ray),
            Self::DoubleSphere { xi, alpha } => double_sphere::distort(*xi, *alpha, ray),
            Self::ExtendedUnified { alpha, beta } => extended_unified::distort(*alpha, *beta, ray),
            Self::General { xi, radial, tangential, prism, tilt } => {
                general::distort(&Plane { radial, tangential, prism }, *xi, tilt, limit, ray)
            }
        }
    }

    /// Ray of any length that meets the image at a point.
    pub(super) fn undistort(&self, limit: f64, at: [f64; 2]) -> Option<[f64; 3]> {
        match self {
            Self::RadialTangential { radial, tangential } => {
                let plane = Plane { radial, tangential, prism: &[0.0; 4] };
                radial_tangential::undistort(&plane, limit, at)
            }
            Self::Equidistant { radial } => equidistant::undistort(radial, limit, at),
            Self::DoubleSphere { xi, alpha } => double_sphere::undistort(*xi, *alpha, at),
            Self::ExtendedUnified { alpha, beta } => extended_unified::undistort(*alpha, *beta, at),
            Self::General { xi, radial, tangential, prism, tilt } => {
                general::undistort(&Plane { radial, tangential, prism }, *xi, tilt, limit, at)
            }
        }
    }
}

/// Reason why a lens cannot be used.
///
/// ```
/// use dynvox_core::rectify::{Lens, LensModel, LensProblem};
///
/// let lens = Lens::new([0.0, 450.0], [320.0, 240.0], LensModel::IDEAL);
/// assert_eq!(lens, Err(LensProblem::Focal));
/// ```
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
