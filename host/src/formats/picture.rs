//! Pictures of cameras: PNG, JPEG, PGM, PPM, TIFF and BMP, of 8 or 16 bit, grey or colour. The
//! content tells the format, not the file's name.
//!
//! The mapper takes 8 bit. Of 16-bit samples `b` bits are significant and the upper 8 of them are
//! taken: `min(value >> (b - 8), 255)`. How many are significant is given, or told by
//! [`significant_bits`] from the largest value of some pictures and kept for all of them: a choice
//! made anew in each picture would change the brightness from frame to frame, which the matchers
//! follow.
//!
//! Memory: the file's samples once, and the 8-bit images made of them; [`super::decode`] has the
//! bounds.

use super::{FormatError, Image, decode, luma};
use bytemuck::allocation::try_cast_vec;
use image::DynamicImage;
use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;

/// Endings of the names of files that hold pictures, in lower case.
pub const ENDINGS: [&str; 9] = ["png", "jpg", "jpeg", "pgm", "ppm", "pnm", "tif", "tiff", "bmp"];
/// Bits a camera's samples may have. What falls between is taken as the next of them.
pub const SAMPLE_BITS: [u32; 5] = [8, 10, 12, 14, 16];
/// Next action for a picture that cannot be decoded.
const FETCH_ANEW: &str = "Fetch or convert this image anew";

/// An 8-bit picture: grey always, colour where the file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Grey pixels, as stored or as [`luma`] of the colour.
    pub grey: Image<u8>,
    /// Colour pixels of a colour file.
    pub colour: Option<Image<[u8; 3]>>,
}

/// A picture as it is stored.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// Grey, 8 bit.
    Grey(Image<u8>),
    /// Colour, 8 bit.
    Colour(Image<[u8; 3]>),
    /// Grey, samples of 16 bit.
    DeepGrey(Image<u16>),
    /// Colour, samples of 16 bit.
    DeepColour(Image<[u16; 3]>),
}

impl Picture {
    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Grey(image) => (image.width(), image.height()),
            Self::Colour(image) => (image.width(), image.height()),
            Self::DeepGrey(image) => (image.width(), image.height()),
            Self::DeepColour(image) => (image.width(), image.height()),
        }
    }

    /// The largest sample of a 16-bit picture; `None` of an 8-bit one.
    pub fn largest_sample(&self) -> Option<u16> {
        match self {
            Self::Grey(_) | Self::Colour(_) => None,
            Self::DeepGrey(image) => image.pixels().iter().max().copied(),
            Self::DeepColour(image) => image.pixels().as_flattened().iter().max().copied(),
        }
    }

    /// The 8-bit picture. `bits` are the significant bits of 16-bit samples, 8 to 16; where they
    /// are not said, this picture's own range tells.
    pub fn to_8_bit(self, bits: Option<u32>) -> Decoded {
        let bits = bits.or_else(|| self.largest_sample().map(significant_bits)).unwrap_or(16);
        let narrow = |value: u16| (value >> bits.clamp(8, 16).saturating_sub(8)).min(255) as u8;
        match self {
            Self::Grey(grey) => Decoded { grey, colour: None },
            Self::Colour(colour) => of_colour(colour),
            Self::DeepGrey(image) => {
                Decoded { grey: image.map(|&value| narrow(value)), colour: None }
            }
            Self::DeepColour(image) => of_colour(image.map(|&rgb| rgb.map(narrow))),
        }
    }
}

fn of_colour(colour: Image<[u8; 3]>) -> Decoded {
    Decoded { grey: colour.map(|&rgb| luma(rgb)), colour: Some(colour) }
}

/// The least of [`SAMPLE_BITS`] that holds a value.
pub fn significant_bits(largest: u16) -> u32 {
    SAMPLE_BITS.into_iter().find(|&bits| u32::from(largest) < 1 << bits).unwrap_or(16)
}

/// Pictures by whose largest value a recording's significant bits are told.
pub const RANGE_PICTURES: usize = 8;

/// Largest values of some pictures of a recording, by which the bits of 16-bit samples are told.
#[derive(Clone, Copy, Debug, Default)]
pub struct SampleRange {
    largest: Option<u16>,
    pictures: usize,
    declared: Option<u16>,
}

impl SampleRange {
    /// Takes the largest sample that a file says it can have ([`declared_maximum`]).
    pub fn from_declared(maximum: u16) -> Self {
        Self { declared: Some(maximum), ..Self::default() }
    }

    /// Adds a picture.
    pub fn add(&mut self, picture: &Picture) {
        self.largest = self.largest.max(picture.largest_sample());
        self.pictures += 1;
    }

    /// Returns true if a picture had samples of 16 bit.
    pub fn is_deep(&self) -> bool {
        self.largest.is_some() || self.declared.is_some()
    }

    /// Significant bits of 16-bit pictures; `None` of others.
    pub fn bits(&self) -> Option<u32> {
        self.declared.or(self.largest).map(significant_bits)
    }

    /// Returns a note for the user; `None` for pictures of 8 bit.
    pub fn note(&self) -> Option<String> {
        let bits = self.bits()?;
        let by = match (self.declared, self.largest) {
            (Some(maximum), _) => format!("the maximum {maximum} that the first one says"),
            (None, largest) => {
                format!("the largest value {} of {} images", largest?, self.pictures)
            }
        };
        Some(format!(
            "16-bit images: {bits} bits are taken as significant, by {by}; --bits says otherwise"
        ))
    }
}

/// Reads a picture. An alpha channel is dropped.
///
/// # Errors
/// The file cannot be read or decoded, or its sides or the memory it takes are beyond the bounds.
pub fn read_picture(path: &Path) -> Result<Picture, FormatError> {
    let refuse = |reason: String| FormatError::content(path, reason, FETCH_ANEW);
    picture_of(decode::decode(open(path)?).map_err(refuse)?).map_err(refuse)
}

/// Decodes a picture that lies in memory.
///
/// # Errors
/// Reason, as the rest of a sentence.
pub fn decode_picture(bytes: &[u8]) -> Result<Picture, String> {
    picture_of(decode::decode(Cursor::new(bytes))?)
}

/// Width and height without decoding the pixels.
///
/// # Errors
/// The file cannot be read, has no header of a picture, or its sides are beyond the bound.
pub fn picture_size(path: &Path) -> Result<(usize, usize), FormatError> {
    decode::size(open(path)?).map_err(|reason| FormatError::content(path, reason, FETCH_ANEW))
}

/// Largest sample that a PGM or PPM of 16 bit says it can have, if that is less than all.
pub fn declared_maximum(path: &Path) -> Option<u16> {
    decode::declared_maximum(open(path).ok()?)
}

fn open(path: &Path) -> Result<BufReader<File>, FormatError> {
    Ok(BufReader::new(File::open(path).map_err(FormatError::read(path))?))
}

fn picture_of(decoded: DynamicImage) -> Result<Picture, String> {
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    fn owned<T>(width: usize, height: usize, pixels: Vec<T>) -> Result<Image<T>, String> {
        Image::new(width, height, pixels).ok_or_else(|| "it has no pixels".to_owned())
    }
    Ok(match decoded {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
            Picture::Grey(owned(width, height, decoded.into_luma8().into_raw())?)
        }
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            Picture::Colour(owned(width, height, grouped(decoded.into_rgb8().into_raw()))?)
        }
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => {
            Picture::DeepGrey(owned(width, height, decoded.into_luma16().into_raw())?)
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            Picture::DeepColour(owned(width, height, grouped(decoded.into_rgb16().into_raw()))?)
        }
        other => {
            return Err(format!(
                "its pixels are {:?}; integers of 8 or 16 bit are read, grey or colour",
                other.color()
            ));
        }
    })
}

/// Samples as pixels of three, without a copy where the memory allows it.
fn grouped<T: bytemuck::Pod>(samples: Vec<T>) -> Vec<[T; 3]> {
    try_cast_vec(samples).unwrap_or_else(|(_, samples)| samples.as_chunks().0.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{
        DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, Rgb, RgbImage, RgbaImage,
    };
    use tempfile::TempDir;

    #[test]
    fn every_format_gives_the_pixels_it_was_made_of() {
        let folder = TempDir::new().unwrap();
        let grey = GrayImage::from_fn(40, 33, |u, v| Luma([(u * 5 + v) as u8]));
        let colour = RgbImage::from_fn(40, 33, |u, v| Rgb([u as u8, v as u8, 200]));
        for ending in ["png", "pgm", "tiff", "bmp"] {
            let path = folder.path().join(format!("grey.{ending}"));
            DynamicImage::from(grey.clone()).save(&path).unwrap();
            let read = read_picture(&path).unwrap().to_8_bit(None);
            assert_eq!(read.grey.pixels(), grey.as_raw().as_slice(), "{ending}");
            assert_eq!(picture_size(&path).unwrap(), (40, 33));
            assert_eq!(
                decode_picture(&std::fs::read(&path).unwrap()).unwrap().to_8_bit(None),
                read,
                "{ending}"
            );
        }
        for ending in ["png", "ppm", "tif", "bmp"] {
            let path = folder.path().join(format!("colour.{ending}"));
            DynamicImage::from(colour.clone()).save(&path).unwrap();
            let read = read_picture(&path).unwrap().to_8_bit(None);
            assert_eq!(read.colour.unwrap().get(7, 9), Some([7, 9, 200]), "{ending}");
            assert_eq!(read.grey.get(7, 9), Some(luma([7, 9, 200])));
        }
    }

    #[test]
    fn a_jpeg_is_near_what_it_was_made_of_and_its_name_does_not_matter() {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("a.png");
        let grey = GrayImage::from_fn(64, 48, |u, v| Luma([(u + v) as u8]));
        let file = &mut std::fs::File::create(&path).unwrap();
        DynamicImage::from(grey.clone())
            .write_to(&mut std::io::BufWriter::new(file), ImageFormat::Jpeg)
            .unwrap();
        let read = read_picture(&path).unwrap().to_8_bit(None).grey;
        let apart = read.pixels().iter().zip(grey.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(apart.unwrap() < 8, "{apart:?}");
        std::fs::write(&path, [0xFF, 0xD8, 0xFF, 0xE0, 0, 0]).unwrap();
        assert!(read_picture(&path).unwrap_err().to_string().contains("a.png cannot be used"));
        RgbaImage::from_pixel(4, 3, ::image::Rgba([9, 8, 7, 0])).save(&path).unwrap();
        assert_eq!(
            read_picture(&path).unwrap().to_8_bit(None).colour.unwrap().get(3, 2),
            Some([9, 8, 7]),
            "alpha is dropped"
        );
    }

    #[test]
    fn the_upper_eight_of_the_significant_bits_are_taken() {
        assert_eq!([200, 1_000, 4_095, 4_096, 40_000].map(significant_bits), [8, 10, 12, 14, 16]);
        let folder = TempDir::new().unwrap();
        for ending in ["png", "pgm", "tiff"] {
            let path = folder.path().join(format!("deep.{ending}"));
            let deep = ImageBuffer::from_fn(16, 4, |u, v| Luma([(u * 250 + v) as u16]));
            DynamicImage::ImageLuma16(deep).save(&path).unwrap();
            let picture = read_picture(&path).unwrap();
            assert_eq!(picture.largest_sample(), Some(3_753), "{ending}");
            let read = picture.clone().to_8_bit(None).grey;
            assert_eq!(
                (read.get(15, 0), read.get(8, 0)),
                (Some(234), Some(125)),
                "12 bits: 3,750 / 16 and 2,000 / 16"
            );
            assert_eq!(picture.clone().to_8_bit(Some(16)).grey.get(15, 0), Some(14));
            assert_eq!(
                picture.to_8_bit(Some(10)).grey.get(15, 0),
                Some(255),
                "beyond the range is white, never black"
            );
        }
        let colour = ImageBuffer::from_pixel(3, 2, Rgb([4_000u16, 160, 0]));
        let path = folder.path().join("deep_colour.png");
        DynamicImage::ImageRgb16(colour).save(&path).unwrap();
        assert_eq!(
            read_picture(&path).unwrap().to_8_bit(None).colour.unwrap().get(1, 1),
            Some([250, 10, 0])
        );
    }
}
