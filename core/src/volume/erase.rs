//! Erasing: what a moving object left in the map before it was known to move goes.
//!
//! Voxels in a box that were seen no more often than the object can have been there are reset; a
//! block without a seen voxel left goes back to the pool. What was mapped there before, and what
//! the object merely stood before, was seen more often and stays.
//!
//! Time: a look-up for each block of the box, or a look at each block of the map where these are
//! fewer, and at each voxel of those in the box.

use super::{BLOCK_SIDE, BlockCoord, Slot, Volume, block::Voxels};
use crate::geometry::OrientedBox;

impl Volume<'_> {
    /// Resets the current segment's voxels within a box that were seen in at most so many frames.
    /// Returns how many.
    pub(crate) fn erase(&mut self, within: &OrientedBox, frames: u32) -> u32 {
        // The most weight that so many frames can have given.
        let weight_most =
            u8::try_from(frames.saturating_mul(self.config.observation_weight.most()))
                .unwrap_or(u8::MAX);
        let block_m = f64::from(self.config.voxel_size_m) * BLOCK_SIDE as f64;
        let [low, high] =
            // Down, also below 0: a box may begin in the middle of a block.
            within.bounds_m().map(|corner| corner.map(|c| libm::floor(c / block_m) as i32));
        // A box larger than the map visits the map's blocks instead of the box's.
        let sides = low
            .iter()
            .zip(&high)
            .map(|(low, high)| (i64::from(*high) - i64::from(*low)).saturating_add(1));
        let blocks = sides.fold(1, i64::saturating_mul);
        let mut reset = 0;
        if blocks > self.pool.len() as i64 {
            let mut from = 0;
            // Erasing may free the slot on the way, which this walk allows.
            while let Some(slot) = self.pool.next_live(from) {
                if self.blocks.key(slot).is_some_and(|key| key.segment == self.segment) {
                    reset += self.erase_block(slot, within, weight_most);
                }
                from = slot.get() + 1;
            }
            return reset;
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let slot = BlockCoord::new(x, y, z).and_then(|coord| self.find(coord));
                    reset += slot.map_or(0, |slot| self.erase_block(slot, within, weight_most));
                }
            }
        }
        reset
    }

    fn erase_block(&mut self, slot: Slot, within: &OrientedBox, weight_most: u8) -> u32 {
        // A block whose least weight is above the limit has nothing to erase.
        let at = slot.index();
        if self.blocks.exceeds(slot, weight_most) {
            return 0;
        }
        let Some(origin) = self.blocks.coord(slot).map(BlockCoord::origin) else { return 0 };
        let voxel_m = f64::from(self.config.voxel_size_m);
        let Some(Voxels { sdf, weight }) = self.blocks.voxels.get_mut(at) else { return 0 };
        let mut planes = self.blocks.colour.get_mut(at);
        let mut reset = 0;
        for (index, (sdf, weight)) in sdf.iter_mut().zip(weight.iter_mut()).enumerate() {
            let offset = [
                index % BLOCK_SIDE,
                index / BLOCK_SIDE % BLOCK_SIDE,
                index / (BLOCK_SIDE * BLOCK_SIDE),
            ];
            // Voxels lie at whole coordinates, a block's first one at its origin.
            let mut point_m = [0.0; 3];
            for ((point, origin), offset) in point_m.iter_mut().zip(origin).zip(offset) {
                *point = voxel_m * (f64::from(origin) + offset as f64);
            }
            // Weight 0 was never seen, and has nothing to reset.
            if (1..=weight_most).contains(weight) && within.contains(point_m) {
                (*sdf, *weight) = (0, 0);
                planes
                    .iter_mut()
                    .flat_map(|planes| planes.iter_mut())
                    .filter_map(|plane| plane.get_mut(index))
                    .for_each(|value| *value = 0);
                reset += 1;
            }
        }
        // An emptied block goes back to the pool.
        if reset > 0 && weight.iter().all(|weight| *weight == 0) {
            self.free_block(slot);
        } else if reset > 0 {
            self.update_digest(slot);
        }
        reset
    }
}
