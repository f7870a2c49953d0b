//! Blocks split among workers.

use crate::volume::{
    Blocks, Slot,
    block::{Colour, Header, Voxels},
};

/// A run of blocks that one worker owns: those in slots `first..`, and which of them to visit.
pub(super) struct Band<'b> {
    pub(super) slots: &'b [Slot],
    pub(super) first: usize,
    pub(super) header: &'b mut [Header],
    pub(super) min_weight: &'b mut [u8],
    pub(super) voxels: &'b mut [Voxels],
    pub(super) colour: &'b mut [Colour],
}

/// Splits at `at`, or at the end where there is less.
fn parts<T>(items: &mut [T], at: usize) -> (&mut [T], &mut [T]) {
    let at = at.min(items.len());
    items.split_at_mut_checked(at).unwrap_or_default()
}

impl<'b> Band<'b> {
    /// All listed blocks.
    pub(super) fn whole(slots: &'b [Slot], blocks: &'b mut Blocks<'_>) -> Self {
        Self {
            slots,
            first: 0,
            header: blocks.header,
            min_weight: blocks.min_weight,
            voxels: blocks.voxels,
            colour: blocks.colour,
        }
    }

    /// Splits before the block in the middle of the list.
    pub(super) fn halves(self) -> (Self, Self) {
        // By the list, not the slots: halves have equally many blocks.
        let (low, high) = self.slots.split_at_checked(self.slots.len() / 2).unwrap_or_default();
        // Slots are in ascending order, so that the memory can be cut where the list is.
        let border = high.first().map_or(self.first, |slot| slot.index());
        let at = border - self.first;
        let (header, header_high) = parts(self.header, at);
        let (min_weight, min_weight_high) = parts(self.min_weight, at);
        let (voxels, voxels_high) = parts(self.voxels, at);
        let (colour, colour_high) = parts(self.colour, at);
        let high = Band {
            slots: high,
            first: border,
            header: header_high,
            min_weight: min_weight_high,
            voxels: voxels_high,
            colour: colour_high,
        };
        (Band { slots: low, first: self.first, header, min_weight, voxels, colour }, high)
    }
}
