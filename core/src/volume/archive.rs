//! A volume's state in a snapshot: slots as they were given out, what the blocks in use hold, and who was seen when.

use super::Volume;
use crate::snapshot::Archive;

impl Volume<'_> {
    /// Writes or reads the volume; [`Volume::remake`] must follow a reading.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
        self.pool.archive(archive);
        let slots = self.pool.high_water();
        for slot in 0..slots as u32 {
            if self.pool.handle(slot).is_some() {
                self.blocks.archive(slot as usize, archive);
            }
        }
        self.visible.archive(slots, archive);
        self.history.archive(slots, archive);
        self.recency.archive(slots, archive);
    }

    /// Enters the blocks that were read into the index, in slot order, and sums their digests. Whether they can be: no place twice, room for all. Nothing that
    /// comes later depends on the order the index was filled in: it only ever answers for one place, and nothing walks it.
    pub(crate) fn remake(&mut self) -> bool {
        for slot in 0..self.pool.high_water() as u32 {
            if self.pool.handle(slot).is_none() {
                continue;
            }
            let Some(coord) = self.blocks.coord(slot) else { return false };
            if self.find(coord).is_some() || self.index.insert(self.blocks.coord, coord, slot).is_err() {
                return false;
            }
            self.digest = self.digest.wrapping_add(self.blocks.digest.get(slot as usize).copied().unwrap_or(0));
        }
        true
    }
}
