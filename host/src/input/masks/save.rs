//! Writes masks as instance PNGs with lists, so that another run, or another program, takes them.

use crate::formats::FormatError;
use crate::input::source::{InputError, InstanceMask};
use crate::owned;
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use std::fmt::Write as _;
use std::path::Path;

/// Writes the masks of a frame as `STEM.png` and `STEM.txt` into a folder. Where masks overlap, the
/// higher score is on top.
///
/// # Errors
/// A file cannot be written, or there are more masks than a picture has values.
pub fn save_masks(
    folder: &Path,
    stem: &str,
    size: (usize, usize),
    masks: &[InstanceMask],
) -> Result<(), InputError> {
    let mut order: Vec<(u16, &InstanceMask)> = (1..).zip(masks).collect();
    order.sort_by(|(_, a), (_, b)| a.score.total_cmp(&b.score));
    save(folder, stem, size, masks, &order)
}

/// Saves masks like [`save_masks`]; where masks overlap, the later one is on top.
///
/// # Errors
/// The folder cannot be written.
pub fn save_masks_in_order(
    folder: &Path,
    stem: &str,
    size: (usize, usize),
    masks: &[InstanceMask],
) -> Result<(), InputError> {
    save(folder, stem, size, masks, &(1..).zip(masks).collect::<Vec<_>>())
}

/// Writes masks, drawn with their values in `order`.
fn save(
    folder: &Path,
    stem: &str,
    (width, height): (usize, usize),
    masks: &[InstanceMask],
    order: &[(u16, &InstanceMask)],
) -> Result<(), InputError> {
    if order.len() < masks.len() {
        return Err(InputError::masks(
            folder,
            format!("{} masks in a frame are more than a picture has values", masks.len()),
        ));
    }
    let mut labels = vec![0u16; width * height];
    for &(label, mask) in order {
        let rows = (mask.pixels.top.max(0)..)
            .take(mask.pixels.height.max(0) as usize)
            .take_while(|v| (*v as usize) < height);
        for v in rows {
            let pixels =
                labels.get_mut(v as usize * width..(v as usize + 1) * width).unwrap_or_default();
            let columns = (0..)
                .zip(pixels)
                .skip(mask.pixels.left.max(0) as usize)
                .take(mask.pixels.width.max(0) as usize);
            columns.filter(|(u, _)| mask.contains(*u, v)).for_each(|(_, pixel)| *pixel = label);
        }
    }
    let mut list = String::from("# id class score x1 y1 x2 y2\n");
    for (label, mask) in (1u16..).zip(masks) {
        let [left, top] = [mask.pixels.left, mask.pixels.top];
        let (right, bottom) = (left + mask.pixels.width, top + mask.pixels.height);
        // Writing to a String cannot fail.
        let _ = writeln!(
            list,
            "{label} {} {} {left}.0 {top}.0 {right}.0 {bottom}.0",
            mask.class.name(),
            mask.score
        );
    }
    let picture = folder.join(format!("{stem}.png"));
    let bytes: Vec<u8> = labels.iter().flat_map(|label| label.to_ne_bytes()).collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&bytes, width as u32, height as u32, image::ExtendedColorType::L16)
        .map_err(|error| error.to_string())
        .and_then(|()| owned::write(&picture, &png).map_err(|error| error.to_string()))
        .map_err(|reason| {
            InputError::masks_format(FormatError::content(
                &picture,
                reason,
                "Free the disk or choose another folder",
            ))
        })?;
    let list_path = folder.join(format!("{stem}.txt"));
    owned::write(&list_path, list.as_bytes())
        .map_err(|error| InputError::masks(&list_path, format!("it cannot be written ({error})")))
}
