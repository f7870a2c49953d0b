//! The greatest disparity of rectangles of an image: a pyramid of maxima (Williams: *Pyramidal
//! Parametrics*, 1983, with maxima for means).
//!
//! Level n holds the maximum of 2^n x 2^n pixels. A rectangle is covered by at most 3 x 3 texels of
//! the level whose texels are about half as large, so what is read reaches beyond it by at most
//! half its side: more is looked at, never less.
//!
//! Memory: 2 bytes for every third pixel. Time: linear in pixels.

use crate::{
    image::View,
    memory::{Capacity, Carver, region_bytes},
};

/// Levels above the image.
const LEVELS: usize = 6;

/// Texels of all levels for images of a size.
const fn texels(width: usize, height: usize) -> usize {
    let (mut sum, mut level) = (0, 1);
    while level <= LEVELS {
        sum += width.div_ceil(1 << level) * height.div_ceil(1 << level);
        level += 1;
    }
    sum
}

/// The levels above an image.
#[derive(Debug)]
pub(super) struct Pyramid<'s> {
    texels: &'s mut [u16],
}

impl<'s> Pyramid<'s> {
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u16>(texels(capacity.image_width, capacity.image_height))
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            texels: carver
                .alloc("planning.pyramid", texels(capacity.image_width, capacity.image_height)),
        }
    }

    /// Fills the levels above an image that is no larger than the capacity's.
    pub fn build(&mut self, image: View<'_, u16>) {
        let (mut width, mut height) = (image.width(), image.height());
        let mut rest = &mut *self.texels;
        let mut below: Option<&[u16]> = None;
        for _ in 0..LEVELS {
            let (columns, rows) = (width.div_ceil(2), height.div_ceil(2));
            let Some((level, further)) =
                core::mem::take(&mut rest).split_at_mut_checked(columns * rows)
            else {
                return;
            };
            // Beyond the border there is no surface: 0.
            let at = |u: usize, v: usize| match below {
                None => image.get(u, v).unwrap_or(0),
                Some(below) if u < width => below.get(v * width + u).copied().unwrap_or(0),
                Some(_) => 0,
            };
            for (position, texel) in level.iter_mut().enumerate() {
                let (u, v) = (2 * (position % columns.max(1)), 2 * (position / columns.max(1)));
                *texel = at(u, v).max(at(u + 1, v)).max(at(u, v + 1)).max(at(u + 1, v + 1));
            }
            (width, height, rest, below) = (columns, rows, further, Some(&*level));
        }
    }

    /// The greatest value of the image from column `u[0]` to `u[1]` and row `v[0]` to `v[1]`, both
    /// included and in the image, and of less than half as much around.
    pub fn greatest(&self, image: View<'_, u16>, u: [usize; 2], v: [usize; 2]) -> u16 {
        let side = (u[1] - u[0]).max(v[1] - v[0]) + 1;
        // The largest level whose texels are at most half a side.
        let level = (side.checked_ilog2().unwrap_or(0) as usize).saturating_sub(1).min(LEVELS);
        let first = if level == 0 { 0 } else { texels_below(image.width(), image.height(), level) };
        let width = image.width().div_ceil(1 << level);
        let mut greatest = 0;
        for row in v[0] >> level..=v[1] >> level {
            for column in u[0] >> level..=u[1] >> level {
                let texel = if level == 0 {
                    image.get(column, row)
                } else {
                    self.texels.get(first + row * width + column).copied()
                };
                greatest = greatest.max(texel.unwrap_or(0));
            }
        }
        greatest
    }
}

/// Texels of the levels below `level`, which is at least 1.
fn texels_below(width: usize, height: usize, level: usize) -> usize {
    (1..level).map(|below| width.div_ceil(1 << below) * height.div_ceil(1 << below)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{memory::SLAB_ALIGN, random::Random};
    use std::{vec, vec::Vec};

    #[test]
    fn the_greatest_is_between_that_of_the_rectangle_and_one_twice_as_large() {
        let (width, height) = (101, 57);
        let capacity = Capacity { image_width: 128, image_height: 64, ..Capacity::TINY };
        let mut slab = vec![0u8; Pyramid::bytes(&capacity) + SLAB_ALIGN];
        let mut pyramid = Pyramid::new_in(
            &capacity,
            &mut Carver::new(&mut slab, Pyramid::bytes(&capacity)).unwrap(),
        );
        let mut random = Random::new(3);
        let pixels: Vec<u16> = (0..width * height)
            .map(|_| if random.below(40) == 0 { random.below(9_000) as u16 } else { 0 })
            .collect();
        let pixels = &pixels[..];
        let image = View::new(pixels, width, height).unwrap();
        pyramid.build(image);
        // The rectangle's greatest pixel, looked up one by one.
        let within = |u: [usize; 2], v: [usize; 2]| {
            (v[0]..=v[1].min(height - 1))
                .flat_map(|row| {
                    (u[0]..=u[1].min(width - 1)).map(move |column| pixels[row * width + column])
                })
                .max()
                .unwrap()
        };
        for _ in 0..2_000 {
            let mut span = |size: usize| {
                let [a, b] = [0; 2].map(|_: i32| random.below(size as u32) as usize);
                [a.min(b), a.max(b)]
            };
            let (u, v) = (span(width), span(height));
            // Texels may reach beyond the rectangle by less than half of its longer side.
            let more = (u[1] - u[0]).max(v[1] - v[0]) + 1;
            let wider = |[low, high]: [usize; 2]| [low.saturating_sub(more / 2), high + more / 2];
            let found = pyramid.greatest(image, u, v);
            assert!(found >= within(u, v) && found <= within(wider(u), wider(v)), "{u:?} {v:?}");
        }
    }
}
