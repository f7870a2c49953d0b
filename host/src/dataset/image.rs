//! Owned images, and PNG files as stereo input: 8 bit, grey or colour, decoded without loss.

use super::DatasetError;
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

/// Reads one 8-bit PNG. An alpha channel is dropped; 16 bits are refused by name.
pub fn read_png(path: &Path) -> Result<Decoded, DatasetError> {
    let failed = |reason: String| DatasetError::Image { path: path.to_path_buf(), reason };
    let decoded = open(path)?.decode().map_err(|error| failed(plain(&error)))?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let absurd = || failed("it has no pixels".into());
    match decoded {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
            let grey = Image::new(width, height, decoded.into_luma8().into_raw()).ok_or_else(absurd)?;
            Ok(Decoded { grey, colour: None })
        }
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            let bytes = decoded.into_rgb8().into_raw();
            let pixels: Vec<[u8; 3]> = bytes.as_chunks().0.to_vec();
            let colour = Image::new(width, height, pixels).ok_or_else(absurd)?;
            Ok(Decoded { grey: colour.map(|&rgb| luma(rgb)), colour: Some(colour) })
        }
        other => Err(DatasetError::Kind {
            path: path.to_path_buf(),
            kind: format!("{}-bit {}", 8 * bytes_per_channel(&other), "PNG"),
        }),
    }
}

/// Reads a grey PNG of 8 or 16 bit as numbers.
pub fn read_png_u16(path: &Path) -> Result<Image<u16>, DatasetError> {
    let failed = |reason: String| DatasetError::Image { path: path.to_path_buf(), reason };
    let decoded = open(path)?.decode().map_err(|error| failed(plain(&error)))?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let pixels = match decoded {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(u16::from).collect(),
        DynamicImage::ImageLuma16(image) => image.into_raw(),
        _ => return Err(failed("it is a colour image; numbers of instances are grey, 8 or 16 bit".into())),
    };
    Image::new(width, height, pixels).ok_or_else(|| failed("it has no pixels".into()))
}

/// Reads a grey PNG of 16 bit as numbers; one of 8 bit, such as a picture of a depth image, is refused.
pub fn read_png_deep(path: &Path) -> Result<Image<u16>, DatasetError> {
    let failed = |reason: String| DatasetError::Image { path: path.to_path_buf(), reason };
    match open(path)?.decode().map_err(|error| failed(plain(&error)))? {
        DynamicImage::ImageLuma16(image) => {
            let (width, height) = (image.width() as usize, image.height() as usize);
            Image::new(width, height, image.into_raw()).ok_or_else(|| failed("it has no pixels".into()))
        }
        other => Err(failed(format!(
            "it is of {} channel(s) of {} bit, not of one of 16",
            other.color().channel_count(),
            8 * bytes_per_channel(&other)
        ))),
    }
}

/// Width and height without decoding the pixels.
pub fn png_size(path: &Path) -> Result<(usize, usize), DatasetError> {
    let (width, height) =
        open(path)?.into_dimensions().map_err(|error| DatasetError::Image { path: path.to_path_buf(), reason: plain(&error) })?;
    Ok((width as usize, height as usize))
}

fn open(path: &Path) -> Result<ImageReader<std::io::BufReader<std::fs::File>>, DatasetError> {
    let mut reader = ImageReader::open(path).map_err(super::error::read_failed(path))?;
    reader.set_format(image::ImageFormat::Png);
    Ok(reader)
}

fn bytes_per_channel(image: &DynamicImage) -> usize {
    let color = image.color();
    usize::from(color.bytes_per_pixel()) / usize::from(color.channel_count()).max(1)
}

/// The decoder's words without a full stop, to stand inside a sentence.
fn plain(error: &image::ImageError) -> String {
    error.to_string().trim_end_matches(['.', '\n']).replace('\n', " ")
}
