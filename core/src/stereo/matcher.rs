//! The matcher: its buffers in the slab, and the order of the steps from two images to disparities.

mod steps;

use super::{
    MAX_IMAGE_SIZE, MIN_IMAGE_SIZE, StereoConfig, StereoReport, StereoStatus, StereoStep,
    config::{CANDIDATE_STEP, MIN_GRID_SIZE},
    delaunay::Triangulation,
    descriptor::Descriptor,
    prior,
    prior::DisparitySet,
    rows::MatchedRows,
    support,
    support::Lattice,
};
use crate::{
    digest::Digest,
    geometry::PixelCorrection,
    image::{DISPARITY_ONE_PX, InvalidPair, MaskedPair, View},
    memory::{Capacity, Carver, region_bytes},
    parallel::{BANDS, Bands, Executor, Work, each, zip2},
    settings::Problems,
};

/// Descriptor rows per band: support points need two of each image.
const ROWS: usize = 4;

/// The matcher: its buffers in the slab and the disparities of the last pair.
pub struct StereoMatcher<'s> {
    /// Four bytes a pixel: the gradients of both images, later the runs of the speckle filter, in
    /// the end a byte for each pixel's confidence.
    gradients: &'s mut [u32],
    /// Left planes, then left disparities in working units, in the end the result.
    disparity: &'s mut [u16],
    /// Right planes, then right disparities, then the ends of the speckle filter's runs, then the
    /// image between two filters.
    other: &'s mut [i16],
    rows: &'s mut [Descriptor],
    support: &'s mut [i16],
    support_scratch: &'s mut [i16],
    left_mesh: Triangulation<'s>,
    right_mesh: Triangulation<'s>,
    left_cells: &'s mut [DisparitySet],
    right_cells: &'s mut [DisparitySet],
    columns: &'s mut [u32],
    image_width: usize,
    image_height: usize,
    width: usize,
    height: usize,
    /// True if the gradients' memory holds the confidences of the last pair.
    has_confidence: bool,
    /// Candidates for support points of the last pair that were matched.
    lattice: Lattice,
    /// Rows of the last pair from one that was matched densely to the next.
    row_step: u16,
}

/// Takes a disparity error out of rows, from `first` on.
struct CorrectRows<'a> {
    correction: PixelCorrection,
    first: usize,
    rows: &'a mut [u16],
    width: usize,
}

impl Work for CorrectRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // Not by `for_each`, whose closure is compiled for the baseline.
        for (v, row) in (self.first..).zip(self.rows.chunks_exact_mut(self.width.max(1))) {
            self.correction.correct_row(v, row);
        }
    }
}

impl core::fmt::Debug for StereoMatcher<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("StereoMatcher")
            .field("width", &self.width)
            .field("height", &self.height)
            .finish_non_exhaustive()
    }
}

/// The most that is looked for in a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StereoBudget {
    /// Pixels matched densely.
    pub pixels: usize,
    /// Candidates for support points.
    pub points: usize,
}

/// Support points there can be: one per candidate.
pub(crate) const fn max_points(capacity: &Capacity) -> usize {
    support::candidates(capacity.image_width, CANDIDATE_STEP)
        * support::candidates(capacity.image_height, CANDIDATE_STEP)
}

/// Cells of the grid prior there can be.
const fn max_cells(capacity: &Capacity) -> usize {
    prior::cells(capacity.image_width, MIN_GRID_SIZE)
        * prior::cells(capacity.image_height, MIN_GRID_SIZE)
}

const fn at_least_one(length: usize) -> usize {
    if length == 0 { 1 } else { length }
}

/// Entries of a region with one per pixel; one at least, so that there is an image to show before
/// the first pair.
const fn max_pixels(capacity: &Capacity) -> usize {
    at_least_one(capacity.image_width) * at_least_one(capacity.image_height)
}

impl<'s> StereoMatcher<'s> {
    /// Bytes of the slab.
    ///
    /// ```
    /// use dynvox_core::{Capacity, stereo::StereoMatcher};
    ///
    /// assert!(StereoMatcher::bytes(&Capacity::TINY) < Capacity::TINY.bytes());
    /// ```
    pub const fn bytes(capacity: &Capacity) -> usize {
        let (pixels, points, cells) =
            (max_pixels(capacity), max_points(capacity), max_cells(capacity));
        region_bytes::<u32>(pixels)
            + region_bytes::<u16>(pixels)
            + region_bytes::<i16>(pixels)
            + region_bytes::<Descriptor>(BANDS * ROWS * capacity.image_width)
            + 2 * region_bytes::<i16>(points)
            + 2 * Triangulation::bytes(points)
            + 2 * region_bytes::<DisparitySet>(cells)
            + region_bytes::<u32>(capacity.image_width)
    }

    /// Takes the matcher's buffers from the slab.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let (pixels, points, cells) =
            (max_pixels(capacity), max_points(capacity), max_cells(capacity));
        Self {
            gradients: carver.alloc("stereo.gradients", pixels),
            disparity: carver.alloc("stereo.disparity", pixels),
            other: carver.alloc("stereo.other", pixels),
            rows: carver.alloc("stereo.rows", BANDS * ROWS * capacity.image_width),
            support: carver.alloc("stereo.support", points),
            support_scratch: carver.alloc("stereo.support_scratch", points),
            left_mesh: Triangulation::new_in(
                points,
                ["stereo.points_left", "stereo.triangles_left", "stereo.hull_left"],
                carver,
            ),
            right_mesh: Triangulation::new_in(
                points,
                ["stereo.points_right", "stereo.triangles_right", "stereo.hull_right"],
                carver,
            ),
            left_cells: carver.alloc("stereo.cells_left", cells),
            right_cells: carver.alloc("stereo.cells_right", cells),
            columns: carver.alloc("stereo.columns", capacity.image_width),
            image_width: capacity.image_width,
            image_height: capacity.image_height,
            // No pair yet: one pixel without disparity, so that a view of it is never empty.
            width: 1,
            height: 1,
            has_confidence: false,
            lattice: Lattice::ALL,
            row_step: 1,
        }
    }

    #[cfg(test)]
    pub(super) fn result_mut(&mut self) -> &mut [u16] {
        self.disparity
    }

    /// Digest of the last pair's disparities.
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        self.disparity_q8().rows().for_each(|row| digest.u16s(row));
        digest.finish()
    }

    /// Disparities of the left image, of the last pair given to [`StereoMatcher::compute`]: 1/256
    /// px, 0 = none, exactly as large as the image (as much of it as the capacity holds, all none,
    /// where the pair was refused).
    pub fn disparity_q8(&self) -> View<'_, u16> {
        // Both sides are at least 1 and their product is at most the region's length, by `begin`.
        View::new(self.disparity, self.width, self.height).unwrap_or(View::ONE_ZERO)
    }

    /// Confidences of the last pair's disparities, as large as [`StereoMatcher::disparity_q8`]: 0
    /// without a disparity, else one more than the number of measured pixels, neither filled in nor
    /// without a disparity, in the 16 x 16 about each, at most 255. `None` unless
    /// [`StereoConfig::min_confidence`] is above 0 and the pair was matched.
    pub fn confidence(&self) -> Option<View<'_, u8>> {
        let confidence = bytemuck::cast_slice(self.gradients);
        View::new(confidence, self.width, self.height).filter(|_| self.has_confidence)
    }

    /// Computes the disparities of a rectified pair.
    pub fn compute<E: Executor>(
        &mut self,
        config: &StereoConfig,
        left: View<'_, u8>,
        right: View<'_, u8>,
        executor: &E,
    ) -> StereoReport {
        self.compute_observed(config, [left, right], executor, |_| ())
    }

    /// Computes disparities like [`StereoMatcher::compute`], for a pair with invalid pixels: they
    /// get no disparity, nor do pixels whose partner in the right image is one of them. No more is
    /// looked for than the budget allows.
    pub(crate) fn compute_within<E: Executor>(
        &mut self,
        config: &StereoConfig,
        pair: &MaskedPair<'_>,
        most: StereoBudget,
        executor: &E,
    ) -> StereoReport {
        let [width, height] = [pair.left.width(), pair.left.height()].map(|side| side.max(1));
        self.row_step = MatchedRows::within(config, height, most.pixels / width).step as u16;
        let grid = [width, height].map(|side| support::candidates(side, CANDIDATE_STEP));
        self.lattice = Lattice::within(grid, most.points);
        self.compute_steps(config, pair, executor, |_| ())
    }

    /// Computes disparities like [`StereoMatcher::compute`], from a left and a right image, calling
    /// `done` after each step: no clock enters the core, so a caller that times the steps does it
    /// there.
    pub fn compute_observed<E: Executor>(
        &mut self,
        config: &StereoConfig,
        [left, right]: [View<'_, u8>; 2],
        executor: &E,
        done: impl FnMut(StereoStep),
    ) -> StereoReport {
        let pair = MaskedPair { left, right, invalid: None, right_moved: false };
        self.row_step = MatchedRows::new(config, left.height()).step as u16;
        self.lattice = Lattice::ALL;
        self.compute_steps(config, &pair, executor, done)
    }

    fn compute_steps<E: Executor>(
        &mut self,
        config: &StereoConfig,
        pair: &MaskedPair<'_>,
        executor: &E,
        mut done: impl FnMut(StereoStep),
    ) -> StereoReport {
        let &MaskedPair { left, right, invalid, right_moved: _ } = pair;
        // A pair that cannot be matched leaves an empty disparity image.
        let status = self.begin(config, left, right);
        let mut report = StereoReport {
            status,
            pixels: (self.width * self.height) as u32,
            row_pixels: (self.width * self.matched().count) as u32,
            ..StereoReport::default()
        };
        if report.status != StereoStatus::Matched {
            self.disparity.fill(0);
            return report;
        }
        self.find_gradients(left, right, invalid, executor);
        done(StereoStep::Gradients);
        self.match_support(config, executor, &mut report);
        done(StereoStep::Support);
        self.filter_support_points(config, executor, &mut report);
        done(StereoStep::FilterSupport);
        self.triangulate(config, executor, &mut report);
        done(StereoStep::Triangulation);
        // Without a triangle there is no plane to search around.
        if report.triangles_left == 0 || report.triangles_right == 0 {
            report.status = StereoStatus::TooFewSupportPoints;
            self.disparity.fill(0);
            return report;
        }
        self.match_densely(config, executor, &mut report);
        done(StereoStep::DenseMatching);
        self.remove_speckles(config, executor, &mut report);
        done(StereoStep::Speckles);
        self.fill_gaps(config, executor, &mut report);
        self.spread_rows(executor);
        done(StereoStep::Gaps);
        self.smooth(config, executor);
        done(StereoStep::Smoothing);
        self.finish(invalid, &mut report);
        self.measure_confidence(config, executor, &mut report);
        done(StereoStep::Output);
        report
    }

    /// Takes disparities from elsewhere (1/256 px, 0 none) instead of a pair's own. Of an image
    /// larger than the capacity, which the mapper refuses, what fits is taken. Nothing is taken at
    /// the pixels that are not to be used.
    pub(crate) fn take(
        &mut self,
        disparity_q8: View<'_, u16>,
        unused: Option<&InvalidPair<'_>>,
    ) -> StereoReport {
        self.has_confidence = false;
        self.width = disparity_q8.width().min(self.image_width).max(1);
        self.height = disparity_q8.height().min(self.image_height).max(1);
        self.disparity.fill(0);
        let mut report = StereoReport {
            status: StereoStatus::Given,
            pixels: (self.width * self.height) as u32,
            ..StereoReport::default()
        };
        // A match this far to the left lies outside the right image at every column.
        let absurd = self.width as u32 * u32::from(DISPARITY_ONE_PX);
        let rows = self.disparity.chunks_exact_mut(self.width.max(1)).zip(disparity_q8.rows());
        for (v, (to, from)) in rows.enumerate() {
            for (u, (to, &given)) in to.iter_mut().zip(from).enumerate() {
                let accepted = u32::from(given) < absurd;
                let is_used = unused.is_none_or(|pair| !pair.left.contains(u, v));
                *to = if accepted && is_used { given } else { 0 };
                report.refused += u32::from(!accepted);
                report.valid += u32::from(*to != 0);
            }
        }
        report
    }

    /// Takes a disparity error out of the last pair's disparities, whichever way they came.
    pub(crate) fn correct<E: Executor>(&mut self, correction: PixelCorrection, executor: &E) {
        let (width, height) = (self.width, self.height);
        let bands = Bands::new(height);
        each(
            executor,
            zip2(bands.first(), bands.split_mut(self.disparity, width)),
            |(first, rows)| {
                executor.vectors().run(CorrectRows { correction, first, rows, width });
            },
        );
    }

    /// Checks the input, takes the image's size and blanks the result.
    fn begin(
        &mut self,
        config: &StereoConfig,
        left: View<'_, u8>,
        right: View<'_, u8>,
    ) -> StereoStatus {
        self.has_confidence = false;
        // The size is clipped even if the pair is refused: readers of the result rely on it.
        self.width = left.width().min(self.image_width).max(1);
        self.height = left.height().min(self.image_height).max(1);
        let mut problems = Problems::new();
        config.validate(&mut problems);
        if !problems.is_empty() {
            StereoStatus::ConfigRefused
        } else if (left.width(), left.height()) != (right.width(), right.height()) {
            StereoStatus::SizesDiffer
        } else if left.width() > self.image_width.min(MAX_IMAGE_SIZE)
            || left.height() > self.image_height.min(MAX_IMAGE_SIZE)
        {
            StereoStatus::TooLarge
        } else if left.width() < MIN_IMAGE_SIZE || left.height() < MIN_IMAGE_SIZE {
            StereoStatus::TooSmall
        } else {
            StereoStatus::Matched
        }
    }
}
