//! Eight neighbours of a row matched at a time: one disparity after the other, for all of them.
//!
//! Neighbours share their cell's list of disparities; about its own plane each has disparities of its own, which are as many for all. A
//! candidate's key has the energy above and the disparity below, so that the least key is the least energy and, of equal ones, the smallest
//! disparity. Borders, where not all eight can have the same candidates, go another and slower way.

use crate::{
    part::part,
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
struct Candidates<'p> {
    points: &'p Eight<Descriptor>,
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

    /// Replaces the planes of pixels `u..`, eight or fewer, by disparities in px, or [`NO_PLANE`] where no plane lies, the image is without
    /// texture or no disparity can be.
    #[inline(always)]
    pub fn match_eight(&mut self, u: usize, listed: &[u32], planes: &mut [i16], kernels: &impl Kernels) {
        let [spare, spare_other] = &mut self.spare;
        let points = eight(self.here, u, spare);
        let texture = kernels.sums(points, &UNTEXTURED);
        let mut own = [NOTHING; LANES];
        for ((own, &plane), &texture) in own.iter_mut().zip(&*planes).zip(&texture) {
            *own = if texture < self.least_texture { NOTHING } else { i32::from(plane) };
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
        for ((plane, own), best) in planes.iter_mut().zip(own).zip(best) {
            *plane = if (own != NOTHING) & (best < BARRED) { (best & 255) as i16 } else { NO_PLANE };
        }
    }
}

impl Candidates<'_> {
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
        let mut best = [BARRED; LANES];
        self.consider::<LEFT>(other, listed.iter().copied(), &mut best, spare, kernels);
        if let Some(keys) = self.least_about_planes::<LEFT>(other, cost, planes, kernels) {
            best.iter_mut().zip(keys).for_each(|(best, key)| *best = key.min(*best));
        } else {
            self.consider_planes::<LEFT>(other, cost, planes, &mut best, spare, kernels);
        }
        best
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
        let (mut firsts, mut is_steep) = ([0; LANES], [false; LANES]);
        let mut outside = false;
        for lane in 0..LANES {
            // Any will do for pixels that have no plane.
            let mean = if planes[lane] == NOTHING { radius } else { planes[lane] & 255 };
            firsts[lane] = mean - radius;
            is_steep[lane] = planes[lane] >= i32::from(STEEP);
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
        let mut best = [BARRED; LANES];
        for (step, about) in cost.about_plane.into_iter().enumerate() {
            if step > last {
                break;
            }
            let mut others = [&Descriptor::UNTEXTURED; LANES];
            for lane in 0..LANES {
                others[lane] = &rows[lane][step];
            }
            let sums = kernels.sums_of(self.points, others);
            let d = if LEFT { last - step } else { step } as u32;
            let [about, elsewhere] = [about, cost.elsewhere].map(|cost| (cost << 8) + d);
            for lane in 0..LANES {
                let base = if is_steep[lane] { elsewhere } else { about } + firsts[lane] as u32;
                best[lane] = ((sums[lane] << KEY_SCALE_BITS) + base).min(best[lane]);
            }
        }
        Some(best)
    }

    /// Lowers keys to those about each pixel's own plane, wherever they are.
    #[cold]
    #[inline(never)]
    fn consider_planes<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        planes: Eight<i32>,
        best: &mut Eight<u32>,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) {
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
                let bases = within.zip(part(costs, outside..)).map(|(d, &cost)| (cost << 8) + d);
                let mut keys = [BARRED; LANES];
                self.consider::<LEFT>(other, bases, &mut keys, spare, kernels);
                best.iter_mut().zip(keys).skip(start).take(run).for_each(|(best, key)| *best = key.min(*best));
            }
            start += run;
        }
    }

    /// Lowers keys to the least of candidates, each told by what its distance is added to for its key, in ascending order of disparity.
    #[inline(always)]
    fn consider<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        bases: impl Iterator<Item = u32> + Clone,
        best: &mut Eight<u32>,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) {
        let column = |base: u32| {
            let d = base as usize & 255;
            if LEFT { self.u.wrapping_sub(d) } else { self.u + d }
        };
        let mut keys = [BARRED; LANES];
        let mut rest = bases.clone();
        // Away from the images' borders all pixels can have all disparities.
        let mut border = None;
        for base in rest.by_ref() {
            let others =
                if (base & 255) as i32 <= self.reach_min { other.get(column(base)..).and_then(|row| row.first_chunk()) } else { None };
            let Some(others) = others else {
                border = Some(base);
                break;
            };
            keys = kernels.least(keys, [self.points, others], base);
        }
        let keys = kernels.ordered(keys);
        best.iter_mut().zip(keys).for_each(|(best, key)| *best = key.min(*best));
        for base in border.into_iter().chain(rest) {
            let d = (base & 255) as i32;
            if d > self.reach_max {
                break;
            }
            let keys = kernels.ordered(kernels.least([BARRED; LANES], [self.points, eight(other, column(base), spare)], base));
            for ((best, key), &reach) in best.iter_mut().zip(keys).zip(&self.reach) {
                *best = if d > reach { *best } else { key.min(*best) };
            }
        }
    }
}
