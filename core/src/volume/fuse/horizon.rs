//! Greatest depths of an image by tile, so that blocks behind all that is observed cost no
//! projection.
//!
//! Memory: that of the cache of requested blocks, which fusion does not need; tiles are as small as
//! fits, from 8 px on, and every 4 x 4 of them are one tile of a coarser level.

use crate::{
    geometry::scalar::max_f32,
    image::View,
    slices::{clipped, clipped_mut},
};

/// Least side of a tile, px, as a shift.
const TILE_SHIFT: u32 = 3;
/// From level to level, as a shift.
const LEVEL_SHIFT: u32 = 2;
/// Most tiles of a level to look at along an axis before the next one is asked.
const MAX_TILES: usize = 4;

/// Greatest depths by tile.
#[derive(Clone, Copy)]
pub(super) struct Horizon<'a> {
    fine: Tiles<'a>,
    coarse: Tiles<'a>,
}

#[derive(Clone, Copy)]
struct Tiles<'a> {
    depth_m: &'a [f32],
    columns: usize,
    shift: u32,
}

impl<'a> Horizon<'a> {
    /// Finds the greatest depths of an image, in `memory`. `None` where that is too small for any
    /// tiles.
    pub fn new(depth_m: View<'_, f32>, memory: &'a mut [f32]) -> Option<Self> {
        let (width, height) = (depth_m.width(), depth_m.height());
        let columns_rows = |shift: u32| [width.div_ceil(1 << shift), height.div_ceil(1 << shift)];
        let tiles = |shift: u32| columns_rows(shift).iter().product::<usize>();
        // The finest tiles whose two levels fit the memory.
        let shift = (TILE_SHIFT..usize::BITS - LEVEL_SHIFT)
            .find(|&shift| tiles(shift) + tiles(shift + LEVEL_SHIFT) <= memory.len())?;
        let (fine, coarse) = memory.split_at_mut_checked(tiles(shift))?;
        let coarse = coarse.get_mut(..tiles(shift + LEVEL_SHIFT))?;
        let [columns, _] = columns_rows(shift);
        let [coarse_columns, _] = columns_rows(shift + LEVEL_SHIFT);
        greatest(depth_m, shift, columns, fine);
        greatest(
            View::new(fine, columns, fine.len().checked_div(columns)?)?,
            LEVEL_SHIFT,
            coarse_columns,
            coarse,
        );
        Some(Self {
            fine: Tiles { depth_m: fine, columns, shift },
            coarse: Tiles { depth_m: coarse, columns: coarse_columns, shift: shift + LEVEL_SHIFT },
        })
    }

    /// A depth that no pixel from the first to the last column and row exceeds, m; all within the
    /// image.
    pub fn greatest_m(&self, columns: [usize; 2], rows: [usize; 2]) -> f32 {
        let across = |shift: u32, [first, last]: [usize; 2]| (last >> shift) - (first >> shift);
        let few = across(self.fine.shift, columns) < MAX_TILES
            && across(self.fine.shift, rows) < MAX_TILES;
        let Tiles { depth_m, columns: stride, shift } = if few { self.fine } else { self.coarse };
        // Tiles reach beyond the rectangle, which can only raise the bound.
        let [first, last] = columns.map(|column| column >> shift);
        let mut greatest_m = 0.0;
        for row in rows[0] >> shift..=rows[1] >> shift {
            let tiles = depth_m.get(row * stride + first..=row * stride + last);
            debug_assert!(tiles.is_some(), "within the image");
            // What is not known hides nothing.
            let Some(tiles) = tiles else { return f32::MAX };
            greatest_m =
                tiles.iter().fold(greatest_m, |greatest_m, &tile_m| max_f32(greatest_m, tile_m));
        }
        greatest_m
    }
}

/// Columns looked at together.
const BLOCK: usize = 64;

/// The greatest of each `1 << shift` columns and rows.
#[inline(never)]
fn greatest(image: View<'_, f32>, shift: u32, columns: usize, tiles: &mut [f32]) {
    tiles.fill(0.0);
    let side = 1 << shift;
    for (first, tiles) in
        (0..image.height()).step_by(side).zip(tiles.chunks_exact_mut(columns.max(1)))
    {
        for start in (0..image.width()).step_by(BLOCK) {
            // Of each column first: many at a time.
            let mut along = [0.0; BLOCK];
            for v in first..image.height().min(first + side) {
                let pixels = clipped(image.row(v), start..);
                along
                    .iter_mut()
                    .zip(pixels)
                    .for_each(|(greatest, &depth_m)| *greatest = max_f32(depth_m, *greatest));
            }
            for (tile, along) in
                clipped_mut(tiles, start >> shift..).iter_mut().zip(along.chunks(side))
            {
                *tile = along.iter().fold(*tile, |greatest, &depth_m| max_f32(depth_m, greatest));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::{vec, vec::Vec};

    #[test]
    fn never_says_less_than_the_greatest_depth_of_the_pixels_asked_for() {
        let mut random = Random::new(3);
        for (width, height, space) in
            [(1, 1, 2), (37, 21, 100), (320, 96, 600), (320, 96, 20), (100, 70, 2)]
        {
            let depth_m: Vec<f32> = (0..width * height)
                .map(|_| random.below(3) as f32 * random.below(1_000) as f32)
                .collect();
            let (image, mut memory) =
                (View::new(&depth_m, width, height).unwrap(), vec![7.0; space]);
            let horizon = Horizon::new(image, &mut memory).unwrap();
            for _ in 0..500 {
                let mut span = |size: usize| {
                    let (a, b) =
                        (random.below(size as u32) as usize, random.below(size as u32) as usize);
                    if a < b { [a, b] } else { [b, a] }
                };
                let (columns, rows) = (span(width), span(height));
                let pixels = (rows[0]..=rows[1])
                    .flat_map(|v| (columns[0]..=columns[1]).map(move |u| (u, v)));
                let exact = pixels
                    .map(|(u, v)| image.get(u, v).unwrap())
                    .fold(0.0, |a, b| if b > a { b } else { a });
                assert!(horizon.greatest_m(columns, rows) >= exact);
            }
        }
        assert!(Horizon::new(View::new(&[1.0], 1, 1).unwrap(), &mut [0.0]).is_none());
    }
}
