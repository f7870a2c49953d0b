//! Blocks that the camera came back to: they leave the index, and new ones are made at their
//! coordinates.
//!
//! An archived block stays in the pool until it is unseen for longest. Its key has the number of
//! its submap as a segment, so that stores, snapshots and digests tell it from the newer block at
//! the same coordinates.

use super::{
    AllocationReport, BlockCoord, BlockKey, BlockStore, Slot, Volume,
    submaps::{SubmapCamera, Submaps},
};
use crate::geometry::{MapSegment, Transform};

impl<'s> Volume<'s> {
    /// Takes the camera of the frame that is fused next: a submap may begin with it.
    pub(crate) fn advance_submaps(&mut self, camera: &SubmapCamera<'_>) {
        self.submaps.advance(camera, self.segment, self.config.voxel_size_m);
    }

    /// Makes no submaps: the numbers of those of an old map are not known.
    pub(crate) fn without_submaps(&mut self) {
        self.submaps.turn_off();
    }

    /// Moves each submap to where loops put it: `correction` tells it for a segment and a
    /// frame; frames ascend.
    pub(crate) fn close(&mut self, correction: impl FnMut(MapSegment, u32) -> Option<Transform>) {
        self.submaps.close(correction);
    }

    /// Submaps of the blocks.
    pub(crate) fn submaps(&self) -> &Submaps<'s> {
        &self.submaps
    }

    /// Makes the block in a slot, which is visible, one of the newest submap.
    pub(super) fn enter_submap(&mut self, slot: Slot) {
        if !self.submaps.is_newest(slot)
            && let Some(coord) = self.blocks.coord(slot)
        {
            self.submaps.insert(slot, coord);
        }
    }

    /// Returns true if the camera came back to the block in a slot.
    pub(super) fn is_left(&self, slot: Slot) -> bool {
        self.submaps.is_left(slot)
    }

    /// Archives the block in a slot and returns the slot of a new one at its coordinates. Where the
    /// pool is full, the archived block leaves it at once.
    #[inline(never)]
    pub(super) fn replace_left<S: BlockStore>(
        &mut self,
        slot: Slot,
        store: &mut S,
        report: &mut AllocationReport,
    ) -> Option<Slot> {
        let key = self.blocks.key(slot)?;
        let submap = self.submaps.of(slot)?;
        if !self.move_to(slot, key.coord, MapSegment::from_archived_submap(submap)) {
            return None;
        }
        if self.pool.is_full() {
            self.evict_block(slot, store, &mut report.eviction);
        }
        let made = self.make(key)?;
        report.made += 1;
        Some(made)
    }

    /// Gives a block the key of a segment of archived blocks. Returns true if it has it now.
    fn move_to(&mut self, slot: Slot, coord: BlockCoord, segment: MapSegment) -> bool {
        let Some(key) = self.blocks.key(slot) else { return false };
        let archived = BlockKey { segment, coord };
        if self.find_key(archived).is_some() {
            return false;
        }
        self.index.remove(key, |slot| self.blocks.key(slot));
        self.blocks.set_segment(slot, segment);
        // There is space: a block has left.
        let entered = self.index.insert(archived, slot, |slot| self.blocks.key(slot)).is_ok();
        debug_assert!(entered, "the index has space for all blocks");
        self.update_digest(slot);
        entered
    }

    /// Returns true if the surface is not where it was fused: blocks are archived, or loops moved
    /// submaps.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert!(!mapper.static_map().is_bent(), "there are no keyframes");
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn is_bent(&self) -> bool {
        let mut all = self.submaps.numbers().filter_map(|number| self.submaps.get(number));
        all.any(|submap| submap.t_closed_driven != Transform::IDENTITY) || self.archived() > 0
    }

    /// Segment that the camera was in where blocks of a segment were fused: another one for
    /// archived blocks.
    ///
    /// ```
    /// use dynvox_core::{
    ///     Capacity, Config, Mapper, geometry::{MapSegment, StereoRig}, memory::SLAB_ALIGN,
    /// };
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// let second = MapSegment::new(1);
    /// assert_eq!(mapper.static_map().driven_segment(second), second);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn driven_segment(&self, segment: MapSegment) -> MapSegment {
        let submap = segment.archived_submap().and_then(|number| self.submaps.get(number));
        submap.map_or(segment, |submap| submap.segment)
    }

    /// Number of archived blocks: those that the camera came back to.
    ///
    /// ```
    /// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    ///
    /// let rig =
    ///     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// assert_eq!(mapper.static_map().archived(), 0);
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn archived(&self) -> u32 {
        if !self.submaps.is_on() {
            return 0;
        }
        let keys = self.pool.live().filter_map(|slot| self.blocks.key(slot));
        keys.filter(|key| key.segment.archived_submap().is_some()).count() as u32
    }
}
