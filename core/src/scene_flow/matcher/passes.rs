//! The two passes of matching, sparse and dense, and the refinement of what they leave.

use super::{FlowMatcher, images};
use crate::{
    geometry::{StereoRig, Transform},
    parallel::{Bands, Executor, each, zip3},
    scene_flow::{
        SceneFlowConfig,
        cells::{CELL_MIN_PX, Shape},
        circle::{COMPARED_MAX, Corners},
        prior::Prior,
        refine::RefineSupported,
        report::PassCount,
        support::{SortedMotions, SupportRule, support},
        turned::TurnFlow,
    },
    slices::clipped,
};

/// Cells in which sparse matches look for support, px; those of the dense pass are [`CELL_MIN_PX`].
const SPARSE_CELL_PX: usize = 24;

impl FlowMatcher<'_> {
    /// Centres the search of the next frame on the flow of a turn, from the axes of the frame that
    /// it is matched with to those now; on no flow without one.
    #[inline(never)]
    pub(crate) fn expect_turn(&mut self, rig: &StereoRig, t_before_now: Option<&Transform>) {
        let flow = t_before_now.map(|turn| TurnFlow::new(rig, turn)).unwrap_or_default();
        self.prior.expect(&flow);
    }

    /// Matches the sparse features and learns from the supported ones where to look.
    pub(super) fn sparse_pass<E: Executor>(
        &mut self,
        config: &SceneFlowConfig,
        [width, height]: [usize; 2],
        executor: &E,
    ) -> PassCount {
        let ((left_before, left), (right_before, right)) =
            (self.left.frames(), self.right.frames());
        // A match is a circle over four images that ends where it began.
        let corners = Corners {
            previous_left: &left_before.sparse,
            previous_right: &right_before.sparse,
            current_right: &right.sparse,
            current_left: &left.sparse,
        };
        // Nothing is known of the motion yet but a turn: search everywhere around it.
        let turn = self.prior.turn();
        let widest = |at: [u16; 2]| Prior::widest(config, turn, at.map(f32::from));
        let compared = corners.trace(widest, u64::MAX, self.traced, executor);
        let closed = corners.gather(self.traced, self.sparse);
        self.sparse_len = closed.min(self.sparse.len());
        let matches = clipped(self.sparse, ..self.sparse_len);
        // A match that moves like no neighbour is an outlier.
        let shape = Shape::new(width, height, SPARSE_CELL_PX);
        let memory = SortedMotions { cells: &mut self.cells, motion: self.motion };
        let rule = SupportRule { support_min: config.support_min, turn };
        support(matches, shape, &rule, memory, self.supported);
        let supported = matches
            .iter()
            .zip(&*self.supported)
            .filter(|&(_, &supported)| supported == 1)
            .map(|(m, _)| *m);
        // The supported matches bound the search of the dense pass.
        self.prior.learn(supported.clone(), width, height, config);
        PassCount {
            closed: closed as u32,
            dropped: (closed - self.sparse_len) as u32,
            unsupported: (self.sparse_len - supported.count()) as u32,
            compared,
        }
    }

    /// Matches all features within what the sparse pass learned; leaves the matches in `refined`
    /// and who is supported in `supported`. Returns its counts and how many there are.
    pub(super) fn dense_pass<E: Executor>(
        &mut self,
        config: &SceneFlowConfig,
        [width, height]: [usize; 2],
        executor: &E,
    ) -> (PassCount, usize) {
        let ((left_before, left), (right_before, right)) =
            (self.left.frames(), self.right.frames());
        let corners = Corners {
            previous_left: &left_before.dense,
            previous_right: &right_before.dense,
            current_right: &right.dense,
            current_left: &left.dense,
        };
        // A bin that learned nothing is searched everywhere.
        let (prior, turn) = (&self.prior, self.prior.turn());
        let widest = |at: [u16; 2]| Prior::widest(config, turn, at.map(f32::from));
        let reach = |at: [u16; 2]| prior.reach(at).unwrap_or_else(|| widest(at));
        let compared = corners.trace(reach, COMPARED_MAX, self.traced, executor);
        // More circles than the buffer holds are dropped and counted.
        let closed = corners.gather(self.traced, self.refined);
        let stored = closed.min(self.refined.len());
        let matches = clipped(self.refined, ..stored);
        let shape = Shape::new(width, height, CELL_MIN_PX);
        let memory = SortedMotions { cells: &mut self.cells, motion: self.motion };
        let rule = SupportRule { support_min: config.support_min, turn };
        support(matches, shape, &rule, memory, self.supported);
        let supported =
            self.supported.iter().take(stored).filter(|&&supported| supported == 1).count();
        let count = PassCount {
            closed: closed as u32,
            dropped: (closed - stored) as u32,
            unsupported: (stored - supported) as u32,
            compared,
        };
        (count, stored)
    }

    /// Refines the supported among the first `closed` matches and closes the gaps the others leave.
    pub(super) fn refine_supported<E: Executor>(
        &mut self,
        config: &SceneFlowConfig,
        [width, height]: [usize; 2],
        closed: usize,
        executor: &E,
    ) {
        let images = images(&self.left, &self.right, [width, height]);
        if config.refine {
            let bands = Bands::new(closed);
            let (matches, supported) =
                (bands.split_mut(self.refined, 1), bands.split_mut(self.supported, 1));
            let jobs = zip3(matches, supported, bands.split_mut(self.score, 1));
            each(executor, jobs, |(matches, supported, score)| {
                executor.vectors().run(RefineSupported { images, matches, supported, score })
            });
        } else {
            // Without refinement no match is better than another: buckets keep the earlier ones.
            self.score.fill(0.0);
        }
        // The order of the supported ones stays, because it decides ties later.
        let mut len = 0;
        for index in 0..closed {
            if self.supported.get(index) == Some(&1) {
                move_item(self.refined, index, len);
                move_item(self.score, index, len);
                len += 1;
            }
        }
        self.refined_len = len;
    }
}

/// Copies an item to an earlier position.
fn move_item<T: Copy>(items: &mut [T], from: usize, to: usize) {
    let item = items.get(from).copied();
    if let (Some(item), Some(slot)) = (item, items.get_mut(to)) {
        *slot = item;
    }
}
