//! What happens to a delivered pair of images.

use super::pasted::{self, Panel};
use super::spec::{FaultKind, Side};
use super::weather;
use crate::formats::Image;
use crate::input::source::{InstanceMask, StereoImages};
use dynvox_core::geometry::StereoRig;
use dynvox_core::masks::PixelBox;
use dynvox_core::random::Random;
use dynvox_core::tracking::Class;

/// Grey level of what covers a lens.
const COVER: u8 = 40;

/// A fault in a frame.
pub(super) struct Happening<'a> {
    pub kind: FaultKind,
    pub rig: &'a StereoRig,
    /// Frames since the fault began: 0 in the first.
    pub since: usize,
}

/// Changes the images of a frame as a fault does that needs no other frame.
pub(super) fn apply(happening: &Happening<'_>, images: &mut StereoImages, random: &mut Random) {
    let Happening { kind, rig, since } = *happening;
    match kind {
        FaultKind::Exchange => {
            std::mem::swap(&mut images.left, &mut images.right);
            images.colour = None;
        }
        FaultKind::Black(side) => each_value(images, side, |_, _| 0),
        FaultKind::Noise(side, sigma) => each_value(images, side, |_, value| {
            saturated(f64::from(value) + sigma * gaussian(random))
        }),
        FaultKind::Brightness(side, factor) => {
            each_value(images, side, |_, value| saturated(f64::from(value) * factor))
        }
        FaultKind::Occlude(side, share) => {
            let covered = (images.left.width() as f64 * share).round() as usize;
            each_value(images, side, |column, value| if column < covered { COVER } else { value });
        }
        FaultKind::Masks => {
            images.masks.instances = absurd_masks(images.left.width(), images.left.height())
        }
        FaultKind::Truck(ahead_m) => pasted::put_panel(images, rig, &Panel::truck(ahead_m)),
        FaultKind::Walker(ahead_m) => pasted::put_panel(images, rig, &Panel::walker(ahead_m)),
        FaultKind::Bus(step_m) => {
            pasted::put_panel(images, rig, &Panel::bus(step_m * since as f64));
        }
        FaultKind::Bonnet(share) => pasted::put_bonnet(images, share),
        FaultKind::Reflection(weight) => pasted::put_reflection(images, weight),
        FaultKind::Dirt(share) => pasted::put_dirt(images, share),
        FaultKind::Tunnel(share) => pasted::put_tunnel(images, share),
        FaultKind::Pattern(sigma) => pasted::put_pattern(images, sigma),
        FaultKind::Rain(streaks) => weather::put_rain(images, streaks, random),
        FaultKind::Wind(px) => weather::put_wind(images, px, since),
        FaultKind::Drift(px) => weather::put_drift(images, px * (since as f64 + 1.0)),
        FaultKind::Zoom(factor) => weather::put_zoom(images, factor),
        FaultKind::Jpeg(quality) => weather::put_compression(images, quality),
        FaultKind::Flicker(share) => weather::put_flicker(images, share, random),
        FaultKind::Freeze(_) | FaultKind::Delay(_) => {}
        FaultKind::Drop | FaultKind::Duplicate | FaultKind::Swap | FaultKind::Jump(_) => {}
    }
}

/// Puts the images of one side of `other` in the place of those of `images`.
pub(super) fn put_side(side: Side, other: StereoImages, images: &mut StereoImages) {
    if side.has_left() {
        (images.left, images.colour) = (other.left, other.colour);
    }
    if side.has_right() {
        images.right = other.right;
    }
}

/// Changes every value of a side's images by its column.
fn each_value(images: &mut StereoImages, side: Side, mut change: impl FnMut(usize, u8) -> u8) {
    let width = images.left.width();
    let mut all = |image: &Image<u8>| {
        let mut at = 0;
        image.map(|&value| {
            at += 1;
            change((at - 1) % width, value)
        })
    };
    if side.has_left() {
        images.left = all(&images.left);
    }
    if side.has_right() {
        images.right = all(&images.right);
    }
    if let Some(colour) = images.colour.as_ref().filter(|_| side.has_left()) {
        let mut at = 0;
        images.colour = Some(colour.map(|values| {
            at += 1;
            values.map(|value| change((at - 1) % width, value))
        }));
    }
}

fn saturated(value: f64) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

/// About normal, of variance 1: the sum of twelve uniform numbers.
fn gaussian(random: &mut Random) -> f64 {
    (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0
}

/// The whole image twice, and one pixel.
fn absurd_masks(width: usize, height: usize) -> Vec<InstanceMask> {
    let of = |class, (width, height): (usize, usize)| InstanceMask {
        class,
        score: 1.0,
        pixels: PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 },
        mask: vec![1; width * height],
    };
    vec![
        of(Class::Car, (width, height)),
        of(Class::Bus, (width, height)),
        of(Class::Person, (1, 1)),
    ]
}
