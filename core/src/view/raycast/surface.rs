//! The blocks in view and the cells of each that the surface runs through.
//!
//! Made anew for every picture: blocks are culled, their signs become bits, the bits of neighbours
//! joined into crossed cells.

use super::{
    cell_index::CellId,
    ray_camera::RayCamera,
    signs::{self, Cells},
};
use crate::{
    memory::{Capacity, Carver, region_bytes},
    parallel::{Bands, Executor, each, zip2},
    volume::{BLOCK_SIDE, Slot, Volume},
};

/// No block.
pub(super) const NONE: Slot = Slot::new(u32::MAX);
/// The rows of a block that no cell is crossed in.
const NO_ROWS: [u16; 2] = [u16::MAX, 0];
/// Parts of the far limit by which it is shortened when more blocks are in view than fit.
const RANGE_STEPS: usize = 64;

/// Blocks in view, by entry, from near to far.
#[derive(Debug)]
pub(super) struct Surface<'s> {
    /// Block coordinates relative to the camera's block.
    local: &'s mut [[i32; 3]],
    /// First and last row of the picture that a block may be seen in.
    rows: &'s mut [[u16; 2]],
    /// The block's own slot and those of the blocks after it in x (1), y (2), z (4); [`NONE`] where
    /// no block is.
    slots: &'s mut [[Slot; 8]],
    signs: &'s mut [[signs::Layers; 2]],
    cells: &'s mut [Cells],
    /// Keys and entries, an open-addressed hash table with linear probes.
    table: &'s mut [u64],
    len: usize,
    /// Shift of a hash that indexes the part of the table in use.
    shift: u32,
}

/// One of the blocks in view.
#[derive(Clone, Copy)]
pub(super) struct BlockInView<'a> {
    /// Coordinates relative to the camera's block.
    pub local: [i32; 3],
    /// Slots of the block and of those around its last corner.
    pub slots: &'a [Slot; 8],
    pub cells: &'a Cells,
}

/// Counts of blocks in view.
#[derive(Clone, Copy, Debug)]
pub(super) struct InView {
    /// Blocks.
    pub blocks: u32,
    /// The far limit up to which all fit, m.
    pub far_m: f32,
}

/// Camera and limits of the search for surface blocks.
pub(super) struct SurfaceSought<'a> {
    pub ray_camera: &'a RayCamera,
    /// Nearest and farthest depth, m.
    pub limits_m: [f32; 2],
    /// Least weight of an observed voxel.
    pub min_weight: u8,
}

/// Key of a block, never 0 in the table since an entry + 1 stands above it.
#[inline]
fn key([x, y, z]: [i32; 3]) -> u64 {
    (x as u64 & 0x1FFF) | (y as u64 & 0x1FFF) << 13 | (z as u64 & 0x1FFF) << 26
}

const KEY_BITS: u32 = 39;
const KEY_MASK: u64 = (1 << KEY_BITS) - 1;

impl<'s> Surface<'s> {
    const fn table_len(entries: usize) -> usize {
        let len = (2 * entries).next_power_of_two();
        if len < 16 { 16 } else { len }
    }

    pub const fn bytes(capacity: &Capacity) -> usize {
        let entries = capacity.visible_blocks;
        region_bytes::<[i32; 3]>(entries)
            + region_bytes::<[u16; 2]>(entries)
            + region_bytes::<[Slot; 8]>(entries)
            + region_bytes::<[signs::Layers; 2]>(entries)
            + region_bytes::<Cells>(entries)
            + region_bytes::<u64>(Self::table_len(entries))
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let entries = capacity.visible_blocks;
        Self {
            local: carver.alloc("raycast.local", entries),
            rows: carver.alloc("raycast.rows", entries),
            slots: carver.alloc("raycast.slots", entries),
            signs: carver.alloc("raycast.signs", entries),
            cells: carver.alloc("raycast.cells", entries),
            table: carver.alloc("raycast.table", Self::table_len(entries)),
            len: 0,
            shift: 0,
        }
    }

    /// Finds the blocks in view and the cells the surface runs through.
    pub fn find<E: Executor>(
        &mut self,
        volume: &Volume<'_>,
        sought: &SurfaceSought<'_>,
        executor: &E,
    ) -> InView {
        let in_view = self.cull(volume, sought.ray_camera, sought.limits_m);
        self.index();
        self.read_signs(volume, sought.min_weight, executor);
        self.join_neighbours();
        in_view
    }

    /// Lists the blocks that have a cell, or a neighbour with a corner, that may be in the picture.
    fn cull(
        &mut self,
        volume: &Volume<'_>,
        ray_camera: &RayCamera,
        [near_m, far_m]: [f32; 2],
    ) -> InView {
        // Cells of the block before this one end at this block's first points: the box is one
        // longer on that side.
        let half = (BLOCK_SIDE as f32 + 1.0) * 0.5;
        let blocks = volume.current_blocks().filter_map(|(slot, coord)| {
            let local = ray_camera.local(coord)?;
            let center = local.map(|c| (c * BLOCK_SIDE as i32) as f32 + half - 1.0);
            let extent = ray_camera.extent(center, [half; 3], near_m, far_m);
            (!extent.is_empty()).then_some((slot, local, extent.rows, extent.depth_m[0]))
        });
        // A counting sort by range: nearest first, in bounded time.
        let steps_per_m = RANGE_STEPS as f32 / far_m;
        let step_of = |depth_m: f32| ((depth_m * steps_per_m) as usize).min(RANGE_STEPS - 1);
        let mut by_range = [0usize; RANGE_STEPS];
        for (.., depth_m) in blocks.clone() {
            if let Some(step) = by_range.get_mut(step_of(depth_m)) {
                *step += 1;
            }
        }
        // Should not all fit: see less far, rather than full of holes.
        let space = self.local.len().min(CellId::MAX_BLOCKS);
        let (mut steps, mut count) = (0, 0);
        let mut starts = [0; RANGE_STEPS];
        self.len = 0;
        for (start, blocks) in starts.iter_mut().zip(by_range) {
            count += blocks;
            if count <= space {
                (*start, self.len) = (self.len, count);
                steps += 1;
            }
        }
        // The nearest first: most of what they hide is left out before it is looked at.
        for (slot, local, rows, depth_m) in blocks {
            if let Some(start) =
                starts.get_mut(..steps).and_then(|starts| starts.get_mut(step_of(depth_m)))
            {
                self.set(*start, slot, local, rows);
                *start += 1;
            }
        }
        InView {
            blocks: count as u32,
            far_m: if steps == RANGE_STEPS { far_m } else { steps as f32 / steps_per_m },
        }
    }

    fn set(&mut self, at: usize, slot: Slot, block: [i32; 3], in_rows: [i32; 2]) {
        if let (Some(local), Some(rows), Some(slots)) =
            (self.local.get_mut(at), self.rows.get_mut(at), self.slots.get_mut(at))
        {
            (*local, *rows) = (block, in_rows.map(|row| row as u16));
            *slots = [slot, NONE, NONE, NONE, NONE, NONE, NONE, NONE];
        }
    }

    /// Fills the table with all entries.
    fn index(&mut self) {
        let len = Self::table_len(self.len);
        self.shift = 64 - len.trailing_zeros();
        let Some(table) = self.table.get_mut(..len) else { return };
        table.fill(0);
        // Entries count from one: zero marks an empty place.
        for (entry, local) in (1u64..).zip(self.local.iter()).take(self.len) {
            let key = key(*local);
            let mut at = bucket(key, self.shift);
            // At most half full: an empty place is found.
            for _ in 0..len {
                if let Some(slot) = table.get_mut(at)
                    && *slot == 0
                {
                    *slot = key | entry << KEY_BITS;
                    break;
                }
                at = (at + 1) & (len - 1);
            }
        }
    }

    fn read_signs<E: Executor>(&mut self, volume: &Volume<'_>, min_weight: u8, executor: &E) {
        let read = |(signs, slots): (&mut [[signs::Layers; 2]], &[[Slot; 8]])| {
            for (signs, [slot, ..]) in signs.iter_mut().zip(slots) {
                if let (Some(sdf), Some(weight)) =
                    (volume.blocks().sdf(*slot), volume.blocks().weight(*slot))
                {
                    *signs = signs::of_block(sdf, weight, min_weight);
                }
            }
        };
        let (Some(signs), Some(slots)) =
            (self.signs.get_mut(..self.len), self.slots.get(..self.len))
        else {
            return;
        };
        // Each block writes its own signs, so bands may run at the same time.
        let bands = Bands::new(self.len);
        each(executor, zip2(bands.split_mut(signs, 1), bands.split(slots, 1)), read);
    }

    /// Finds each block's neighbours and the cells it shares with them.
    fn join_neighbours(&mut self) {
        const UNSEEN: [signs::Layers; 2] = [[0; BLOCK_SIDE]; 2];
        for at in 0..self.len {
            let Some(&[x, y, z]) = self.local.get(at) else { return };
            let mut around = [&UNSEEN; 8];
            let mut slots = [NONE; 8];
            for (n, (around, slot)) in (0i32..).zip(around.iter_mut().zip(&mut slots)) {
                let entry = if n == 0 {
                    Some(at)
                } else {
                    self.entry([x + (n & 1), y + (n >> 1 & 1), z + (n >> 2)])
                };
                // A neighbour out of view or not in the map counts as unseen.
                if let Some((signs, slots)) =
                    entry.and_then(|entry| self.signs.get(entry).zip(self.slots.get(entry)))
                {
                    *around = signs;
                    *slot = slots[0];
                }
            }
            let cells = signs::cells(around);
            if let (Some(to), Some(all)) = (self.cells.get_mut(at), self.slots.get_mut(at)) {
                *to = cells;
                *all = slots;
            }
            // A block without a cell that the surface crosses is passed over when rows are drawn.
            if let Some(rows) = self.rows.get_mut(at)
                && cells.iter().all(|layer| layer.crossed == 0)
            {
                *rows = NO_ROWS;
            }
        }
    }

    /// The entry of a block in the table.
    #[inline]
    fn entry(&self, block: [i32; 3]) -> Option<usize> {
        let key = key(block);
        // The table has at least one free entry, at which an unlucky search ends.
        let mut at = bucket(key, self.shift);
        let mask = (1usize << (64 - self.shift)) - 1;
        loop {
            let found = *self.table.get(at)?;
            if found & KEY_MASK == key && found != 0 {
                return Some((found >> KEY_BITS) as usize - 1);
            }
            if found == 0 {
                return None;
            }
            at = (at + 1) & mask;
        }
    }

    /// The block of an entry.
    #[inline]
    pub fn block(&self, entry: usize) -> Option<BlockInView<'_>> {
        Some(BlockInView {
            local: *self.local.get(entry)?,
            slots: self.slots.get(entry)?,
            cells: self.cells.get(entry)?,
        })
    }

    /// The blocks that may be seen in rows of the picture from a first to a last one, and their
    /// entries, from near to far.
    pub fn blocks_in_rows(
        &self,
        [first, last]: [usize; 2],
    ) -> impl Iterator<Item = (usize, BlockInView<'_>)> {
        let is_seen =
            move |rows: &[u16; 2]| usize::from(rows[0]) <= last && usize::from(rows[1]) >= first;
        let entries =
            self.rows.iter().take(self.len).enumerate().filter(move |(_, rows)| is_seen(rows));
        entries.filter_map(|(entry, _)| Some((entry, self.block(entry)?)))
    }

    /// Blocks in use.
    pub fn len(&self) -> usize {
        self.len
    }
}

#[inline]
fn bucket(key: u64, shift: u32) -> usize {
    (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> shift) as usize
}
