//! Disparities around the pixels of an image, 64 columns at a time: what edges are found with, for
//! the map and for objects.
//!
//! Matching widens what is near: beside its edge, what is behind gets its disparity, and behind it
//! the far surface is continued. So pixels are compared with those a few columns and rows away.

use crate::{image::View, slices::padded};

/// Columns worked on at once: a word of a mask.
pub(crate) const BLOCK: usize = 64;
/// Difference above which neighbours are across an edge, 1/256 px: 1.5 px. Within a few pixels a
/// surface has no such step unless it is viewed edge-on.
pub(crate) const EDGE_Q8: u16 = 384;
/// Reach of an edge within which colours, and the depths behind it, are unreliable, px.
pub(crate) const EDGE_REACH_PX: usize = 3;

/// A disparity image, 1/256 px, 0 none, to be compared with itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings<'a> {
    pub disparity_q8: View<'a, u16>,
}

impl Surroundings<'_> {
    /// The disparities of a block that begins at column `first` of row `v`, moved by so many
    /// pixels; 0 outside the image.
    #[inline(always)]
    pub fn tap(&self, first: usize, v: usize, [du, dv]: [isize; 2]) -> [u16; BLOCK] {
        let Some(v) = v.checked_add_signed(dv).filter(|&v| v < self.disparity_q8.height()) else {
            return [0; BLOCK];
        };
        let outside = du.min(0).unsigned_abs().saturating_sub(first).min(BLOCK);
        padded(self.disparity_q8.row(v), first.saturating_add_signed(du), outside, 0)
    }

    /// The largest disparity within [`EDGE_REACH_PX`] along row and column of each pixel of a
    /// block.
    #[inline(always)]
    pub fn nearest(&self, first: usize, v: usize) -> [u16; BLOCK] {
        let mut nearest = [0; BLOCK];
        // Rings of growing distance: along rows and columns only.
        for distance_px in 1..=EDGE_REACH_PX {
            for offset in beside(distance_px) {
                let tap = self.tap(first, v, offset);
                for (nearest, &other) in nearest.iter_mut().zip(&tap) {
                    *nearest = if other > *nearest { other } else { *nearest };
                }
            }
        }
        nearest
    }

    /// The least disparity about each pixel of a block: of what has one, less one, within
    /// `edge_reach_px`, and of all, none being 0, within [`EDGE_REACH_PX`]. The largest number
    /// where `edge_reach_px` is 0.
    #[inline(always)]
    pub fn farthest(&self, first: usize, v: usize, edge_reach_px: usize) -> [[u16; BLOCK]; 2] {
        let mut farthest = [[u16::MAX; BLOCK]; 2];
        if edge_reach_px == 0 {
            return farthest;
        }
        let [behind, spoiling] = &mut farthest;
        // Loops, not closures, which compilers leave as calls for the baseline.
        for distance_px in 1..=EDGE_REACH_PX.max(edge_reach_px) {
            for offset in beside(distance_px) {
                let tap = self.tap(first, v, offset);
                if distance_px <= edge_reach_px {
                    // None wraps around to the largest.
                    behind
                        .iter_mut()
                        .zip(&tap)
                        .for_each(|(least, tap)| *least = least_of(*least, tap.wrapping_sub(1)));
                }
                if distance_px <= EDGE_REACH_PX {
                    spoiling
                        .iter_mut()
                        .zip(&tap)
                        .for_each(|(least, tap)| *least = least_of(*least, *tap));
                }
            }
        }
        farthest
    }
}

/// Offsets to the pixels so far to each side, above and below.
#[inline(always)]
fn beside(distance_px: usize) -> [[isize; 2]; 4] {
    let px = distance_px as isize;
    [[px, 0], [-px, 0], [0, px], [0, -px]]
}

#[inline]
fn least_of(a: u16, b: u16) -> u16 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const WIDTH: usize = 150;
    const HEIGHT: usize = 12;

    #[test]
    fn extremes_equal_those_found_pixel_by_pixel() {
        let mut random = Random::new(7);
        let pixels: Vec<u16> = (0..WIDTH * HEIGHT)
            .map(|_| if random.below(4) == 0 { 0 } else { random.below(65_536) as u16 })
            .collect();
        let image = View::new(&pixels, WIDTH, HEIGHT).unwrap();
        let surroundings = Surroundings { disparity_q8: image };
        let others = |u: usize, v: usize, reach: isize| -> Vec<u16> {
            let offsets = (1..=reach).flat_map(|px| [(px, 0), (-px, 0), (0, px), (0, -px)]);
            let at = |(du, dv)| image.get(u.checked_add_signed(du)?, v.checked_add_signed(dv)?);
            offsets.map(|offset| at(offset).unwrap_or(0)).collect()
        };
        for (first, v) in [(0, 0), (64, 5), (86, HEIGHT - 1)] {
            let nearest = surroundings.nearest(first, v);
            let [behind, spoiling] = surroundings.farthest(first, v, 2);
            for i in 0..BLOCK {
                let around = others(first + i, v, 3);
                assert_eq!(nearest[i], *around.iter().max().unwrap());
                assert_eq!(spoiling[i], *around.iter().min().unwrap());
                let known = others(first + i, v, 2).into_iter().filter(|&other| other > 0);
                assert_eq!(behind[i], known.min().map_or(u16::MAX, |least| least - 1));
            }
        }
    }
}
