//! Blocks split among workers.

use crate::volume::{BLOCK_VOXELS, Blocks};

/// A run of blocks that one worker owns: the payload of slots `first..`, and which of them to visit.
pub(super) struct Band<'b> {
    pub(super) slots: &'b [u32],
    pub(super) first: usize,
    pub(super) coord: &'b [[i16; 4]],
    pub(super) sdf: &'b mut [[i16; BLOCK_VOXELS]],
    pub(super) weight: &'b mut [[u8; BLOCK_VOXELS]],
    pub(super) colour: &'b mut [[[u8; BLOCK_VOXELS]; 3]],
    pub(super) digest: &'b mut [u64],
    pub(super) faintest: &'b mut [u8],
}

impl<'b> Band<'b> {
    /// All listed blocks.
    pub(super) fn whole(slots: &'b [u32], blocks: &'b mut Blocks<'_>) -> Self {
        Self {
            slots,
            first: 0,
            coord: blocks.coord,
            sdf: blocks.sdf,
            weight: blocks.weight,
            colour: blocks.colour,
            digest: blocks.digest,
            faintest: blocks.faintest,
        }
    }

    /// Splits before the block in the middle of the list.
    pub(super) fn halves(self) -> (Self, Self) {
        let (low, high) = self.slots.split_at(self.slots.len() / 2);
        let border = high.first().map_or(self.first, |&slot| slot as usize);
        let at = (border - self.first).min(self.sdf.len());
        let coloured = at.min(self.colour.len());
        let (sdf, sdf_high) = self.sdf.split_at_mut(at);
        let (weight, weight_high) = self.weight.split_at_mut(at);
        let (colour, colour_high) = self.colour.split_at_mut(coloured);
        let (digest, digest_high) = self.digest.split_at_mut(at);
        let (faintest, faintest_high) = self.faintest.split_at_mut(at);
        (
            Band {
                slots: low,
                first: self.first,
                coord: self.coord,
                sdf,
                weight,
                colour,
                digest,
                faintest,
            },
            Band {
                slots: high,
                first: border,
                coord: self.coord,
                sdf: sdf_high,
                weight: weight_high,
                colour: colour_high,
                digest: digest_high,
                faintest: faintest_high,
            },
        )
    }
}
