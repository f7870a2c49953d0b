//! Image messages as pictures.

use super::cdr::{RawImage, compressed_image};
use crate::formats::{Image, Picture, decode_picture};

/// The picture in an image message.
///
/// # Errors
/// What is wrong, as the rest of a sentence.
pub fn picture(message: &[u8], compressed: bool) -> Result<Picture, String> {
    if compressed {
        return decode_picture(compressed_image(message).ok_or("the message is truncated")?);
    }
    let image = RawImage::read(message).ok_or("the message is truncated")?;
    let (width, height) = (image.width, image.height);
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
    let samples = samples(&image, width * channels, deep)
        .ok_or_else(|| format!("it has fewer bytes than {width} x {height} pixels"))?;
    let blue_first = image.encoding.starts_with("bgr") || image.encoding == "8UC3";
    let pixel = |at: usize| -> [u16; 3] {
        let of = |channel: usize| samples.get(at * channels + channel).copied().unwrap_or_default();
        if blue_first { [of(2), of(1), of(0)] } else { [of(0), of(1), of(2)] }
    };
    let colour = match pattern(image.encoding) {
        Some(red) => demosaiced(&samples, (width, height), red),
        None if channels > 1 => (0..width * height).map(pixel).collect(),
        None => return grey(samples, (width, height), deep),
    };
    let picture = if deep {
        Image::new(width, height, colour).map(Picture::DeepColour)
    } else {
        Image::new(width, height, colour.iter().map(|rgb| rgb.map(|value| value as u8)).collect())
            .map(Picture::Colour)
    };
    picture.ok_or_else(|| "it has no pixels".to_owned())
}

fn grey(samples: Vec<u16>, (width, height): (usize, usize), deep: bool) -> Result<Picture, String> {
    let picture = if deep {
        Image::new(width, height, samples).map(Picture::DeepGrey)
    } else {
        Image::new(width, height, samples.iter().map(|&value| value as u8).collect())
            .map(Picture::Grey)
    };
    picture.ok_or_else(|| "it has no pixels".to_owned())
}

/// The samples row by row, without padding.
fn samples(image: &RawImage<'_>, per_row: usize, deep: bool) -> Option<Vec<u16>> {
    let row_bytes = per_row * if deep { 2 } else { 1 };
    let rows = || (0..image.height).map(|row| image.data.get(row * image.step..)?.get(..row_bytes));
    let mut samples = Vec::new();
    for row in rows() {
        let row = row?;
        if deep {
            let number = |bytes: &[u8; 2]| {
                if image.big_endian {
                    u16::from_be_bytes(*bytes)
                } else {
                    u16::from_le_bytes(*bytes)
                }
            };
            samples.extend(row.as_chunks().0.iter().map(number));
        } else {
            samples.extend(row.iter().map(|&byte| u16::from(byte)));
        }
    }
    Some(samples)
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
fn demosaiced(
    samples: &[u16],
    (width, height): (usize, usize),
    (red_u, red_v): (usize, usize),
) -> Vec<[u16; 3]> {
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
                sums[at] += u32::from(samples.get(v * width + u).copied().unwrap_or_default());
                counts[at] += 1;
            }
        }
        let mut rgb = [0u16; 3];
        for (at, value) in rgb.iter_mut().enumerate() {
            *value = (sums[at] / counts[at].max(1)) as u16;
        }
        rgb[own] = samples.get(v * width + u).copied().unwrap_or_default();
        rgb
    };
    (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| pixel(u, v)).collect()
}
