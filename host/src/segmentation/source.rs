//! Choosing a source and laying it over a data set.

use super::{
    Frames, Segmenter, Sightings, exact::Exact, indexed::Indexed, mnc::Mnc, mots::MotsPictures, mots::MotsText, noisy::Noisy, unusable,
};
use crate::dataset::{Dataset, DatasetError, Layer, Masks, Overlay, StereoImages};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where masks come from, as the command line says it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// The data set's own: its folder of instances, the street's exact masks, else none.
    #[default]
    Auto,
    /// Nothing is seen.
    None,
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

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = |path: &str| if path.is_empty() { Err(format!("{text} names no folder")) } else { Ok(PathBuf::from(path)) };
        Ok(match text.split_once(':') {
            None => match text {
                "auto" => Self::Auto,
                "none" => Self::None,
                "exact" => Self::Exact,
                "noisy" => Self::Noisy(1),
                _ => return Err("one of auto, none, files:DIR, mots:DIR, mnc:DIR, exact, noisy".to_owned()),
            },
            Some(("files", folder)) => Self::Files(path(folder)?),
            Some(("mots", folder)) => Self::Mots(path(folder)?),
            Some(("mnc", folder)) => Self::Mnc(path(folder)?),
            Some(("noisy", seed)) => Self::Noisy(seed.parse().map_err(|_| format!("{seed} is no seed: give a whole number"))?),
            Some((kind, _)) => {
                return Err(format!("there is no source {kind}: use auto, none, files:DIR, mots:DIR, mnc:DIR, exact, noisy"));
            }
        })
    }
}

/// Lays the chosen masks over a data set.
///
/// # Errors
/// The source does not exist, has nothing for any frame, or does not fit the data set.
pub fn attach(dataset: Box<dyn Dataset>, choice: &Choice) -> Result<Box<dyn Dataset>, DatasetError> {
    let source = Source::open(dataset.as_ref(), choice)?;
    let Some(Source { segmenter, note, fits_scaled }) = source else { return Ok(dataset) };
    let scale = dataset.size().0 as f64 / dataset.full_size().0 as f64;
    let shrink = (!fits_scaled && dataset.size() != dataset.full_size()).then_some(scale);
    Ok(Box::new(Overlay::new(dataset, Masking { segmenter, shrink }, note)))
}

/// A source that was opened.
struct Source {
    segmenter: Box<dyn Segmenter>,
    note: String,
    /// Whether its masks have the size of the images as they are mapped, not as they are in files.
    fits_scaled: bool,
}

impl Source {
    fn open(dataset: &dyn Dataset, choice: &Choice) -> Result<Option<Self>, DatasetError> {
        let frames = || Frames {
            stems: (0..dataset.len()).map(|index| dataset.stem(index).unwrap_or_else(|| format!("{index:06}"))).collect(),
            size: dataset.full_size(),
        };
        let exact = |segmenter: Box<dyn Segmenter>, note: &str| {
            if dataset.masks() != Masks::Exact {
                return Err(unusable(Path::new(dataset.name()), "only the synthetic street has exact masks".to_owned()));
            }
            Ok(Some(Self { segmenter, note: note.to_owned(), fits_scaled: true }))
        };
        let files = |(segmenter, there): (Box<dyn Segmenter>, usize), path: &Path| {
            let all = dataset.len();
            let note = match there {
                there if there == all => format!("masks from {}", path.display()),
                there => format!("masks from {} for {there} of {all} frames: in the others nothing is seen", path.display()),
            };
            Self { segmenter, note, fits_scaled: false }
        };
        fn boxed<S: Segmenter + 'static>((segmenter, there): (S, usize)) -> (Box<dyn Segmenter>, usize) {
            (Box::new(segmenter), there)
        }
        let opened = |path: &Path, open: &dyn Fn() -> Result<(Box<dyn Segmenter>, usize), DatasetError>| {
            if !path.exists() {
                return Err(unusable(path, "there is no such folder".to_owned()));
            }
            let (segmenter, there) = open()?;
            if there == 0 {
                let example = dataset.stem(0).unwrap_or_else(|| "000000".to_owned());
                return Err(unusable(path, format!("it has nothing for any frame; the first image is {example}.png")));
            }
            Ok(Some(files((segmenter, there), path)))
        };
        match choice {
            Choice::None => Ok(None),
            Choice::Exact => exact(Box::new(Exact), "exact masks"),
            Choice::Noisy(seed) => exact(Box::new(Noisy { inner: Exact, seed: *seed }), "exact masks with a detector's faults"),
            Choice::Auto => match dataset.masks() {
                Masks::Absent => Ok(None),
                Masks::Exact => exact(Box::new(Exact), "exact masks"),
                Masks::Folder(folder) => match boxed(Indexed::open(&folder, frames())) {
                    (_, 0) => Ok(None),
                    found => Ok(Some(files(found, &folder))),
                },
            },
            Choice::Files(folder) => opened(folder, &|| Ok(boxed(Indexed::open(folder, frames())))),
            Choice::Mots(path) if path.is_file() => opened(path, &|| Ok(boxed((MotsText::open(path, frames())?, dataset.len())))),
            Choice::Mots(folder) => opened(folder, &|| Ok(boxed(MotsPictures::open(folder, frames())))),
            Choice::Mnc(folder) => opened(folder, &|| {
                let (dumps, there) = Mnc::open(folder, frames());
                // A frame without a dump is one in which nothing was found: only a folder without any is wrong.
                Ok(boxed((dumps, if there > 0 { dataset.len() } else { 0 })))
            }),
        }
    }
}

/// Masks, fitted to the images.
struct Masking {
    segmenter: Box<dyn Segmenter>,
    /// How much masks must be scaled to fit the images.
    shrink: Option<f64>,
}

impl Layer for Masking {
    fn add(&self, dataset: &dyn Dataset, index: usize, images: &mut StereoImages) -> Result<(), DatasetError> {
        let mut seen: Sightings = self.segmenter.sightings(index, images)?;
        if let Some(scale) = self.shrink {
            for one in std::mem::take(&mut seen.all) {
                seen.keep(one.shrunk(scale, dataset.size()));
            }
        }
        images.sightings = seen;
        Ok(())
    }
}
