//! Owned images, and PNG files: 8 bit, grey or colour, as pictures; 16 bit as numbers.

use super::FormatError;
use dynvox_core::image::View;
use image::{DynamicImage, ImageReader};
use std::path::Path;

/// An owned image, row by row without padding.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    pixels: Vec<T>,
}

impl<T> Image<T> {
    /// Takes over `pixels`; `None` unless there are `width` x `height` of them and at least one.
    pub fn new(width: usize, height: usize, pixels: Vec<T>) -> Option<Self> {
        (width > 0 && height > 0 && width.checked_mul(height)? == pixels.len()).then_some(Self { width, height, pixels })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// Borrows it as the core takes images.
    pub fn view(&self) -> Option<View<'_, T>> {
        View::new(&self.pixels, self.width, self.height)
    }

    /// The same image with every pixel mapped.
    pub fn map<U>(&self, each: impl FnMut(&T) -> U) -> Image<U> {
        Image {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(each).collect(),
        }
    }
}

impl<T: Copy> Image<T> {
    /// Copies a view.
    pub fn from_view(view: &View<'_, T>) -> Self {
        Self {
            width: view.width(),
            height: view.height(),
            pixels: view.rows().flatten().copied().collect(),
        }
    }

    /// Pixel at column `u`, row `v`; `None` beyond the image.
    pub fn get(&self, u: usize, v: usize) -> Option<T> {
        if u >= self.width { None } else { self.pixels.get(v * self.width + u).copied() }
    }
}

/// Luma of ITU-R BT.601 in integers: the grey of a colour image is the same on every machine.
pub fn luma([r, g, b]: [u8; 3]) -> u8 {
    ((77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b) + 128) >> 8) as u8
}

/// A decoded PNG: grey always, colour where the file has it.
pub struct Decoded {
    /// Grey pixels, as stored or as [`luma`] of the colour.
    pub grey: Image<u8>,
    /// Colour pixels of a colour file.
    pub colour: Option<Image<[u8; 3]>>,
}

/// What to do about a picture that cannot be decoded.
const FETCH_ANEW: &str = "Fetch or convert this image anew";

/// Reads one 8-bit PNG. An alpha channel is dropped; 16 bits are refused by name.
///
/// # Errors
/// The file cannot be read or decoded, or has 16 bits.
pub fn read_png(path: &Path) -> Result<Decoded, FormatError> {
    let decoded = decode(path)?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    match decoded {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
            let grey = owned(path, width, height, decoded.into_luma8().into_raw())?;
            Ok(Decoded { grey, colour: None })
        }
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            let bytes = decoded.into_rgb8().into_raw();
            let colour = owned(path, width, height, bytes.as_chunks().0.to_vec())?;
            Ok(Decoded { grey: colour.map(|&rgb| luma(rgb)), colour: Some(colour) })
        }
        other => Err(FormatError::content(
            path,
            format!("it is a {}-bit PNG, and pictures are 8 bit, grey or colour", bits_of(&other)),
            "Convert it, for instance with `convert in.png -depth 8 out.png`",
        )),
    }
}

/// Reads a grey PNG of 8 or 16 bit as numbers.
///
/// # Errors
/// The file cannot be read or decoded, or has colours.
pub fn read_png_u16(path: &Path) -> Result<Image<u16>, FormatError> {
    let decoded = decode(path)?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let pixels = match decoded {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(u16::from).collect(),
        DynamicImage::ImageLuma16(image) => image.into_raw(),
        _ => return Err(FormatError::content(path, "it is a colour image", "Numbers of instances are grey, 8 or 16 bit")),
    };
    owned(path, width, height, pixels)
}

/// Reads a grey PNG of 16 bit as numbers; one of 8 bit, such as a picture of a depth image, is refused.
///
/// # Errors
/// The file cannot be read or decoded, or is not of one channel of 16 bit.
pub fn read_png_deep(path: &Path) -> Result<Image<u16>, FormatError> {
    match decode(path)? {
        DynamicImage::ImageLuma16(image) => owned(path, image.width() as usize, image.height() as usize, image.into_raw()),
        other => {
            let reason = format!("it is of {} channel(s) of {} bit, not of one of 16", other.color().channel_count(), bits_of(&other));
            Err(FormatError::content(path, reason, FETCH_ANEW))
        }
    }
}

/// Width and height without decoding the pixels.
///
/// # Errors
/// The file cannot be read, or has no header of a PNG.
pub fn png_size(path: &Path) -> Result<(usize, usize), FormatError> {
    let (width, height) = open(path)?.into_dimensions().map_err(|error| undecoded(path, &error))?;
    Ok((width as usize, height as usize))
}

fn open(path: &Path) -> Result<ImageReader<std::io::BufReader<std::fs::File>>, FormatError> {
    let mut reader = ImageReader::open(path).map_err(FormatError::read(path))?;
    reader.set_format(image::ImageFormat::Png);
    Ok(reader)
}

fn decode(path: &Path) -> Result<DynamicImage, FormatError> {
    open(path)?.decode().map_err(|error| undecoded(path, &error))
}

fn owned<T>(path: &Path, width: usize, height: usize, pixels: Vec<T>) -> Result<Image<T>, FormatError> {
    Image::new(width, height, pixels).ok_or_else(|| FormatError::content(path, "it has no pixels", FETCH_ANEW))
}

fn bits_of(image: &DynamicImage) -> usize {
    let color = image.color();
    8 * usize::from(color.bytes_per_pixel()) / usize::from(color.channel_count()).max(1)
}

/// The decoder's words without a full stop, to stand inside a sentence.
fn undecoded(path: &Path, error: &image::ImageError) -> FormatError {
    FormatError::content(path, error.to_string().trim_end_matches(['.', '\n']).replace('\n', " "), FETCH_ANEW)
}
