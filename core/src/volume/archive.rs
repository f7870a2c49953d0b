//! A volume's state in a snapshot: slots as they were given out, what the blocks in use hold, and who was seen when.

use super::Volume;
use crate::snapshot::Archive;

impl Volume<'_> {
    /// Writes or reads the volume; [`Volume::remake`] must follow a reading.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
        self.pool.archive(archive);
        if !self.pool.rebuild() {
            archive.refuse();
        }
        let slots = self.pool.high_water();
        for slot in self.pool.live() {
            self.blocks.archive(slot, archive);
        }
        self.visible.archive(slots, archive);
        self.history.archive(slots, archive);
        self.recency.archive(slots, archive);
    }

    /// Enters the blocks that were read into the index, in slot order, and sums their digests. Whether they can be: no place twice, room for all. Nothing that
    /// comes later depends on the order the index was filled in: it only ever answers for one place, and nothing walks it.
    pub(crate) fn remake(&mut self) -> bool {
        for slot in self.pool.live() {
            let Some(coord) = self.blocks.coord(slot) else { return false };
            if self.index.find(coord, |slot| self.blocks.coord(slot)).is_some()
                || self.index.insert(coord, slot, |slot| self.blocks.coord(slot)).is_err()
            {
                return false;
            }
            self.digest = self.digest.wrapping_add(self.blocks.header.get(slot.index()).map_or(0, |header| header.digest));
        }
        true
    }
}
