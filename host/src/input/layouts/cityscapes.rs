//! Cityscapes: `leftImg8bit_sequence/SPLIT/CITY/CITY_SEQUENCE_FRAME_leftImg8bit.png`, the right
//! images likewise, and a camera file for each sequence. One sequence of 30 frames is one
//! recording.

use super::kitti::{chosen, sequences};
use super::names::{pictures_in, stem_of};
use super::pairing::CameraFiles;
use super::sequence::{ImageFiles, Parts, Sequence, present};
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::{FormatError, read_text_within};
use crate::input::data_set::{DataSet, Layout, OpenOptions};
use crate::input::source::InputError;
use dynvox_core::geometry::StereoRig;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Folders of the images of a side, of whole sequences first.
const LEFT: [&str; 2] = ["leftImg8bit_sequence", "leftImg8bit"];
const RIGHT: [&str; 2] = ["rightImg8bit_sequence", "rightImg8bit"];
/// Frames a second of its cameras.
const RATE_HZ: u64 = 17;

/// A camera file.
#[derive(Deserialize)]
struct CameraFile {
    extrinsic: Extrinsic,
    intrinsic: Intrinsic,
}

#[derive(Deserialize)]
struct Extrinsic {
    baseline: f64,
}

#[derive(Deserialize)]
struct Intrinsic {
    fx: f64,
    u0: f64,
    v0: f64,
}

/// Cityscapes.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "cityscapes",
    summary: "Cityscapes: `leftImg8bit_sequence`, `rightImg8bit_sequence`, `camera`",
    describe: |_| "Cityscapes: left and right images of each sequence".to_owned(),
    matches: |path| left_root(path).is_some(),
    sequences: |path| Ok(sequences_of(path)?.into_keys().collect()),
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

/// Opens a sequence, named `aachen_000000`.
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let all = sequences_of(path)?;
    let names: Vec<String> = all.keys().cloned().collect();
    let name = chosen(path, options.sequence.as_deref(), &names)?;
    let folder = all.get(&name).cloned().unwrap_or_default();
    let action = "Fetch rightImg8bit_sequence and camera of the data set: a stereo mapper needs \
                  both cameras";
    let right = RIGHT
        .iter()
        .map(|side| path.join(side))
        .find(|side| side.is_dir())
        .unwrap_or(path.join(RIGHT[0]));
    let right = present(right, action)?.join(&folder);
    let left = left_root(path).unwrap_or_default().join(&folder);
    let of_sequence = |folder: &Path| -> Result<CameraFiles, InputError> {
        let files: Vec<PathBuf> = pictures_in(folder)?
            .into_iter()
            .filter(|file| sequence_of(file).as_deref() == Some(&name))
            .collect();
        // The frames of a sequence are numbered on; their cameras are triggered at a constant rate.
        let number = |file: &PathBuf| stem_of(file).split('_').nth(2)?.parse::<u64>().ok();
        let stamps_ns =
            files.iter().map(|file| Some(number(file)? * 1_000_000_000 / RATE_HZ)).collect();
        Ok(CameraFiles { files, stamps_ns })
    };
    let images = ImageFiles::Cameras([of_sequence(&left)?, of_sequence(&right)?]);
    let cameras = options.cameras_or(|| rig(&path.join("camera").join(&folder), &name))?;
    Sequence::from_parts(Parts {
        notes: vec![format!("times by the data set's {RATE_HZ} frames a second")],
        instances: path.join("instances").join(&name),
        ..Parts::new(options, format!("cityscapes-{name}"), images, cameras)
    })
}

/// The folder of all left images, if this is the data set.
fn left_root(path: &Path) -> Option<PathBuf> {
    LEFT.iter().map(|side| path.join(side)).find(|side| side.is_dir())
}

/// Each sequence with its folder below that of the side: `train/aachen`.
fn sequences_of(path: &Path) -> Result<BTreeMap<String, PathBuf>, InputError> {
    let root = left_root(path)
        .ok_or_else(|| InputError::Layout { path: path.to_path_buf(), below: Vec::new() })?;
    let mut found = BTreeMap::new();
    for split in sequences(&root)? {
        for city in sequences(&root.join(&split))? {
            let folder = Path::new(&split).join(city);
            let names = pictures_in(&root.join(&folder))?
                .iter()
                .filter_map(|file| sequence_of(file))
                .collect::<Vec<_>>();
            found.extend(names.into_iter().map(|name| (name, folder.clone())));
        }
    }
    Ok(found)
}

/// `aachen_000000` of `aachen_000000_000019_leftImg8bit.png`.
fn sequence_of(file: &Path) -> Option<String> {
    let stem = stem_of(file);
    let mut words = stem.split('_');
    Some(format!("{}_{}", words.next()?, words.next()?))
}

/// The rig of a sequence's first camera file.
fn rig(folder: &Path, sequence: &str) -> Result<StereoRig, FormatError> {
    let entries = std::fs::read_dir(folder)
        .map_err(FormatError::read(folder))?
        .flatten()
        .map(|entry| entry.path());
    let mut files: Vec<PathBuf> = entries
        .filter(|file| {
            file.extension().is_some_and(|ending| ending == "json")
                && stem_of(file).starts_with(sequence)
        })
        .collect();
    files.sort();
    let missing = || {
        FormatError::content(
            folder,
            format!("it has no camera file of {sequence}"),
            "Fetch the data set's camera files",
        )
    };
    let file = files.first().ok_or_else(missing)?;
    let refuse = |reason: String| {
        FormatError::content(
            file,
            reason,
            "Fetch the camera file anew, or give a calibration with --calibration",
        )
    };
    let camera: CameraFile = serde_json::from_str(&read_text_within(file, &CALIBRATION_TEXT)?)
        .map_err(|error| refuse(error.to_string()))?;
    let rig = StereoRig {
        focal_px: camera.intrinsic.fx,
        center_u_px: camera.intrinsic.u0,
        center_v_px: camera.intrinsic.v0,
        baseline_m: camera.extrinsic.baseline,
    };
    if rig.validate().is_ok() {
        Ok(rig)
    } else {
        Err(refuse("its numbers are not those of a stereo camera".to_owned()))
    }
}
