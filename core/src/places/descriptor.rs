//! Binary descriptors of image points: comparisons of brightness in a patch (BRIEF; Calonder et
//! al., 2010), in integers only.
//!
//! A patch is as wide as twice the point's disparity, between 16 and 64 px, so that one camera sees
//! the same part of a surface from near and from far. It stays upright.

use super::keypoint::Keypoint;
use crate::image::View;
use bytemuck::{Pod, Zeroable};

/// Bits of a descriptor.
pub(super) const BITS: u32 = 256;
/// Words of a descriptor.
const WORDS: usize = BITS as usize / 64;
/// Cells of a patch, across and down.
const CELLS: usize = 32;
/// Cells that are summed up for a comparison, across and down: single pixels are noisy.
const BLUR: usize = 5;
/// Sums in a row of a patch.
const SUMS: usize = CELLS - BLUR + 1;
/// Least and largest side of a cell, 1/256 px.
const CELL_Q8: [i32; 2] = [128, 512];
/// Cells per pixel of disparity: a patch of 32 cells is twice the disparity wide.
const DISPARITY_CELLS: i32 = 16;

/// Pairs of sums that are compared, fixed by a generator of its own when the program is compiled.
const PAIRS: [[u16; 2]; BITS as usize] = pairs();

#[expect(clippy::indexing_slicing, reason = "evaluated by the compiler, which checks it")]
const fn pairs() -> [[u16; 2]; BITS as usize] {
    let (mut pairs, mut state, mut at) = ([[0; 2]; BITS as usize], 0x706c_6163_6573_u64, 0);
    while at < pairs.len() {
        let (mut side, mut ends) = (0, [0; 2]);
        while side < 2 {
            // The mean of two draws: comparisons near the middle say more.
            let (mut axis, mut cell) = (0, [0; 2]);
            while axis < 2 {
                let mut sum = 0;
                let mut draw = 0;
                while draw < 2 {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695);
                    sum += (state >> 33) as usize % SUMS;
                    draw += 1;
                }
                cell[axis] = sum / 2;
                axis += 1;
            }
            ends[side] = (cell[1] * SUMS + cell[0]) as u16;
            side += 1;
        }
        // A sum compared with itself says nothing.
        if ends[0] != ends[1] {
            pairs[at] = ends;
            at += 1;
        }
    }
    pairs
}

/// Descriptor of a point in an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Descriptor(pub [u64; WORDS]);

impl Descriptor {
    /// Describes the surroundings of a point; `None` where its patch reaches beyond the image.
    pub(super) fn new(image: View<'_, u8>, point: &Keypoint) -> Option<Self> {
        let sums = sums(image, point)?;
        let sum = |at: u16| sums.get(usize::from(at)).copied().unwrap_or_default();
        let mut words = [0; WORDS];
        for (word, pairs) in words.iter_mut().zip(PAIRS.chunks(64)) {
            *word = pairs
                .iter()
                .enumerate()
                .fold(0, |bits, (bit, &[a, b])| bits | u64::from(sum(a) < sum(b)) << bit);
        }
        Some(Self(words))
    }

    /// Bits that differ.
    pub(super) fn distance(&self, other: &Self) -> u32 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a ^ b).count_ones()).sum()
    }

    /// Sixteen of the bits.
    pub(super) fn substring(&self, number: usize) -> u16 {
        let word = self.0.get(number / 4).copied().unwrap_or_default();
        (word >> (16 * (number % 4))) as u16
    }
}

/// Sums over 5 x 5 cells of a point's patch.
fn sums(image: View<'_, u8>, point: &Keypoint) -> Option<[u16; SUMS * SUMS]> {
    let [least, largest] = CELL_Q8;
    let cell_q8 = (i32::from(point.disparity_q8) / DISPARITY_CELLS).max(least).min(largest);
    let first_q8 =
        |middle_q3: u16| (i32::from(middle_q3) << 5) - cell_q8 * (CELLS as i32 - 1) / 2 + 128;
    let [left_q8, top_q8] = [point.u_q3, point.v_q3].map(first_q8);
    let last = |first_q8: i32| (first_q8 + cell_q8 * (CELLS as i32 - 1)) >> 8;
    let fits = |first_q8: i32, size: usize| first_q8 >= 0 && (last(first_q8) as usize) < size;
    if !fits(left_q8, image.width()) || !fits(top_q8, image.height()) {
        return None;
    }
    // Rows first, then columns: both run over the cells once.
    let mut across = [0u16; SUMS * CELLS];
    for (row, sums) in (0..).zip(across.chunks_exact_mut(SUMS)) {
        let pixels = image.row(((top_q8 + cell_q8 * row) >> 8) as usize);
        let mut cells = [0u16; CELLS];
        for (column, cell) in (0..).zip(&mut cells) {
            let at = ((left_q8 + cell_q8 * column) >> 8) as usize;
            *cell = u16::from(pixels.get(at).copied().unwrap_or_default());
        }
        for (sum, window) in sums.iter_mut().zip(cells.windows(BLUR)) {
            *sum = window.iter().sum();
        }
    }
    let mut both = [0u16; SUMS * SUMS];
    for (at, sum) in both.iter_mut().enumerate() {
        *sum = across.iter().skip(at).step_by(SUMS).take(BLUR).sum();
    }
    Some(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const SIDE: usize = 160;

    /// Smooth noise, enlarged by a factor of 1/256.
    fn picture(seed: u64, zoom_q8: usize) -> Vec<u8> {
        let mut random = Random::new(seed);
        let noise: Vec<i32> = (0..64 * 64).map(|_| random.below(200) as i32).collect();
        let at = |u: usize, v: usize| {
            let ([a, p], [b, q]) = ([u >> 10, u & 1023], [v >> 10, v & 1023]);
            let corner = |x: usize, y: usize| noise[(y % 64) * 64 + x % 64];
            let row = |y: usize| corner(a, y) * (1024 - p as i32) + corner(a + 1, y) * p as i32;
            ((row(b) >> 10) * (1024 - q as i32) + (row(b + 1) >> 10) * q as i32) >> 10
        };
        let to = |x: usize| (x * 256 * 256) / zoom_q8;
        (0..SIDE * SIDE).map(|i| at(to(i % SIDE), to(i / SIDE)) as u8).collect()
    }

    fn described(pixels: &[u8], at: [u16; 2], disparity_px: u16) -> Option<Descriptor> {
        let point = Keypoint { u_q3: at[0] * 8, v_q3: at[1] * 8, disparity_q8: disparity_px * 256 };
        Descriptor::new(View::new(pixels, SIDE, SIDE).unwrap(), &point)
    }

    #[test]
    fn a_point_seen_from_half_the_distance_keeps_its_descriptor() {
        let (far, near) = (picture(1, 256), picture(1, 512));
        let before = described(&far, [40, 36], 12).unwrap();
        let same = before.distance(&described(&near, [80, 72], 24).unwrap());
        let other = before.distance(&described(&near, [60, 90], 24).unwrap());
        assert!(same < 40 && other > 80, "{same} and {other} of 256 bits");
    }

    #[test]
    fn a_darker_image_has_the_same_descriptors() {
        let light = picture(2, 256);
        let dark: Vec<u8> = light.iter().map(|grey| grey / 2 + 7).collect();
        let [a, b] = [&light, &dark].map(|pixels| described(pixels, [70, 70], 16).unwrap());
        assert!(a.distance(&b) < 24, "{}", a.distance(&b));
    }

    #[test]
    fn a_patch_that_reaches_beyond_the_image_has_none() {
        let pixels = picture(3, 256);
        assert!(described(&pixels, [7, 80], 4).is_none());
        assert!(described(&pixels, [8, 80], 4).is_some());
        assert!(described(&pixels, [140, 80], 40).is_none());
    }
}
