//! Use of each bound of [`Capacity`] in a run, and the least capacity that would have been enough
//! for it.

use super::{Finished, FrameContext, FrameRow, ObserveError, ObservedRun, Observer};
use dynvox_core::scene_flow::FlowReport;
use dynvox_core::{Capacity, Mapper};
use serde::{Deserialize, Serialize};

/// Use of a bound over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoundUse {
    /// The most needed at once. Where something was refused it is what was in use and what was
    /// refused in that frame: with so much, more may be needed.
    pub needed: usize,
    /// Number of items refused, evicted or shortened because of the bound, over the run.
    pub refused: u64,
}

impl BoundUse {
    /// A frame needed so much, and was refused so much of it.
    fn add(&mut self, needed: usize, refused: u32) {
        self.needed = self.needed.max(needed);
        self.refused += u64::from(refused);
    }
}

/// The use of each bound, by the name it has in [`Capacity`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoundUses {
    /// Features of an image and pass.
    pub features: BoundUse,
    /// Matches of a pass.
    pub matches: BoundUse,
    /// Blocks of the static map in memory. Those that a store took are not refused.
    pub blocks: BoundUse,
    /// Blocks visible in a frame.
    pub visible_blocks: BoundUse,
    /// Frames of the pruning window.
    pub history_frames: BoundUse,
    /// Detections of a frame.
    pub detections: BoundUse,
    /// Words of the masks of a frame.
    pub mask_words: BoundUse,
    /// Tracks.
    pub tracks: BoundUse,
    /// Objects reconstructed at once.
    pub objects: BoundUse,
    /// Blocks of an object.
    pub object_blocks: BoundUse,
    /// Pixels of crops that wait.
    pub crop_pixels: BoundUse,
}

impl BoundUses {
    /// Adds a frame and the mapper after it.
    fn add(&mut self, row: &FrameRow, mapper: &Mapper<'_>, lost_blocks: u64) {
        let report = &row.report;
        self.add_flow(&report.scene_flow);
        let (blocks, allocation) = (&report.blocks, &report.allocate);
        // Needed is what was used and what was refused: with so much, nothing would have been
        // refused.
        let refused = allocation.refused + allocation.eviction.lost;
        self.blocks.add(
            blocks.peak as usize + lost_blocks as usize + allocation.refused as usize,
            refused,
        );
        self.visible_blocks
            .add((blocks.visible + allocation.unlisted) as usize, allocation.unlisted);
        self.history_frames.add(row.history_frames, report.prune.early);
        let tracking = &report.tracking;
        let found = &tracking.detections;
        let detections = found.accepted
            + found.tracked_only
            + found.covered
            + found.bad_mask
            + report.segmentation.instances;
        self.detections.add(
            (detections + found.over_capacity + found.mask_store_full) as usize,
            found.over_capacity,
        );
        self.mask_words
            .add(tracking.mask_words as usize, found.mask_store_full + tracking.tracks.masks_lost);
        // An evicted track gave its slot to another: both were needed.
        let tracks = &tracking.tracks;
        self.tracks.add(
            (tracks.tracks + tracks.evicted + tracks.refused) as usize,
            tracks.evicted + tracks.refused,
        );
        let objects = &report.objects;
        self.objects.add((objects.objects + objects.refused) as usize, objects.refused);
        let most = mapper
            .objects()
            .map(|(_, object)| object.volume().pool().peak())
            .max()
            .unwrap_or_default();
        self.object_blocks.add(most + objects.blocks_refused as usize, objects.blocks_refused);
        self.crop_pixels.add(objects.crop_pixels as usize, objects.crops_dropped);
    }

    /// The sparse pass may have a quarter of the features.
    fn add_flow(&mut self, flow: &FlowReport) {
        for image in [&flow.left, &flow.right] {
            // What would have been enough for both passes.
            let needed = image.dense.max(4 * image.sparse) + image.dropped;
            self.features.add(needed as usize, image.dropped);
        }
        for pass in [&flow.sparse, &flow.dense] {
            self.matches.add(pass.closed as usize, pass.dropped);
        }
    }

    /// Each with its name and the capacity's bound.
    pub fn rows(&self, capacity: &Capacity) -> [(&'static str, usize, BoundUse); 11] {
        [
            ("features", capacity.features, self.features),
            ("matches", capacity.matches, self.matches),
            ("blocks", capacity.blocks, self.blocks),
            ("visible_blocks", capacity.visible_blocks, self.visible_blocks),
            ("history_frames", capacity.history_frames, self.history_frames),
            ("detections", capacity.detections, self.detections),
            ("mask_words", capacity.mask_words, self.mask_words),
            ("tracks", capacity.tracks, self.tracks),
            ("objects", capacity.objects, self.objects),
            ("object_blocks", capacity.object_blocks, self.object_blocks),
            ("crop_pixels", capacity.crop_pixels, self.crop_pixels),
        ]
    }

    /// The least capacity with these uses, for images of `size`, instead of `used`.
    fn least(&self, used: &Capacity, size: (usize, usize)) -> Capacity {
        // A mapper cannot work with a bound of zero.
        let at_least_1 = |of: BoundUse| of.needed.max(1);
        let blocks = at_least_1(self.blocks);
        let objects = self.objects.needed;
        Capacity {
            image_width: size.0,
            image_height: size.1,
            features: at_least_1(self.features),
            matches: at_least_1(self.matches),
            blocks,
            visible_blocks: at_least_1(self.visible_blocks).min(blocks),
            history_frames: at_least_1(self.history_frames),
            detections: self.detections.needed.min(dynvox_core::tracking::MAX_DETECTIONS),
            mask_words: self.mask_words.needed,
            tracks: self.tracks.needed,
            objects: objects.min(dynvox_core::objects::MAX_OBJECTS),
            object_blocks: if objects > 0 { at_least_1(self.object_blocks) } else { 0 },
            crop_pixels: self.crop_pixels.needed,
            ..*used
        }
    }
}

/// Use of the capacity over a run.
#[derive(Clone, Copy, Debug)]
pub struct BoundsSection {
    /// Bound by bound.
    pub uses: BoundUses,
    /// The least capacity with which nothing that was not refused would be. Where something was
    /// refused it is larger there than that of the run, and may still be too small.
    pub least: Capacity,
}

/// Collects the use of bounds.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct BoundsObserver {
    uses: BoundUses,
    lost_blocks: u64,
}

impl Observer for BoundsObserver {
    type Section = BoundsSection;

    fn frame(
        &mut self,
        _: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        self.lost_blocks += u64::from(frame.row.report.allocate.eviction.lost);
        self.uses.add(frame.row, frame.view.mapper(), self.lost_blocks);
        Ok(())
    }

    fn finish(
        mut self,
        run: &ObservedRun<'_>,
        _: &Finished,
    ) -> Result<BoundsSection, ObserveError> {
        let volume = &run.plan.config.volume;
        if volume.prunes() {
            // A shorter window would be another setting, even where the run ended before the window
            // was full.
            let asked = volume.prune_lag as usize;
            self.uses.history_frames.needed = if self.uses.history_frames.refused > 0 {
                asked
            } else {
                asked.min(run.plan.capacity.history_frames)
            };
        }
        Ok(BoundsSection {
            uses: self.uses,
            least: self.uses.least(&run.plan.capacity, run.plan.dataset.size()),
        })
    }
}
