//! The blocks visible in the current frame.
//!
//! A block is visible when the frame's depth runs through it, or when it was visible in the frame
//! before and still lies in the picture: the second is what clears space where noise once put a
//! surface.
//!
//! Memory: 8 bytes per entry (this frame's list and the last one's) and 4 per block (the frame each
//! was last visible in).

use super::{Full, Slot};
use crate::state::Visitor;
use crate::{
    memory::{Capacity, Carver, region_bytes},
    slices::{clipped, clipped_mut},
};

/// This frame's visible slots, each once.
#[derive(Debug)]
pub struct VisibleList<'s> {
    slots: &'s mut [Slot],
    len: usize,
    before: &'s mut [Slot],
    before_len: usize,
    last_visible: &'s mut [u32],
    frame: u32,
    peak: usize,
}

impl<'s> VisibleList<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        2 * region_bytes::<Slot>(capacity.visible_blocks) + region_bytes::<u32>(capacity.blocks)
    }

    /// Cuts the lists.
    pub(crate) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            slots: carver.alloc("volume.visible", capacity.visible_blocks),
            len: 0,
            before: carver.alloc("volume.visible_before", capacity.visible_blocks),
            before_len: 0,
            last_visible: carver.alloc("volume.last_visible", capacity.blocks),
            frame: 0,
            peak: 0,
        }
    }

    /// Begins a frame: the list of the last one is set aside.
    pub(super) fn begin_frame(&mut self) {
        core::mem::swap(&mut self.slots, &mut self.before);
        self.before_len = self.len;
        self.len = 0;
        self.frame = self.frame.wrapping_add(1);
    }

    /// Number of the frame begun last, from 1.
    pub(super) fn frame(&self) -> u32 {
        self.frame
    }

    /// Enters a slot unless it is entered already.
    pub(super) fn mark(&mut self, slot: Slot) -> Result<(), Full> {
        let last = self.last_visible.get_mut(slot.index()).ok_or(Full)?;
        // `last_visible` is the mark: no other set is needed.
        if *last == self.frame {
            return Ok(());
        }
        // A full list loses the block for this frame, and counts it.
        *self.slots.get_mut(self.len).ok_or(Full)? = slot;
        *last = self.frame;
        self.len += 1;
        if self.len > self.peak {
            self.peak = self.len;
        }
        Ok(())
    }

    /// Returns true if a slot is entered for this frame.
    pub(super) fn is_marked(&self, slot: Slot) -> bool {
        self.last_visible.get(slot.index()) == Some(&self.frame)
    }

    /// The frame a slot was last entered in.
    pub(super) fn last_visible(&self, slot: Slot) -> u32 {
        self.last_visible.get(slot.index()).copied().unwrap_or(0)
    }

    /// Returns true if a slot was entered in this frame or the last.
    pub(super) fn was_lately(&self, slot: Slot) -> bool {
        self.frame.wrapping_sub(self.last_visible(slot)) <= 1
    }

    /// Entry `i` of the last frame's list.
    pub(super) fn before(&self, i: usize) -> Option<Slot> {
        self.before.get(..self.before_len)?.get(i).copied()
    }

    /// Visits every field, in a pool that gave out `end` slots at most.
    pub(super) fn visit(&mut self, end: usize, visitor: &mut impl Visitor) {
        let Self {
            slots,
            len,
            last_visible,
            frame,
            peak,
            // The next frame begins by forgetting it.
            before: _,
            before_len: _,
        } = self;
        visitor.u32(frame);
        visitor.count(peak, slots.len());
        visitor.count(len, slots.len());
        visitor.u32s(bytemuck::cast_slice_mut::<_, u32>(clipped_mut(slots, ..*len)));
        visitor.u32s(clipped_mut(last_visible, ..end));
    }

    /// Orders the list by slot, which is the order of fusion and of memory; all slots are below
    /// `end`. Reads off which slots are entered instead of comparing them: no more work than a
    /// sort, and no depth that depends on the list.
    pub(super) fn sort(&mut self, end: usize) {
        let entered =
            (0..).zip(self.last_visible.iter().take(end)).filter(|(_, last)| **last == self.frame);
        for (target, (slot, _)) in self.slots.iter_mut().take(self.len).zip(entered) {
            *target = Slot::new(slot);
        }
    }

    /// The slots visible in this frame, ascending.
    pub fn slots(&self) -> &[Slot] {
        clipped(self.slots, ..self.len)
    }

    /// The most entries a frame can have.
    pub(crate) fn capacity(&self) -> usize {
        self.slots.len()
    }

    /// The most entries a frame ever had.
    pub(crate) fn peak(&self) -> usize {
        self.peak
    }
}
