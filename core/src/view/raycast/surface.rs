//! The blocks in view and the cells of each that the surface runs through.
//!
//! Made anew for every picture: blocks are culled, their signs become bits, the bits of neighbours joined into crossed cells. Then a
//! ray asks one bit per cell, and most blocks not at all: only those with crossed cells remain in the table.

use super::{
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
/// Parts of the far limit by which it is shortened when more blocks are in view than fit.
const RANGE_STEPS: usize = 64;

/// Blocks in view, by entry, in slot order.
#[derive(Debug)]
pub(super) struct Surface<'s> {
    /// Block coordinates relative to the camera's block.
    local: &'s mut [[i32; 3]],
    /// The block's own slot and those of the blocks after it in x (1), y (2), z (4); [`NONE`] where no block is.
    slots: &'s mut [[Slot; 8]],
    signs: &'s mut [[signs::Layers; 2]],
    cells: &'s mut [Cells],
    /// Keys and entries, an open-addressed hash table with linear probes.
    table: &'s mut [u64],
    len: usize,
    /// How far a hash is shifted down to index the part of the table in use.
    shift: u32,
}

/// What was in view.
#[derive(Clone, Copy, Debug)]
pub(super) struct InView {
    /// Blocks.
    pub blocks: u32,
    /// The far limit up to which all fit, m.
    pub far_m: f32,
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
            + region_bytes::<[Slot; 8]>(entries)
            + region_bytes::<[signs::Layers; 2]>(entries)
            + region_bytes::<Cells>(entries)
            + region_bytes::<u64>(Self::table_len(entries))
    }

    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let entries = capacity.visible_blocks;
        Self {
            local: carver.alloc("raycast.local", entries),
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
        ray_camera: &RayCamera,
        limits_m: [f32; 2],
        min_weight: u8,
        executor: &E,
    ) -> InView {
        let in_view = self.cull(volume, ray_camera, limits_m);
        self.index(|_| true);
        self.read_signs(volume, min_weight, executor);
        self.join_neighbours();
        self.index(|cells| cells.iter().any(|layer| layer.crossed != 0));
        in_view
    }

    /// Lists the blocks that have a cell, or a neighbour with a corner, that may be in the picture.
    fn cull(&mut self, volume: &Volume<'_>, ray_camera: &RayCamera, [near_m, far_m]: [f32; 2]) -> InView {
        // Cells of the block before this one end at this block's first points: the box is one longer on that side.
        let half = (BLOCK_SIDE as f32 + 1.0) * 0.5;
        let blocks = volume.pool().live().filter_map(|slot| {
            let local = ray_camera.local(volume.blocks().coord(slot)?)?;
            let center = local.map(|c| (c * BLOCK_SIDE as i32) as f32 + half - 1.0);
            Some((slot, local, ray_camera.extent(center, [half; 3], near_m, far_m)?.depth_m[0]))
        });
        self.len = 0;
        let mut count = 0;
        let mut by_range = [0u32; RANGE_STEPS];
        let steps_per_m = RANGE_STEPS as f32 / far_m;
        for (slot, local, depth_m) in blocks.clone() {
            count += 1;
            if let Some(step) = by_range.get_mut(((depth_m * steps_per_m) as usize).min(RANGE_STEPS - 1)) {
                *step += 1;
            }
            self.push(slot, local);
        }
        if count as usize <= self.local.len() {
            return InView { blocks: count, far_m };
        }
        // Not all fit: see less far, rather than full of holes.
        let mut space = self.local.len() as u32;
        let steps = by_range.iter().take_while(|&&step| space.checked_sub(step).map(|left| space = left).is_some()).count();
        let far_m = steps as f32 / steps_per_m;
        self.len = 0;
        blocks.filter(|(_, _, depth_m)| ((depth_m * steps_per_m) as usize) < steps).for_each(|(slot, local, _)| self.push(slot, local));
        InView { blocks: count, far_m }
    }

    fn push(&mut self, slot: Slot, block: [i32; 3]) {
        if let (Some(local), Some(slots)) = (self.local.get_mut(self.len), self.slots.get_mut(self.len)) {
            *local = block;
            *slots = [slot, NONE, NONE, NONE, NONE, NONE, NONE, NONE];
            self.len += 1;
        }
    }

    /// Fills the table with the entries whose cells are `wanted`.
    fn index(&mut self, is_kept: impl Fn(&Cells) -> bool) {
        let count = self.cells.iter().take(self.len).filter(|cells| is_kept(cells)).count();
        let len = Self::table_len(count);
        self.shift = 64 - len.trailing_zeros();
        let Some(table) = self.table.get_mut(..len) else { return };
        table.fill(0);
        for ((entry, local), cells) in (1u64..).zip(self.local.iter()).zip(self.cells.iter()).take(self.len) {
            if !is_kept(cells) {
                continue;
            }
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
                if let (Some(sdf), Some(weight)) = (volume.blocks().sdf(*slot), volume.blocks().weight(*slot)) {
                    *signs = signs::of_block(sdf, weight, min_weight);
                }
            }
        };
        let (Some(signs), Some(slots)) = (self.signs.get_mut(..self.len), self.slots.get(..self.len)) else { return };
        let bands = Bands::of(self.len);
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
                let entry = if n == 0 { Some(at) } else { self.entry([x + (n & 1), y + (n >> 1 & 1), z + (n >> 2)]) };
                if let Some((signs, slots)) = entry.and_then(|entry| self.signs.get(entry).zip(self.slots.get(entry))) {
                    *around = signs;
                    *slot = slots[0];
                }
            }
            let cells = signs::cells(around);
            if let (Some(to), Some(all)) = (self.cells.get_mut(at), self.slots.get_mut(at)) {
                *to = cells;
                *all = slots;
            }
        }
    }

    /// The entry of a block in the table.
    #[inline]
    pub fn entry(&self, block: [i32; 3]) -> Option<usize> {
        let key = key(block);
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

    /// The cells of an entry, and the slots around the last corner of its block.
    #[inline]
    pub fn block(&self, entry: usize) -> Option<(&Cells, &[Slot; 8])> {
        Some((self.cells.get(entry)?, self.slots.get(entry)?))
    }

    /// All blocks in view with their cells, in slot order.
    pub fn blocks(&self) -> impl Iterator<Item = ([i32; 3], &Cells)> {
        self.local.iter().copied().zip(self.cells.iter()).take(self.len)
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
