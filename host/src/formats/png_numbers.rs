//! PNG files whose grey values are numbers: of instances, of disparity, of depth.

use super::decode::{self, plain};
use super::{FormatError, Image};
use crate::owned::write;
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageEncoder};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Next action for a file that cannot be decoded.
const FETCH_ANEW: &str = "Fetch or convert this image anew";

/// Reads a grey PNG of 8 or 16 bit as numbers.
///
/// # Errors
/// The file cannot be read or decoded, has colours, or is beyond the bounds.
pub fn read_png_u16(path: &Path) -> Result<Image<u16>, FormatError> {
    let decoded = decode(path)?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let pixels = match decoded {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(u16::from).collect(),
        DynamicImage::ImageLuma16(image) => image.into_raw(),
        _ => {
            return Err(FormatError::content(
                path,
                "it is a colour image",
                "Numbers of instances are grey, 8 or 16 bit",
            ));
        }
    };
    owned(path, width, height, pixels)
}

/// Reads a grey PNG of 16 bit as numbers; one of 8 bit, such as a picture of a depth image, is
/// refused.
///
/// # Errors
/// The file cannot be read or decoded, is not of one channel of 16 bit, or is beyond the bounds.
pub fn read_png_deep(path: &Path) -> Result<Image<u16>, FormatError> {
    match decode(path)? {
        DynamicImage::ImageLuma16(image) => {
            owned(path, image.width() as usize, image.height() as usize, image.into_raw())
        }
        other => {
            let color = other.color();
            let bits = 8 * color.bytes_per_pixel() / color.channel_count().max(1);
            let reason = format!(
                "it is of {} channel(s) of {bits} bit, not of one of 16",
                color.channel_count()
            );
            Err(FormatError::content(path, reason, FETCH_ANEW))
        }
    }
}

/// Writes numbers as a grey PNG of 16 bit.
///
/// # Errors
/// The file cannot be written.
pub fn write_png_deep(path: &Path, image: &Image<u16>) -> Result<(), FormatError> {
    let bytes: Vec<u8> = image.pixels().iter().copied().flat_map(u16::to_ne_bytes).collect();
    write_grey(path, [image.width(), image.height()], &bytes, ExtendedColorType::L16)
}

/// Writes numbers as a grey PNG of 8 bit.
///
/// # Errors
/// The file cannot be written.
pub fn write_png_bytes(path: &Path, image: &Image<u8>) -> Result<(), FormatError> {
    write_grey(path, [image.width(), image.height()], image.pixels(), ExtendedColorType::L8)
}

fn write_grey(
    path: &Path,
    size: [usize; 2],
    bytes: &[u8],
    colour: ExtendedColorType,
) -> Result<(), FormatError> {
    let mut png = Vec::new();
    let [width, height] = size.map(|size| size as u32);
    PngEncoder::new(&mut png)
        .write_image(bytes, width, height, colour)
        .map_err(|error| plain(&error))
        .and_then(|()| write(path, &png).map_err(|error| error.to_string()))
        .map_err(|reason| {
            FormatError::content(path, reason, "Check the folder, and whether the disk is full")
        })
}

fn decode(path: &Path) -> Result<DynamicImage, FormatError> {
    let file = File::open(path).map_err(FormatError::read(path))?;
    decode::decode_png(BufReader::new(file))
        .map_err(|reason| FormatError::content(path, reason, FETCH_ANEW))
}

fn owned(
    path: &Path,
    width: usize,
    height: usize,
    pixels: Vec<u16>,
) -> Result<Image<u16>, FormatError> {
    Image::new(width, height, pixels)
        .ok_or_else(|| FormatError::content(path, "it has no pixels", FETCH_ANEW))
}
