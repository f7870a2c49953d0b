//! Lenses of the street's cameras, and by how much the rig is off.

use crate::formats::calibration::lens_table::{self, LensTable};
use dynvox_core::rectify::LensModel;
use serde::de::{Deserializer, Error as _};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};

/// Name of the lens that bends nothing.
const IDEAL: &str = "ideal";

/// The lens images are taken through, with the parameters as calibration tools name them; those
/// that a table leaves out are a typical lens's.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum StreetLens {
    /// An ideal pinhole: images come rectified.
    #[default]
    Ideal,
    /// A lens of one of the core's models: images come raw.
    Bent(LensModel),
}

impl StreetLens {
    /// The core's model; `None` if images come rectified.
    pub fn model(&self) -> Option<LensModel> {
        match *self {
            Self::Ideal => None,
            Self::Bent(model) => Some(model),
        }
    }
}

impl Serialize for StreetLens {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Bent(model) => lens_table::serialize(model, serializer),
            Self::Ideal => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry("model", IDEAL)?;
                map.end()
            }
        }
    }
}

impl<'de> Deserialize<'de> for StreetLens {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = LensTable::deserialize(deserializer)?;
        if table.name().map_err(D::Error::custom)? == IDEAL {
            return Ok(Self::Ideal);
        }
        table.model_or_typical().map(Self::Bent).map_err(D::Error::custom)
    }
}

/// Misalignment of the right camera that its calibration does not know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigError {
    /// Shift of right images to the right, px: the correction that must be added to disparities.
    pub disparity_offset_px: f64,
    /// Shift of right images downwards, px.
    pub vertical_shift_px: f64,
    /// Clockwise rotation of right images about the principal point, degrees.
    pub roll_deg: f64,
    /// Upward pitch of the right camera, degrees.
    pub pitch_deg: f64,
}

impl RigError {
    /// Returns true if the rig stands as calibrated.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
