//! Choosing a source and laying it over a data set.

use super::{Frames, MaskSource, exact::Exact, indexed::Indexed, mnc::Mnc, mots::MotsPictures, mots::MotsText, noisy::Noisy};
use crate::input::source::{AvailableMasks, FrameMasks, FrameSource, InputError, Overlay, OverlaySource, StereoImages};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where masks come from, as the command line says it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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
            Self::Files(_) | Self::Mots(_) | Self::Mnc(_) | Self::Exact | Self::Noisy(_) => None,
        }
    }
}

impl FromStr for MaskChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = |path: &str| if path.is_empty() { Err(format!("{text} does not name a folder")) } else { Ok(PathBuf::from(path)) };
        Ok(match text.split_once(':') {
            None => match text {
                "auto" => Self::Auto,
                "none" => Self::None,
                "motion" => Self::Motion,
                "exact" => Self::Exact,
                "noisy" => Self::Noisy(1),
                _ => return Err("one of auto, motion, none, files:DIR, mots:DIR, mnc:DIR, exact, noisy".to_owned()),
            },
            Some(("files", folder)) => Self::Files(path(folder)?),
            Some(("mots", folder)) => Self::Mots(path(folder)?),
            Some(("mnc", folder)) => Self::Mnc(path(folder)?),
            Some(("noisy", seed)) => Self::Noisy(seed.parse().map_err(|_| format!("{seed} is not a seed: give a whole number"))?),
            Some((kind, _)) => {
                return Err(format!("there is no source {kind}: use auto, motion, none, files:DIR, mots:DIR, mnc:DIR, exact, noisy"));
            }
        })
    }
}

/// Lays the chosen masks over a data set.
///
/// # Errors
/// The source does not exist, has nothing for any frame, or does not fit the data set.
pub fn attach(dataset: Box<dyn FrameSource>, choice: &MaskChoice) -> Result<Box<dyn FrameSource>, InputError> {
    let opened = OpenedSource::open(dataset.as_ref(), choice)?;
    let Some(OpenedSource { source, note, fits_scaled }) = opened else { return Ok(dataset) };
    let scale = dataset.size().0 as f64 / dataset.full_size().0 as f64;
    let shrink = (!fits_scaled && dataset.size() != dataset.full_size()).then_some(scale);
    Ok(Box::new(Overlay::new(dataset, MaskOverlay { source, shrink }, note)))
}

/// A source that was opened.
struct OpenedSource {
    source: Box<dyn MaskSource>,
    note: String,
    /// Whether its masks have the size of the images as they are mapped, not as they are in files.
    fits_scaled: bool,
}

impl OpenedSource {
    fn open(dataset: &dyn FrameSource, choice: &MaskChoice) -> Result<Option<Self>, InputError> {
        let frames = || Frames {
            stems: (0..dataset.len()).map(|index| dataset.stem(index).unwrap_or_else(|| format!("{index:06}"))).collect(),
            size: dataset.full_size(),
        };
        let exact = |source: Box<dyn MaskSource>, note: &str| {
            if dataset.masks() != AvailableMasks::Exact {
                return Err(InputError::masks(Path::new(dataset.name()), "only the synthetic street has exact masks".to_owned()));
            }
            Ok(Some(Self { source, note: note.to_owned(), fits_scaled: true }))
        };
        let files = |(source, there): (Box<dyn MaskSource>, usize), path: &Path| {
            let all = dataset.len();
            let note = match there {
                there if there == all => format!("masks from {}", path.display()),
                there => format!("masks from {} for {there} of {all} frames: in the others nothing is seen", path.display()),
            };
            Self { source, note, fits_scaled: false }
        };
        fn boxed<S: MaskSource + 'static>((source, there): (S, usize)) -> (Box<dyn MaskSource>, usize) {
            (Box::new(source), there)
        }
        let opened = |path: &Path, open: &dyn Fn() -> Result<(Box<dyn MaskSource>, usize), InputError>| {
            if !path.exists() {
                return Err(InputError::masks(path, "there is no such folder".to_owned()));
            }
            let (source, there) = open()?;
            if there == 0 {
                let example = dataset.stem(0).unwrap_or_else(|| "000000".to_owned());
                return Err(InputError::masks(path, format!("it has nothing for any frame; the first image is {example}.png")));
            }
            Ok(Some(files((source, there), path)))
        };
        match choice {
            MaskChoice::None | MaskChoice::Motion => Ok(None),
            MaskChoice::Exact => exact(Box::new(Exact), "exact masks"),
            MaskChoice::Noisy(seed) => exact(Box::new(Noisy { inner: Exact, seed: *seed }), "exact masks with a detector's faults"),
            MaskChoice::Auto => match dataset.masks() {
                AvailableMasks::Absent | AvailableMasks::Exact => Ok(None),
                AvailableMasks::Folder(folder) => match boxed(Indexed::open(&folder, frames())) {
                    (_, 0) => Ok(None),
                    found => Ok(Some(files(found, &folder))),
                },
            },
            MaskChoice::Files(folder) => opened(folder, &|| Ok(boxed(Indexed::open(folder, frames())))),
            MaskChoice::Mots(path) if path.is_file() => opened(path, &|| Ok(boxed((MotsText::open(path, frames())?, dataset.len())))),
            MaskChoice::Mots(folder) => opened(folder, &|| Ok(boxed(MotsPictures::open(folder, frames())))),
            MaskChoice::Mnc(folder) => opened(folder, &|| {
                let (dumps, there) = Mnc::open(folder, frames());
                // A frame without a dump is one in which nothing was found: only a folder without any is wrong.
                Ok(boxed((dumps, if there > 0 { dataset.len() } else { 0 })))
            }),
        }
    }
}

/// Masks, fitted to the images.
struct MaskOverlay {
    source: Box<dyn MaskSource>,
    /// How much masks must be scaled to fit the images.
    shrink: Option<f64>,
}

impl OverlaySource for MaskOverlay {
    fn add(&self, dataset: &dyn FrameSource, index: usize, images: &mut StereoImages) -> Result<(), InputError> {
        let mut masks: FrameMasks = self.source.masks(index, images)?;
        if let Some(scale) = self.shrink {
            for one in std::mem::take(&mut masks.instances) {
                masks.push(one.scaled(scale, dataset.size()));
            }
        }
        images.masks = masks;
        Ok(())
    }
}
