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

/// Splits at `at`, or at the end where there is less.
fn parts<T>(items: &mut [T], at: usize) -> (&mut [T], &mut [T]) {
    let at = at.min(items.len());
    items.split_at_mut_checked(at).unwrap_or_default()
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
        let (low, high) = self.slots.split_at_checked(self.slots.len() / 2).unwrap_or_default();
        let border = high.first().map_or(self.first, |&slot| slot as usize);
        let at = border - self.first;
        let (sdf, sdf_high) = parts(self.sdf, at);
        let (weight, weight_high) = parts(self.weight, at);
        let (colour, colour_high) = parts(self.colour, at);
        let (digest, digest_high) = parts(self.digest, at);
        let (faintest, faintest_high) = parts(self.faintest, at);
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
