//! The depth image that is fused: from disparity, without what the matcher makes up, and with a
//! note at each pixel on how it is to be taken.
//!
//! *Edges.* The matcher widens what is near: beside its edge, what is behind gets its disparity.
//! Pixels nearer than something within `edge_reach_px`, by more than [`EDGE_Q8`], are left out.
//! What is left within [`EDGE_REACH_PX`](super::surroundings::EDGE_REACH_PX) of an edge, or of a
//! pixel without disparity, may still show the colour of what is behind, or of the sky.
//!
//! *Obliqueness.* A plane's disparity is linear in the pixel. With slopes `a`, `b` of the disparity
//! `d` and the pixel (x, y) from the principal point, the plane's normal is along
//! `(f a, f b, d - x a - y b)` and its product with the pixel's ray is `d`: so the cosine between
//! the two is `d / |normal|` times the length of a ray of depth 1, and distance along the normal is
//! distance along z times `d / |normal|`.
//!
//! Both are written into [`NotedDepth`]. Memory: none. Time: linear in pixels.

use super::{
    DistanceAlong, NotedDepth, VolumeConfig,
    noted_depth::LEVELS,
    surroundings::{BLOCK, EDGE_Q8, Surroundings},
};
use crate::{
    geometry::{
        DepthRange, StereoRig,
        scalar::{floored_i32, min_f32},
    },
    image::{View, ViewMut},
    parallel::{Bands, Executor, Work, each, zip2},
};

/// Distance to the pixels a slope is taken from, px.
const SLOPE_REACH: isize = 4;
/// Largest difference to them within a surface: 6 px.
const SLOPE_MOST_Q8: u16 = 4 * EDGE_Q8;
/// A disparity image about to become depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObservedDepth<'a> {
    pub config: &'a VolumeConfig,
    pub rig: &'a StereoRig,
    /// 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
}

impl ObservedDepth<'_> {
    /// Writes the depths with their notes; none where nothing is to be fused.
    pub fn write<E: Executor>(&self, depths: &mut ViewMut<'_, NotedDepth>, executor: &E) {
        let width = depths.width().max(1);
        let bands = Bands::new(depths.pixels_mut().len() / width);
        let jobs = zip2(bands.first(), bands.split_mut(depths.pixels_mut(), width));
        each(executor, jobs, |(first, depths)| {
            executor.vectors().run(WriteRows { observed: self, first, width, depths })
        });
    }

    #[inline(always)]
    fn write_block(&self, first: usize, v: usize, depths: &mut [NotedDepth]) {
        // `BLOCK` pixels of a row at a time, so that vectors are filled.
        let surroundings = Surroundings { disparity_q8: self.disparity_q8 };
        let here = surroundings.tap(first, v, [0, 0]);
        // Beyond the farthest depth fused as well: what is before it is free.
        let range = DepthRange::new(self.rig, self.config.near_m, f32::MAX);
        let mut within = [0.0; BLOCK];
        for (within, &disparity) in within.iter_mut().zip(&here) {
            *within = range.depth_m(disparity);
        }
        // In much of an image nothing is: sky, and what is too near.
        if within.iter().fold(0, |any, value| any | value.to_bits()) == 0 {
            depths.fill(NotedDepth::NONE);
            return;
        }
        let edge_reach_px = usize::from(self.config.edge_reach_px);
        let [behind, spoiling] = surroundings.farthest(first, v, edge_reach_px);
        // Not by `map` of an array, which compilers leave as a call for the baseline.
        let tap = |du, dv| surroundings.tap(first, v, [du, dv]);
        let levels = match self.config.distance {
            // Along the ray the cosine is 1, the highest level.
            DistanceAlong::Ray => [LEVELS as u16 - 1; BLOCK],
            DistanceAlong::Normal => {
                let along_u = slope(&here, &tap(SLOPE_REACH, 0), &tap(-SLOPE_REACH, 0));
                let along_v = slope(&here, &tap(0, SLOPE_REACH), &tap(0, -SLOPE_REACH));
                self.levels(first, v, &here, [&along_u, &along_v])
            }
        };
        let edges = behind.iter().zip(&spoiling);
        let notes = here.iter().zip(edges).zip(&levels);
        for ((depth, &within), ((&disparity, (&behind, &spoiling)), &level)) in
            depths.iter_mut().zip(&within).zip(notes)
        {
            // Nearer than something within reach: its colour may be mixed with that.
            let has_unreliable_colour = disparity > spoiling.saturating_add(EDGE_Q8);
            let noted = NotedDepth::new(within, level, has_unreliable_colour);
            *depth = if (within > 0.0) & (disparity <= behind.saturating_add(EDGE_Q8)) {
                noted
            } else {
                NotedDepth::NONE
            };
        }
    }

    /// Levels of obliqueness of a block with these slopes along columns and rows.
    #[inline(always)]
    fn levels(
        &self,
        first: usize,
        v: usize,
        here: &[u16; BLOCK],
        [along_u, along_v]: [&[f32; BLOCK]; 2],
    ) -> [u16; BLOCK] {
        let focal = self.rig.focal_px as f32;
        let y = (v as f64 - self.rig.center_v_px) as f32;
        let x_first = (first as f64 - self.rig.center_u_px) as f32;
        let mut squares = [0i16; BLOCK];
        let slopes = along_u.iter().zip(along_v);
        for (i, ((square, &disparity), (&a, &b))) in
            (0u16..).zip(squares.iter_mut().zip(here).zip(slopes))
        {
            let (d, x) = (f32::from(disparity) * (1.0 / 256.0), x_first + f32::from(i));
            // The normal of a plane whose disparity has these slopes.
            let (nu, nv, nz) = (focal * a, focal * b, d - x * a - y * b);
            // The square of the cosine is compared: a root has no vectors everywhere. Without a
            // disparity it may be any number.
            *square = fixed(d * d / (nu * nu + nv * nv + nz * nz));
        }
        let mut levels = [0; BLOCK];
        levels.iter_mut().zip(&squares).for_each(|(level, &square)| *level = level_of(square));
        levels
    }
}

/// A square of 1 in fixed point.
const SQUARE_ONE: f32 = 32_768.0;

/// Squares of what lies between two levels of obliqueness, in fixed point, where all of them are
/// whole numbers.
#[expect(clippy::indexing_slicing, reason = "the loop ends with the array")]
const BETWEEN_LEVELS: [i16; LEVELS as usize - 1] = {
    let mut squares = [0; LEVELS as usize - 1];
    let mut i = 0;
    while i < squares.len() {
        // (i + 1.5) / LEVELS, squared.
        let doubled = 2 * i as u32 + 3;
        squares[i] = (SQUARE_ONE as u32 / (2 * LEVELS).pow(2) * doubled.pow(2)) as i16;
        i += 1;
    }
    squares
};

/// A square in fixed point, rounded down, held at the most there is.
#[inline(always)]
fn fixed(square: f32) -> i16 {
    floored_i32(min_f32(square * SQUARE_ONE, f32::from(i16::MAX))) as i16
}

/// The level of obliqueness of a cosine's square in fixed point.
#[inline(always)]
fn level_of(square: i16) -> u16 {
    BETWEEN_LEVELS.iter().map(|&between| u16::from(square >= between)).sum()
}

/// One of four bands of rows, from `first` on.
struct WriteRows<'a> {
    observed: &'a ObservedDepth<'a>,
    first: usize,
    width: usize,
    depths: &'a mut [NotedDepth],
}

impl Work for WriteRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (v, row) in (self.first..).zip(self.depths.chunks_exact_mut(self.width.max(1))) {
            for (block, depths) in row.chunks_mut(BLOCK).enumerate() {
                self.observed.write_block(block * BLOCK, v, depths);
            }
        }
    }
}

/// Slopes, px per px, from those of the two neighbours that lie on the same surface.
#[inline(always)]
fn slope(here: &[u16; BLOCK], after: &[u16; BLOCK], before: &[u16; BLOCK]) -> [f32; BLOCK] {
    const HALF: f32 = 0.5 / (SLOPE_REACH as f32 * 256.0);
    let mut slopes = [0.0; BLOCK];
    for (slope, ((&here, &after), &before)) in
        slopes.iter_mut().zip(here.iter().zip(after).zip(before))
    {
        // A neighbour across an edge tells nothing of this surface.
        let has_after = (after > 0) & (after.abs_diff(here) < SLOPE_MOST_Q8);
        let has_before = (before > 0) & (before.abs_diff(here) < SLOPE_MOST_Q8);
        // Differences so small have 16 bits with their signs.
        let (rise, fall) = (after.wrapping_sub(here) as i16, here.wrapping_sub(before) as i16);
        let sum = if has_after { rise } else { 0 } + if has_before { fall } else { 0 };
        // Of two neighbours the mean, of one its own slope, of none 0.
        *slope = f32::from(sum) * if has_after & has_before { HALF } else { 2.0 * HALF };
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Serial;
    use std::vec::Vec;

    const RIG: StereoRig =
        StereoRig { focal_px: 200.0, center_u_px: 150.0, center_v_px: 40.0, baseline_m: 0.5 };
    const SIZE: [usize; 2] = [300, 80];

    fn observed(
        config: &VolumeConfig,
        disparity_q8: impl Fn(usize, usize) -> u16,
    ) -> Vec<NotedDepth> {
        let [width, height] = SIZE;
        let pixels: Vec<u16> =
            (0..width * height).map(|at| disparity_q8(at % width, at / width)).collect();
        let mut depths = std::vec![NotedDepth::new(1.0, 0, true); width * height];
        let observed = ObservedDepth {
            config,
            rig: &RIG,
            disparity_q8: View::new(&pixels, width, height).unwrap(),
        };
        observed.write(&mut ViewMut::new(&mut depths, width, height).unwrap(), &Serial);
        depths
    }

    #[test]
    fn a_road_is_seen_obliquely_and_a_wall_is_not() {
        let config = VolumeConfig::default();
        // A road 1.5 m below the camera: d = f B / z and z = 1.5 f / y, so d = B y / 1.5.
        let road =
            observed(&config, |_, v| (256.0 * 0.5 * (v as f64 - RIG.center_v_px) / 1.5) as u16);
        let wall = observed(&config, |_, _| 10 * 256);
        for (u, v) in [(5, 70), (150, 60), (290, 72)] {
            let noted = road[v * SIZE[0] + u];
            let depth_m = f64::from(noted.m());
            let exact = 1.5 / depth_m;
            // The normal is (0, 1, 0): distance along z times the product with the ray of depth 1
            // is the camera's height over depth.
            assert!(
                (f64::from(noted.obliqueness()) - exact).abs() < 1.0 / 16.0,
                "{u} {v}: {depth_m} m, {exact}"
            );
            assert!((depth_m - 1.5 * RIG.focal_px / (v as f64 - RIG.center_v_px)).abs() < 0.1);
            let at_wall = wall[v * SIZE[0] + u];
            assert!(
                (at_wall.m() - 10.0).abs() < 1e-3
                    && at_wall.obliqueness() == 1.0
                    && !at_wall.has_unreliable_colour()
            );
        }
        let along_z = observed(&VolumeConfig { distance: DistanceAlong::Ray, ..config }, |_, v| {
            256 * (2 + v as u16 / 4)
        });
        assert!(
            along_z.iter().all(|&depth| depth.obliqueness() == 1.0 || depth == NotedDepth::NONE)
        );
    }

    #[test]
    fn levels_in_fixed_point_are_those_of_floats() {
        let plain = |square: f32| {
            (0..LEVELS - 1)
                .filter(|&i| square >= ((i as f32 + 1.5) / LEVELS as f32).powi(2))
                .count()
        };
        let borders = (0..LEVELS - 1).map(|i| ((i as f32 + 1.5) / LEVELS as f32).powi(2));
        let beside = borders.flat_map(|border| [border.next_down(), border, border.next_up()]);
        for square in beside.chain((0..=4_000).map(|i| i as f32 / 3_217.0)) {
            assert_eq!(usize::from(level_of(fixed(square))), plain(square), "{square}");
        }
    }

    #[test]
    fn what_is_too_far_to_be_fused_keeps_its_depth() {
        let config = VolumeConfig::default();
        let too_far = observed(&config, |_, _| 256);
        assert!(too_far.iter().all(|depth| (depth.m() - 100.0).abs() < 1e-3));
        let too_near = observed(&config, |_, _| u16::MAX);
        assert!(too_near.iter().all(|depth| *depth == NotedDepth::NONE));
    }

    #[test]
    fn a_near_rim_is_left_out_and_colour_at_an_edge_is_doubtful() {
        // Near from column 100 on, far before; nothing from column 200 on.
        let disparity = |u: usize, _: usize| [10 * 256, 20 * 256, 0][u / 100];
        let depth_m =
            observed(&VolumeConfig { edge_reach_px: 2, ..VolumeConfig::default() }, disparity);
        let row = &depth_m[SIZE[0] * 30..][..SIZE[0]];
        let fused: Vec<usize> = (95..105).filter(|&u| row[u].m() > 0.0).collect();
        assert_eq!(
            fused,
            [95, 96, 97, 98, 99, 102, 103, 104],
            "two pixels of the near side are the matcher's"
        );
        let spoiled: Vec<usize> =
            (0..SIZE[0]).filter(|&u| row[u].m() > 0.0 && row[u].has_unreliable_colour()).collect();
        assert_eq!(spoiled, [0, 1, 2, 102, 197, 198, 199], "three px beside an edge or nothing");
        let all =
            observed(&VolumeConfig { edge_reach_px: 0, ..VolumeConfig::default() }, disparity);
        assert!(all[..200].iter().all(|depth| depth.m() > 0.0 && !depth.has_unreliable_colour()));
    }
}
