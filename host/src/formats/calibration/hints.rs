//! Answers of a person to what the files of a calibration leave open.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Length that a calibration's unit has, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LengthUnit(pub f64);

impl LengthUnit {
    /// Metre.
    pub const METRE: Self = Self(1.0);
    /// Centimetre.
    pub const CENTIMETRE: Self = Self(0.01);
    /// Millimetre.
    pub const MILLIMETRE: Self = Self(0.001);
}

impl FromStr for LengthUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "m" => return Ok(Self::METRE),
            "cm" => return Ok(Self::CENTIMETRE),
            "mm" => return Ok(Self::MILLIMETRE),
            "inch" => return Ok(Self(0.0254)),
            _ => {}
        }
        let number = text.parse::<f64>().ok();
        number.filter(|length| length.is_finite() && *length > 0.0).map(Self).ok_or_else(|| {
            "must be m, cm, mm, inch, or the side of the board's squares in metres: 0.025"
                .to_owned()
        })
    }
}

impl fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::METRE => f.write_str("m"),
            Self::CENTIMETRE => f.write_str("cm"),
            Self::MILLIMETRE => f.write_str("mm"),
            Self(length_m) => write!(f, "{length_m} m"),
        }
    }
}

/// Kind of lens that four coefficients without a name are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum LensFamily {
    /// `cv2.calibrateCamera`: k1 k2 p1 p2.
    Pinhole,
    /// `cv2.fisheye.calibrate`: k1 k2 k3 k4.
    Fisheye,
}

impl LensFamily {
    /// The other kind.
    pub fn other(self) -> Self {
        match self {
            Self::Pinhole => Self::Fisheye,
            Self::Fisheye => Self::Pinhole,
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Fisheye => "fisheye",
        }
    }
}

/// Order to exchange: of the calibration's cameras, of the images, or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Swap {
    /// The right camera comes first in the calibration and among the images.
    Both,
    /// The right camera comes first in the calibration only.
    Calibration,
    /// The right camera's images come first.
    Images,
}

impl Swap {
    /// Tells whether the calibration's cameras are exchanged.
    pub fn calibration(self) -> bool {
        self != Self::Images
    }

    /// Tells whether the images are exchanged.
    pub fn images(self) -> bool {
        self != Self::Calibration
    }
}

/// Answers of a person to what the files of a calibration leave open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default, deny_unknown_fields)]
pub struct CalibrationHints {
    /// Unit of the calibration's translations: m, cm, mm, inch, or the side of the board's squares
    /// in metres (0.025) [default: the format's own]
    #[arg(long = "calibration-unit", value_name = "UNIT")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<LengthUnit>,
    /// Lens that four coefficients without a name are of [default: guessed, and said]
    #[arg(long, value_enum)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens_model: Option<LensFamily>,
    /// Exchange the cameras: in the calibration and the images (both), or in one of them
    #[arg(
        long,
        value_enum,
        value_name = "WHAT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "both"
    )]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub swap: Option<Swap>,
    /// Cameras stand one above the other: turn rectified images by a quarter
    #[arg(long)]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub vertical: bool,
    /// True for KITTI's colour pair, where a file has both.
    #[arg(skip)]
    #[serde(skip)]
    pub colour: bool,
}

impl CalibrationHints {
    /// The options that say so, each after a space.
    pub fn options(&self) -> String {
        let unit = self.unit.map(|unit| match unit {
            LengthUnit::METRE | LengthUnit::CENTIMETRE | LengthUnit::MILLIMETRE => {
                format!(" --calibration-unit {unit}")
            }
            LengthUnit(length_m) => format!(" --calibration-unit {length_m}"),
        });
        let lens = self.lens_model.map(|family| format!(" --lens-model {}", family.name()));
        let swap = self.swap.map(|swap| match swap {
            Swap::Both => " --swap".to_owned(),
            Swap::Calibration => " --swap=calibration".to_owned(),
            Swap::Images => " --swap=images".to_owned(),
        });
        let vertical = self.vertical.then(|| " --vertical".to_owned());
        [unit, lens, swap, vertical].into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_a_name_or_the_side_of_a_square() {
        for (word, length_m) in
            [("m", 1.0), ("cm", 0.01), ("mm", 1e-3), ("inch", 0.0254), ("0.025", 0.025)]
        {
            assert_eq!(word.parse(), Ok(LengthUnit(length_m)));
        }
        for word in ["", "feet", "0", "-1", "nan", "inf"] {
            assert!(
                word.parse::<LengthUnit>().unwrap_err().contains("side of the board"),
                "{word}"
            );
        }
    }
}
