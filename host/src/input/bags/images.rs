//! Image messages as pictures.

use super::container::Topic;
use super::messages::{RawImage, compressed_image};
use crate::formats::bounds::{check_decoding, check_sides};
use crate::formats::{BayerPattern, Image, Picture, Sample, decode_picture, demosaiced};

/// The picture in an image message of a topic.
///
/// # Errors
/// What is wrong, as the rest of a sentence.
pub fn picture(message: &[u8], topic: &Topic) -> Result<Picture, String> {
    if topic.kind.ends_with("CompressedImage") {
        let file = compressed_image(message, topic.encoding).ok_or("the message is truncated")?;
        return decode_picture(file);
    }
    let image = RawImage::read(message, topic.encoding).ok_or("the message is truncated")?;
    let (width, height) = (image.width, image.height);
    check_sides(width, height)?;
    let (channels, deep) = match image.encoding {
        "mono8" | "8UC1" => (1, false),
        "mono16" | "16UC1" => (1, true),
        "rgb8" | "bgr8" | "8UC3" => (3, false),
        "rgb16" | "bgr16" => (3, true),
        "rgba8" | "bgra8" => (4, false),
        encoding if pattern(encoding).is_some() => (1, encoding.ends_with("16")),
        other => {
            return Err(format!(
                "its encoding is {other}; mono, rgb, bgr and bayer of 8 and 16 bit are read"
            ));
        }
    };
    let row_samples = width * channels;
    check_rows(&image, row_samples * if deep { 2 } else { 1 })?;
    // The message, its samples without padding, and the picture.
    check_decoding(
        width,
        height,
        3 * (width * height * channels) as u64 * if deep { 2 } else { 1 },
    )?;
    let layout = Layout {
        size: (width, height),
        channels,
        blue_first: image.encoding.starts_with("bgr") || image.encoding == "8UC3",
        mosaic: pattern(image.encoding),
    };
    let rows = image.data.chunks(image.step.max(1)).take(height);
    let picture = if deep {
        let number: fn([u8; 2]) -> u16 =
            if image.big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
        let mut samples = Vec::with_capacity(row_samples * height);
        for row in rows {
            samples.extend(row.as_chunks().0.iter().take(row_samples).copied().map(number));
        }
        layout.picture(samples, Picture::DeepGrey, Picture::DeepColour)
    } else {
        let mut samples = Vec::with_capacity(row_samples * height);
        rows.for_each(|row| samples.extend(row.iter().take(row_samples)));
        layout.picture(samples, Picture::Grey, Picture::Colour)
    };
    picture.ok_or_else(|| "it has no pixels".to_owned())
}

/// Arrangement of an image's samples.
struct Layout {
    /// Width and height, px.
    size: (usize, usize),
    /// Samples of a pixel.
    channels: usize,
    /// True if blue comes before green and red.
    blue_first: bool,
    /// Pattern of a mosaic.
    mosaic: Option<BayerPattern>,
}

impl Layout {
    /// Makes a picture of samples without padding; `None` if it has no pixels.
    fn picture<T: Sample>(
        &self,
        samples: Vec<T>,
        grey: fn(Image<T>) -> Picture,
        colour: fn(Image<[T; 3]>) -> Picture,
    ) -> Option<Picture> {
        let (width, height) = self.size;
        let pixels = match self.mosaic {
            Some(pattern) => demosaiced(&samples, self.size, pattern),
            None if self.channels > 1 => {
                let pixel = |pixel: &[T]| {
                    let channel = |at: usize| pixel.get(at).copied().unwrap_or_default();
                    let order = if self.blue_first { [2, 1, 0] } else { [0, 1, 2] };
                    order.map(channel)
                };
                samples.chunks_exact(self.channels).map(pixel).collect()
            }
            None => return Image::new(width, height, samples).map(grey),
        };
        Image::new(width, height, pixels).map(colour)
    }
}

/// Refuses a message whose rows overlap, or whose pixels are not there.
fn check_rows(image: &RawImage<'_>, row_bytes: usize) -> Result<(), String> {
    let (width, height, step) = (image.width, image.height, image.step);
    if step < row_bytes {
        return Err(format!(
            "its rows are {step} bytes apart (step), but {width} px take {row_bytes}"
        ));
    }
    let needed =
        height.saturating_sub(1).checked_mul(step).and_then(|all| all.checked_add(row_bytes));
    if needed.is_none_or(|needed| needed > image.data.len()) {
        return Err(format!("it has fewer bytes than {width} x {height} pixels"));
    }
    Ok(())
}

/// The pattern of a mosaic's encoding.
fn pattern(encoding: &str) -> Option<BayerPattern> {
    let name = encoding.strip_prefix("bayer_")?;
    BayerPattern::from_name(name.trim_end_matches("16").trim_end_matches('8'))
}
