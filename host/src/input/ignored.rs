//! Pixels that no stage uses, from a picture: the car's own bonnet, mirrors, a dirty lens.
//!
//! The picture is drawn on a left image of the recording, raw where the images are raw, and white
//! where nothing is to be used. Grey from 128 on counts as white, so that a JPEG serves as well.

use super::source::{FrameSource, InputError, Overlay, OverlaySource, StereoImages};
use crate::formats::{FormatError, Image, read_picture};
use std::path::Path;
use std::sync::Arc;

/// Grey value from which on a pixel is white.
const WHITE: u8 = 128;

/// Lays a mask over a data set.
///
/// # Errors
/// The picture cannot be read, is not of the left images' size, or ignores nothing or everything.
pub fn attach(
    dataset: Box<dyn FrameSource>,
    path: &Path,
) -> Result<Box<dyn FrameSource>, InputError> {
    let ignored = Arc::new(fitted(&read(path, dataset.as_ref())?, dataset.as_ref()));
    let [white, all] = [white(&ignored), ignored.pixels().len()];
    let share = 100.0 * white as f64 / all as f64;
    let note = format!("{share:.1} % of the image is ignored, by {}", path.display());
    let source = IgnoredPixels(ignored.clone());
    Ok(Box::new(Overlay::new(dataset, source, note).ignoring(ignored)))
}

struct IgnoredPixels(Arc<Image<u8>>);

impl OverlaySource for IgnoredPixels {
    fn add(
        &self,
        _: &dyn FrameSource,
        _: usize,
        images: &mut StereoImages,
    ) -> Result<(), InputError> {
        images.ignored = Some(self.0.clone());
        Ok(())
    }
}

/// Size of the left images as they are stored.
fn stored_size(dataset: &dyn FrameSource) -> (usize, usize) {
    match dataset.rectification() {
        Some(rectification) => {
            let raw = &rectification.left.raw;
            (raw.width as usize, raw.height as usize)
        }
        None => dataset.full_size(),
    }
}

/// The picture, 255 where it is white and 0 elsewhere.
fn read(path: &Path, dataset: &dyn FrameSource) -> Result<Image<u8>, InputError> {
    let refuse = |reason: String| InputError::IgnoreMask { path: path.to_path_buf(), reason };
    let picture = read_picture(path).map_err(|error| match error {
        FormatError::Content { reason, .. } => refuse(format!("{reason}. Save it as PNG anew")),
        other => other.into(),
    })?;
    let (size, (width, height)) = (picture.size(), stored_size(dataset));
    if size != (width, height) {
        let (found_width, found_height) = size;
        return Err(refuse(format!(
            "it is {found_width} x {found_height} px, and the left images are {width} x {height}. \
             Draw it on one of them"
        )));
    }
    let grey = picture.to_8_bit(None).grey;
    let mask = grey.map(|&value| if value >= WHITE { u8::MAX } else { 0 });
    match white(&mask) {
        0 => Err(refuse(format!(
            "it has no white pixel; its largest value is {}. Paint what is to be ignored with 255, \
             or leave --ignore-mask out",
            grey.pixels().iter().max().copied().unwrap_or_default()
        ))),
        all if all == mask.pixels().len() => Err(refuse(
            "all of it is white, so that nothing is left to map. Paint what is to be used black"
                .to_owned(),
        )),
        _ => Ok(mask),
    }
}

/// The mask at the size of the images that are mapped: each pixel shows the one of the stored image
/// that it comes from.
fn fitted(mask: &Image<u8>, dataset: &dyn FrameSource) -> Image<u8> {
    let ((width, height), rig) = (dataset.size(), dataset.rig());
    let scale = [mask.width() as f64 / width as f64, mask.height() as f64 / height as f64];
    let stored = |u: usize, v: usize| match dataset.rectification() {
        Some(rectification) => rectification.left.raw_pixel(&rig, [u as f64, v as f64]),
        // Areas begin half a pixel before the pixels' centres.
        None => Some([(u as f64 + 0.5) * scale[0] - 0.5, (v as f64 + 0.5) * scale[1] - 0.5]),
    };
    let value = |u: usize, v: usize| {
        let [u, v] = stored(u, v)?.map(f64::round);
        // Pixels that no raw pixel covers are left out by the rectification itself.
        (u >= 0.0 && v >= 0.0).then(|| mask.get(u as usize, v as usize)).flatten()
    };
    let pixels =
        (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| value(u, v));
    Image::new(width, height, pixels.map(Option::unwrap_or_default).collect())
        .unwrap_or_else(|| mask.clone())
}

fn white(mask: &Image<u8>) -> usize {
    mask.pixels().iter().filter(|&&value| value != 0).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Scaled, StreetFrames};
    use crate::synth::StreetConfig;

    fn street() -> Box<dyn FrameSource> {
        let config = StreetConfig { width: 160, height: 64, frames: 2, ..StreetConfig::default() };
        Box::new(StreetFrames::new(config).unwrap())
    }

    /// A picture whose lower half is white, but for the noise of a JPEG.
    fn half(folder: &Path, [width, height]: [u32; 2]) -> std::path::PathBuf {
        let path = folder.join("bonnet.png");
        let pixel = |_, v| image::Luma([if v < height / 2 { 3u8 } else { 250 }]);
        image::GrayImage::from_fn(width, height, pixel).save(&path).unwrap();
        path
    }

    #[test]
    fn the_lower_half_is_ignored_at_any_scale_and_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = half(folder.path(), [160, 64]);
        for (scale, size) in [(1.0, (160, 64)), (0.5, (80, 32))] {
            let dataset: Box<dyn FrameSource> = Box::new(Scaled::new(street(), scale).unwrap());
            let dataset = attach(dataset, &path).unwrap();
            assert!(dataset.notes().iter().any(|note| note.starts_with("50.0 % of the image")));
            let ignored = dataset.frame(1).unwrap().ignored.unwrap();
            assert_eq!((ignored.width(), ignored.height()), size);
            let (upper, lower) = ignored.pixels().split_at(size.0 * size.1 / 2);
            assert!(upper.iter().all(|&pixel| pixel == 0) && lower.iter().all(|&pixel| pixel != 0));
        }
    }

    #[test]
    fn a_mask_of_another_size_or_without_white_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refusal = |path: &Path| attach(street(), path).err().unwrap().to_string();
        let sentence = refusal(&half(folder.path(), [100, 64]));
        assert!(sentence.contains("100 x 64 px, and the left images are 160 x 64"), "{sentence}");
        let path = folder.path().join("dim.png");
        for (grey, words) in [(1u8, "its largest value is 1"), (255, "nothing is left to map")] {
            image::GrayImage::from_pixel(160, 64, image::Luma([grey])).save(&path).unwrap();
            assert!(refusal(&path).contains(words), "{}", refusal(&path));
        }
    }
}
