//! The same masks with a detector's faults, seeded: some are missed, cars beside one another become
//! one, borders are ragged, scores vary, cars are called vans and the other way round, and false
//! detections are added. Each frame's random numbers depend on the seed and the frame's number
//! only.

use super::MaskSource;
use crate::input::source::{FrameMasks, InputError, InstanceMask, StereoImages, union};
use dynvox_core::masks::PixelBox;
use dynvox_core::random::Random;
use dynvox_core::tracking::Class;

/// Probability that a mask is missed, percent.
const MISSED: u32 = 10;
/// Probability that two cars that touch become one, percent.
const MERGED: u32 = 15;
/// Probability that a car is called a van or the other way round, percent.
const MISCALLED: u32 = 5;
/// Probability of a false detection, percent of frames.
const FALSE: u32 = 30;
/// Side of the patches in which a border moves alike, px.
const PATCH_PX: i32 = 6;
/// Largest shift of a border, px at an image width of 640.
const RAGGED_PX: f64 = 2.0;

/// Another source's masks, spoilt.
pub(super) struct Noisy<S> {
    pub inner: S,
    pub seed: u64,
}

impl<S: MaskSource> MaskSource for Noisy<S> {
    fn masks(&self, index: usize, images: &StereoImages) -> Result<FrameMasks, InputError> {
        let mut masks = self.inner.masks(index, images)?;
        let mut random =
            Random::new(self.seed ^ (index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let chance = |percent: u32, random: &mut Random| random.below(100) < percent;
        let image = PixelBox {
            left: 0,
            top: 0,
            width: images.left.width() as i32,
            height: images.left.height() as i32,
        };
        let most = ((RAGGED_PX * f64::from(image.width) / 640.0).round() as i32).max(1);
        let mut kept: Vec<InstanceMask> = Vec::new();
        for mut one in std::mem::take(&mut masks.instances) {
            // All are drawn for every mask: what happens to one does not shift the draws of the
            // next.
            let [missed, merged, miscalled] =
                [MISSED, MERGED, MISCALLED].map(|percent| chance(percent, &mut random));
            let (score, patches) =
                (0.5 + random.below(500) as f32 / 1_000.0, u64::from(random.next_u32()));
            if missed {
                continue;
            }
            one.score = score;
            if miscalled {
                one.class = if one.class == Class::Car { Class::Van } else { Class::Car };
            }
            let Some(one) = ragged(&one, &image, most, patches) else { continue };
            match kept.iter_mut().find(|other| merged && touch(other, &one)) {
                Some(other) => *other = joined(other, &one),
                None => kept.push(one),
            }
        }
        if chance(FALSE, &mut random) {
            kept.extend(ghost(&image, &mut random));
        }
        masks.instances = kept;
        Ok(masks)
    }
}

/// The mask with every patch of pixels looking some pixels aside.
fn ragged(one: &InstanceMask, image: &PixelBox, most: i32, patches: u64) -> Option<InstanceMask> {
    let PixelBox { left, top, width, height } = one.pixels;
    let around = PixelBox {
        left: left - most,
        top: top - most,
        width: width + 2 * most,
        height: height + 2 * most,
    };
    let shift = |u: i32, v: i32, axis: u64| {
        let patch = u64::from((u.div_euclid(PATCH_PX)) as u32) << 32
            | u64::from((v.div_euclid(PATCH_PX)) as u32);
        Random::new(patches ^ patch.wrapping_mul(0xD6E8_FEB8_6659_FD93) ^ axis)
            .below(2 * most as u32 + 1) as i32
            - most
    };
    InstanceMask::from_predicate(one.class, one.score, around.intersection(image), |u, v| {
        one.contains(u + shift(u, v, 1), v + shift(u, v, 2))
    })
}

fn touch(a: &InstanceMask, b: &InstanceMask) -> bool {
    let PixelBox { left, top, width, height } = b.pixels;
    a.pixels
        .intersection(&PixelBox {
            left: left - 2,
            top: top - 2,
            width: width + 4,
            height: height + 4,
        })
        .area()
        > 0
}

fn joined(a: &InstanceMask, b: &InstanceMask) -> InstanceMask {
    let (pixels, better) = (union(&a.pixels, &b.pixels), if a.score >= b.score { a } else { b });
    InstanceMask::from_predicate(better.class, better.score, pixels, |u, v| {
        a.contains(u, v) || b.contains(u, v)
    })
    .unwrap_or_else(|| a.clone())
}

/// A false detection: an ellipse of some class somewhere below the sky.
fn ghost(image: &PixelBox, random: &mut Random) -> Option<InstanceMask> {
    let classes = [Class::Car, Class::Car, Class::Person, Class::Truck, Class::Bus, Class::Other];
    let class =
        classes.get(random.below(classes.len() as u32) as usize).copied().unwrap_or_default();
    let side = |least: i32, most: i32, random: &mut Random| {
        least + random.below((most - least).max(1) as u32) as i32
    };
    let (width, height) = (
        side(image.width / 20, image.width / 4, random),
        side(image.height / 8, image.height / 2, random),
    );
    let left = side(0, image.width - width, random);
    let top = side(image.height / 4, image.height - height, random);
    let score = 0.3 + random.below(400) as f32 / 1_000.0;
    let pixels = PixelBox { left, top, width, height }.intersection(image);
    let off = |at: i32, from: i32, side: i32| (2 * (at - from) + 1 - side) as f32 / side as f32;
    InstanceMask::from_predicate(class, score, pixels, |u, v| {
        off(u, left, width).powi(2) + off(v, top, height).powi(2) <= 1.0
    })
}
