//! How near and how far the surface can be, per tile of the picture.
//!
//! Each block's crossed cells are wrapped in tight boxes, one for each eighth of the block, and every box is entered in the tiles that it
//! may cover. Rays then begin right before the surface.

use super::{
    ray_camera::{AXES, Extent, RayCamera},
    signs::Cells,
    surface::Surface,
};
use crate::{
    geometry::scalar::{max_f32, min_f32},
    memory::{Capacity, Carver, region_bytes},
    part::part,
    volume::BLOCK_SIDE,
};

/// Width of a tile, px, as a shift.
pub(super) const TILE_SHIFT: usize = 1;

/// Depth ranges by tile, 2 px wide and one row high: depth changes fast from row to row of a road, and all rays of a tile begin where
/// the nearest of them may.
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

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            depth_m: carver.alloc("raycast.ranges", Self::tiles(capacity.image_width, capacity.image_height)),
            columns: 0,
        }
    }

    /// Whether a picture of this size fits.
    pub fn fit(&self, width: usize, height: usize) -> bool {
        width.div_ceil(1 << TILE_SHIFT).checked_mul(height).is_some_and(|tiles| tiles <= self.depth_m.len())
    }

    /// Enters the crossed cells of all blocks in view.
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn find(&mut self, surface: &Surface<'_>, ray_camera: &RayCamera, [near_m, far_m]: [f32; 2]) {
        self.columns = ray_camera.width.div_ceil(1 << TILE_SHIFT);
        if let Some(tiles) = self.depth_m.get_mut(..self.columns * ray_camera.height) {
            tiles.fill([f32::MAX, 0.0]);
        }
        for (block, cells) in surface.blocks() {
            for_each_box(cells, |low, high| {
                let (mut center, mut half) = ([0.0; 3], [0.0; 3]);
                for axis in AXES {
                    let (low, high) = (low[axis] as f32, high[axis] as f32);
                    center[axis] = (block[axis] * BLOCK_SIDE as i32) as f32 + 0.5 * (low + high);
                    // A hundredth of a cell more than the box, so that no rounding starts a ray behind its first cell.
                    half[axis] = 0.5 * (high - low) + 0.01;
                }
                if let Some(extent) = ray_camera.extent(center, half, near_m, far_m) {
                    self.widen(&extent);
                }
            });
        }
    }

    fn widen(&mut self, extent: &Extent) {
        let [first, last] = extent.columns.map(|column| column >> TILE_SHIFT);
        for row in extent.rows[0]..=extent.rows[1] {
            let start = row * self.columns;
            for [near_m, far_m] in self.depth_m.get_mut(start + first..=start + last).into_iter().flatten() {
                *near_m = min_f32(*near_m, extent.depth_m[0]);
                *far_m = max_f32(*far_m, extent.depth_m[1]);
            }
        }
    }

    /// The ranges of a picture row, a tile each for two columns.
    pub fn row(&self, v: usize) -> &[[f32; 2]] {
        part(self.depth_m, v * self.columns..(v + 1) * self.columns)
    }
}

/// Visits tight boxes around the cells set, one for each 2 x 2 x 2 of them: from `low` to `high` in lattice points of the block.
fn for_each_box(cells: &Cells, mut visit: impl FnMut([i32; 3], [i32; 3])) {
    /// The first cell of each 2 x 2.
    const CORNERS: u64 = 0x0055_0055_0055_0055;
    for (z, [lower, upper]) in (0i32..).step_by(2).zip(cells.as_chunks::<2>().0) {
        let (lower, upper) = (lower.crossed, upper.crossed);
        let both = lower | upper;
        let mut parts = (both | both >> 1 | both >> 8 | both >> 9) & CORNERS;
        while parts != 0 {
            let corner = parts.trailing_zeros();
            parts &= parts - 1;
            // Bits 0 and 1 are the first row, 8 and 9 the second.
            let [lower, upper] = [lower, upper].map(|layer| (layer >> corner) as u32 & 0x0303);
            let occupied = lower | upper;
            let [left, right] = [occupied & 0x0101, occupied & 0x0202].map(|bits| i32::from(bits != 0));
            let [first, second] = [occupied & 0x0003, occupied & 0x0300].map(|bits| i32::from(bits != 0));
            let [lower, upper] = [lower, upper].map(|bits| i32::from(bits != 0));
            let base = [(corner & 7) as i32, (corner >> 3) as i32, z];
            // An end without cells moves the box's face in by one.
            let low = [base[0] + 1 - left, base[1] + 1 - first, base[2] + 1 - lower];
            let high = [base[0] + 1 + right, base[1] + 1 + second, base[2] + 1 + upper];
            visit(low, high);
        }
    }
}
