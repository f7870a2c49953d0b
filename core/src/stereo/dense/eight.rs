//! Eight neighbours of a row matched at a time: one disparity after the other, for all of them.
//!
//! Neighbours share their cell's list of disparities, and most of them their plane. A candidate's key has the energy above and the
//! disparity below, so that the least key is the least energy and, of equal ones, the smallest disparity.

use crate::stereo::{
    StereoConfig,
    descriptor::{Descriptor, MARGIN},
    prior::{NO_PLANE, PlaneCost, STEEP},
    sad::{Eight, Kernels, LANES, UNTEXTURED, eight},
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
    pub fn match_eight(&mut self, u: usize, listed: &[u8], planes: &mut [i16], kernels: &impl Kernels) {
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
    /// The least key of each pixel, [`BARRED`] or more where it has none.
    #[inline(always)]
    fn least_keys<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        listed: &[u8],
        planes: Eight<i32>,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) -> Eight<u32> {
        let mut best = [BARRED; LANES];
        let mut consider = |d: i32, cost: u32, others: &Eight<u32>| {
            let column = if LEFT { self.u.wrapping_sub(d as usize) } else { self.u.wrapping_add(d as usize) };
            best = kernels.least(best, [self.points, eight(other, column, spare)], (cost << 8) + d as u32, others);
        };
        for &d in listed {
            let d = i32::from(d);
            if d > self.reach_max {
                break;
            }
            consider(d, cost.elsewhere, &self.beyond(d));
        }
        // Most often all eight have one plane, or change it once.
        let mut start = 0;
        while let Some(&plane) = planes.get(start) {
            let run = planes.iter().skip(start).take_while(|other| **other == plane).count();
            let mut others = [BARRED; LANES];
            others.iter_mut().skip(start).take(run).for_each(|barred| *barred = 0);
            start += run;
            if plane == NOTHING {
                continue;
            }
            let (mean, radius) = (plane & 255, cost.radius as i32);
            let costs = if plane >= i32::from(STEEP) { &cost.about_steep } else { &cost.about_plane };
            for (d, &cost) in (mean - radius..=mean + radius).zip(costs) {
                if (0..=self.reach_min).contains(&d) {
                    consider(d, cost, &others);
                } else if (0..=self.reach_max).contains(&d) {
                    let mut barred = self.beyond(d);
                    barred.iter_mut().zip(&others).for_each(|(barred, others)| *barred |= others);
                    consider(d, cost, &barred);
                }
            }
        }
        best
    }

    /// Which pixels cannot have this disparity.
    #[inline(always)]
    fn beyond(&self, d: i32) -> Eight<u32> {
        let mut barred = [0; LANES];
        // Most often all can.
        if d > self.reach_min {
            barred.iter_mut().zip(&self.reach).for_each(|(barred, &reach)| *barred = if d > reach { BARRED } else { 0 });
        }
        barred
    }
}
