//! Image messages as pictures.

use super::container::Topic;
use super::messages::{RawImage, compressed_image};
use crate::formats::bounds::{check_decoding, check_sides};
use crate::formats::{Image, Picture, decode_picture};

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
        red: pattern(image.encoding),
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
    /// Column and row of the red pixel in a Bayer pattern.
    red: Option<(usize, usize)>,
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
        let pixels = match self.red {
            Some(red) => demosaiced(&samples, self.size, red),
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

/// A sample of 8 or 16 bit.
trait Sample: Copy + Default + Into<u32> {
    /// The mean of samples, by their sum and number.
    fn mean(sum: u32, count: u32) -> Self;
}

impl Sample for u8 {
    fn mean(sum: u32, count: u32) -> Self {
        (sum / count.max(1)) as Self
    }
}

impl Sample for u16 {
    fn mean(sum: u32, count: u32) -> Self {
        (sum / count.max(1)) as Self
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

/// Column and row of the red pixel in each square of a Bayer pattern.
fn pattern(encoding: &str) -> Option<(usize, usize)> {
    let name = encoding.strip_prefix("bayer_")?;
    Some(match name.trim_end_matches("16").trim_end_matches('8') {
        "rggb" => (0, 0),
        "grbg" => (1, 0),
        "gbrg" => (0, 1),
        "bggr" => (1, 1),
        _ => return None,
    })
}

/// Colours of a Bayer image: each the mean of the pixel's neighbours of that colour, itself
/// included.
fn demosaiced<T: Sample>(
    samples: &[T],
    (width, height): (usize, usize),
    (red_u, red_v): (usize, usize),
) -> Vec<[T; 3]> {
    let channel = |u: usize, v: usize| match ((u + red_u) % 2, (v + red_v) % 2) {
        (0, 0) => 0,
        (1, 1) => 2,
        _ => 1,
    };
    let pixel = |u: usize, v: usize| {
        let own = channel(u, v);
        let (mut sums, mut counts) = ([0u32; 3], [0u32; 3]);
        for v in v.saturating_sub(1)..(v + 2).min(height) {
            for u in u.saturating_sub(1)..(u + 2).min(width) {
                let at = channel(u, v);
                sums[at] += samples.get(v * width + u).copied().unwrap_or_default().into();
                counts[at] += 1;
            }
        }
        let mut rgb = [T::default(); 3];
        for (at, value) in rgb.iter_mut().enumerate() {
            *value = T::mean(sums[at], counts[at]);
        }
        rgb[own] = samples.get(v * width + u).copied().unwrap_or_default();
        rgb
    };
    (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| pixel(u, v)).collect()
}
