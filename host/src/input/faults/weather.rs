//! What weather, wear and compression make of images.

use super::changed::{each_pixel, warp};
use crate::formats::{Image, decode_picture};
use crate::input::source::StereoImages;
use dynvox_core::random::Random;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

/// Length of a streak of rain, as a share of the height, and its brightness, grey levels.
const STREAK: f64 = 0.09;
const STREAK_GREY: f64 = 70.0;
/// Columns by which a streak leans for each row.
const LEAN: f64 = 0.15;
/// Period of leaves that the wind moves, as a share of the width, and their phase a frame, rad.
const LEAVES: f64 = 0.06;
const GUST_RAD: f64 = 1.1;

/// Draws streaks of rain, others in each image and frame.
pub(super) fn put_rain(images: &mut StereoImages, streaks: usize, random: &mut Random) {
    let (width, height) = (images.left.width(), images.left.height());
    let length = (STREAK * height as f64).ceil() as usize;
    for image in [&mut images.left, &mut images.right] {
        let mut pixels = image.pixels().to_vec();
        for _ in 0..streaks {
            let (u, v) =
                (random.below(width as u32) as usize, random.below(height as u32) as usize);
            for row in v..(v + length).min(height) {
                let column = u + (LEAN * (row - v) as f64) as usize;
                if column < width {
                    let pixel = &mut pixels[row * width + column];
                    *pixel = (f64::from(*pixel) + STREAK_GREY).min(255.0) as u8;
                }
            }
        }
        if let Some(rained) = Image::new(width, height, pixels) {
            *image = rained;
        }
    }
    images.colour = None;
}

/// Moves the upper half of both images to and fro by up to so many px, as leaves in the wind.
pub(super) fn put_wind(images: &mut StereoImages, px: f64, frame: usize) {
    let gust = GUST_RAD * frame as f64;
    warp(images, |at| {
        let share = (1.0 - 2.0 * at.v / at.height).clamp(0.0, 1.0);
        let phase = (at.u + 0.7 * at.v) / (LEAVES * at.width);
        [at.u + px * share * (phase + gust).sin(), at.v + 0.5 * px * share * (phase - gust).cos()]
    });
}

/// Shifts the right image to the right by so many px, as a rig that warms up.
pub(super) fn put_drift(images: &mut StereoImages, px: f64) {
    warp(images, |at| [if at.is_right { at.u - px } else { at.u }, at.v]);
}

/// Enlarges both images around their middle: the calibration is that of another image size.
pub(super) fn put_zoom(images: &mut StereoImages, factor: f64) {
    warp(images, |at| {
        let around = |px: f64, side: f64| 0.5 * side + (px - 0.5 * side) / factor;
        [around(at.u, at.width), around(at.v, at.height)]
    });
}

/// Leaves of both images what compression of this quality leaves.
pub(super) fn put_compression(images: &mut StereoImages, quality: u8) {
    for image in [&mut images.left, &mut images.right] {
        if let Some(compressed) = compressed(image, quality) {
            *image = compressed;
        }
    }
    images.colour = None;
}

fn compressed(image: &Image<u8>, quality: u8) -> Option<Image<u8>> {
    let mut bytes = Vec::new();
    let (width, height) = (image.width() as u32, image.height() as u32);
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .write_image(image.pixels(), width, height, ExtendedColorType::L8)
        .ok()?;
    Some(decode_picture(&bytes).ok()?.to_8_bit(None).grey)
}

/// Makes the light flicker: each frame, in both images, by a share up or down.
pub(super) fn put_flicker(images: &mut StereoImages, share: f64, random: &mut Random) {
    let factor = 1.0 + share * (f64::from(random.below(2001)) / 1000.0 - 1.0);
    each_pixel(images, |_, value| factor * value);
}
