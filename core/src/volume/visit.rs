//! A volume as state: slots as they were given out, what the blocks in use hold, and who was seen
//! when.

use super::Volume;
use crate::{invariants::Invariants, state::Visitor};

impl Volume<'_> {
    /// Visits every field; [`Volume::rebuild`] must follow a reading.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            pool,
            blocks,
            visible,
            history,
            lru,
            submaps,
            // Rebuilt, given by the caller, told by the camera, or of one frame only.
            index: _,
            digest: _,
            config: _,
            segment: _,
            requested: _,
        } = self;
        // First the pool, which tells how far the other arrays are in use.
        pool.visit(visitor);
        if !pool.rebuild() {
            visitor.refuse();
        }
        let slots = pool.high_water();
        // Free slots have no content.
        for slot in pool.live() {
            blocks.visit(slot, visitor);
        }
        visible.visit(slots, visitor);
        history.visit(slots, visitor);
        lru.visit(slots, visitor);
        submaps.visit(slots, visitor);
    }

    /// Says what must hold of the volume after a frame.
    pub(crate) fn check_invariants(&self, invariants: &mut Invariants) {
        invariants.require(
            self.pool.len() <= self.pool.capacity(),
            "no more blocks are in use than the pool has",
        );
        // A necessary condition that costs little; the list itself is not walked.
        invariants.require(
            self.pool.is_empty() == self.lru.oldest().is_none(),
            "every block in use is in the LRU list",
        );
        invariants.require(
            self.history.len() <= self.history.capacity(),
            "the window has no more frames than it can hold",
        );
        let end = self.pool.high_water();
        invariants.require(
            self.visible.slots().iter().all(|slot| slot.index() < end),
            "every visible slot was given out",
        );
    }

    /// Inserts the blocks that were read into the index, in slot order, and sums their digests.
    /// Returns true if the blocks can be in one map: no key twice, space for all, and each in the
    /// LRU list. Nothing that comes later depends on the order of insertion: the index answers for
    /// one block, and nothing walks it.
    pub(crate) fn rebuild(&mut self) -> bool {
        for slot in self.pool.live() {
            let Some(key) = self.blocks.key(slot) else { return false };
            if self.find_key(key).is_some()
                || self.index.insert(key, slot, |slot| self.blocks.key(slot)).is_err()
            {
                return false;
            }
            self.digest = self.digest.wrapping_add(
                self.blocks.header.get(slot.index()).map_or(0, |header| header.digest),
            );
        }
        self.lru.is_whole(&self.pool)
    }
}
