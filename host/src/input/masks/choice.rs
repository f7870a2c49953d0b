//! Choosing a source of masks.

use super::{MaskFormat, boxes, coco, ids, indexed, mnc, mots, yolo};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Source of masks, as the command line names it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskChoice {
    /// The data set's folder of instances, if it has one, and moving objects by their motion.
    #[default]
    Auto,
    /// No masks, and no search for moving objects.
    None,
    /// No masks: moving objects are found by their motion alone.
    Motion,
    /// Files of a format, at a path.
    Files(#[serde(with = "format")] &'static MaskFormat, PathBuf),
    /// Networks of ONNX files.
    Networks(Vec<PathBuf>),
    /// The synthetic street's exact masks.
    Exact,
    /// Exact masks with a detector's faults, drawn from a seed.
    Noisy(u64),
}

impl MaskChoice {
    /// Returns true if moving objects are searched for by their motion; `None` if the settings
    /// decide.
    pub fn finds_motion(&self) -> Option<bool> {
        match self {
            Self::Auto | Self::Motion => Some(true),
            Self::None => Some(false),
            _ => None,
        }
    }
}

/// A format as its name.
mod format {
    use super::{MASK_FORMATS, MaskFormat};
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;

    pub fn serialize<S: Serializer>(
        format: &&'static MaskFormat,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(format.name)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<&'static MaskFormat, D::Error> {
        let name = String::deserialize(deserializer)?;
        let format = MASK_FORMATS.iter().find(|format| format.name == name);
        format.copied().ok_or_else(|| D::Error::custom(format!("no masks are named {name}")))
    }
}

/// All formats of mask files.
pub static MASK_FORMATS: &[&MaskFormat] = &[
    &indexed::FORMAT,
    &mots::FORMAT,
    &mnc::FORMAT,
    &coco::FORMAT,
    &yolo::FORMAT,
    &boxes::FORMAT,
    &ids::FORMAT,
];

/// Lists the values of `--instances`.
fn known() -> String {
    let formats = MASK_FORMATS.iter().map(|format| {
        let value = format.value.split(' ').next().unwrap_or_default();
        format!("{}:{value}", format.name)
    });
    let values = ["auto", "motion", "none"].map(String::from).into_iter().chain(formats);
    let values = values.chain(["onnx:FILE", "exact", "noisy"].map(String::from));
    values.collect::<Vec<_>>().join(", ")
}

impl MaskChoice {
    /// Text of the help of `--instances`.
    pub fn help() -> String {
        let formats = MASK_FORMATS.iter().map(|format| match format.summary {
            "" => format!("{}:{}", format.name, format.value),
            summary => format!("{}:{} ({summary})", format.name, format.value),
        });
        format!(
            "Source of instance masks: auto (files where the data set has them, and motion), \
             motion (moving objects are found by their motion alone), none, {}, \
             onnx:FILE[,FILE] (networks), exact or noisy[:SEED] (the synthetic street)",
            formats.collect::<Vec<_>>().join(", ")
        )
    }
}

impl FromStr for MaskChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((kind, rest)) = text.split_once(':') else {
            return Ok(match text {
                "auto" => Self::Auto,
                "none" => Self::None,
                "motion" => Self::Motion,
                "exact" => Self::Exact,
                "noisy" => Self::Noisy(1),
                _ => return Err(format!("one of {}", known())),
            });
        };
        if kind == "noisy" {
            return rest
                .parse()
                .map(Self::Noisy)
                .map_err(|_| format!("{rest} is not a seed: give a whole number"));
        }
        if rest.is_empty() {
            return Err(format!("{text} does not name a file or folder"));
        }
        if kind == "onnx" {
            return Ok(Self::Networks(rest.split(',').map(PathBuf::from).collect()));
        }
        let format = MASK_FORMATS.iter().find(|format| format.name == kind);
        let format = format.ok_or_else(|| format!("there is no source {kind}: use {}", known()))?;
        Ok(Self::Files(format, PathBuf::from(rest)))
    }
}

/// The text that [`MaskChoice::from_str`] reads.
impl fmt::Display for MaskChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::None => f.write_str("none"),
            Self::Motion => f.write_str("motion"),
            Self::Files(format, path) => write!(f, "{}:{}", format.name, path.display()),
            Self::Networks(paths) => {
                let paths: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
                write!(f, "onnx:{}", paths.join(","))
            }
            Self::Exact => f.write_str("exact"),
            Self::Noisy(seed) => write!(f, "noisy:{seed}"),
        }
    }
}
