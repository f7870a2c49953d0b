//! Choosing a source and laying it over a data set.

use super::compare::{self, Ratios};
use super::scale::{DepthScale, suggestion};
use crate::formats::{FormatError, Image, read_opencv_depth, read_pfm, read_png_deep};
use crate::input::source::{
    AvailableMasks, FrameSource, GivenDepth, InputError, Overlay, OverlaySource, Quantity,
    StereoImages, to_disparity,
};
use dynvox_core::geometry::StereoRig;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Endings looked for, in this order.
const ENDINGS: [&str; 3] = ["png", "pfm", "xml"];
/// Folder the original puts its files in, below the one it is told.
const INNER: &str = "Frames";

/// Folder of files of depth or disparity, named like the left images.
pub struct DepthFolder {
    /// Name on the command line, before the colon.
    pub name: &'static str,
    /// Quantity that the files of a folder hold.
    quantity: fn(&Path) -> Quantity,
}

/// A kind of folder as its name.
mod kind {
    use super::{DEPTH_FOLDERS, DepthFolder};
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;

    pub fn serialize<S: Serializer>(
        kind: &&'static DepthFolder,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(kind.name)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<&'static DepthFolder, D::Error> {
        let name = String::deserialize(deserializer)?;
        let kind = DEPTH_FOLDERS.iter().find(|kind| kind.name == name);
        kind.ok_or_else(|| D::Error::custom(format!("no folder of depth is named {name}")))
    }
}

/// All kinds of folders.
pub static DEPTH_FOLDERS: &[DepthFolder] = &[
    DepthFolder { name: "files", quantity: quantity_of },
    DepthFolder { name: "disparity", quantity: |_| Quantity::DisparityPx },
    DepthFolder { name: "depth", quantity: |_| Quantity::DepthM },
];

/// Two kinds are equal if their names are.
impl PartialEq for DepthFolder {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for DepthFolder {}

impl fmt::Debug for DepthFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Source of depth, as the command line names it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthChoice {
    /// The core's stereo matching.
    #[default]
    Elas,
    /// Files of a kind, in a folder.
    Files(#[serde(with = "kind")] &'static DepthFolder, PathBuf),
    /// The synthetic street's exact depth.
    Exact,
}

impl FromStr for DepthChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || {
            let folders: Vec<_> =
                DEPTH_FOLDERS.iter().map(|kind| format!("{}:DIR", kind.name)).collect();
            format!("one of elas, {}, exact", folders.join(", "))
        };
        match text.split_once(':') {
            None if text == "elas" => Ok(Self::Elas),
            None if text == "exact" => Ok(Self::Exact),
            None => Err(known()),
            Some((name, path)) => {
                let kind = DEPTH_FOLDERS.iter().find(|kind| kind.name == name);
                let kind = kind.ok_or_else(known)?;
                if path.is_empty() {
                    return Err(format!("{text} names no folder"));
                }
                Ok(Self::Files(kind, PathBuf::from(path)))
            }
        }
    }
}

/// The text that [`DepthChoice::from_str`] reads.
impl fmt::Display for DepthChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Elas => f.write_str("elas"),
            Self::Files(kind, path) => write!(f, "{}:{}", kind.name, path.display()),
            Self::Exact => f.write_str("exact"),
        }
    }
}

/// Lays the chosen depth over a data set whose images have their full size; `scale` is the unit of
/// the files' numbers, where it is not the usual one.
///
/// # Errors
/// The folder does not exist, has nothing for any frame, has depths of another unit, or the data set
/// has no exact depth.
pub fn attach(
    dataset: Box<dyn FrameSource>,
    choice: &DepthChoice,
    scale: Option<&DepthScale>,
) -> Result<Box<dyn FrameSource>, InputError> {
    let (folder, quantity) = match choice {
        DepthChoice::Elas => return Ok(dataset),
        DepthChoice::Exact if dataset.masks() != AvailableMasks::Exact => {
            return Err(InputError::depth(
                Path::new(dataset.name()),
                "only the synthetic street has exact depth".to_owned(),
            ));
        }
        DepthChoice::Exact => {
            return Ok(Box::new(Overlay::new(dataset, Source::Exact, "exact depth".to_owned())));
        }
        DepthChoice::Files(kind, folder) => (folder, (kind.quantity)(folder)),
    };
    if !folder.is_dir() {
        return Err(InputError::depth(folder, "there is no such folder".to_owned()));
    }
    let folders = if folder.join(INNER).is_dir() {
        vec![folder.clone(), folder.join(INNER)]
    } else {
        vec![folder.clone()]
    };
    let stems: Vec<String> = (0..dataset.len())
        .map(|index| dataset.stem(index).unwrap_or_else(|| format!("{index:06}")))
        .collect();
    let files: Vec<Option<PathBuf>> = stems.iter().map(|stem| file_of(&folders, stem)).collect();
    let there = files.iter().flatten().count();
    if there == 0 {
        let example = stems.first().map_or("000000", String::as_str);
        return Err(InputError::depth(
            folder,
            format!("it has nothing for any frame; the first would be {example}.png, .pfm or .xml"),
        ));
    }
    let what = match quantity {
        Quantity::DisparityPx => "disparity",
        Quantity::DepthM => "depth",
    };
    let part = if there == files.len() {
        String::new()
    } else {
        format!(" for {there} of {} frames", files.len())
    };
    let unit = FileUnit { quantity, per_unit: scale.map(DepthScale::per_unit) };
    let mut note = format!("{what} from {}{part}", folder.display());
    if let Some(off) = unit_off(dataset.as_ref(), &files, unit)? {
        // A unit that was named is believed, and the factor is only said.
        if scale.is_none() {
            return Err(InputError::depth(folder, off));
        }
        note = format!("{note}; {off}");
    }
    let expected = stems.iter().map(|stem| folder.join(format!("{stem}.png"))).collect();
    Ok(Box::new(Overlay::new(dataset, Source::Files { files, expected, unit }, note)))
}

/// Says by which factor the files' depths differ from the run's own matches, if by one.
fn unit_off(
    dataset: &dyn FrameSource,
    files: &[Option<PathBuf>],
    unit: FileUnit,
) -> Result<Option<String>, InputError> {
    let there: Vec<(usize, &PathBuf)> =
        (0..).zip(files).filter_map(|(at, file)| Some((at, file.as_ref()?))).collect();
    let step = there.len().div_ceil(compare::FRAMES).max(1);
    let mut ratios = Ratios::default();
    for (index, path) in there.iter().step_by(step) {
        // Frames that cannot be read are refused when their turn comes.
        let Ok(images) = dataset.frame(*index) else { continue };
        let Ok((values, quantity)) = values_of(path, unit, dataset.size()) else { continue };
        let rig = dataset.rig();
        let product = (rig.focal_px * rig.baseline_m) as f32;
        // Of a wrong unit most values may be none that the rig can have: they tell it, too.
        let given_px = values.map(|&value| match quantity {
            Quantity::DisparityPx => value,
            Quantity::DepthM if value > 0.0 => product / value,
            Quantity::DepthM => 0.0,
        });
        if let Some(matched) = compare::matched(dataset, &images) {
            ratios.add(&given_px, &matched);
        }
    }
    Ok(ratios.factor().map(|ratio| {
        let (factor, direction) = if ratio > 1.0 { (ratio, "near") } else { (1.0 / ratio, "far") };
        // Depth falls as disparity rises.
        let right = match (unit.quantity, there.first()) {
            (Quantity::DepthM, Some((_, path))) => unit.of(path) * ratio,
            (Quantity::DisparityPx, Some((_, path))) => unit.of(path) / ratio,
            (_, None) => 1.0,
        };
        let option = suggestion(right, unit.quantity);
        format!(
            "its depths are {factor:.1} x too {direction} compared with the run's own matches. The \
             unit of its numbers may be another: try --depth-scale {option}"
        )
    }))
}

/// Unit of the numbers in files.
#[derive(Clone, Copy, Debug)]
pub(super) struct FileUnit {
    pub quantity: Quantity,
    /// M or px for each unit; `None` for the usual unit of the file's format.
    pub per_unit: Option<f64>,
}

impl FileUnit {
    /// The usual unit.
    #[cfg(test)]
    pub fn usual(quantity: Quantity) -> Self {
        Self { quantity, per_unit: None }
    }

    /// M or px for each unit of a file's numbers.
    fn of(&self, path: &Path) -> f64 {
        let usual = || match (ending(path), self.quantity) {
            (Some("pfm"), _) => 1.0,
            (Some("xml"), _) | (_, Quantity::DepthM) => 1e-3,
            (_, Quantity::DisparityPx) => 1.0 / 256.0,
        };
        self.per_unit.unwrap_or_else(usual)
    }
}

fn ending(path: &Path) -> Option<&str> {
    path.extension().and_then(|ending| ending.to_str())
}

/// A folder whose name speaks of depth and not of disparity holds depth:
/// `precomputed-depth-dispnet` holds disparity.
fn quantity_of(folder: &Path) -> Quantity {
    let name = folder.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    if name.contains("depth") && !name.contains("disp") {
        Quantity::DepthM
    } else {
        Quantity::DisparityPx
    }
}

/// The file of a frame: named as its image, or by its number in four digits as the original does.
fn file_of(folders: &[PathBuf], stem: &str) -> Option<PathBuf> {
    let short = stem.parse::<u32>().ok().map(|number| format!("{number:04}"));
    let stems = std::iter::once(stem).chain(short.as_deref());
    let candidates = stems.flat_map(|stem| folders.iter().map(move |folder| (folder, stem)));
    let mut files = candidates
        .flat_map(|(folder, stem)| ENDINGS.map(|ending| folder.join(format!("{stem}.{ending}"))));
    files.find(|path| path.is_file())
}

/// Reads one file. What it holds follows from its format and `unit`.
pub(super) fn read(
    path: &Path,
    unit: FileUnit,
    size: (usize, usize),
    rig: &StereoRig,
) -> Result<GivenDepth, InputError> {
    let (values, quantity) = values_of(path, unit, size)?;
    let given = to_disparity(&values, quantity, rig);
    match refused_by_most(&given, &values, quantity) {
        Some(reason) => Err(InputError::depth(path, reason)),
        None => Ok(given),
    }
}

/// The values of a file, m or px.
fn values_of(
    path: &Path,
    unit: FileUnit,
    size: (usize, usize),
) -> Result<(Image<f32>, Quantity), InputError> {
    let per_unit = unit.of(path) as f32;
    Ok(match ending(path) {
        Some("pfm") => {
            let values = read_pfm(path, size).map_err(InputError::depth_format)?;
            (values.map(|value| value * per_unit), unit.quantity)
        }
        Some("xml") => {
            // Read in m, of mm.
            let values = read_opencv_depth(path, size).map_err(InputError::depth_format)?;
            (values.map(|value| value * (per_unit / 1e-3)), Quantity::DepthM)
        }
        _ => {
            let image = read_png_deep(path).map_err(InputError::depth_format)?;
            if (image.width(), image.height()) != size {
                return Err(InputError::depth_format(FormatError::other_size(
                    path,
                    (image.width(), image.height()),
                    size,
                )));
            }
            (image.map(|&value| f32::from(value) * per_unit), unit.quantity)
        }
    })
}

/// Says why most values of a file are none, if they are.
fn refused_by_most(given: &GivenDepth, values: &Image<f32>, quantity: Quantity) -> Option<String> {
    let usable = given.disparity_q8.pixels().iter().filter(|value| **value > 0).count();
    let count = |is: fn(f32) -> bool| values.pixels().iter().filter(|value| is(**value)).count();
    let (all, finite, negative, positive) = (
        values.pixels().len(),
        count(f32::is_finite),
        count(|value| value < 0.0 && value.is_finite()),
        count(|value| value > 0.0 && value.is_finite()),
    );
    if negative > usable {
        return Some(format!(
            "{negative} of {all} values are negative. Disparities of some matchers are right minus \
             left: if these are, give --depth-scale negative"
        ));
    }
    if given.refused.out_of_range as usize > usable {
        let bound = match quantity {
            Quantity::DisparityPx => "are disparities of 256 px and more",
            Quantity::DepthM => "are depths nearer than a disparity of 256 px",
        };
        return Some(format!(
            "{} of {all} values {bound}: the unit may be another. Give it with --depth-scale",
            given.refused.out_of_range
        ));
    }
    if usable == 0 && 2 * positive > all {
        return Some(format!(
            "{positive} of {all} values are too far to have a disparity: the unit may be another. \
             Give it with --depth-scale"
        ));
    }
    (finite == 0).then(|| format!("none of its {all} values is a number"))
}

enum Source {
    Files {
        files: Vec<Option<PathBuf>>,
        /// Paths at which a missing file was expected.
        expected: Vec<PathBuf>,
        unit: FileUnit,
    },
    Exact,
}

impl OverlaySource for Source {
    fn add(
        &self,
        dataset: &dyn FrameSource,
        index: usize,
        images: &mut StereoImages,
    ) -> Result<(), InputError> {
        let (size, rig) = (dataset.size(), dataset.rig());
        images.depth = match self {
            Self::Exact => images.exact.as_ref().map(|exact| {
                // The sky is no value that could not be used.
                let depth_m: Image<f32> =
                    exact.depth_m.map(|&depth_m| if depth_m.is_finite() { depth_m } else { 0.0 });
                to_disparity(&depth_m, Quantity::DepthM, &rig)
            }),
            Self::Files { files, expected, unit } => {
                match (files.get(index).and_then(Option::as_ref), expected.get(index)) {
                    (Some(path), _) => Some(read(path, *unit, size, &rig)?),
                    (None, Some(path)) => {
                        return Err(InputError::depth(
                            path,
                            "it is missing, as are .pfm and .xml of that name".to_owned(),
                        ));
                    }
                    // Frames beyond the data set are its own to refuse.
                    (None, None) => None,
                }
            }
        };
        Ok(())
    }
}
