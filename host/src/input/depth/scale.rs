//! Unit of the numbers in files of depth or disparity.

use crate::input::source::Quantity;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Known units by name: m of a depth, px of a disparity, for each unit of the file.
const NAMED: [(&str, f64); 8] = [
    ("m", 1.0),
    ("cm", 0.01),
    ("mm", 0.001),
    ("tum", 1.0 / 5_000.0),
    ("kitti", 1.0 / 256.0),
    ("sgbm", 1.0 / 16.0),
    ("px", 1.0),
    ("negative", -1.0),
];
/// A factor within this of a known unit is named as that unit.
const SAME: f64 = 0.05;

/// M (of a depth) or px (of a disparity) for each unit of a file's numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct DepthScale {
    text: String,
    per_unit: f64,
}

impl DepthScale {
    /// M or px for each unit; below 0 of disparities that are left minus right.
    pub fn per_unit(&self) -> f64 {
        self.per_unit
    }
}

impl FromStr for DepthScale {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<f64>().ok();
        let named = || NAMED.iter().find(|(name, _)| *name == text).map(|(_, per_unit)| *per_unit);
        let fraction = || {
            let (above, below) = text.split_once('/')?;
            Some(number(above)? / number(below)?)
        };
        let per_unit = named().or_else(|| number(text)).or_else(fraction);
        per_unit
            .filter(|per_unit| per_unit.is_finite() && *per_unit != 0.0)
            .map(|per_unit| Self { text: text.to_owned(), per_unit })
            .ok_or_else(|| {
                let names: Vec<&str> = NAMED.iter().map(|(name, _)| *name).collect();
                format!("must be m or px for each unit: 0.001, 1/5000, or {}", names.join(", "))
            })
    }
}

impl fmt::Display for DepthScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl TryFrom<String> for DepthScale {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<DepthScale> for String {
    fn from(scale: DepthScale) -> Self {
        scale.text
    }
}

/// Words for `--depth-scale` that give so many m or px for each unit: a known unit's name if it is
/// near one.
pub(super) fn suggestion(per_unit: f64, quantity: Quantity) -> String {
    let of_quantity = |name: &str| match quantity {
        Quantity::DepthM => !["sgbm", "px", "negative"].contains(&name),
        Quantity::DisparityPx => ["kitti", "sgbm", "px", "negative"].contains(&name),
    };
    let near =
        |(name, known): &&(&str, f64)| of_quantity(name) && (per_unit / known - 1.0).abs() <= SAME;
    match NAMED.iter().find(near) {
        Some((name, _)) => (*name).to_owned(),
        None => format!("{per_unit:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_numbers_fractions_or_names() {
        let read = |text: &str| text.parse::<DepthScale>().map(|scale| scale.per_unit());
        for (text, expected) in
            [("0.001", 0.001), ("mm", 0.001), ("1/5000", 2e-4), ("tum", 2e-4), ("-1", -1.0)]
        {
            assert_eq!(read(text), Ok(expected), "{text}");
        }
        assert_eq!(read("negative"), Ok(-1.0));
        for wrong in ["", "0", "inch", "1/0", "nan"] {
            assert!(read(wrong).unwrap_err().contains("1/5000"), "{wrong}");
        }
        let scale: DepthScale = "1/5000".parse().unwrap();
        let stored = serde_json::to_string(&scale).unwrap();
        assert_eq!(
            (stored.as_str(), serde_json::from_str(&stored).ok()),
            ("\"1/5000\"", Some(scale))
        );
    }

    #[test]
    fn a_known_unit_is_suggested_by_its_name() {
        assert_eq!(suggestion(0.000_203, Quantity::DepthM), "tum");
        assert_eq!(suggestion(0.0039, Quantity::DepthM), "kitti");
        assert_eq!(suggestion(0.0625, Quantity::DisparityPx), "sgbm");
        assert_eq!(suggestion(0.3048, Quantity::DepthM), "3.048e-1");
    }
}
