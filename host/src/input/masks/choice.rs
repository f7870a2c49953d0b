//! Choosing a source of masks.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// Where masks come from, as the command line says it.
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
    /// A folder of instance PNGs and lists.
    Files(PathBuf),
    /// KITTI-MOTS: a folder of PNGs or a text file.
    Mots(PathBuf),
    /// A folder of MNC dumps.
    Mnc(PathBuf),
    /// A file of COCO JSON: polygons, run lengths or boxes.
    Coco(PathBuf),
    /// A folder of YOLO text: boxes or polygons.
    Yolo(PathBuf),
    /// Boxes: labels of KITTI, MOTChallenge text, or a folder of lists.
    Boxes(PathBuf),
    /// A folder of PNGs of instance numbers without lists.
    Ids(PathBuf),
    /// Networks of ONNX files.
    Networks(Vec<PathBuf>),
    /// The synthetic street's exact masks.
    Exact,
    /// The same with a detector's faults, drawn from a seed.
    Noisy(u64),
}

impl MaskChoice {
    /// Whether moving objects are searched for by their motion; `None` where the settings decide.
    pub fn finds_motion(&self) -> Option<bool> {
        match self {
            Self::Auto | Self::Motion => Some(true),
            Self::None => Some(false),
            _ => None,
        }
    }
}

/// What `--instances` takes.
const KNOWN: &str = "auto, motion, none, files:DIR, mots:DIR, mnc:DIR, coco:FILE, yolo:DIR, boxes:FILE, ids:DIR, onnx:FILE, exact, noisy";

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
                _ => return Err(format!("one of {KNOWN}")),
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
        let source = match kind {
            "onnx" => return Ok(Self::Networks(rest.split(',').map(PathBuf::from).collect())),
            "files" => Self::Files,
            "mots" => Self::Mots,
            "mnc" => Self::Mnc,
            "coco" => Self::Coco,
            "yolo" => Self::Yolo,
            "boxes" => Self::Boxes,
            "ids" => Self::Ids,
            _ => return Err(format!("there is no source {kind}: use {KNOWN}")),
        };
        Ok(source(PathBuf::from(rest)))
    }
}
