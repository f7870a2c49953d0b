//! A map from rectified pixels to raw ones: one `u32` a pixel.
//!
//! An entry holds column and row of the raw image in fixed point, the column in the upper bits.
//! Each coordinate has as many bits before the point as the raw image needs; what is left of the 32
//! is shared behind it, at most 8 bits each: 1/64 px for 1392 x 512, 1/32 px for 2048 x 1536.

use super::{MAX_RAW_SIDE, RawCamera, TurnedCamera};
use crate::{
    geometry::StereoRig,
    image::{InvalidPixels, View},
    slices::clipped,
};

/// The entry of a pixel that no raw pixel covers.
pub(super) const NONE: u32 = u32::MAX;

/// Distance outside the centres of a raw image's outermost pixels at which a position still counts
/// as covered, px: a rectified image's sides, found from points along the raw ones, may be off by
/// this.
const RIM_PX: f64 = 1.0 / 16.0;

/// Pixels around an invalid one that are not to be used either: descriptors of features reach 5 px
/// and their gradients 1 px further.
pub const INVALID_MARGIN_PX: usize = 6;

/// Layout of an entry's bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packing {
    /// Bits behind the point of the column.
    fraction_u: u32,
    /// Bits behind the point of the row.
    fraction_v: u32,
    /// Bits of the row in all.
    row_bits: u32,
}

impl Packing {
    /// For raw images of this size.
    pub(super) fn new(camera: &RawCamera) -> Self {
        let (whole_u, whole_v) = (bits(camera.width), bits(camera.height));
        let spare = u32::BITS - whole_u - whole_v;
        let (fraction_u, fraction_v) = (spare.div_ceil(2).min(8), (spare / 2).min(8));
        Self { fraction_u, fraction_v, row_bits: whole_v + fraction_v }
    }

    /// The entry of a point in the raw image; [`NONE`] outside it.
    ///
    /// All four neighbours of an entry lie within the image: a point in the last column is moved
    /// left by the smallest step there is, one in the last row up.
    fn entry(&self, camera: &RawCamera, [u, v]: [f64; 2]) -> u32 {
        let [last_u, last_v] = [camera.width - 1, camera.height - 1];
        let inside = |at: f64, last: u32| at >= -RIM_PX && at <= f64::from(last) + RIM_PX;
        let within = inside(u, last_u) && inside(v, last_v);
        if !within {
            return NONE;
        }
        let fixed = |value: f64, fraction: u32, last: u32| {
            // The cast takes what lies before the first pixel to it.
            let nearest = libm::floor(value * f64::from(1u32 << fraction) + 0.5) as u32;
            nearest.min((last << fraction) - 1)
        };
        fixed(u, self.fraction_u, last_u) << self.row_bits | fixed(v, self.fraction_v, last_v)
    }

    /// Column, row and weights of their right and lower neighbours.
    #[inline(always)]
    pub(super) fn unpack(&self, entry: u32) -> ([usize; 2], [u32; 2]) {
        let (u, v) = (entry >> self.row_bits, entry & ((1 << self.row_bits) - 1));
        let weights = [u & ((1 << self.fraction_u) - 1), v & ((1 << self.fraction_v) - 1)];
        ([(u >> self.fraction_u) as usize, (v >> self.fraction_v) as usize], weights)
    }
}

/// Bits of the largest position in an image with so many columns or rows.
fn bits(side: u32) -> u32 {
    u32::BITS - (side.clamp(2, MAX_RAW_SIDE) - 1).leading_zeros()
}

/// Makes the map of one camera for a rectified image `width` wide.
pub(super) fn fill(map: &mut [u32], width: usize, camera: &TurnedCamera, rig: &StereoRig) {
    let packing = Packing::new(&camera.raw);
    for (v, row) in map.chunks_exact_mut(width.max(1)).enumerate() {
        for (u, entry) in row.iter_mut().enumerate() {
            let raw = camera.raw_pixel(rig, [u as f64, v as f64]);
            *entry = raw.map_or(NONE, |raw| packing.entry(&camera.raw, raw));
        }
    }
}

/// Sets the bits of all pixels within [`INVALID_MARGIN_PX`] of one that no raw pixel covers. How
/// many no raw pixel covers.
pub(super) fn mark_invalid(map: &[u32], width: usize, height: usize, words: &mut [u64]) -> u32 {
    words.fill(0);
    let row_words = InvalidPixels::words_a_row(width);
    let mut count = 0;
    for (v, row) in map.chunks_exact(width.max(1)).enumerate() {
        for (u, _) in row.iter().enumerate().filter(|(_, entry)| **entry == NONE) {
            count += 1;
            let [above, below] = [
                v.saturating_sub(INVALID_MARGIN_PX),
                (v + INVALID_MARGIN_PX).min(height.saturating_sub(1)),
            ];
            let [first, last] =
                [u.saturating_sub(INVALID_MARGIN_PX), (u + INVALID_MARGIN_PX).min(width - 1)];
            // Inside an invalid area the neighbours have set all but the foremost column.
            let inside = u > 0 && row.get(u - 1) == Some(&NONE);
            for near_v in above..=below {
                let Some(words) = words.get_mut(near_v * row_words..(near_v + 1) * row_words)
                else {
                    continue;
                };
                for near_u in (if inside { last } else { first })..=last {
                    if let Some(word) = words.get_mut(near_u / 64) {
                        *word |= 1 << (near_u % 64);
                    }
                }
            }
        }
    }
    count
}

/// Fills a rectified image from a raw one: bilinear, in integers, halves rounded up. Pixels that no
/// raw pixel covers become 0. Nothing where the raw image is not of the size the map was made for.
pub(super) fn remap<T: Sample>(map: &[u32], camera: &RawCamera, raw: &View<'_, T>, out: &mut [T]) {
    if [raw.width(), raw.height()] != [camera.width as usize, camera.height as usize] {
        return;
    }
    let packing = Packing::new(camera);
    let (data, stride) = raw.strided();
    // The memory may go on below the image, as where two pictures lie one above the other.
    let data = clipped(data, ..(raw.height() - 1) * stride + raw.width());
    // From a pixel to its right lower neighbour, both included.
    let span = stride + 2;
    for (out, &entry) in out.iter_mut().zip(map) {
        let ([u, v], weights) = packing.unpack(entry);
        // `NONE` names the last column and row there could be, and the window from there on ends
        // outside the image.
        let window = data.get(v * stride + u..).and_then(|rest| rest.get(..span));
        *out = match window.map(|window| (window.first_chunk::<2>(), window.last_chunk::<2>())) {
            Some((Some(upper), Some(lower))) => T::between(upper, lower, weights, &packing),
            _ => T::NONE,
        };
    }
}

/// Value that a remap interpolates.
pub(super) trait Sample: Copy + Send + Sync {
    /// Value of a pixel without cover.
    const NONE: Self;

    /// The value between two pixels and the two below them, so far to the right and down.
    fn between(upper: &[Self; 2], lower: &[Self; 2], weights: [u32; 2], packing: &Packing) -> Self;
}

impl Sample for u8 {
    const NONE: Self = 0;

    #[inline(always)]
    fn between(
        upper: &[Self; 2],
        lower: &[Self; 2],
        [right, down]: [u32; 2],
        packing: &Packing,
    ) -> Self {
        // At most 16 bits: 8 of the pixel, 8 of the fraction. A difference may be negative, and
        // wraps back in the sum.
        let along = |[a, b]: &[u8; 2]| {
            (u32::from(*a) << packing.fraction_u)
                .wrapping_add(u32::from(*b).wrapping_sub(u32::from(*a)).wrapping_mul(right))
        };
        let (upper, lower) = (along(upper), along(lower));
        let sum = (upper << packing.fraction_v)
            .wrapping_add(lower.wrapping_sub(upper).wrapping_mul(down));
        let bits = packing.fraction_u + packing.fraction_v;
        (sum.wrapping_add((1 << bits) >> 1) >> bits) as u8
    }
}

impl Sample for [u8; 3] {
    const NONE: Self = [0; 3];

    #[inline(always)]
    fn between(
        [a, b]: &[Self; 2],
        [c, d]: &[Self; 2],
        weights: [u32; 2],
        packing: &Packing,
    ) -> Self {
        let ([a0, a1, a2], [b0, b1, b2], [c0, c1, c2], [d0, d1, d2]) = (*a, *b, *c, *d);
        [([a0, b0], [c0, d0]), ([a1, b1], [c1, d1]), ([a2, b2], [c2, d2])]
            .map(|(upper, lower)| u8::between(&upper, &lower, weights, packing))
    }
}
