//! The scene flow of a running stereo camera.

mod anchored;
mod passes;

pub(crate) use anchored::AnchorPoint;

use super::{
    SceneFlowConfig,
    bucket::{Scored, select},
    camera::{Camera, Incoming, Names},
    cells::{Cells, Shape},
    matches::Match,
    prior::Prior,
    refine::{Images, Pixels, find_back},
    report::{FlowReport, FlowStatus},
    support::Motion,
};
use crate::{
    digest::Digest,
    geometry::PixelCorrection,
    image::{InvalidPair, MaskedPair, View},
    invariants::Invariants,
    memory::{Capacity, Carver, region_bytes},
    parallel::{Executor, Vectors},
    slices::clipped,
    state::Visitor,
};

/// Side of the cells from which matches are selected for egomotion, px, as in DynSLAM.
const BUCKET_PX: usize = 50;

/// Features and matches over the last two frames.
#[derive(Debug)]
pub struct FlowMatcher<'s> {
    left: Camera<'s>,
    right: Camera<'s>,
    /// Width and height of the last frame, if there is one.
    last: Option<[usize; 2]>,
    /// The frame before it was matched with it.
    matched: bool,
    capacity: [usize; 2],
    traced: &'s mut [[u32; 3]],
    prior: Prior<'s>,
    cells: Cells<'s>,
    motion: &'s mut [Motion],
    supported: &'s mut [u8],
    sparse: &'s mut [Match],
    sparse_len: usize,
    refined: &'s mut [Match],
    refined_len: usize,
    score: &'s mut [f32],
    selection: &'s mut [u32],
    selection_len: usize,
    /// Disparity error taken out of the last frame's matches.
    correction: PixelCorrection,
}

const LEFT: Names = Names {
    pixels: "scene_flow.left.pixels",
    position: "scene_flow.left.position",
    descriptor: "scene_flow.left.descriptor",
    cell: "scene_flow.left.cell",
    gradient: "scene_flow.left.gradient",
    blob: "scene_flow.left.blob",
    corner: "scene_flow.left.corner",
    sums: "scene_flow.left.sums",
    candidate: "scene_flow.left.candidate",
    list: "scene_flow.left.list",
};

const RIGHT: Names = Names {
    pixels: "scene_flow.right.pixels",
    position: "scene_flow.right.position",
    descriptor: "scene_flow.right.descriptor",
    cell: "scene_flow.right.cell",
    gradient: "scene_flow.right.gradient",
    blob: "scene_flow.right.blob",
    corner: "scene_flow.right.corner",
    sums: "scene_flow.right.sums",
    candidate: "scene_flow.right.candidate",
    list: "scene_flow.right.list",
};

/// Sparse matches stored.
const fn sparse_matches(capacity: &Capacity) -> usize {
    capacity.matches / 4
}

impl<'s> FlowMatcher<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let matches = capacity.matches;
        2 * Camera::bytes(capacity)
            + region_bytes::<[u32; 3]>(capacity.features)
            + Prior::bytes(capacity)
            + Cells::bytes(capacity)
            + region_bytes::<Motion>(matches)
            + region_bytes::<u8>(matches)
            + region_bytes::<Match>(sparse_matches(capacity))
            + region_bytes::<Match>(matches)
            + region_bytes::<f32>(matches)
            + region_bytes::<u32>(matches)
    }

    /// Cuts its regions.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let matches = capacity.matches;
        Self {
            left: Camera::new_in(capacity, carver, &LEFT),
            right: Camera::new_in(capacity, carver, &RIGHT),
            last: None,
            matched: false,
            capacity: [capacity.image_width, capacity.image_height],
            traced: carver.alloc("scene_flow.circle", capacity.features),
            prior: Prior::new_in(capacity, carver),
            cells: Cells::new_in(capacity, carver),
            motion: carver.alloc("scene_flow.motion", matches),
            supported: carver.alloc("scene_flow.supported", matches),
            sparse: carver.alloc("scene_flow.sparse", sparse_matches(capacity)),
            sparse_len: 0,
            refined: carver.alloc("scene_flow.refined", matches),
            refined_len: 0,
            score: carver.alloc("scene_flow.score", matches),
            selection: carver.alloc("scene_flow.selection", matches),
            selection_len: 0,
            correction: PixelCorrection::default(),
        }
    }

    /// The sparse pass' matches of the last frame: whole pixels, outliers included.
    pub(crate) fn sparse(&self) -> &[Match] {
        clipped(self.sparse, ..self.sparse_len)
    }

    /// The dense pass' matches of the last frame that are supported by their neighbours, refined
    /// below the pixel.
    pub(crate) fn refined(&self) -> &[Match] {
        clipped(self.refined, ..self.refined_len)
    }

    /// Positions in [`FlowMatcher::refined`] of the matches selected for egomotion: the best of
    /// each cell, cell by cell.
    pub(crate) fn selection(&self) -> &[u32] {
        clipped(self.selection, ..self.selection_len)
    }

    /// The matches selected for egomotion.
    pub fn bucketed(&self) -> impl Iterator<Item = &Match> + Clone {
        self.selection().iter().filter_map(|&index| self.refined().get(index as usize))
    }

    /// Previous and current left image, brought to one brightness; `None` where the last frame was
    /// not matched with one before.
    pub(crate) fn left_images(&self) -> Option<[View<'_, u8>; 2]> {
        let [width, height] = self.last.filter(|_| self.matched)?;
        let (previous, current) = self.left.frames();
        let view = |pixels| View::new(pixels, width, height);
        Some([view(previous.pixels)?, view(current.pixels)?])
    }

    /// Looks for a scene point where it is expected: the patch around its current left position, a
    /// whole pixel, is found again below the pixel in the other three images. `None` without a
    /// frame before, where it is expected outside an image or at no number, and where it is lost:
    /// no texture, or nothing alike within 1.75 px.
    pub(crate) fn find(&self, expected: &Match) -> Option<Match> {
        // Features lie where the right image shows them, matches where the correction puts them: it
        // is taken off for the search and put back on what is found.
        let expected = &expected.with_right(|at| self.correction.uncorrected(at));
        let [width, height] = self.last.filter(|_| self.matched)?;
        let inside = |at: [f32; 2]| {
            at[0] >= 0.0 && at[1] >= 0.0 && at[0] < width as f32 && at[1] < height as f32
        };
        let positions = [
            expected.previous_left,
            expected.previous_right,
            expected.current_left,
            expected.current_right,
        ];
        let found = positions
            .into_iter()
            .all(inside)
            .then(|| find_back(expected, images(&self.left, &self.right, [width, height])))??;
        Some(found.with_right(|at| self.correction.corrected(at)))
    }

    /// Takes a disparity error out of the last frame's matches, and of those found later.
    pub(crate) fn correct(&mut self, correction: PixelCorrection) {
        self.correction = correction;
        for matches in
            [self.sparse.get_mut(..self.sparse_len), self.refined.get_mut(..self.refined_len)]
        {
            matches
                .unwrap_or_default()
                .iter_mut()
                .for_each(|m| *m = m.with_right(|at| correction.corrected(at)));
        }
    }

    #[cfg(test)]
    pub(super) fn refined_mut(&mut self, at: usize) -> &mut Match {
        &mut self.refined[at]
    }

    /// Digest of the last frame's matches: sparse, refined and selected.
    pub(crate) fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        for matches in [self.sparse(), self.refined()] {
            digest.u64(matches.len() as u64);
            for m in matches {
                [m.previous_left, m.previous_right, m.current_left, m.current_right]
                    .iter()
                    .for_each(|&at| digest.f32s(at));
            }
        }
        self.selection().iter().for_each(|&index| digest.u64(u64::from(index)));
        digest.finish()
    }

    /// Forgets the last frame alone: the next one is matched with the one before it.
    pub fn keep_previous(&mut self) {
        self.left.forget_current();
        self.right.forget_current();
    }

    /// Returns true if both images of the last frame have more than twice the features of those it
    /// was matched with.
    pub(crate) fn is_much_richer(&self) -> bool {
        self.left.is_much_richer() && self.right.is_much_richer()
    }

    /// Forgets the last frame: the next one is a first one.
    pub fn reset(&mut self) {
        self.last = None;
        self.clear();
    }

    /// Says what must hold of the matches after a frame.
    pub(crate) fn check_invariants(&self, invariants: &mut Invariants) {
        invariants.require(
            self.sparse_len <= self.sparse.len(),
            "no more sparse matches than there is memory for",
        );
        invariants.require(
            self.refined_len <= self.refined.len(),
            "no more refined matches than there is memory for",
        );
        let selected = |&index: &u32| (index as usize) < self.refined_len;
        invariants.require(
            self.selection().iter().all(selected),
            "every selected match is a refined one",
        );
    }

    /// Visits the last pair; [`FlowMatcher::rebuild`] must follow a reading.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            left,
            right,
            last,
            capacity,
            // Belong to one frame.
            matched: _,
            traced: _,
            prior: _,
            cells: _,
            motion: _,
            supported: _,
            sparse: _,
            sparse_len: _,
            refined: _,
            refined_len: _,
            score: _,
            selection: _,
            selection_len: _,
            correction: _,
        } = self;
        let [mut width, mut height] = last.unwrap_or_default();
        visitor.count(&mut width, capacity[0]);
        visitor.count(&mut height, capacity[1]);
        *last = (width * height > 0).then_some([width, height]);
        left.visit([width, height], visitor);
        right.visit([width, height], visitor);
    }

    /// Finds the features of the pair that was read.
    pub(crate) fn rebuild(&mut self, config: &SceneFlowConfig, invalid: Option<&InvalidPair<'_>>) {
        if let Some([width, height]) = self.last {
            let vectors = Vectors::BASELINE;
            self.left.describe([width, height], invalid.map(|pair| &pair.left), config, vectors);
            let invalid_right = invalid.and_then(|pair| pair.right.as_ref());
            self.right.describe([width, height], invalid_right, config, vectors);
        }
    }

    fn clear(&mut self) {
        (self.sparse_len, self.refined_len, self.selection_len) = (0, 0, 0);
        self.correction = PixelCorrection::default();
        self.matched = false;
    }

    /// Takes in a stereo frame and matches it with the one before.
    pub fn push<E: Executor>(
        &mut self,
        config: &SceneFlowConfig,
        left: View<'_, u8>,
        right: View<'_, u8>,
        executor: &E,
    ) -> FlowReport {
        // Every pixel counts, and the rows are where they were.
        let pair = MaskedPair { left, right, invalid: None, right_moved: false };
        self.push_within(config, &pair, executor)
    }

    /// Takes in and matches, as [`FlowMatcher::push`] does, a frame with invalid pixels: no feature
    /// is found there.
    pub(crate) fn push_within<E: Executor>(
        &mut self,
        config: &SceneFlowConfig,
        &MaskedPair { left, right, invalid, right_moved }: &MaskedPair<'_>,
        executor: &E,
    ) -> FlowReport {
        // The next frame cannot be matched with a refused one: there is no last pair then.
        self.clear();
        let size = [left.width(), left.height()];
        if size != [right.width(), right.height()]
            || size[0] > self.capacity[0]
            || size[1] > self.capacity[1]
        {
            self.last = None;
            return FlowReport { status: FlowStatus::Refused, ..FlowReport::default() };
        }
        // The two cameras' features are found at the same time.
        let [invalid_left, invalid_right] =
            [invalid.map(|pair| &pair.left), invalid.and_then(|pair| pair.right.as_ref())];
        let (vectors, follows) = (executor.vectors(), self.last == Some(size));
        let incoming = |image| Incoming { image, follows };
        let (left, right) = executor.join(
            || self.left.take(incoming(left), invalid_left, config, vectors),
            || self.right.take(incoming(right), invalid_right, config, vectors),
        );
        let mut report = FlowReport { left, right, ..FlowReport::default() };
        // A first frame has nothing to be matched with.
        if self.last.replace(size) != Some(size) {
            return FlowReport { status: FlowStatus::First, ..report };
        }
        // An image that repeats the last one means a frozen camera, or one that stands.
        match [self.left.is_repeated(size), self.right.is_repeated(size)] {
            [false, false] => {}
            // Rows of the right image that are moved anew make it differ where the camera stands.
            [true, false] if right_moved => report.status = FlowStatus::Repeated,
            [true, true] => report.status = FlowStatus::Repeated,
            _ => return FlowReport { status: FlowStatus::Frozen, ..report },
        }
        self.matched = true;
        // Few wide searches teach where many narrow ones have to look.
        report.sparse = self.sparse_pass(config, size, executor);
        let closed;
        (report.dense, closed) = self.dense_pass(config, size, executor);
        self.refine_supported(config, size, closed, executor);
        report.refined = self.refined_len as u32;
        report.unrefined = closed as u32 - report.dense.unsupported - report.refined;
        // Egomotion gets the best of each cell.
        let shape = Shape::new(size[0], size[1], BUCKET_PX);
        let (refined, score) = (clipped(self.refined, ..self.refined_len), &*self.score);
        self.selection_len = select(
            Scored { matches: refined, score },
            shape,
            usize::from(config.bucket_matches),
            &mut self.cells,
            self.selection,
        );
        report.bucketed = self.selection_len as u32;
        report
    }
}

/// The last two pairs, of that size.
fn images<'a>(
    left: &'a Camera<'_>,
    right: &'a Camera<'_>,
    // The buffers are for the capacity; the images use their beginning.
    [width, height]: [usize; 2],
) -> Images<'a> {
    let ((left_before, left), (right_before, right)) = (left.frames(), right.frames());
    let pixels = |data: &'a [u8]| Pixels { data: clipped(data, ..width * height), width };
    Images {
        previous_left: pixels(left_before.pixels),
        previous_right: pixels(right_before.pixels),
        current_left: pixels(left.pixels),
        current_right: pixels(right.pixels),
    }
}
