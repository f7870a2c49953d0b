//! How near and how far the surface can be, per tile of the picture.
//!
//! Each block's crossed cells are wrapped in tight boxes, one for each eighth of the block, and every box is entered in the tiles that it
//! may cover. Rays then begin right before the surface.

use super::{
    eye::{Extent, Eye},
    signs::Layers,
    surface::Surface,
};
use crate::{
    geometry::scalar::{max_f32, min_f32},
    memory::{Capacity, Carver, SlabError, region_bytes},
    volume::BLOCK_SIDE,
};

/// Width of a tile, px, as a shift.
pub(super) const TILE_SHIFT: usize = 3;
/// Side of the eighth of a block, cells.
const PART: usize = BLOCK_SIDE / 2;

/// Depth ranges by tile: a tile is 8 px wide and one row high, for depth changes fast from row to row of a road.
#[derive(Debug)]
pub(super) struct Ranges<'s> {
    /// Nearest and farthest depth, m; farthest 0: nothing.
    depth_m: &'s mut [[f32; 2]],
    columns: usize,
}

impl<'s> Ranges<'s> {
    const fn tiles(width: usize, height: usize) -> usize {
        width.div_ceil(1 << TILE_SHIFT) * height
    }

    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<[f32; 2]>(Self::tiles(capacity.image_width, capacity.image_height))
    }

    pub fn carve(capacity: &Capacity, carver: &mut Carver<'s>) -> Result<Self, SlabError> {
        Ok(Self { depth_m: carver.cut("raycast.ranges", Self::tiles(capacity.image_width, capacity.image_height))?, columns: 0 })
    }

    /// Whether a picture of this size has room.
    pub fn fit(&self, width: usize, height: usize) -> bool {
        width.div_ceil(1 << TILE_SHIFT).checked_mul(height).is_some_and(|tiles| tiles <= self.depth_m.len())
    }

    /// Enters the crossed cells of all blocks in view.
    pub fn find(&mut self, surface: &Surface<'_>, eye: &Eye, [near_m, far_m]: [f32; 2]) {
        self.columns = eye.width.div_ceil(1 << TILE_SHIFT);
        if let Some(tiles) = self.depth_m.get_mut(..self.columns * eye.height) {
            tiles.fill([f32::MAX, 0.0]);
        }
        for (block, cells) in surface.blocks() {
            for_each_box(cells, |low, high| {
                let at = |axis: usize, c: usize| (block.get(axis).copied().unwrap_or(0) * BLOCK_SIDE as i32 + c as i32) as f32;
                let bounds = [0, 1, 2].map(|axis| {
                    let (low, high) = (low.get(axis).copied().unwrap_or(0), high.get(axis).copied().unwrap_or(0));
                    (at(axis, low), at(axis, high))
                });
                let center = bounds.map(|(low, high)| 0.5 * (low + high));
                // A hundredth of a cell more than the box, so that no rounding starts a ray behind its first cell.
                let half = bounds.map(|(low, high)| 0.5 * (high - low) + 0.01);
                if let Some(extent) = eye.extent(center, half, near_m, far_m) {
                    self.enter(&extent);
                }
            });
        }
    }

    fn enter(&mut self, extent: &Extent) {
        let [first, last] = extent.columns.map(|column| column >> TILE_SHIFT);
        for row in extent.rows[0]..=extent.rows[1] {
            let start = row * self.columns;
            for [near_m, far_m] in self.depth_m.get_mut(start + first..=start + last).into_iter().flatten() {
                *near_m = min_f32(*near_m, extent.depth_m[0]);
                *far_m = max_f32(*far_m, extent.depth_m[1]);
            }
        }
    }

    /// The ranges of a picture row, a tile each for eight columns.
    pub fn row(&self, v: usize) -> &[[f32; 2]] {
        self.depth_m.get(v * self.columns..(v + 1) * self.columns).unwrap_or(&[])
    }
}

/// Visits tight boxes around the cells set: from `low` to `high` in lattice points of the block.
fn for_each_box(cells: &Layers, mut visit: impl FnMut([usize; 3], [usize; 3])) {
    for (z, layers) in cells.as_chunks::<PART>().0.iter().enumerate() {
        let all = layers.iter().fold(0, |all, layer| all | layer);
        if all == 0 {
            continue;
        }
        for quarter in 0..4 {
            let (x, y) = (quarter & 1, quarter >> 1);
            // The quarter's cells, moved to the low corner: 4 bits in each of 4 bytes.
            let part = |layer: u64| (layer >> (PART * x + BLOCK_SIDE * PART * y)) as u32 & 0x0F0F_0F0F;
            let seen = part(all);
            if seen == 0 {
                continue;
            }
            let half = seen | seen >> 16;
            let columns = (half | half >> 8) & 0xF;
            let first_z = layers.iter().position(|&layer| part(layer) != 0).unwrap_or(0);
            let last_z = layers.iter().rposition(|&layer| part(layer) != 0).unwrap_or(PART - 1);
            let low = [columns.trailing_zeros() as usize, seen.trailing_zeros() as usize / BLOCK_SIDE, first_z];
            let high = [columns.ilog2() as usize, seen.ilog2() as usize / BLOCK_SIDE, last_z];
            let base = [x * PART, y * PART, z * PART];
            visit(
                [base[0] + low[0], base[1] + low[1], base[2] + low[2]],
                [base[0] + high[0] + 1, base[1] + high[1] + 1, base[2] + high[2] + 1],
            );
        }
    }
}
