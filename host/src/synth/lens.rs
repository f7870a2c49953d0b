//! Lenses of the street's cameras, and by how much the rig is off.

use dynvox_core::rectify::LensModel;
use serde::{Deserialize, Serialize};

/// The lens images are taken through, with the parameters as calibration tools name them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum StreetLens {
    /// An ideal pinhole: images come rectified.
    #[default]
    Ideal,
    /// Pinhole with radial and tangential distortion.
    RadialTangential(RadialTangential),
    /// Equidistant fisheye.
    Equidistant(Equidistant),
    /// Double sphere.
    DoubleSphere(DoubleSphere),
    /// Extended unified.
    ExtendedUnified(ExtendedUnified),
}

impl StreetLens {
    /// The core's model; `None` where images come rectified.
    pub fn model(&self) -> Option<LensModel> {
        match *self {
            Self::Ideal => None,
            Self::RadialTangential(RadialTangential { radial, tangential }) => {
                Some(LensModel::RadialTangential { radial, tangential })
            }
            Self::Equidistant(Equidistant { radial }) => Some(LensModel::Equidistant { radial }),
            Self::DoubleSphere(DoubleSphere { xi, alpha }) => {
                Some(LensModel::DoubleSphere { xi, alpha })
            }
            Self::ExtendedUnified(ExtendedUnified { alpha, beta }) => {
                Some(LensModel::ExtendedUnified { alpha, beta })
            }
        }
    }
}

/// Parameters of radial and tangential distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RadialTangential {
    /// k1 to k6; rational where the last three are not 0.
    pub radial: [f64; 6],
    /// p1, p2.
    pub tangential: [f64; 2],
}

impl Default for RadialTangential {
    fn default() -> Self {
        Self { radial: [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0], tangential: [2e-4, -3e-4] }
    }
}

/// Parameters of an equidistant fisheye.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Equidistant {
    /// k1 to k4.
    pub radial: [f64; 4],
}

impl Default for Equidistant {
    fn default() -> Self {
        Self { radial: [-0.013, 0.02, -0.012, 0.002] }
    }
}

/// Parameters of a double sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DoubleSphere {
    /// Distance of the spheres' centres.
    pub xi: f64,
    /// Share of the second projection.
    pub alpha: f64,
}

impl Default for DoubleSphere {
    fn default() -> Self {
        Self { xi: -0.18, alpha: 0.59 }
    }
}

/// Parameters of the extended unified model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExtendedUnified {
    /// Share of the projection surface.
    pub alpha: f64,
    /// Shape of the projection surface.
    pub beta: f64,
}

impl Default for ExtendedUnified {
    fn default() -> Self {
        Self { alpha: 0.6, beta: 1.1 }
    }
}

/// What the calibration does not know: how far the right camera is from where it should be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigError {
    /// How far right images are shifted to the right, px: what must be added to disparities.
    pub disparity_offset_px: f64,
    /// How far right images are shifted down, px.
    pub vertical_shift_px: f64,
    /// How far right images are rotated clockwise about the principal point, degrees.
    pub roll_deg: f64,
    /// How far the right camera is pitched up, degrees.
    pub pitch_deg: f64,
}

impl RigError {
    /// Whether the rig stands as calibrated.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
