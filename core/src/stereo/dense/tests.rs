//! The twin of dense matching: one pixel and one candidate at a time.

use super::{eight::MATCH_TEXTURE, *};
use crate::{
    parallel::Vectors,
    random::Random,
    sad::{compare, distance},
    stereo::prior::STEEP,
};
use std::{vec, vec::Vec};

/// An image pair's gradients, planes and grid priors, without any sense but with everything that
/// may happen.
struct Scene {
    config: StereoConfig,
    width: usize,
    height: usize,
    /// Left horizontal and vertical, right horizontal and vertical.
    gradients: [Vec<u8>; 4],
    planes: [Vec<i16>; 2],
    cells: [Vec<DisparitySet>; 2],
}

impl Scene {
    fn random(random: &mut Random, width: usize, config: StereoConfig) -> Self {
        let height = 2 * MARGIN + 5;
        // Few values, so that distances are often equal, and stretches without texture.
        let mut gradients = || {
            (0..width * height)
                .map(|i| if i % width < 9 { 128 } else { 110 + 12 * random.below(4) as u8 })
                .collect()
        };
        let gradients = [(); 4].map(|()| gradients());
        let mut planes = || {
            let mut plane = NO_PLANE;
            let mut next = |random: &mut Random| {
                if random.below(5) == 0 {
                    let disparity =
                        [random.below(60), u32::from(config.disparity_max - 8) + random.below(9)]
                            [usize::from(random.below(4) == 0)];
                    plane = if random.below(6) == 0 {
                        NO_PLANE
                    } else {
                        disparity as i16 + [0, STEEP][random.below(2) as usize]
                    };
                }
                plane
            };
            (0..width * height).map(|_| next(random)).collect()
        };
        let planes = [planes(), planes()];
        let cells = prior_cells(width, &config) * prior_cells(height, &config);
        let most = u64::from(config.disparity_max);
        let mut sets = || {
            let set = |random: &mut Random| {
                (0..random.below(20)).fold([0; 4], |mut set: DisparitySet, _| {
                    let d = u64::from(random.below(most as u32 + 1));
                    set[(d / 64) as usize] |= 1 << (d % 64);
                    set
                })
            };
            (0..cells).map(|_| set(random)).collect()
        };
        let cells = [sets(), sets()];
        Self { config, width, height, gradients, planes, cells }
    }

    fn matching(&self, step: usize) -> DenseMatching<'_> {
        let [left_du, left_dv, right_du, right_dv] = &self.gradients;
        let gradients = |du, dv| Gradients { du, dv, width: self.width, height: self.height };
        DenseMatching {
            config: &self.config,
            rows: MatchedRows { step, count: self.height / step },
            gradients: [gradients(left_du, left_dv), gradients(right_du, right_dv)],
            cells: self
                .cells
                .each_ref()
                .map(|cells| CellGrid { cells, columns: prior_cells(self.width, &self.config) }),
            cost: PlaneCost::new(&self.config),
        }
    }

    /// Rows of an image that are matched if that many are one step.
    fn rows(&self, image: &[i16], step: usize) -> Vec<i16> {
        image.chunks(self.width).skip(step - 1).step_by(step).flatten().copied().collect()
    }

    /// The disparities and the counts that a level of vector instructions gives.
    fn matched(&self, vectors: Vectors, step: usize) -> (Vec<i16>, [u32; 2]) {
        let [mut left, mut right] = self.planes.each_ref().map(|planes| self.rows(planes, step));
        let mut scratch = vec![Descriptor([0; 16]); 2 * self.width];
        let mut band = DenseBand {
            first: 0,
            left: &mut left,
            right: &mut right,
            scratch: &mut scratch,
            counts: [0; 2],
        };
        compare(vectors, MatchBand { matching: &self.matching(step), band: &mut band });
        let counts = band.counts;
        (left, counts)
    }

    /// The twin.
    fn plain(&self) -> (Vec<i16>, [u32; 2]) {
        let matching = self.matching(1);
        let (mut disparities, mut counts) = (vec![NONE; self.width * self.height], [0; 2]);
        let mut rows = [(); 2].map(|()| vec![Descriptor([0; 16]); self.width]);
        for v in MARGIN..self.height - MARGIN {
            for (gradients, row) in matching.gradients.iter().zip(&mut rows) {
                // All rows within the margin have descriptors.
                assert!(gradients.describe_row(v, row));
            }
            let best = |left: bool, u: usize| {
                self.best(
                    &matching,
                    [&rows[usize::from(!left)], &rows[usize::from(left)]],
                    left,
                    u,
                    v,
                )
            };
            for u in 0..self.width {
                let Some(d) = best(true, u) else { continue };
                counts[0] += 1;
                // Back from the right image, to about the same disparity.
                if best(false, u - d).is_some_and(|back| {
                    back.abs_diff(d) <= usize::from(self.config.consistency_threshold)
                }) {
                    let fraction = if self.config.subpixel {
                        self.fraction(&rows[0], &rows[1], u, d)
                    } else {
                        0
                    };
                    disparities[v * self.width + u] = d as i16 * WORKING_ONE_PX + fraction;
                } else {
                    counts[1] += 1;
                }
            }
        }
        (disparities, counts)
    }

    /// The disparity of least energy of a pixel; of equal ones the smallest.
    fn best(
        &self,
        matching: &DenseMatching<'_>,
        [here, other]: [&[Descriptor]; 2],
        left: bool,
        u: usize,
        v: usize,
    ) -> Option<usize> {
        let side = usize::from(!left);
        let plane = self.planes[side][v * self.width + u];
        let inside = (MARGIN..self.width - MARGIN).contains(&u);
        if plane == NO_PLANE
            || !inside
            || distance(&here[u], &Descriptor::UNTEXTURED) < MATCH_TEXTURE
        {
            return None;
        }
        let cost = &matching.cost;
        let size = self.config.grid_size;
        let set = self.cells[side][v / size * prior_cells(self.width, &self.config) + u / size];
        let costs = if plane >= STEEP { &cost.about_steep } else { &cost.about_plane };
        let reach = if left { u - MARGIN } else { self.width - MARGIN - 1 - u }
            .min(usize::from(self.config.disparity_max));
        let energy = |d: usize| {
            let off = d as i32 - i32::from(plane & 255) + cost.radius as i32;
            let near = (0..=2 * cost.radius as i32).contains(&off).then(|| costs[off as usize]);
            let listed = (set[d / 64] >> (d % 64) & 1 == 1).then_some(cost.elsewhere);
            // The left image's point lies further left in the right image.
            let column = if left { u - d } else { u + d };
            // Near the plane or in the cell's list, at the lower cost; else no candidate.
            [near, listed]
                .into_iter()
                .flatten()
                .min()
                .map(|cost| 16 * distance(&here[u], &other[column]) + cost)
        };
        (0..=reach).filter_map(|d| energy(d).map(|energy| (energy, d))).min().map(|(_, d)| d)
    }

    fn fraction(&self, left: &[Descriptor], right: &[Descriptor], u: usize, d: usize) -> i16 {
        if d == 0 || d >= (u - MARGIN).min(usize::from(self.config.disparity_max)) {
            return 0;
        }
        let [before, here, after] =
            [d - 1, d, d + 1].map(|d| distance(&left[u], &right[u - d]) as i32);
        let rise = before.max(after) - here;
        if before.min(after) < here || rise == 0 {
            0
        } else {
            (31 * (before - after) / rise) as i16
        }
    }
}

fn prior_cells(length: usize, config: &StereoConfig) -> usize {
    crate::stereo::prior::cells(length, config.grid_size)
}

#[test]
fn every_vector_level_equals_one_pixel_at_a_time() {
    let mut random = Random::new(12);
    let preset = StereoConfig { disparity_max: 70, ..StereoConfig::robotics() };
    let configs = [
        preset,
        StereoConfig { grid_size: 11, subpixel: false, ..preset },
        StereoConfig {
            plane_radius_sigmas: 6.0,
            disparity_max: 255,
            consistency_threshold: 0,
            ..preset
        },
    ];
    // The least width, and such as are and are not multiples of the lanes.
    for (width, config) in [16, 61, 96, 130, 301, 330].into_iter().zip(configs.into_iter().cycle())
    {
        for _ in 0..4 {
            let scene = Scene::random(&mut random, width, config);
            let (plain, counts) = scene.plain();
            for vectors in Vectors::available() {
                let (matched, counted) = scene.matched(vectors, 1);
                assert!(matched == plain && counted == counts, "{} at {width} px", vectors.name());
                let (seconds, _) = scene.matched(vectors, 2);
                assert!(seconds == scene.rows(&plain, 2), "{} at {width} px", vectors.name());
            }
        }
    }
}

#[test]
fn cutting_off_a_quotients_fraction_divides_whole_numbers() {
    for rise in 1..=4_080 {
        for difference in [rise, rise - 1, 1 - rise, -rise, rise / 2, rise / 3] {
            assert_eq!(((31 * difference) as f32 / rise as f32) as i32, 31 * difference / rise);
        }
    }
}
