//! The matcher: its buffers in the slab, and the steps from two images to disparities.

use super::{
    MAX_IMAGE_SIZE, MIN_IMAGE_SIZE, StereoConfig, StereoReport, StereoStatus, StereoStep,
    config::{DISPARITY_LIMIT, MIN_CANDIDATE_STEP, MIN_GRID_SIZE},
    delaunay::{SupportPoint, Triangulation},
    dense::{DenseBand, DenseMatching, NONE, WORKING_ONE_PX},
    descriptor::{Descriptor, Gradients},
    filter_support, gaps,
    gaps::Filling,
    gradient, invalid, median, prior,
    prior::{CellGrid, DisparitySet, PlaneCost},
    smooth, speckle,
    speckle::Scratch,
    support,
    support::{NO_MATCH, SupportMatching},
};
use crate::{
    digest::Digest,
    geometry::ColumnCorrection,
    image::{DISPARITY_ONE_PX, InvalidPair, View},
    memory::{Capacity, Carver, region_bytes},
    parallel::{BANDS, Bands, Executor, each, zip3},
    problem::Problems,
};

/// Descriptor rows per band: support points need two of each image.
const ROWS: usize = 4;

/// The matcher: its buffers in the slab and the disparities of the last pair.
pub struct StereoMatcher<'s> {
    /// Four bytes a pixel: the gradients of both images, later the runs of the speckle filter.
    gradients: &'s mut [u32],
    /// Left planes, then left disparities in working units, in the end the result.
    disparity: &'s mut [u16],
    /// Right planes, then right disparities, then the ends of the speckle filter's runs, then the image between two filters.
    other: &'s mut [i16],
    rows: &'s mut [Descriptor],
    support: &'s mut [i16],
    support_before: &'s mut [i16],
    left_mesh: Triangulation<'s>,
    right_mesh: Triangulation<'s>,
    left_cells: &'s mut [DisparitySet],
    right_cells: &'s mut [DisparitySet],
    columns: &'s mut [u32],
    image_width: usize,
    image_height: usize,
    width: usize,
    height: usize,
}

impl core::fmt::Debug for StereoMatcher<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("StereoMatcher").field("width", &self.width).field("height", &self.height).finish_non_exhaustive()
    }
}

/// Support points there can be: one per candidate.
const fn most_points(capacity: &Capacity) -> usize {
    support::candidates(capacity.image_width, MIN_CANDIDATE_STEP) * support::candidates(capacity.image_height, MIN_CANDIDATE_STEP)
}

/// Cells of the grid prior there can be.
const fn most_cells(capacity: &Capacity) -> usize {
    prior::cells(capacity.image_width, MIN_GRID_SIZE) * prior::cells(capacity.image_height, MIN_GRID_SIZE)
}

const fn at_least_one(length: usize) -> usize {
    if length == 0 { 1 } else { length }
}

/// Entries of a region with one per pixel; one at least, so that there is an image to show before the first pair.
const fn most_pixels(capacity: &Capacity) -> usize {
    at_least_one(capacity.image_width) * at_least_one(capacity.image_height)
}

impl<'s> StereoMatcher<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        let (pixels, points, cells) = (most_pixels(capacity), most_points(capacity), most_cells(capacity));
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
        let (pixels, points, cells) = (most_pixels(capacity), most_points(capacity), most_cells(capacity));
        Self {
            gradients: carver.alloc("stereo.gradients", pixels),
            disparity: carver.alloc("stereo.disparity", pixels),
            other: carver.alloc("stereo.other", pixels),
            rows: carver.alloc("stereo.rows", BANDS * ROWS * capacity.image_width),
            support: carver.alloc("stereo.support", points),
            support_before: carver.alloc("stereo.support_before", points),
            left_mesh: Triangulation::new_in(points, ["stereo.points_left", "stereo.triangles_left", "stereo.hull_left"], carver),
            right_mesh: Triangulation::new_in(points, ["stereo.points_right", "stereo.triangles_right", "stereo.hull_right"], carver),
            left_cells: carver.alloc("stereo.cells_left", cells),
            right_cells: carver.alloc("stereo.cells_right", cells),
            columns: carver.alloc("stereo.columns", capacity.image_width),
            image_width: capacity.image_width,
            image_height: capacity.image_height,
            width: 1,
            height: 1,
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

    /// Disparities of the left image, of the last pair given to [`StereoMatcher::compute`]: 1/256 px, 0 = none, exactly as large as the
    /// image (as much of it as the capacity holds, all none, where the pair was refused).
    pub fn disparity_q8(&self) -> View<'_, u16> {
        // Both sides are at least 1 and their product is at most the region's length, by `begin`.
        View::new(self.disparity, self.width, self.height).unwrap_or(View::ONE_ZERO)
    }

    /// Computes the disparities of a rectified pair.
    pub fn compute<E: Executor>(&mut self, config: &StereoConfig, left: View<'_, u8>, right: View<'_, u8>, executor: &E) -> StereoReport {
        self.compute_observed(config, left, right, executor, |_| ())
    }

    /// As [`StereoMatcher::compute`], for a pair with invalid pixels: they get no disparity, nor do those whose partner in the
    /// right image is one of them.
    pub fn compute_within<E: Executor>(
        &mut self,
        config: &StereoConfig,
        left: View<'_, u8>,
        right: View<'_, u8>,
        invalid: Option<&InvalidPair<'_>>,
        executor: &E,
    ) -> StereoReport {
        self.compute_steps(config, [left, right], invalid, executor, |_| ())
    }

    /// As [`StereoMatcher::compute`], calling `done` after each step: no clock enters the core, so a caller that times the steps does it there.
    pub fn compute_observed<E: Executor>(
        &mut self,
        config: &StereoConfig,
        left: View<'_, u8>,
        right: View<'_, u8>,
        executor: &E,
        done: impl FnMut(StereoStep),
    ) -> StereoReport {
        self.compute_steps(config, [left, right], None, executor, done)
    }

    fn compute_steps<E: Executor>(
        &mut self,
        config: &StereoConfig,
        [left, right]: [View<'_, u8>; 2],
        invalid: Option<&InvalidPair<'_>>,
        executor: &E,
        mut done: impl FnMut(StereoStep),
    ) -> StereoReport {
        let status = self.begin(config, left, right);
        let mut report = StereoReport { status, pixels: (self.width * self.height) as u32, ..StereoReport::default() };
        if report.status != StereoStatus::Matched {
            return report;
        }
        self.find_gradients(left, right, invalid, executor);
        done(StereoStep::Gradients);
        self.match_support(config, executor, &mut report);
        done(StereoStep::Support);
        self.filter_support_points(config, &mut report);
        done(StereoStep::Sifting);
        self.triangulate(config, executor, &mut report);
        done(StereoStep::Triangulation);
        if report.triangles_left == 0 || report.triangles_right == 0 {
            report.status = StereoStatus::TooFewSupportPoints;
            return report;
        }
        self.match_densely(config, executor, &mut report);
        done(StereoStep::DenseMatching);
        self.remove_speckles(config, &mut report);
        done(StereoStep::Speckles);
        self.fill_gaps(config, &mut report);
        done(StereoStep::Gaps);
        self.smooth(config, executor);
        done(StereoStep::Smoothing);
        self.finish(invalid, &mut report);
        done(StereoStep::Output);
        report
    }

    /// Takes disparities from elsewhere (1/256 px, 0 none) in place of a pair's own. Of an image larger than the capacity, which the mapper
    /// refuses, what fits is taken.
    pub fn take(&mut self, disparity_q8: View<'_, u16>) -> StereoReport {
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
        for (to, from) in self.disparity.chunks_exact_mut(self.width.max(1)).zip(disparity_q8.rows()) {
            for (to, &given) in to.iter_mut().zip(from) {
                let accepted = u32::from(given) < absurd;
                *to = if accepted { given } else { 0 };
                report.refused += u32::from(!accepted);
                report.valid += u32::from(*to != 0);
            }
        }
        report
    }

    /// Takes a disparity error out of the last pair's disparities, whichever way they came.
    pub fn correct<E: Executor>(&mut self, correction: ColumnCorrection, executor: &E) {
        let (width, height) = (self.width, self.height);
        each(executor, Bands::of(height).split_mut(self.disparity, width), |rows: &mut [u16]| {
            rows.chunks_exact_mut(width.max(1)).for_each(|row| correction.correct_row(row));
        });
    }

    /// Checks the input, takes the image's size and blanks the result.
    fn begin(&mut self, config: &StereoConfig, left: View<'_, u8>, right: View<'_, u8>) -> StereoStatus {
        self.width = left.width().min(self.image_width).max(1);
        self.height = left.height().min(self.image_height).max(1);
        self.disparity.fill(0);
        let mut problems = Problems::new();
        config.validate(&mut problems);
        if !problems.is_empty() {
            StereoStatus::ConfigRefused
        } else if (left.width(), left.height()) != (right.width(), right.height()) {
            StereoStatus::SizesDiffer
        } else if left.width() > self.image_width.min(MAX_IMAGE_SIZE) || left.height() > self.image_height.min(MAX_IMAGE_SIZE) {
            StereoStatus::TooLarge
        } else if left.width() < MIN_IMAGE_SIZE || left.height() < MIN_IMAGE_SIZE {
            StereoStatus::TooSmall
        } else {
            StereoStatus::Matched
        }
    }

    fn find_gradients<E: Executor>(&mut self, left: View<'_, u8>, right: View<'_, u8>, invalid: Option<&InvalidPair<'_>>, executor: &E) {
        let (width, bands) = (self.width, Bands::of(self.height));
        let [left_du, left_dv, right_du, right_dv] = split_planes(self.gradients, width * self.height);
        let [left_invalid, right_invalid] = [invalid.map(|pair| &pair.left), invalid.map(|pair| &pair.right)];
        for (image, invalid, du, dv) in [(left, left_invalid, left_du, left_dv), (right, right_invalid, right_du, right_dv)] {
            let jobs = zip3(bands.first(), bands.split_mut(du, width), bands.split_mut(dv, width));
            each(executor, jobs, |(first, du, dv)| gradient::gradients(image, first, du, dv));
            if let Some(invalid) = invalid {
                invalid::flatten(invalid, width, du);
                invalid::flatten(invalid, width, dv);
            }
        }
    }

    fn match_support<E: Executor>(&mut self, config: &StereoConfig, executor: &E, report: &mut StereoReport) {
        let [left, right] = gradients(self.gradients, self.width, self.height);
        let (columns, rows) =
            (support::candidates(self.width, config.candidate_step), support::candidates(self.height, config.candidate_step));
        let bands = Bands::of(rows);
        let matching = SupportMatching { config, left, right };
        let jobs = zip3(bands.first(), bands.split_mut(self.support, columns), Bands::of(BANDS).split_mut(self.rows, ROWS * self.width));
        each(executor, jobs, |(first, grid, scratch)| matching.match_rows(first, grid, scratch));
        let grid = self.support.get(..columns * rows).unwrap_or(&[]);
        report.candidates = grid.len() as u32;
        report.support_matches = grid.iter().filter(|&&d| d != NO_MATCH).count() as u32;
    }

    fn filter_support_points(&mut self, config: &StereoConfig, report: &mut StereoReport) {
        let step = config.candidate_step;
        let (columns, rows) = (support::candidates(self.width, step), support::candidates(self.height, step));
        let Some(grid) = self.support.get_mut(..columns * rows) else { return };
        report.implausible = filter_support::remove_implausible(config, grid, columns, self.support_before);
        report.redundant = filter_support::remove_redundant(config, grid, columns);
        self.left_mesh.clear();
        self.right_mesh.clear();
        for (j, row) in grid.chunks_exact(columns.max(1)).enumerate() {
            for (i, &disparity) in row.iter().enumerate().filter(|(_, d)| **d != NO_MATCH) {
                let (u, v, disparity) = ((i * step) as u16, (j * step) as u16, disparity as u16);
                self.left_mesh.add(SupportPoint { u, v, disparity });
                report.occluded_right += u32::from(self.right_mesh.add(SupportPoint { u: u - disparity, v, disparity }));
            }
        }
        report.support_points = self.left_mesh.points().len() as u32;
    }

    fn triangulate<E: Executor>(&mut self, config: &StereoConfig, executor: &E, report: &mut StereoReport) {
        let columns = prior::cells(self.width, config.grid_size);
        let cells = columns * prior::cells(self.height, config.grid_size);
        let prepare = |mesh: &mut Triangulation<'_>, sets: &mut [DisparitySet]| {
            mesh.triangulate();
            prior::mark_cells(config, mesh.points(), columns, sets.get_mut(..cells).unwrap_or(&mut []));
        };
        executor.join(|| prepare(&mut self.left_mesh, self.left_cells), || prepare(&mut self.right_mesh, self.right_cells));
        report.triangles_left = self.left_mesh.triangle_count() as u32;
        report.triangles_right = self.right_mesh.triangle_count() as u32;
    }

    fn match_densely<E: Executor>(&mut self, config: &StereoConfig, executor: &E, report: &mut StereoReport) {
        let (width, bands) = (self.width, Bands::of(self.height));
        let columns = prior::cells(width, config.grid_size);
        let matching = DenseMatching {
            config,
            gradients: gradients(self.gradients, width, self.height),
            cells: [CellGrid { cells: self.left_cells, columns }, CellGrid { cells: self.right_cells, columns }],
            cost: PlaneCost::new(config),
        };
        let disparity: &mut [i16] = bytemuck::cast_slice_mut(self.disparity);
        let images = zip3(bands.first(), bands.split_mut(disparity, width), bands.split_mut(self.other, width));
        let scratch = Bands::of(BANDS).split_mut(self.rows, ROWS * width);
        let mut jobs = [(); BANDS].map(|()| None);
        for ((job, (first, left, right)), scratch) in jobs.iter_mut().zip(images).zip(scratch) {
            *job = Some(DenseBand { first, left, right, scratch, counts: [0; 2] });
        }
        let (left_mesh, right_mesh) = (&self.left_mesh, &self.right_mesh);
        each(executor, jobs.each_mut(), |band| {
            if let Some(band) = band {
                prior::rasterise_planes(left_mesh, config.plane_slope_max, band.first, width, band.left);
                prior::rasterise_planes(right_mesh, config.plane_slope_max, band.first, width, band.right);
                matching.match_band(band);
            }
        });
        for [matched, inconsistent] in jobs.iter().flatten().map(|band| band.counts) {
            report.matched += matched;
            report.inconsistent += inconsistent;
        }
    }

    fn remove_speckles(&mut self, config: &StereoConfig, report: &mut StereoReport) {
        let similarity = working(config.speckle_similarity);
        let image = image_of(self.disparity, self.width * self.height);
        let scratch = Scratch {
            runs: bytemuck::cast_slice_mut(self.gradients),
            ends: bytemuck::cast_slice_mut(self.other),
            flags: bytemuck::cast_slice_mut(self.columns),
        };
        report.speckles = speckle::remove_speckles(image, self.width, similarity, config.speckle_size, scratch);
    }

    fn fill_gaps(&mut self, config: &StereoConfig, report: &mut StereoReport) {
        let filling = Filling { width: config.gap_width, discontinuity: working(config.gap_discontinuity) as u16 };
        let image = image_of(self.disparity, self.width * self.height);
        report.filled = gaps::fill_rows(image, self.width, filling) + gaps::fill_columns(image, self.width, filling, self.columns);
    }

    fn smooth<E: Executor>(&mut self, config: &StereoConfig, executor: &E) {
        let (width, pixels, bands) = (self.width, self.width * self.height, Bands::of(self.height));
        let image = image_of(self.disparity, pixels);
        let other = self.other.get_mut(..pixels).unwrap_or(&mut []);
        if config.adaptive_mean {
            let rows = zip3(bands.first(), bands.split_mut(image, width), bands.split_mut(other, width));
            each(executor, rows, |(_, from, to)| smooth::mean_along_rows(from, width, to));
            let columns = zip3(bands.first(), bands.split_mut(image, width), [(); BANDS]);
            each(executor, columns, |(first, to, ())| smooth::mean_along_columns(other, width, first, to));
        }
        if config.median {
            other.iter_mut().zip(&*image).for_each(|(to, from)| *to = *from);
            let rows = zip3(bands.first(), bands.split_mut(image, width), [(); BANDS]);
            each(executor, rows, |(first, to, ())| median::median(other, width, first, to));
        }
    }

    /// Turns working units into the result's.
    fn finish(&mut self, invalid: Option<&InvalidPair<'_>>, report: &mut StereoReport) {
        let disparities = self.disparity.get_mut(..self.width * self.height).unwrap_or(&mut []);
        for disparity in disparities.iter_mut() {
            let working = *disparity as i16;
            // Smoothed values stay between those they come from: 0..=255 px.
            *disparity = if working == NONE { 0 } else { working as u16 * (DISPARITY_ONE_PX / WORKING_ONE_PX as u16) };
        }
        if let Some(invalid) = invalid {
            invalid::remove(invalid, self.width, disparities);
        }
        report.valid = disparities.iter().filter(|disparity| **disparity != 0).count() as u32;
    }
}

/// Whole px in working units, held at the largest difference two disparities can have.
fn working(px: u16) -> i16 {
    px.min(DISPARITY_LIMIT) as i16 * WORKING_ONE_PX
}

/// The first `pixels` of the disparity region as working units.
fn image_of(disparity: &mut [u16], pixels: usize) -> &mut [i16] {
    bytemuck::cast_slice_mut(disparity).get_mut(..pixels).unwrap_or(&mut [])
}

/// The gradient region as four images: horizontal and vertical gradient of the left image, then of the right one.
fn split_planes(gradients: &mut [u32], pixels: usize) -> [&mut [u8]; 4] {
    let mut planes = bytemuck::cast_slice_mut::<u32, u8>(gradients).chunks_exact_mut(pixels.max(1));
    [(); 4].map(|()| planes.next().unwrap_or(&mut []))
}

/// The gradients of both images.
fn gradients(region: &[u32], width: usize, height: usize) -> [Gradients<'_>; 2] {
    let mut planes = bytemuck::cast_slice::<u32, u8>(region).chunks_exact((width * height).max(1));
    [(); 2].map(|()| Gradients {
        du: planes.next().unwrap_or(&[]),
        dv: planes.next().unwrap_or(&[]),
        width,
        height,
    })
}
