//! The steps from a pair's gradients to its disparities, each on the matcher's buffers.

use super::{ROWS, StereoMatcher};
use crate::{
    image::{DISPARITY_ONE_PX, DisparityQ8, InvalidPair, View},
    parallel::{BANDS, Bands, Executor, each, zip2, zip3},
    sad::compare,
    slices::{clipped, clipped_mut},
    stereo::{
        GapEnds, StereoConfig, StereoReport,
        confidence::MeasureConfidence,
        config::{CANDIDATE_STEP, DISPARITY_LIMIT},
        delaunay::{SupportPoint, Triangulation},
        dense::{DenseBand, DenseMatching, FILLED, MatchBand, NONE, WORKING_ONE_PX},
        descriptor::Gradients,
        filter_support::FilterSupport,
        gaps::{FillColumns, FillRows, Filling},
        gradient::GradientRows,
        invalid, median, prior,
        prior::{CellGrid, DisparitySet, PlaneCost, RasterisePlanes},
        rows::MatchedRows,
        smooth::{Along, Smooth},
        speckle::{Blanked, RemoveSpeckles, Scratch},
        spread::SpreadRows,
        support,
        support::{MatchRows, NO_MATCH, SupportMatching},
    },
};

/// Slope from which on a triangle bridges two surfaces, px of disparity per px: its plane is
/// searched but not preferred. Without a limit 4.8 instead of 4.5 % are off on KITTI 2012.
const MAX_PLANE_SLOPE: f32 = 0.7;
/// Difference from which on the ends of a gap are two surfaces, px, as published.
const GAP_DISCONTINUITY: u16 = 3;

impl StereoMatcher<'_> {
    pub(super) fn find_gradients<E: Executor>(
        &mut self,
        left: View<'_, u8>,
        right: View<'_, u8>,
        invalid: Option<&InvalidPair<'_>>,
        executor: &E,
    ) {
        let (width, bands) = (self.width, Bands::new(self.height));
        let [left_du, left_dv, right_du, right_dv] =
            split_planes(self.gradients, width * self.height);
        let [left_invalid, right_invalid] =
            [invalid.map(|pair| &pair.left), invalid.and_then(|pair| pair.right.as_ref())];
        for (image, invalid, du, dv) in
            [(left, left_invalid, left_du, left_dv), (right, right_invalid, right_du, right_dv)]
        {
            let jobs = zip3(bands.first(), bands.split_mut(du, width), bands.split_mut(dv, width));
            each(executor, jobs, |(first, du, dv)| {
                executor.vectors().run(GradientRows { image, first, du, dv })
            });
            // Invalid pixels get the gradient of an even surface: the border of a mask is not
            // texture.
            if let Some(invalid) = invalid {
                invalid::flatten(invalid, width, du);
                invalid::flatten(invalid, width, dv);
            }
        }
    }

    pub(super) fn match_support<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        let [left, right] = gradients(self.gradients, self.width, self.height);
        let (columns, rows) = (
            support::candidates(self.width, CANDIDATE_STEP),
            support::candidates(self.height, CANDIDATE_STEP),
        );
        let bands = Bands::new(rows);
        let matching = SupportMatching { config, left, right, lattice: self.lattice };
        // Bands run at the same time, each with its own rows of descriptors.
        let jobs = zip3(
            bands.first(),
            bands.split_mut(self.support, columns),
            Bands::new(BANDS).split_mut(self.rows, ROWS * self.width),
        );
        each(executor, jobs, |(first, grid, scratch)| {
            compare(executor.vectors(), MatchRows { matching, first, grid, scratch })
        });
        let grid = clipped(self.support, ..columns * rows);
        report.candidates = self.lattice.count([columns, rows]) as u32;
        report.support_matches = grid.iter().filter(|&&d| d != NO_MATCH).count() as u32;
    }

    pub(super) fn filter_support_points<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        let step = CANDIDATE_STEP;
        let (columns, rows) =
            (support::candidates(self.width, step), support::candidates(self.height, step));
        let Some(grid) = self.support.get_mut(..columns * rows) else { return };
        // The last candidates have no window: points there are at the image's rim.
        let rim = [self.width - 1, self.height - 1];
        let beyond_px = [rim[0] - (columns - 1) * step, rim[1] - (rows - 1) * step];
        let filter =
            FilterSupport { config, grid, columns, beyond_px, scratch: self.support_scratch };
        [report.implausible, report.rim_points, report.redundant] = executor.vectors().run(filter);
        // Rows from the top: the triangulation takes its points in scan order.
        self.left_mesh.clear();
        self.right_mesh.clear();
        for (j, row) in grid.chunks_exact(columns.max(1)).enumerate() {
            for (i, &disparity) in row.iter().enumerate().filter(|(_, d)| **d != NO_MATCH) {
                let u = if i + 1 == columns { rim[0] } else { i * step } as u16;
                let v = if j + 1 == rows { rim[1] } else { j * step } as u16;
                let disparity = disparity as u16;
                self.left_mesh.add(SupportPoint { u, v, disparity });
                // Nearer than the right image shows it, a surface is the left image's only.
                if let Some(u) = u.checked_sub(disparity) {
                    report.occluded_right +=
                        u32::from(self.right_mesh.add(SupportPoint { u, v, disparity }));
                }
            }
        }
        report.support_points = self.left_mesh.points().len() as u32;
    }

    pub(super) fn triangulate<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        let columns = prior::cells(self.width, config.grid_size);
        let cells = columns * prior::cells(self.height, config.grid_size);
        let prepare = |mesh: &mut Triangulation<'_>, sets: &mut [DisparitySet]| {
            mesh.triangulate();
            prior::mark_cells(config, mesh.points(), columns, clipped_mut(sets, ..cells));
        };
        // The two meshes share nothing: one thread each.
        executor.join(
            || prepare(&mut self.left_mesh, self.left_cells),
            || prepare(&mut self.right_mesh, self.right_cells),
        );
        report.triangles_left = self.left_mesh.triangle_count() as u32;
        report.triangles_right = self.right_mesh.triangle_count() as u32;
    }

    /// Rows of the pair that are matched densely.
    pub(super) fn matched(&self) -> MatchedRows {
        MatchedRows::every(usize::from(self.row_step), self.height)
    }

    pub(super) fn match_densely<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        let (width, rows) = (self.width, self.matched());
        let bands = Bands::new(rows.count);
        let columns = prior::cells(width, config.grid_size);
        let matching = DenseMatching {
            config,
            rows,
            gradients: gradients(self.gradients, width, self.height),
            cells: [
                CellGrid { cells: self.left_cells, columns },
                CellGrid { cells: self.right_cells, columns },
            ],
            cost: PlaneCost::new(config),
        };
        // Left and right image are matched band by band, each with its own scratch.
        let disparity: &mut [i16] = bytemuck::cast_slice_mut(self.disparity);
        let images = zip3(
            bands.first(),
            bands.split_mut(disparity, width),
            bands.split_mut(self.other, width),
        );
        let scratch = Bands::new(BANDS).split_mut(self.rows, ROWS * width);
        let mut jobs = [(); BANDS].map(|()| None);
        for ((job, (first, left, right)), scratch) in jobs.iter_mut().zip(images).zip(scratch) {
            *job = Some(DenseBand { first, left, right, scratch, counts: [0; 2] });
        }
        let (left_mesh, right_mesh) = (&self.left_mesh, &self.right_mesh);
        // A band draws its planes first and matches along them.
        each(executor, jobs.each_mut(), |band| {
            if let Some(band) = band {
                for (mesh, out) in [(left_mesh, &mut *band.left), (right_mesh, &mut *band.right)] {
                    executor.vectors().run(RasterisePlanes {
                        mesh,
                        slope_max: MAX_PLANE_SLOPE,
                        rows,
                        first: band.first,
                        width,
                        out,
                    });
                }
                compare(executor.vectors(), MatchBand { matching: &matching, band });
            }
        });
        // Sums over bands in a fixed order: threads cannot reach them.
        for [matched, inconsistent] in jobs.iter().flatten().map(|band| band.counts) {
            report.matched += matched;
            report.inconsistent += inconsistent;
        }
    }

    pub(super) fn remove_speckles<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        let rows = self.matched();
        // Sizes are of whole images: every second row has half of a segment's pixels.
        let smallest = config.speckle_size.div_ceil((rows.step as u32).max(1));
        report.speckles = self.remove_segments(config, smallest, executor).measured;
        // The second pass removes larger islands. Gaps within a surface are filled first, so that a
        // surface with holes is one segment.
        let lone_size = (config.lone_share * (self.width * rows.count) as f32) as u32;
        if lone_size > 1 {
            let filling = Filling {
                width: config.lone_gap.min(config.gap_width),
                discontinuity: working(config.speckle_similarity) as u16 + 1,
                ends: GapEnds::Surface,
                rows,
            };
            report.filled = self.fill(filling, executor);
            let blanked = self.remove_segments(config, lone_size, executor);
            report.speckles += blanked.measured;
            // A pixel that was filled and then removed does not count as filled.
            report.filled -= blanked.filled;
        }
    }

    pub(super) fn fill_gaps<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        let filling = Filling {
            width: config.gap_width,
            discontinuity: working(GAP_DISCONTINUITY) as u16,
            ends: config.gap_ends,
            rows: self.matched(),
        };
        report.filled += self.fill(filling, executor);
    }

    /// Removes segments of fewer than `smallest` pixels.
    fn remove_segments<E: Executor>(
        &mut self,
        config: &StereoConfig,
        smallest: u32,
        executor: &E,
    ) -> Blanked {
        let rows = self.matched();
        // The gradients and the right image's disparities are done with: their memory holds the
        // runs.
        let scratch = Scratch {
            runs: bytemuck::cast_slice_mut(self.gradients),
            ends: bytemuck::cast_slice_mut(self.other),
            flags: bytemuck::cast_slice_mut(self.columns),
        };
        let disparity = image_of(self.disparity, self.width * rows.count);
        let similarity = rows.widened(working(config.speckle_similarity));
        executor.vectors().run(RemoveSpeckles {
            disparity,
            width: self.width,
            similarity,
            smallest,
            scratch,
        })
    }

    /// Fills gaps along rows, then along columns; returns the pixels filled.
    fn fill<E: Executor>(&mut self, filling: Filling, executor: &E) -> u32 {
        let (width, rows, vectors) = (self.width, filling.rows.count, executor.vectors());
        let image = image_of(self.disparity, width * rows);
        // Buffers that other steps use as well, cut to what the bands need.
        let edges = Bands::new(BANDS).split_mut(bytemuck::cast_slice_mut(self.columns), width);
        let bands = zip2(Bands::new(rows).split_mut(image, width), edges);
        let along_rows = each(executor, bands, |(rows, edges)| {
            vectors.run(FillRows { rows, width, filling, edges })
        });
        // Columns are filled in one band: each needs the whole image's height.
        let (ends, last_row) = bytemuck::cast_slice_mut::<u32, u16>(self.columns)
            .split_at_mut_checked(width)
            .unwrap_or_default();
        let ends = bytemuck::cast_slice_mut(ends);
        along_rows.iter().sum::<u32>()
            + vectors.run(FillColumns { image, width, filling, last_row, ends })
    }

    /// Puts the matched rows where they belong, and others between them.
    pub(super) fn spread_rows<E: Executor>(&mut self, executor: &E) {
        let rows = self.matched();
        let image = image_of(self.disparity, self.width * self.height);
        executor.vectors().run(SpreadRows { image, width: self.width, rows });
    }

    pub(super) fn smooth<E: Executor>(&mut self, config: &StereoConfig, executor: &E) {
        let (width, pixels, bands) =
            (self.width, self.width * self.height, Bands::new(self.height));
        let image = image_of(self.disparity, pixels);
        let other = clipped_mut(self.other, ..pixels);
        let smooth = |from: &[i16], along, to: &mut [i16]| {
            let rows = zip2(bands.first(), bands.split_mut(to, width));
            each(executor, rows, |(first, to)| {
                executor.vectors().run(Smooth { from, width, along, first, to })
            });
        };
        // Rows go to the other buffer and columns come back, so that the result ends where it
        // began.
        for _ in 0..config.adaptive_mean {
            smooth(image, Along::Rows, other);
            smooth(other, Along::Columns, image);
        }
        if config.median {
            // The median needs neighbours that have not changed yet.
            other.iter_mut().zip(&*image).for_each(|(to, from)| *to = *from);
            let rows = zip2(bands.first(), bands.split_mut(image, width));
            each(executor, rows, |(first, to)| median::median(other, width, first, to));
        }
    }

    /// Turns working units into the result's.
    pub(super) fn finish(&mut self, invalid: Option<&InvalidPair<'_>>, report: &mut StereoReport) {
        let disparities = clipped_mut(self.disparity, ..self.width * self.height);
        for disparity in disparities.iter_mut() {
            let working = *disparity as i16;
            // Smoothed values stay between those they come from: 0..=255 px.
            let (px, filled) = if working == NONE {
                (0, false)
            } else {
                (working & !FILLED, working & FILLED != 0)
            };
            let value = DisparityQ8::new(px as u16 * (DISPARITY_ONE_PX / WORKING_ONE_PX as u16));
            *disparity = if filled { value.filled() } else { value }.get();
        }
        // Gap filling and smoothing may have reached into invalid pixels.
        if let Some(invalid) = invalid {
            invalid::remove(invalid, self.width, disparities);
        }
        report.valid = disparities.iter().filter(|disparity| **disparity != 0).count() as u32;
    }

    /// Measures confidences, if the settings ask for them, and removes what has too little.
    pub(super) fn measure_confidence<E: Executor>(
        &mut self,
        config: &StereoConfig,
        executor: &E,
        report: &mut StereoReport,
    ) {
        self.has_confidence = config.min_confidence > 0;
        if !self.has_confidence {
            return;
        }
        let (width, pixels, bands) =
            (self.width, self.width * self.height, Bands::new(self.height));
        let disparity_q8 = clipped_mut(self.disparity, ..pixels);
        // The gradients are done with.
        let confidence = clipped_mut(bytemuck::cast_slice_mut(self.gradients), ..pixels);
        let counts = Bands::new(BANDS).split_mut(bytemuck::cast_slice_mut(self.columns), width);
        let rows = zip3(bands.first(), bands.split_mut(confidence, width), counts);
        each(executor, rows, |(first, out, counts)| {
            let disparity_q8 = &*disparity_q8;
            executor.vectors().run(MeasureConfidence { disparity_q8, width, first, counts, out })
        });
        // Only now: a pixel counts for its neighbours whether it is kept or not.
        for (disparity, confidence) in disparity_q8.iter_mut().zip(confidence) {
            let goes = (*disparity != 0) & (*confidence < config.min_confidence);
            report.doubtful += u32::from(goes);
            (*disparity, *confidence) = if goes { (0, 0) } else { (*disparity, *confidence) };
        }
        report.valid -= report.doubtful;
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

/// The gradient region as four images: horizontal and vertical gradient of the left image, then of
/// the right one.
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
