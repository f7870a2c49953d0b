//! Neighbours of a row matched at a time: one disparity after the other, for all of them.
//!
//! Sixteen share their cell's list of disparities, for how long that is no processor foresees;
//! about its own plane each of eight has disparities of its own, which are as many for all. A
//! candidate's key has the energy above and the disparity below, so that the least key is the least
//! energy and, of equal ones, the smallest disparity. Borders, where not all can have the same
//! candidates, go another and slower way.

use super::load;
use crate::{
    lanes::{Eight, LANES},
    sad::{KEY_SCALE_BITS, Kernels},
    slices::{clipped, store},
    stereo::{
        StereoConfig,
        config::DISPARITY_LIMIT,
        descriptor::{Descriptor, MARGIN, UNTEXTURED, eight},
        prior::{NO_PLANE, PLANE_WIDTH, PlaneCost, STEEP},
    },
};

/// Set in a key that does not count: above every key, and still a positive `i32`.
const BARRED: u32 = 1 << 30;
/// Least texture of a descriptor that is matched densely, as published.
pub(super) const MATCH_TEXTURE: u32 = 1;
/// No plane: as wide as keys are.
const NOTHING: i32 = NO_PLANE as i32;

/// A row to be matched, of the left or of the right image.
pub(super) struct Row<'a, const LEFT: bool> {
    here: &'a [Descriptor],
    other: &'a [Descriptor],
    cost: &'a PlaneCost,
    least_texture: u32,
    most: i32,
    spare: Eight<Descriptor>,
}

/// Eight pixels to be matched, and what they may match.
struct Group {
    /// A copy, so that compilers keep it in registers.
    points: Eight<Descriptor>,
    /// Column of the first pixel.
    u: usize,
    /// Largest number of pixels to match.
    count: i32,
    /// Plane of each pixel; [`NOTHING`] where it is not matched.
    planes: Eight<i32>,
    /// Greatest disparity of each pixel: beyond it the other row has no descriptors.
    reach: Eight<i32>,
    /// Least and greatest of those.
    reach_min: i32,
    reach_max: i32,
}

impl<'a, const LEFT: bool> Row<'a, LEFT> {
    #[inline(always)]
    pub fn new(
        config: &StereoConfig,
        cost: &'a PlaneCost,
        here: &'a [Descriptor],
        other: &'a [Descriptor],
    ) -> Self {
        Self {
            here,
            other,
            cost,
            least_texture: MATCH_TEXTURE,
            most: i32::from(config.disparity_max),
            // Stands for the pixels beyond a row's end.
            spare: UNTEXTURED,
        }
    }

    /// Replaces the planes of a row's pixels `u..`, sixteen or `count`, by disparities in px, or
    /// [`NO_PLANE`] where no plane lies, the image is without texture or no disparity can be.
    #[inline(always)]
    pub fn match_sixteen(
        &mut self,
        u: usize,
        count: usize,
        listed: &[u32],
        row: &mut [i16],
        kernels: &impl Kernels,
    ) {
        // Sixteen pixels share the list of disparities and read it once.
        let groups = [
            self.group(u, count, row, kernels),
            self.group(u + LANES, count.saturating_sub(LANES), row, kernels),
        ];
        let mut best = [[BARRED; LANES]; 2];
        if groups.iter().any(|group| !group.is_empty()) {
            best = consider::<LEFT>(&groups, self.other, listed, &mut self.spare, kernels);
        }
        // Each pixel's own plane adds disparities that are preferred near it.
        for (group, mut best) in groups.iter().zip(best) {
            if !group.is_empty() {
                best = lesser(
                    best,
                    group.least_about_planes::<LEFT>(
                        self.other,
                        self.cost,
                        &mut self.spare,
                        kernels,
                    ),
                );
            }
            group.write(best, row);
        }
    }

    /// The eight pixels from column `u` on. The first `count` may be matched.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below eight")]
    fn group(&mut self, u: usize, count: usize, row: &[i16], kernels: &impl Kernels) -> Group {
        let points = *eight(self.here, u, &mut self.spare);
        let texture = kernels.sums(&points, &UNTEXTURED);
        let (old, count) = (load(row, u), count.min(LANES) as i32);
        let (mut planes, mut reach) = ([NOTHING; LANES], [0; LANES]);
        // A patch without texture looks the same everywhere, so its pixel is not matched.
        for lane in 0..LANES {
            let is_matched = (texture[lane] >= self.least_texture) & ((lane as i32) < count);
            planes[lane] = if is_matched { i32::from(old[lane]) } else { NOTHING };
        }
        let columns = self.here.len() as i32;
        // The largest disparity whose partner has a descriptor in the other row.
        for (reach, at) in reach.iter_mut().zip(u as i32..) {
            let columns = if LEFT { at - MARGIN as i32 } else { columns - MARGIN as i32 - 1 - at };
            *reach = if columns < self.most { columns } else { self.most };
        }
        // From left to right, reach grows in the left image and falls in the right one.
        let (reach_min, reach_max) =
            if LEFT { (reach[0], reach[LANES - 1]) } else { (reach[LANES - 1], reach[0]) };
        Group { points, u, count, planes, reach, reach_min, reach_max }
    }
}

/// The least keys of candidates, each told by what its distance is added to for its key, in
/// ascending order of disparity: those of two groups side by side. [`BARRED`] where a pixel has
/// none.
#[inline(always)]
fn consider<const LEFT: bool>(
    groups: &[Group; 2],
    other: &[Descriptor],
    bases: &[u32],
    spare: &mut Eight<Descriptor>,
    kernels: &impl Kernels,
) -> [Eight<u32>; 2] {
    let [Group { u: first, reach_min, .. }, second] = groups;
    let reach_min = *reach_min.min(&second.reach_min);
    // Away from the images' borders all pixels can have all disparities.
    let is_whole = |base: &u32| (base & 255) as i32 <= reach_min;
    let whole = if bases.last().is_none_or(is_whole) {
        bases.len()
    } else {
        bases.partition_point(is_whole)
    };
    // A key holds cost and disparity, so that the least key is the cheapest match.
    let mut keys = [[BARRED; LANES]; 2];
    let mut border = whole;
    for (i, &base) in clipped(bases, ..whole).iter().enumerate() {
        let others = other
            .get(matched::<LEFT>(*first, base)..)
            .and_then(|row| row.as_chunks().0.first_chunk::<2>());
        let Some(others) = others else {
            border = i;
            break;
        };
        for ((keys, group), others) in keys.iter_mut().zip(groups).zip(others) {
            *keys = kernels.least(*keys, [&group.points, others], base);
        }
    }
    // Near a border each disparity is tested pixel by pixel.
    for (keys, group) in keys.iter_mut().zip(groups) {
        *keys = kernels.ordered(*keys);
        if border < bases.len() {
            group.consider_at_border::<LEFT>(other, clipped(bases, border..), keys, spare, kernels);
        }
    }
    keys
}

/// Returns the position in the other row of the match of column `u` that a candidate stands for.
#[inline(always)]
fn matched<const LEFT: bool>(u: usize, base: u32) -> usize {
    let d = base as usize & 255;
    if LEFT { u.wrapping_sub(d) } else { u + d }
}

impl Group {
    /// Returns true if no pixel is to be matched.
    #[inline(always)]
    fn is_empty(&self) -> bool {
        self.planes == [NOTHING; LANES]
    }

    /// Considers candidates like [`consider`], if not all pixels can have them; `best` has the
    /// least keys of those before them.
    #[cold]
    #[inline(never)]
    fn consider_at_border<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        bases: &[u32],
        best: &mut Eight<u32>,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) {
        for &base in bases {
            // The low byte of a base is the disparity, and bases ascend: none behind is within
            // reach.
            let d = (base & 255) as i32;
            if d > self.reach_max {
                break;
            }
            let others = eight(other, matched::<LEFT>(self.u, base), spare);
            let keys =
                kernels.ordered(kernels.least([BARRED; LANES], [&self.points, others], base));
            for ((best, key), &reach) in best.iter_mut().zip(keys).zip(&self.reach) {
                *best = if d > reach { *best } else { key.min(*best) };
            }
        }
    }

    /// Replaces the pixels' planes in the row by the disparities of keys.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "lanes are below eight")]
    fn write(&self, keys: Eight<u32>, row: &mut [i16]) {
        let mut pixels = load(row, self.u);
        for lane in 0..LANES {
            let is_found = (self.planes[lane] != NOTHING) & (keys[lane] < BARRED);
            let disparity = if is_found { (keys[lane] & 255) as i16 } else { NO_PLANE };
            // Beyond them are planes of the next cell.
            pixels[lane] = if (lane as i32) < self.count { disparity } else { pixels[lane] };
        }
        store(row, self.u, pixels);
    }

    /// The least key about each pixel's own plane, [`BARRED`] where it has none.
    #[inline(always)]
    fn least_about_planes<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) -> Eight<u32> {
        match self.least_about_inner_planes::<LEFT>(other, cost, kernels) {
            Some(keys) => keys,
            None => self.least_about_any_planes::<LEFT>(other, cost, spare, kernels),
        }
    }

    /// The least keys about each pixel's own plane; `None` where some are at a border, or a pixel's
    /// least or greatest disparity.
    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "lanes are below eight, steps below the width of a table"
    )]
    fn least_about_inner_planes<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        kernels: &impl Kernels,
    ) -> Option<Eight<u32>> {
        let planes = &self.planes;
        let radius = cost.radius as i32;
        // The range about each plane's disparity, and whether it has to lie in the image.
        let (mut firsts, mut steep) = ([0; LANES], [0; LANES]);
        let mut outside = false;
        for lane in 0..LANES {
            // Any will do for pixels that have no plane.
            let mean = if planes[lane] == NOTHING { radius } else { planes[lane] & 255 };
            firsts[lane] = mean - radius;
            steep[lane] = if planes[lane] >= i32::from(STEEP) { u32::MAX } else { 0 };
            outside |= (mean < radius) | (mean + radius > self.reach[lane]);
        }
        // Near a border the slow twin tests each disparity by itself.
        if outside {
            return None;
        }
        let last = 2 * cost.radius;
        let rows = self.rows_from::<LEFT>(other, &firsts, last)?;
        // What a candidate's distance is added to; about a steep plane, which is not preferred, all
        // cost the same.
        let lowered = |mut best: Eight<u32>, sums: Eight<u32>, step: usize, about: u32| {
            // In the left row, columns ascend while disparities fall.
            let d = if LEFT { last - step } else { step } as u32;
            let more = (cost.elsewhere - about) << 8;
            for lane in 0..LANES {
                let key = (sums[lane] << KEY_SCALE_BITS)
                    + (about << 8)
                    + d
                    + firsts[lane] as u32
                    + (steep[lane] & more);
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
        // The odd last candidate.
        let mut lasts = [&Descriptor::UNTEXTURED; LANES];
        for lane in 0..LANES {
            lasts[lane] = rows[lane].get(last)?;
        }
        Some(lowered(
            best,
            kernels.sums_of(&self.points, lasts),
            last,
            *cost.about_plane.get(last)?,
        ))
    }

    /// The descriptors of the other row that candidates from the first ones to `last` more stand
    /// for, in the order of columns; `None` where they do not lie in it.
    #[inline(always)]
    fn rows_from<'a, const LEFT: bool>(
        &self,
        other: &'a [Descriptor],
        firsts: &Eight<i32>,
        last: usize,
    ) -> Option<Eight<&'a [Descriptor; PLANE_WIDTH]>> {
        // Columns of the row are below 2^13. Four bytes wide, they are found side by side, and no
        // end of a range can wrap.
        let mut starts = [0; LANES];
        for (start, (u, &first)) in starts.iter_mut().zip((self.u as u32..).zip(firsts)) {
            *start =
                if LEFT { u.wrapping_sub(first as u32 + last as u32) } else { u + first as u32 };
        }
        let mut rows = [&[Descriptor::UNTEXTURED; PLANE_WIDTH]; LANES];
        for (row, start) in rows.iter_mut().zip(starts.map(|start| start as usize)) {
            *row = other.get(start..start + PLANE_WIDTH)?.first_chunk()?;
        }
        Some(rows)
    }

    /// Returns the least keys about planes of any position.
    #[cold]
    #[inline(never)]
    fn least_about_any_planes<const LEFT: bool>(
        &self,
        other: &[Descriptor],
        cost: &PlaneCost,
        spare: &mut Eight<Descriptor>,
        kernels: &impl Kernels,
    ) -> Eight<u32> {
        let mut best = [BARRED; LANES];
        let mut start = 0;
        // Neighbouring pixels on one plane share their candidates.
        while let Some(&plane) = self.planes.get(start) {
            let run = self.planes.iter().skip(start).take_while(|other| **other == plane).count();
            if plane != NOTHING {
                let first = (plane & 255) - cost.radius as i32;
                let costs =
                    if plane >= i32::from(STEEP) { &cost.about_steep } else { &cost.about_plane };
                let costs = clipped(costs, ..2 * cost.radius + 1);
                let outside = usize::try_from(-first).unwrap_or_default();
                // A key holds no greater disparity.
                let within = first.max(0) as u32..=u32::from(DISPARITY_LIMIT);
                let mut bases = [0; PLANE_WIDTH];
                let mut count = 0;
                for ((base, d), &cost) in
                    bases.iter_mut().zip(within).zip(clipped(costs, outside..))
                {
                    *base = (cost << 8) + d;
                    count += 1;
                }
                let mut keys = [BARRED; LANES];
                self.consider_at_border::<LEFT>(
                    other,
                    clipped(&bases, ..count),
                    &mut keys,
                    spare,
                    kernels,
                );
                best.iter_mut().zip(keys).skip(start).take(run).for_each(|(best, key)| *best = key);
            }
            start += run;
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
