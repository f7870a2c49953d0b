//! Which blocks were visible in each of the last frames: the paper's fixed-lag window (Section
//! III-F).
//!
//! A ring of bit sets over the pool's slots, one per frame. A slot that was freed and given out
//! again since is told apart by the frame its block was allocated in. Walking a set visits slots in
//! ascending order, on every machine.
//!
//! Memory: `frames * ceil(blocks / 64) * 8` bytes, one more set for what a frame could not finish,
//! and 4 bytes a block: 1.7 MiB for 200 frames of 70,000 blocks, where lists of coordinates would
//! take 13.7 MiB (docs/decisions/0005-history-of-bit-sets.md). Time: one bit per visible block to
//! enter a frame; a pass over one set to take one out.

use super::Slot;
use crate::state::Visitor;
use crate::{
    memory::{Capacity, Carver, region_bytes},
    slices::clipped_mut,
};

/// Frames, as bit sets over slots, oldest first out.
#[derive(Debug)]
pub struct VisibleHistory<'s> {
    /// `frames` sets of `words` words each.
    sets: &'s mut [u64],
    words: usize,
    /// Blocks that were taken out of the ring and not visited yet.
    due: &'s mut [u64],
    /// The frame each slot's block was made in.
    allocated_at: &'s mut [u32],
    /// Frame number of the oldest set, and how many there are.
    oldest: u32,
    len: usize,
    peak: usize,
}

impl<'s> VisibleHistory<'s> {
    const fn words(capacity: &Capacity) -> usize {
        capacity.blocks.div_ceil(64)
    }

    /// Bytes of the slab.
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<u64>(capacity.history_frames * Self::words(capacity))
            + region_bytes::<u64>(Self::words(capacity))
            + region_bytes::<u32>(capacity.blocks)
    }

    /// Cuts an empty history.
    pub(crate) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let words = Self::words(capacity);
        Self {
            sets: carver.alloc("volume.history", capacity.history_frames * words),
            words,
            due: carver.alloc("volume.history_due", words),
            allocated_at: carver.alloc("volume.allocated_at", capacity.blocks),
            oldest: 0,
            len: 0,
            peak: 0,
        }
    }

    /// Frames the ring can hold.
    pub(crate) fn capacity(&self) -> usize {
        self.sets.len().checked_div(self.words).unwrap_or(0)
    }

    /// Frames in the ring.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if no frame is in the ring.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Words of the ring in use now and at most ever.
    pub(super) fn words_in_use(&self) -> [usize; 2] {
        [self.len * self.words, self.peak * self.words]
    }

    /// Notes that the block in `slot` was made in `frame`.
    pub(super) fn allocated_at(&mut self, slot: Slot, frame: u32) {
        if let Some(allocated_at) = self.allocated_at.get_mut(slot.index()) {
            *allocated_at = frame;
        }
    }

    /// Notes that the block in `slot` is gone: it is no longer due, and what the ring says of it is
    /// void.
    pub(super) fn on_free(&mut self, slot: Slot) {
        self.allocated_at(slot, u32::MAX);
        if let Some(word) = self.due.get_mut(slot.index() / 64) {
            *word &= !(1 << (slot.get() % 64));
        }
    }

    /// Appends the slots visible in `frame`, which must follow the last frame of the ring. The ring
    /// must not be full.
    pub(super) fn push(&mut self, frame: u32, visible: &[Slot]) {
        // An empty ring begins wherever the frames are.
        if self.len == 0 {
            self.oldest = frame;
        }
        let Some(set) = self.set_mut(frame) else { return };
        set.fill(0);
        for &slot in visible {
            if let Some(word) = set.get_mut(slot.index() / 64) {
                *word |= 1 << (slot.get() % 64);
            }
        }
        self.len += 1;
        if self.len > self.peak {
            self.peak = self.len;
        }
    }

    /// Takes the oldest frame out of the ring: its blocks are due. Returns the frame.
    pub(super) fn expire(&mut self) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        let frame = self.oldest;
        // Wrapping, as frames are numbered in 32 bits.
        self.oldest = frame.wrapping_add(1);
        let at = self.set_range(frame)?;
        let set = self.sets.get(at)?;
        for (i, (due, seen)) in self.due.iter_mut().zip(set).enumerate() {
            // The bits are taken one by one, from the lowest.
            let mut bits = *seen;
            // Only visible slots whose block is as old as the frame are due.
            while bits != 0 {
                let bit = bits.trailing_zeros();
                bits &= bits - 1;
                let slot = i * 64 + bit as usize;
                if self.allocated_at.get(slot).is_some_and(|&allocated_at| allocated_at <= frame) {
                    *due |= 1 << bit;
                }
            }
        }
        Some(frame)
    }

    /// Visits every field, in a pool that gave out `slots` slots at most.
    pub(super) fn visit(&mut self, slots: usize, visitor: &mut impl Visitor) {
        let (capacity, used) = (self.capacity(), slots.div_ceil(64));
        let Self { sets, words, due, allocated_at, oldest, len, peak } = self;
        visitor.u32(oldest);
        visitor.count(len, capacity);
        visitor.count(peak, capacity);
        // Only the frames in the ring; the others are overwritten before they are read.
        for age in 0..*len as u32 {
            let at =
                (oldest.wrapping_add(age) as usize).checked_rem(capacity).unwrap_or(0) * *words;
            visitor.u64s(clipped_mut(sets, at..at + used));
        }
        visitor.u64s(clipped_mut(due, ..used));
        visitor.u32s(clipped_mut(allocated_at, ..slots));
    }

    /// The oldest frame in the ring.
    pub(crate) fn oldest(&self) -> Option<u32> {
        (self.len > 0).then_some(self.oldest)
    }

    /// Returns true if a frame is still in the ring.
    pub(super) fn covers(&self, frame: u32) -> bool {
        (frame.wrapping_sub(self.oldest) as usize) < self.len
    }

    /// The next slot that is due, at or after `from`; it is due no longer.
    pub(super) fn take_due(&mut self, from: u32) -> Option<Slot> {
        let first = from as usize / 64;
        for (i, word) in self.due.iter_mut().enumerate().skip(first) {
            // Bits below `from` in its own word belong to slots visited already.
            let below = if i == first { (1 << (from % 64)) - 1 } else { 0 };
            let bits = *word & !below;
            if bits != 0 {
                let bit = bits.trailing_zeros();
                *word &= !(1 << bit);
                return Some(Slot::new(i as u32 * 64 + bit));
            }
        }
        None
    }

    /// Slots that are due and wait for a later frame.
    pub(crate) fn due(&self) -> u32 {
        self.due.iter().map(|word| word.count_ones()).sum()
    }

    fn set_range(&self, frame: u32) -> Option<core::ops::Range<usize>> {
        let at = (frame as usize).checked_rem(self.capacity())? * self.words;
        Some(at..at + self.words)
    }

    fn set_mut(&mut self, frame: u32) -> Option<&mut [u64]> {
        let range = self.set_range(frame)?;
        self.sets.get_mut(range)
    }
}
