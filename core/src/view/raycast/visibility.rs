//! Visibility: the cell in which each pixel's ray meets the surface, the nearest of those it
//! passes.
//!
//! Cells are projected into the picture one by one (cell projection: Wilhelms, Van Gelder, *A
//! Coherent Projection Approach for Direct Volume Rendering*, 1991), and of all that stop a pixel's
//! ray the one it enters first is kept: their order changes nothing but the time. What is seen
//! there is worked out afterwards, once for each pixel (Burns, Hunt, *The Visibility Buffer*,
//! 2013). Eight rays side by side are tried at once.

use super::{
    cell::{Faces, depths_m, mean, position},
    cell_index::{CellId, CellIndex},
    crossed::{CrossedCell, CrossedCells},
    ray_camera::{Ray, RayCamera, RowOfRays},
    surface::BlockInView,
};
use crate::{
    lanes::{self, Eight, LANES, at_lane, set},
    memory::{Capacity, Carver, region_bytes},
    parallel::{BANDS, Bands, Work, zip2},
    slices::clipped,
    volume::BLOCK_SIDE,
};

/// Rows of the picture that cells are projected into at once, at most: few enough for a processor's
/// cache.
const MAX_STRIP_ROWS: usize = 16;

/// The cell of each pixel, for a strip of rows of each band.
#[derive(Debug)]
pub(super) struct Visibility<'s> {
    strip_rows: usize,
    enters_m: &'s mut [f32],
    cells: &'s mut [CellId],
}

impl<'s> Visibility<'s> {
    /// Pixels of a strip's row in memory: eight from the last one of the picture on are there.
    const fn stride(width: usize) -> usize {
        width + LANES
    }

    /// Rows of a strip: no more than a band of the largest picture has.
    const fn strip_rows(capacity: &Capacity) -> usize {
        let band = capacity.image_height.div_ceil(BANDS);
        if band < MAX_STRIP_ROWS { band } else { MAX_STRIP_ROWS }
    }

    const fn pixels(capacity: &Capacity) -> usize {
        BANDS * Self::strip_rows(capacity) * Self::stride(capacity.image_width)
    }

    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<f32>(Self::pixels(capacity)) + region_bytes::<CellId>(Self::pixels(capacity))
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            strip_rows: Self::strip_rows(capacity),
            enters_m: carver.alloc("raycast.enters", Self::pixels(capacity)),
            cells: carver.alloc("raycast.nearest", Self::pixels(capacity)),
        }
    }

    /// Returns true if a picture of this width fits.
    pub fn fits(&self, width: usize) -> bool {
        Self::stride(width)
            .checked_mul(BANDS * self.strip_rows)
            .is_some_and(|pixels| pixels <= self.cells.len())
    }

    /// A strip for each band.
    pub fn strips(&mut self, width: usize) -> [Strip<'_>; BANDS] {
        let (stride, rows) = (Self::stride(width), self.strip_rows);
        let bands = Bands::new(BANDS);
        let memory = zip2(
            bands.split_mut(self.enters_m, rows * stride),
            bands.split_mut(self.cells, rows * stride),
        );
        memory.map(|(enters_m, cells)| Strip { rows, stride, enters_m, cells })
    }
}

/// A strip of rows.
pub(super) struct Strip<'b> {
    /// Largest number of rows.
    pub rows: usize,
    stride: usize,
    /// The depth at which each pixel's ray enters its cell, m.
    enters_m: &'b mut [f32],
    cells: &'b mut [CellId],
}

impl Strip<'_> {
    /// Forgets what was there.
    pub fn clear(&mut self) {
        self.enters_m.fill(f32::MAX);
        self.cells.fill(CellId::NONE);
    }

    /// The cells of the pixels of a row.
    pub fn row(&self, row: usize) -> &[CellId] {
        clipped(self.cells, row * self.stride..(row + 1) * self.stride)
    }

    /// Eight pixels of a row.
    #[inline(always)]
    fn eight(&mut self, row: usize, first: usize) -> Option<(&mut Eight<f32>, &mut Eight<CellId>)> {
        let start = row * self.stride + first;
        Some((
            self.enters_m.get_mut(start..)?.first_chunk_mut()?,
            self.cells.get_mut(start..)?.first_chunk_mut()?,
        ))
    }
}

/// The projection of all cells into a strip.
pub(super) struct Projection<'p, 'b, 'a, 's> {
    pub cells: CrossedCells<'a, 's>,
    pub ray_camera: &'p RayCamera,
    pub limits_m: [f32; 2],
    /// First and last row of the strip.
    pub rows: [usize; 2],
    pub strip: &'p mut Strip<'b>,
}

impl Work for Projection<'_, '_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let surface = self.cells.surface;
        let (mut cells, mut passing) = (Extents::default(), Passing::default());
        for (entry, block) in surface.blocks_in_rows(self.rows) {
            for (z, layer) in (0u32..).zip(block.cells) {
                let mut crossed = layer.crossed;
                while crossed != 0 {
                    let bit = crossed.trailing_zeros();
                    crossed &= crossed - 1;
                    cells.push(
                        CellIndex::of_voxel(z << 6 | bit),
                        layer.fully_observed >> bit & 1 == 1,
                    );
                    // Cells are projected eight at a time; the block's last ones after it.
                    if cells.len == LANES {
                        self.project(entry, &block, &mut cells, &mut passing);
                    }
                }
            }
            self.project(entry, &block, &mut cells, &mut passing);
        }
    }
}

impl Projection<'_, '_, '_, '_> {
    /// Tries the rays that may pass some cells of a block.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn project(
        &mut self,
        entry: usize,
        block: &BlockInView<'_>,
        cells: &mut Extents,
        passing: &mut Passing,
    ) {
        cells.find(self.ray_camera, block.local, self.limits_m);
        // Cells may reach beyond the strip: its rows are clipped.
        for lane in 0..cells.len.min(LANES) {
            let [first, last] = [
                cells.rows[0][lane].max(self.rows[0] as i32),
                cells.rows[1][lane].min(self.rows[1] as i32),
            ];
            if first > last {
                continue;
            }
            let cell = CrossedCell {
                block: block.local,
                slots: block.slots,
                at: cells.at[lane],
                fully_observed: cells.fully_observed[lane],
            };
            let covering = CoveringCell {
                id: CellId::new(entry, cell.at),
                cell,
                nearest_m: cells.nearest_m[lane],
                columns: [cells.columns[0][lane] as usize, cells.columns[1][lane] as usize],
                rows: [first as usize, last as usize],
            };
            self.cover(&covering, passing);
        }
        cells.len = 0;
    }

    /// Tries the rays of the pixels that a cell may cover and that show nothing nearer.
    #[inline(always)]
    fn cover(&mut self, covering: &CoveringCell<'_>, passing: &mut Passing) {
        let &CoveringCell { id, ref cell, nearest_m, columns, rows } = covering;
        let ([left, right], [first, last]) = (columns, rows);
        // Of a cell that is hidden no corner is read.
        let mut target = None;
        for u in (left..right + 1).step_by(LANES) {
            // Mask out the lanes beyond the cell's last column.
            let own = lanes::first(right + 1 - u);
            for v in first..last + 1 {
                let Some((enters_m, cells)) = self.strip.eight(v - self.rows[0], u) else {
                    continue;
                };
                // Pixels that show something nearer need no test.
                if enters_m
                    .iter()
                    .zip(own)
                    .fold(0, |any, (&enters_m, own)| any | own & i16::from(nearest_m < enters_m))
                    == 0
                {
                    continue;
                }
                if target.is_none() {
                    let Some(corners) = self.cells.corners(cell) else { return };
                    target = Some(Target { id, faces: self.cells.faces(cell), corners });
                }
                if let Some(target) = &target {
                    let rays = self.ray_camera.row(v);
                    let rays = EightRays { rays: &rays, first: u, limits_m: self.limits_m };
                    target.meet(&rays, passing, enters_m, cells);
                }
            }
        }
    }
}

/// Some cells of a block, and which pixels each may cover.
#[derive(Default)]
struct Extents {
    len: usize,
    at: Eight<CellIndex>,
    fully_observed: Eight<bool>,
    columns: [Eight<i32>; 2],
    rows: [Eight<i32>; 2],
    /// Below the depth at which any ray enters it, m.
    nearest_m: Eight<f32>,
}

/// Factor on a cell's nearest depth, so that no rounding takes a ray from a cell that it enters
/// first.
const NEARER: f32 = 0.999;

impl Extents {
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn push(&mut self, cell: CellIndex, fully_observed: bool) {
        let lane = self.len % LANES;
        (self.at[lane], self.fully_observed[lane]) = (cell, fully_observed);
        self.len += 1;
    }

    /// Finds the pixels that the cells may cover: no rows where none.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below their number")]
    fn find(&mut self, ray_camera: &RayCamera, block: [i32; 3], [near_m, far_m]: [f32; 2]) {
        let [x, y, z] = block.map(|c| (c * BLOCK_SIDE as i32) as f32 + 0.5);
        for lane in 0..LANES {
            let at = self.at[lane];
            let from_first = |axis: usize| at.coordinate(axis) as i32 as f32;
            let center = [x + from_first(0), y + from_first(1), z + from_first(2)];
            let extent = ray_camera.extent(center, [0.5; 3], near_m, far_m);
            (self.columns[0][lane], self.columns[1][lane]) = (extent.columns[0], extent.columns[1]);
            self.rows[0][lane] = if extent.is_empty() { i32::MAX } else { extent.rows[0] };
            self.rows[1][lane] = extent.rows[1];
            self.nearest_m[lane] = extent.depth_m[0] * NEARER;
        }
    }
}

/// Rays that may pass a cell.
#[derive(Default)]
struct Passing {
    slope: [Eight<f32>; 3],
    per_unit: [Eight<f32>; 3],
    /// Depths at which the rays enter and leave the cell.
    depths_m: [Eight<f32>; 2],
    /// All ones for those that pass it, for those of them that leave it behind the surface, and for
    /// those that meet the surface. Each has memory of its own: what is masked in place is stored
    /// in parts, for which the next load has to wait.
    passes: Eight<u32>,
    leaves_behind: Eight<u32>,
    meets: Eight<u32>,
}

impl Passing {
    /// The field where a ray passes a cell at a depth.
    #[inline(always)]
    fn value(&self, target: &Target, lane: usize, depth_m: f32) -> f32 {
        let ray =
            Ray { slope: at_lane(&self.slope, lane), per_unit: at_lane(&self.per_unit, lane) };
        mean(&target.corners, position(&ray, &target.faces, depth_m))
    }
}

/// A cell of a block, and the pixels it may cover.
struct CoveringCell<'a> {
    id: CellId,
    cell: CrossedCell<'a>,
    /// Below the depth at which any ray enters it, m.
    nearest_m: f32,
    /// First and last column.
    columns: [usize; 2],
    /// First and last row.
    rows: [usize; 2],
}

/// Rays of eight pixels side by side.
struct EightRays<'a> {
    rays: &'a RowOfRays,
    /// Column of the first.
    first: usize,
    /// Nearest and farthest depth that is shown, m.
    limits_m: [f32; 2],
}

/// A cell as rays meet it.
struct Target {
    id: CellId,
    faces: Faces,
    corners: [f32; 8],
}

impl Target {
    /// Takes the pixels whose rays come from free space through the surface in this cell, and enter
    /// it before the one they had.
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        clippy::needless_range_loop,
        reason = "lanes are below their number; compilers make vectors of such loops"
    )]
    fn meet(
        &self,
        eight: &EightRays<'_>,
        passing: &mut Passing,
        nearest_m: &mut Eight<f32>,
        cells: &mut Eight<CellId>,
    ) {
        let &EightRays { rays, first, limits_m: [near_m, far_m] } = eight;
        // Every ray's entry into and exit from the cell.
        for lane in 0..LANES {
            let ray = rays.ray(first as f32 + lane as f32);
            let [enters_m, leaves_m] = depths_m(&ray, &self.faces, near_m);
            let passes = (enters_m < leaves_m) & (enters_m <= far_m) & (enters_m < nearest_m[lane]);
            passing.passes[lane] = u32::from(passes).wrapping_neg();
            set(&mut passing.slope, lane, &ray.slope);
            set(&mut passing.per_unit, lane, &ray.per_unit);
            set(&mut passing.depths_m, lane, &[enters_m, leaves_m]);
        }
        // Most rays that pass a cell leave it before the surface.
        let mut any = 0;
        for lane in 0..LANES {
            let is_behind = u32::from(passing.value(self, lane, passing.depths_m[1][lane]) <= 0.0)
                .wrapping_neg();
            passing.leaves_behind[lane] = passing.passes[lane] & is_behind;
            any |= passing.passes[lane] & is_behind;
        }
        // No ray leaves behind the surface: nothing is met.
        if any == 0 {
            return;
        }
        for lane in 0..LANES {
            let is_before = u32::from(passing.value(self, lane, passing.depths_m[0][lane]) > 0.0)
                .wrapping_neg();
            passing.meets[lane] = passing.leaves_behind[lane] & is_before;
        }
        // Masks instead of branches: which of eight rays meet the surface is hard to predict.
        for ((nearest_m, enters_m), &meets) in
            nearest_m.iter_mut().zip(&passing.depths_m[0]).zip(&passing.meets)
        {
            *nearest_m = f32::from_bits(enters_m.to_bits() & meets | nearest_m.to_bits() & !meets);
        }
        for (CellId(nearest), &meets) in cells.iter_mut().zip(&passing.meets) {
            *nearest = self.id.0 & meets | *nearest & !meets;
        }
    }
}
