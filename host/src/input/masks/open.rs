//! Laying a source of masks over a data set.

#[cfg(feature = "onnx")]
use super::boxes::BoxMasks;
use super::format::{OpenedMasks, frames_of};
use super::indexed::Indexed;
#[cfg(feature = "onnx")]
use super::network::Networks;
use super::{MaskChoice, MaskFormat, MaskSource, exact::Exact, noisy::Noisy};
use crate::input::source::{
    AvailableMasks, FrameMasks, FrameSource, InputError, Overlay, OverlaySource, StereoImages,
    StopRequest,
};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Lays the chosen masks over a data set, those of every `every`-th frame. Where a network takes
/// long, `stop` ends it.
///
/// # Errors
/// The source does not exist, has nothing for any frame, or does not fit the data set.
pub fn attach(
    dataset: Box<dyn FrameSource>,
    choice: &MaskChoice,
    every: NonZeroUsize,
    stop: &StopRequest,
) -> Result<Box<dyn FrameSource>, InputError> {
    let opened = open(dataset.as_ref(), choice, stop)?;
    let Some(OpenedSource { source, note, fits_scaled }) = opened else {
        return Ok(dataset);
    };
    let scale = dataset.size().0 as f64 / dataset.full_size().0 as f64;
    let shrink = (!fits_scaled && dataset.size() != dataset.full_size()).then_some(scale);
    Ok(Box::new(Overlay::new(dataset, MaskOverlay { source, shrink, every }, note)))
}

/// A source that was opened.
struct OpenedSource {
    source: Box<dyn MaskSource>,
    note: String,
    /// True if the masks have the size of the images as they are mapped, rather than as they are in
    /// files.
    fits_scaled: bool,
}

/// Opens the chosen source; `None` where there are no masks.
fn open(
    dataset: &dyn FrameSource,
    choice: &MaskChoice,
    stop: &StopRequest,
) -> Result<Option<OpenedSource>, InputError> {
    let opened = match choice {
        MaskChoice::None | MaskChoice::Motion => return Ok(None),
        MaskChoice::Exact => exact(dataset, Box::new(Exact), "exact masks")?,
        MaskChoice::Noisy(seed) => exact(
            dataset,
            Box::new(Noisy { inner: Exact, seed: *seed }),
            "exact masks with a detector's faults",
        )?,
        MaskChoice::Auto => return Ok(available(dataset)),
        MaskChoice::Files(format, path) => given(dataset, format, path)?,
        MaskChoice::Networks(paths) => networks(dataset, paths, stop)?,
    };
    Ok(Some(opened))
}

/// The synthetic street's own masks.
fn exact(
    dataset: &dyn FrameSource,
    source: Box<dyn MaskSource>,
    note: &str,
) -> Result<OpenedSource, InputError> {
    if dataset.masks() != AvailableMasks::Exact {
        return Err(InputError::masks(
            Path::new(dataset.name()),
            "only the synthetic street has exact masks".to_owned(),
        ));
    }
    Ok(OpenedSource { source, note: note.to_owned(), fits_scaled: true })
}

/// The masks that come with a data set.
fn available(dataset: &dyn FrameSource) -> Option<OpenedSource> {
    let AvailableMasks::Folder(folder) = dataset.masks() else { return None };
    let (source, there) = Indexed::open(&folder, frames_of(dataset));
    let note = note(dataset, &folder, there);
    (there > 0).then(|| OpenedSource { source: Box::new(source), note, fits_scaled: false })
}

/// Masks, or boxes to make masks of, from files.
fn given(
    dataset: &dyn FrameSource,
    format: &MaskFormat,
    path: &Path,
) -> Result<OpenedSource, InputError> {
    if !path.exists() {
        return Err(InputError::masks(path, "there is no such file or folder".to_owned()));
    }
    let OpenedMasks { source, there, fits_scaled } = (format.open)(path, dataset)?;
    if there == 0 {
        let example = dataset.stem(0).unwrap_or_else(|| "000000".to_owned());
        return Err(InputError::masks(
            path,
            format!("it has nothing for any frame; the first image is {example}.png"),
        ));
    }
    Ok(OpenedSource { source, note: note(dataset, path, there), fits_scaled })
}

/// Masks of networks.
#[cfg(feature = "onnx")]
fn networks(
    dataset: &dyn FrameSource,
    paths: &[PathBuf],
    stop: &StopRequest,
) -> Result<OpenedSource, InputError> {
    let source = Box::new(BoxMasks::of_pictures(Networks::open(paths, stop)?, dataset)?);
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    Ok(OpenedSource {
        source,
        note: format!("masks of {}", names.join(" and ")),
        fits_scaled: true,
    })
}

/// Networks in a program that was built without them.
#[cfg(not(feature = "onnx"))]
fn networks(
    _: &dyn FrameSource,
    paths: &[PathBuf],
    _: &StopRequest,
) -> Result<OpenedSource, InputError> {
    let path = paths.first().map_or_else(PathBuf::new, Clone::clone);
    Err(InputError::network(
        &path,
        "this dynvox has no runtime for networks. Build it with one: `cargo build --release \
         --features onnx`",
    ))
}

fn note(dataset: &dyn FrameSource, path: &Path, there: usize) -> String {
    match dataset.len() {
        all if all == there => format!("masks from {}", path.display()),
        all => format!(
            "masks from {} for {there} of {all} frames: in the others nothing is seen",
            path.display()
        ),
    }
}

/// Masks, fitted to the images.
struct MaskOverlay {
    source: Box<dyn MaskSource>,
    /// Factor by which masks are scaled to fit the images.
    shrink: Option<f64>,
    /// Interval between frames with masks.
    every: NonZeroUsize,
}

impl OverlaySource for MaskOverlay {
    fn add(
        &self,
        dataset: &dyn FrameSource,
        index: usize,
        images: &mut StereoImages,
    ) -> Result<(), InputError> {
        if !index.is_multiple_of(self.every.get()) {
            return Ok(());
        }
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
