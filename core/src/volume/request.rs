//! Which blocks a depth image runs through: the walk along its rays, and what remembers the blocks
//! met.
//!
//! Each band of rows has a cache of the blocks it met last and a list of those to ask the map for.
//! A list that is full is emptied before its band goes on, so that no size of it loses a block.

use super::{BLOCK_SIDE, Viewpoint, VolumeConfig};
use crate::{
    geometry::scalar::{floor_i32, max_f32, min_f32},
    image::View,
    memory::{Carver, region_bytes},
    parallel::{BANDS, Bands},
};
use nalgebra::Vector3;

/// Most blocks one ray visits: 2 x 64 voxels of truncation are 16 blocks, diagonally across three
/// axes, and one at either end.
pub const MAX_BLOCKS_PER_RAY: usize = 16 * 2 + 3;

/// Rows and columns from one pixel whose ray is walked to the next, where a block is narrower than
/// [`WIDE_PX`]: at KITTI's focal length it is 14 px wide at 20 m. Twice as many from that width on,
/// four times from twice that on (docs/decisions/0047-fewer-rays-where-blocks-are-wide.md).
pub(crate) const PIXEL_STEP: usize = 2;
const WIDE_PX: f64 = 16.0;
/// Entries of a band's cache, as a power of two, and of its list.
const CACHE_BITS: u32 = 11;
const CACHE_ENTRIES: usize = 1 << CACHE_BITS;
const LIST_ENTRIES: usize = 2_048;
const _: () = assert!(LIST_ENTRIES >= MAX_BLOCKS_PER_RAY, "a list holds a ray");

/// A block relative to the camera's, in one word that is never 0.
#[derive(Clone, Copy)]
struct Tag(u64);

/// Bits of each coordinate in a tag.
const FIELD: u32 = 21;

impl Tag {
    #[inline]
    fn from_block([x, y, z]: [i32; 3]) -> Self {
        const MASK: u64 = (1 << FIELD) - 1;
        Self(
            1 << 63
                | (x as u64 & MASK) << (2 * FIELD)
                | (y as u64 & MASK) << FIELD
                | (z as u64 & MASK),
        )
    }

    /// The block again.
    #[inline]
    fn block(self) -> [i32; 3] {
        [2, 1, 0]
            .map(|field| (self.0 << (64 - FIELD - field * FIELD)) as i64 >> (64 - FIELD))
            .map(|c| c as i32)
    }

    /// Returns the entry of a cache.
    #[inline]
    fn entry(self) -> usize {
        (self.0.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - CACHE_BITS)) as usize
    }
}

/// Caches and lists of all bands.
#[derive(Debug, Default)]
pub(super) struct RequestedCache<'s> {
    caches: &'s mut [u64],
    lists: &'s mut [u64],
}

impl<'s> RequestedCache<'s> {
    pub const fn bytes() -> usize {
        region_bytes::<u64>(BANDS * CACHE_ENTRIES) + region_bytes::<u64>(BANDS * LIST_ENTRIES)
    }

    pub fn new_in(carver: &mut Carver<'s>) -> Self {
        Self {
            caches: carver.alloc("volume.requested", BANDS * CACHE_ENTRIES),
            lists: carver.alloc("volume.requests", BANDS * LIST_ENTRIES),
        }
    }

    /// Memory for what is needed between two allocations alone.
    pub fn scratch(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(self.caches)
    }

    /// The bands of an image of that many rows, nothing met yet.
    pub fn bands(&mut self, rows: usize) -> [Band<'_>; BANDS] {
        self.caches.fill(0);
        // Every `PIXEL_STEP`-th row, in four bands.
        let quarters = Bands::new(rows.div_ceil(PIXEL_STEP));
        let mut caches = self.caches.chunks_mut(CACHE_ENTRIES);
        let list_len = self.lists.len() / BANDS;
        let mut lists = self.lists.chunks_mut(list_len.max(1));
        let [a, b, c, d] = quarters.first();
        [[a, b], [b, c], [c, d], [d, rows.div_ceil(PIXEL_STEP)]].map(|[first, end]| Band {
            cache: caches.next().unwrap_or_default(),
            list: lists.next().unwrap_or_default(),
            len: 0,
            next: [first, 0],
            end,
        })
    }
}

/// Some rows of an image, and the blocks met in them.
pub(super) struct Band<'b> {
    cache: &'b mut [u64],
    list: &'b mut [u64],
    len: usize,
    /// Row and column to go on with, in steps.
    next: [usize; 2],
    /// The row after the last, in steps.
    end: usize,
}

impl Band<'_> {
    /// Returns true if all rows were walked and the list is empty.
    pub fn is_done(&self) -> bool {
        self.next[0] >= self.end && self.len == 0
    }

    /// Number of blocks in the list.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Empties the list: the blocks met, relative to the camera's, in order. One may come twice.
    pub fn drain(&mut self) -> impl Iterator<Item = [i32; 3]> {
        let len = core::mem::take(&mut self.len);
        self.list.iter().take(len).map(|&tag| Tag(tag).block())
    }

    /// Lists a block unless it was met just now.
    #[inline]
    fn meet(&mut self, block: [i32; 3]) {
        let tag = Tag::from_block(block);
        let entry = self.cache.get_mut(tag.entry());
        debug_assert!(
            entry.is_some() && self.len < self.list.len(),
            "a cache has an entry for each tag, and the list holds a ray"
        );
        // A block whose entry another one took is listed again, which costs a lookup and no more.
        if let (Some(entry), Some(request)) = (entry, self.list.get_mut(self.len))
            && *entry != tag.0
        {
            (*entry, *request) = (tag.0, tag.0);
            self.len += 1;
        }
    }
}

/// The rays of a depth image, in units of blocks relative to the camera's.
pub(super) struct Rays<'a> {
    depth_m: View<'a, f32>,
    start: Vector3<f32>,
    /// The ray of pixel (0, 0) per metre of depth, and its change per column and row.
    rays: [Vector3<f32>; 3],
    /// Least and largest distance before and behind the surface within which blocks are made, m.
    reach_m: [f32; 2],
    far_m: f32,
    /// First row, and first column of it.
    offset: [usize; 2],
    /// Offset of the rays, in steps, if fewer are walked.
    sparse_offset: [usize; 2],
    /// Surfaces nearer than these have a half and a quarter of the rays across: blocks are wide
    /// there.
    wide_m: [f32; 2],
}

impl<'a> Rays<'a> {
    /// The rays of a camera at `start`; which pixels are taken changes from frame to frame.
    pub fn new(
        config: &VolumeConfig,
        view: &Viewpoint,
        depth_m: View<'a, f32>,
        start: Vector3<f32>,
        frame: u32,
    ) -> Self {
        let block_m = f64::from(config.voxel_size_m) * BLOCK_SIDE as f64;
        Self {
            depth_m,
            start,
            rays: view.rays_world().map(|ray| (ray / block_m).cast::<f32>()),
            // At least two voxels on each side of the surface.
            reach_m: [max_f32(config.allocation_m, 2.0 * config.voxel_size_m), config.truncation_m],
            far_m: config.far_m,
            // Another of the 2 x 2 pixels in each frame.
            offset: [(frame / 2) as usize % PIXEL_STEP, frame as usize % PIXEL_STEP],
            // The larger change comes first: two steps from every frame, or every second one, to
            // the next.
            sparse_offset: [1, 0].map(|bit| {
                (frame >> (bit + 2) & 1 | (frame >> bit ^ frame >> (bit + 4)) << 1 & 2) as usize
            }),
            wide_m: [WIDE_PX, 2.0 * WIDE_PX]
                .map(|width_px| (view.rig.focal_px * block_m / width_px) as f32),
        }
    }

    /// First column of a row, both counted in steps: the next row's lie between.
    fn first_column(&self, row: usize) -> usize {
        (self.offset[1] + row) % PIXEL_STEP
    }

    /// Steps from one ray of a surface to the next: 1, 2 or 4.
    #[inline(always)]
    fn steps(&self, depth_m: f32) -> usize {
        let [wide_m, wider_m] = self.wide_m;
        1 + usize::from(depth_m < wide_m) + 2 * usize::from(depth_m < wider_m)
    }

    /// Returns true if a spacing of so many steps takes this ray.
    #[inline(always)]
    fn is_taken(&self, steps: usize, [row, column]: [usize; 2]) -> bool {
        ((row + self.sparse_offset[0]) | (column + self.sparse_offset[1])) & (steps - 1) == 0
    }

    /// Returns the distance before and behind a surface over which its ray is walked: at least half
    /// of the way in depth to the rays above and to the left, so that no block between them is
    /// missed on a road or wall at a grazing angle. `beside_m` are the depths one step off.
    #[inline(always)]
    fn reach_m(&self, depth_m: f32, beside_m: [f32; 2], steps: usize) -> f32 {
        let [least_m, max_m] = self.reach_m;
        let half = 0.5 * steps as f32;
        let [above, left] = beside_m
            .map(|beside_m| if beside_m > 0.0 { half * (beside_m - depth_m).abs() } else { 0.0 });
        min_f32(max_f32(least_m, max_f32(above, left)), max_m)
    }

    /// Walks a band's rays until it ends or its list may be too short for another one.
    pub fn walk(&self, band: &mut Band<'_>) {
        let [corner, per_column, per_row] = self.rays;
        while band.next[0] < band.end {
            let [row, first] = band.next;
            let v = PIXEL_STEP * row + self.offset[0];
            let ray = corner + per_row * v as f32;
            let first_u = self.first_column(row) + PIXEL_STEP * first;
            let (here, above) =
                (self.depth_m.row(v), self.depth_m.row(v.saturating_sub(PIXEL_STEP)));
            let depths = here.iter().zip(above).skip(first_u).step_by(PIXEL_STEP);
            let mut left_m =
                first_u.checked_sub(PIXEL_STEP).and_then(|u| here.get(u)).copied().unwrap_or(0.0);
            for (i, (&depth_m, &above_m)) in depths.enumerate() {
                // The neighbours' depths tell a steep surface, which a thin band would miss.
                let beside_m = [above_m, core::mem::replace(&mut left_m, depth_m)];
                if !(depth_m > 0.0 && depth_m <= self.far_m) {
                    continue;
                }
                // Near surfaces need fewer rays: their pixels are closer together than blocks.
                let steps = self.steps(depth_m);
                if !self.is_taken(steps, [row, first + i]) {
                    continue;
                }
                // The list is full: the band stops here, is emptied, and goes on with this ray.
                if band.list.len() - band.len < MAX_BLOCKS_PER_RAY {
                    band.next = [row, first + i];
                    return;
                }
                let ray = ray + per_column * (first_u + PIXEL_STEP * i) as f32;
                let reach_m = self.reach_m(depth_m, beside_m, steps);
                // Blocks along the ray before and behind the surface.
                let from = self.start + ray * max_f32(depth_m - reach_m, 0.0);
                let to = self.start + ray * (depth_m + reach_m);
                walk(from, to, |block| band.meet(block));
            }
            band.next = [row + 1, 0];
        }
    }
}

/// A walk along one axis of the block grid.
#[derive(Clone, Copy)]
struct Axis {
    at: i32,
    step: i32,
    left: i32,
    /// Ray parameter at which the next block begins, and its growth per block.
    next: f32,
    growth: f32,
}

impl Axis {
    #[inline(always)]
    fn new(from: f32, to: f32) -> Self {
        let (at, last) = (floor_i32(from), floor_i32(to));
        // Blocks to cross along this axis.
        let (ahead, left) =
            (last > at, last.saturating_sub(at).saturating_abs().min(MAX_BLOCKS_PER_RAY as i32));
        // Unused where no border is crossed.
        let per_block = 1.0 / (to - from);
        // The border crossed next, as a share of the way.
        let border = at as f32 + if ahead { 1.0 } else { 0.0 };
        Self {
            at,
            step: if ahead { 1 } else { -1 },
            left,
            next: if left > 0 { (border - from) * per_block } else { f32::MAX },
            growth: if ahead { per_block } else { -per_block },
        }
    }

    /// Goes on if it is this axis' turn: selections, for which axis it is no processor can foresee.
    #[inline(always)]
    fn advance(&mut self, turn: bool) {
        self.at += if turn { self.step } else { 0 };
        self.left -= i32::from(turn);
        let next = if self.left > 0 { self.next + self.growth } else { f32::MAX };
        self.next = if turn { next } else { self.next };
    }
}

/// Visits every block between two points once, in order; both in block units.
#[inline(always)]
fn walk(from: Vector3<f32>, to: Vector3<f32>, mut visit: impl FnMut([i32; 3])) {
    let mut x = Axis::new(from.x, to.x);
    let mut y = Axis::new(from.y, to.y);
    let mut z = Axis::new(from.z, to.z);
    visit([x.at, y.at, z.at]);
    // One block fewer: the first one is visited already.
    let steps = (x.left + y.left + z.left).min(MAX_BLOCKS_PER_RAY as i32 - 1);
    for _ in 0..steps {
        // The axis whose border comes next; of equal ones x before y before z.
        let x_turn = (x.next <= y.next) & (x.next <= z.next);
        let z_turn = !x_turn & (z.next < y.next);
        x.advance(x_turn);
        y.advance(!x_turn & !z_turn);
        z.advance(z_turn);
        visit([x.at, y.at, z.at]);
    }
}

#[cfg(test)]
mod tests;
