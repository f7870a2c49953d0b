//! Eight neighbours of a row matched at a time: one disparity after the other, for all of them.
//!
//! Neighbours share their cell's list of disparities; about its own plane each has disparities of its own, which are as many for all. A
//! candidate's key has the energy above and the disparity below, so that the least key is the least energy and, of equal ones, the smallest
//! disparity. Borders, where not all eight can have the same candidates, go another and slower way.

use super::load;
use crate::{
    part::{part, store},
    sad::{Eight, KEY_SCALE_BITS, Kernels, LANES},
    stereo::{
        StereoConfig,
        config::DISPARITY_LIMIT,
        descriptor::{Descriptor, MARGIN, UNTEXTURED, eight},
        prior::{NO_PLANE, PLANE_WIDTH, PlaneCost, STEEP},
    },
};

/// Set in a key that does not count: above every key, and still a positive `i32`.
const BARRED: u32 = 1 << 30;
/// No plane: as wide as keys are.
const NOTHING: i32 = NO_PLANE as i32;

/// A row to be matched, of the left or of the right image.
pub(super) struct Row<'a, const LEFT: bool> {
    here: &'a [Descriptor],
    other: &'a [Descriptor],
    cost: &'a PlaneCost,
    least_texture: u32,
    most: i32,
    spare: [Eight<Descriptor>; 2],
}

/// What the eight pixels at hand may match.
struct Candidates {
    /// A copy, so that compilers keep it in registers.
    points: Eight<Descriptor>,
    /// Column of the first pixel.
    u: usize,
    /// Greatest disparity of each pixel: beyond it the other row has no descriptors.
    reach: Eight<i32>,
    /// Least and greatest of those.
    reach_min: i32,
    reach_max: i32,
}

impl<'a, const LEFT: bool> Row<'a, LEFT> {
    #[inline(always)]
    pub fn new(config: &StereoConfig, cost: &'a PlaneCost, here: &'a [Descriptor], other: &'a [Descriptor]) -> Self {
        Self {
            here,
            other,
            cost,
            least_texture: u32::from(config.match_texture),
            most: i32::from(config.disparity_max),
            spare: [UNTEXTURED; 2],
        }
    }

    /// Replaces the planes of a row's pixels `u..`, eight or `count`, by disparities in px, or [`NO_PLANE`] where no plane lies, the image is
    /// without texture or no disparity can be.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below eight")]
    pub fn match_eight(&mut self, u: usize, count: usize, listed: &[u32], row: &mut [i16], kernels: &impl Kernels) {
        let [spare, spare_other] = &mut self.spare;
        let points = *eight(self.here, u, spare);
        let texture = kernels.sums(&points, &UNTEXTURED);
        let mut planes = load(row, u);
        let count = count.min(LANES) as i32;
        let mut own = [NOTHING; LANES];
        for lane in 0..LANES {
            let is_matched = (texture[lane] >= self.least_texture) & ((lane as i32) < count);
            own[lane] = if is_matched { i32::from(planes[lane]) } else { NOTHING };
        }
        let mut best = [BARRED; LANES];
        if own != [NOTHING; LANES] {
            let columns = self.here.len() as i32;
            let mut reach = [0; LANES];
            for (reach, at) in reach.iter_mut().zip(u as i32..) {
                let columns = if LEFT { at - MARGIN as i32 } else { columns - MARGIN as i32 - 1 - at };
                *reach = if columns < self.most { columns } else { self.most };
            }
            let (reach_min, reach_max) = if LEFT { (reach[0], reach[LANES - 1]) } else { (reach[LANES - 1], reach[0]) };
            let candidates = Candidates { points, u, reach, reach_min, reach_max };
            best = candidates.least_keys::<LEFT>(self.other, self.cost, listed, own, spare_other, kernels);
        }
        for lane in 0..LANES {
            let is_found = (own[lane] != NOTHING) & (best[lane] < BARRED);
            let disparity = if is_found { (best[lane] & 255) as i16 } else { NO_PLANE };
            // Beyond them are planes of the next cell.
            planes[lane] = if (lane as i32) < count { disparity } else { planes[lane] };
        }
        store(row, u, planes);
    }
}

impl Candidates {
    /// The least key of each pixel, [`BARRED`] where it has none.
    #[inline(always)]
    fn least_keys<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        listed: &[u32],
        planes: Eight<i32>,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) -> Eight<u32> {
        let best = self.consider::<LEFT>(other, listed, spare, kernels);
        match self.least_about_planes::<LEFT>(other, cost, planes, kernels) {
            Some(keys) => lesser(best, keys),
            None => self.consider_planes::<LEFT>(other, cost, planes, best, spare, kernels),
        }
    }

    /// The least keys about each pixel's own plane; `None` where some are at a border, or a pixel's least or greatest disparity.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below eight, steps below the width of a table")]
    fn least_about_planes<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        planes: Eight<i32>,
        kernels: &impl Kernels,
    ) -> Option<Eight<u32>> {
        let radius = cost.radius as i32;
        let (mut firsts, mut steep) = ([0; LANES], [0; LANES]);
        let mut outside = false;
        for lane in 0..LANES {
            // Any will do for pixels that have no plane.
            let mean = if planes[lane] == NOTHING { radius } else { planes[lane] & 255 };
            firsts[lane] = mean - radius;
            steep[lane] = if planes[lane] >= i32::from(STEEP) { u32::MAX } else { 0 };
            outside |= (mean < radius) | (mean + radius > self.reach[lane]);
        }
        if outside {
            return None;
        }
        let last = 2 * cost.radius;
        let mut rows = [&[Descriptor::UNTEXTURED; PLANE_WIDTH]; LANES];
        for lane in 0..LANES {
            let first = firsts[lane] as usize;
            let start = if LEFT { (self.u + lane).wrapping_sub(first + last) } else { self.u + lane + first };
            rows[lane] = other.get(start..)?.first_chunk()?;
        }
        // What a candidate's distance is added to; about a steep plane, which is not preferred, all cost the same.
        let lowered = |mut best: Eight<u32>, sums: Eight<u32>, step: usize, about: u32| {
            let d = if LEFT { last - step } else { step } as u32;
            let more = (cost.elsewhere - about) << 8;
            for lane in 0..LANES {
                let key = (sums[lane] << KEY_SCALE_BITS) + (about << 8) + d + firsts[lane] as u32 + (steep[lane] & more);
                best[lane] = if key < best[lane] { key } else { best[lane] };
            }
            best
        };
        let mut best = [BARRED; LANES];
        // Their number is odd: two by two, and the last one.
        for (i, &[about, about_next]) in cost.about_plane.as_chunks().0.iter().enumerate() {
            let step = 2 * i;
            if step >= last {
                break;
            }
            let mut twos = [&[Descriptor::UNTEXTURED; 2]; LANES];
            for lane in 0..LANES {
                twos[lane] = rows[lane].get(step..)?.first_chunk()?;
            }
            let [one, two] = kernels.sums_of_two(&self.points, twos);
            best = lowered(lowered(best, one, step, about), two, step + 1, about_next);
        }
        let mut lasts = [&Descriptor::UNTEXTURED; LANES];
        for lane in 0..LANES {
            lasts[lane] = rows[lane].get(last)?;
        }
        Some(lowered(best, kernels.sums_of(&self.points, lasts), last, *cost.about_plane.get(last)?))
    }

    /// The lesser of keys and of those about each pixel's own plane, wherever they are.
    #[cold]
    #[inline(never)]
    fn consider_planes<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        planes: Eight<i32>,
        mut best: Eight<u32>,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) -> Eight<u32> {
        let mut start = 0;
        while let Some(&plane) = planes.get(start) {
            let run = planes.iter().skip(start).take_while(|other| **other == plane).count();
            if plane != NOTHING {
                let first = (plane & 255) - cost.radius as i32;
                let costs = if plane >= i32::from(STEEP) { &cost.about_steep } else { &cost.about_plane };
                let costs = part(costs, ..2 * cost.radius + 1);
                let outside = usize::try_from(-first).unwrap_or_default();
                // A key holds no greater disparity.
                let within = first.max(0) as u32..=u32::from(DISPARITY_LIMIT);
                let mut bases = [0; PLANE_WIDTH];
                let mut count = 0;
                for ((base, d), &cost) in bases.iter_mut().zip(within).zip(part(costs, outside..)) {
                    *base = (cost << 8) + d;
                    count += 1;
                }
                let keys = self.consider::<LEFT>(other, part(&bases, ..count), spare, kernels);
                best.iter_mut().zip(keys).skip(start).take(run).for_each(|(best, key)| *best = key.min(*best));
            }
            start += run;
        }
        best
    }

    /// The least keys of candidates, each told by what its distance is added to for its key, in ascending order of disparity.
    #[inline(always)]
    fn consider<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        bases: &[u32],
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) -> Eight<u32> {
        let column = |base: u32| {
            let d = base as usize & 255;
            if LEFT { self.u.wrapping_sub(d) } else { self.u + d }
        };
        // Away from the images' borders all pixels can have all disparities.
        let is_whole = |base: &u32| (base & 255) as i32 <= self.reach_min;
        let whole = if bases.last().is_none_or(is_whole) { bases.len() } else { bases.partition_point(is_whole) };
        let mut keys = [BARRED; LANES];
        let mut border = whole;
        for (i, &base) in part(bases, ..whole).iter().enumerate() {
            let Some(others) = other.get(column(base)..).and_then(|row| row.first_chunk()) else {
                border = i;
                break;
            };
            keys = kernels.least(keys, [&self.points, others], base);
        }
        let mut best = kernels.ordered(keys);
        for &base in part(bases, border..) {
            let d = (base & 255) as i32;
            if d > self.reach_max {
                break;
            }
            let keys = kernels.ordered(kernels.least([BARRED; LANES], [&self.points, eight(other, column(base), spare)], base));
            for ((best, key), &reach) in best.iter_mut().zip(keys).zip(&self.reach) {
                *best = if d > reach { *best } else { key.min(*best) };
            }
        }
        best
    }
}

/// The lesser of each two keys.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "lanes are below eight")]
fn lesser(mut a: Eight<u32>, b: Eight<u32>) -> Eight<u32> {
    for lane in 0..LANES {
        a[lane] = if b[lane] < a[lane] { b[lane] } else { a[lane] };
    }
    a
}
