//! Pruning: what noise left behind goes, a fixed lag after it was last looked at (Section III-F of
//! the paper).
//!
//! After frame n the blocks visible in frame n - lag are visited. Each voxel with 0 < weight <=
//! `prune_weight` is reset; a block without a seen voxel left goes back to the pool. By support,
//! the default, voxels stay where enough of their block was seen more often, and a block goes that
//! was not visible since and has no voxel near a surface (Nießner et al., 2013, Section 5.3). At
//! most `prune_blocks_per_frame` blocks are visited per frame; the rest stays due and comes first in
//! the next.
//!
//! With `prune_weight` 0 pruning is off, bit for bit.

use super::{BLOCK_VOXELS, PruneBy, Slot, Volume, block::Voxels};

/// Distance from which on a block is far from a surface, voxels: a cell that the surface runs
/// through has a corner that is nearer.
const FAR_VOXELS: f32 = 2.0;
/// One of so many seen voxels must weigh more for those of low weight to stay.
const SUPPORT_ONE_OF: u32 = 10;

/// Counts of pruning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct PruneReport {
    /// Blocks visited.
    pub visited: u32,
    /// Voxels reset to never seen.
    pub voxels_reset: u32,
    /// Blocks given back.
    pub blocks_freed: u32,
    /// Blocks due that wait for a later frame.
    pub carried_over: u32,
    /// Frames taken out of the history before their time, because it was full.
    pub early: u32,
    /// Voxels reset because a moving object was there.
    pub voxels_erased: u32,
}

impl PruneReport {
    fn add(&mut self, reset: u32, freed: bool) {
        self.visited += 1;
        self.voxels_reset += reset;
        self.blocks_freed += u32::from(freed);
    }
}

/// The voxels and blocks that pruning removes.
#[derive(Clone, Copy)]
pub(super) struct PruneRule {
    /// Voxels seen at most this often.
    pub weight: u8,
    /// Blocks farther from any surface than this share of the truncation; 0 is none.
    pub distance: f32,
    /// One of so many seen voxels of a block must weigh more for the others to stay; 0: none stay.
    pub support_one_of: u32,
}

impl Volume<'_> {
    /// Remembers what is visible in this frame and prunes what was visible `prune_lag` frames ago.
    #[cfg(test)]
    pub(crate) fn prune(&mut self) -> PruneReport {
        self.prune_within(u32::MAX)
    }

    /// Remembers what is visible in this frame and prunes at most so many of the blocks that were
    /// visible `prune_lag` frames ago.
    pub(crate) fn prune_within(&mut self, most: u32) -> PruneReport {
        let mut report = PruneReport::default();
        if !self.config.prunes() {
            return report;
        }
        let frame = self.visible.frame();
        if self.history.len() == self.history.capacity() && self.history.expire().is_some() {
            report.early += u32::from(self.history.capacity() < self.config.prune_lag as usize);
        }
        self.history.push(frame, self.visible.slots());
        // Frames as old as the lag leave the window, and their blocks become due.
        while self
            .history
            .oldest()
            .is_some_and(|oldest| frame.wrapping_sub(oldest) >= self.config.prune_lag)
        {
            self.history.expire();
        }
        self.visit_due(self.config.prune_blocks_per_frame.min(most), self.rule(), &mut report);
        report
    }

    /// Prunes everything still in the window, as at the end of a run. A voxel cannot have been seen
    /// more often than there were frames: of a map of one frame nothing goes.
    pub(crate) fn finish(&mut self) -> PruneReport {
        let mut report = PruneReport::default();
        while self.history.expire().is_some() {}
        let frames = u8::try_from(self.visible.frame()).unwrap_or(u8::MAX);
        let expected = frames.saturating_sub(1);
        let rule = self.rule();
        let weight = if rule.weight < expected { rule.weight } else { expected };
        self.visit_due(u32::MAX, PruneRule { weight, ..rule }, &mut report);
        report
    }

    /// Prunes every block of the map by `prune_weight`, whenever it was seen.
    pub fn prune_whole(&mut self, prune_weight: u8) -> PruneReport {
        let mut report = PruneReport::default();
        let mut from = 0;
        while let Some(slot) = self.pool.next_live(from) {
            let (reset, freed) =
                self.prune_block(slot, PruneRule { weight: prune_weight, ..self.rule() });
            report.add(reset, freed);
            from = slot.get() + 1;
        }
        report
    }

    /// Returns the rule for a block that has left the window.
    pub(super) fn rule(&self) -> PruneRule {
        let weight = self.config.prune_weight;
        match self.config.prune_rule {
            PruneBy::Weight => PruneRule { weight, distance: 0.0, support_one_of: 0 },
            PruneBy::Support => {
                let distance = FAR_VOXELS * self.config.voxel_size_m / self.config.truncation_m;
                PruneRule { weight, distance, support_one_of: SUPPORT_ONE_OF }
            }
        }
    }

    /// Visits at most so many blocks that are due, by a rule. Those visible in the window will be
    /// due again, and do not go for their distance.
    fn visit_due(&mut self, most: u32, rule: PruneRule, report: &mut PruneReport) {
        let mut from = 0;
        while report.visited < most
            && let Some(slot) = self.history.take_due(from)
        {
            let in_window = self.history.covers(self.visible.last_visible(slot));
            let rule = PruneRule { distance: if in_window { 0.0 } else { rule.distance }, ..rule };
            let (reset, freed) = self.prune_block(slot, rule);
            report.add(reset, freed);
            from = slot.get() + 1;
        }
        report.carried_over = self.history.due();
    }

    /// Resets the voxels of low weight in a block, and frees it when nothing near a surface is
    /// left. How many were reset, and whether it was freed.
    pub(super) fn prune_block(&mut self, slot: Slot, rule: PruneRule) -> (u32, bool) {
        let (at, prune_weight, by_distance) = (slot.index(), rule.weight, rule.distance > 0.0);
        // Most blocks are known to hold no voxel of low weight without reading them.
        if !by_distance && self.blocks.exceeds(slot, prune_weight) {
            return (0, false);
        }
        let Some(Voxels { sdf, weight }) = self.blocks.voxels.get_mut(at) else {
            return (0, false);
        };
        let census = Census::new(weight, prune_weight).supported(rule.support_one_of);
        // A block that leaves is not cleared: the next block in its slot does that.
        if census.remaining == 0 {
            self.free_block(slot);
            return (census.low_weight, true);
        }
        if census.low_weight > 0 {
            reset_low_weight(prune_weight, sdf, weight, self.blocks.colour.get_mut(at));
        }
        let far = by_distance && nearest(sdf, weight) > rule.distance;
        if far {
            self.free_block(slot);
        } else if census.low_weight > 0 {
            self.update_digest(slot);
        }
        (census.low_weight, far)
    }

    /// Takes a block out of the map.
    pub(super) fn free_block(&mut self, slot: Slot) {
        let Some(key) = self.blocks.key(slot) else { return };
        self.index.remove(key, |slot| self.blocks.key(slot));
        self.digest = self
            .digest
            .wrapping_sub(self.blocks.header.get(slot.index()).map_or(0, |header| header.digest));
        self.history.on_free(slot);
        self.lru.remove(slot);
        self.pool.free(slot);
    }
}

/// Counts of a block's weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Census {
    /// Voxels seen, but at most `prune_weight` times.
    low_weight: u32,
    /// Voxels seen more often.
    remaining: u32,
}

/// Voxels counted at a time: their number fits into a byte, so that the count runs in vectors of
/// bytes.
const GROUP: usize = 128;

impl Census {
    /// Counts voxels of low weight among the remaining ones where one of so many weighs more.
    fn supported(self, one_of: u32) -> Self {
        let seen = self.low_weight + self.remaining;
        if self.remaining * one_of >= seen && self.remaining > 0 {
            return Self { low_weight: 0, remaining: seen };
        }
        self
    }

    /// Counts a block's voxels. Pruning reads nothing else of most blocks it visits, so this is its
    /// cost.
    fn new(weight: &[u8; BLOCK_VOXELS], prune_weight: u8) -> Self {
        let mut census = Self { low_weight: 0, remaining: 0 };
        for group in weight.as_chunks::<GROUP>().0 {
            // Weight 0 becomes 255, which no prune weight exceeds.
            census.low_weight += u32::from(
                group
                    .iter()
                    .map(|&weight| u8::from(weight.wrapping_sub(1) < prune_weight))
                    .sum::<u8>(),
            );
            census.remaining +=
                u32::from(group.iter().map(|&weight| u8::from(weight > prune_weight)).sum::<u8>());
        }
        census
    }
}

/// Resets voxels seen at most `prune_weight` times.
fn reset_low_weight(
    prune_weight: u8,
    sdf: &mut [i16; BLOCK_VOXELS],
    weight: &mut [u8; BLOCK_VOXELS],
    planes: Option<&mut [[u8; BLOCK_VOXELS]; 3]>,
) {
    let remaining = |weight: u8| weight > prune_weight;
    for plane in planes.into_iter().flatten() {
        plane
            .iter_mut()
            .zip(weight.iter())
            .for_each(|(channel, &weight)| *channel = if remaining(weight) { *channel } else { 0 });
    }
    sdf.iter_mut()
        .zip(weight.iter())
        .for_each(|(sdf, &weight)| *sdf = if remaining(weight) { *sdf } else { 0 });
    weight.iter_mut().for_each(|weight| *weight = if remaining(*weight) { *weight } else { 0 });
}

/// Smallest |distance| of the seen voxels, as a share of the truncation.
fn nearest(sdf: &[i16; BLOCK_VOXELS], weight: &[u8; BLOCK_VOXELS]) -> f32 {
    let mut nearest = i16::MAX;
    for (&sdf, &weight) in sdf.iter().zip(weight) {
        nearest = nearest.min(if weight > 0 { sdf.wrapping_abs() } else { i16::MAX });
    }
    f32::from(nearest) / 32_767.0
}
