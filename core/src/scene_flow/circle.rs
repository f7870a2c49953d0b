//! Circular matching: left-previous -> right-previous -> right-current -> left-current ->
//! left-previous. A circle that does not close on the feature it began with is no match, nor is one
//! without positive disparity in both frames.

use super::{
    SceneFlowConfig,
    features::{CELL_U, CELL_V, Features, Sought, Window},
    matches::Match,
};
use crate::{
    parallel::{Bands, Executor, each, zip2},
    sad::{Comparison, Kernels, compare},
};
use bytemuck::{Pod, Zeroable};

/// Interval of the features that are traced before the others, to tell what those cost.
pub(super) const SAMPLED: usize = 16;
/// Most descriptors that the dense pass compares for a feature, on average; KITTI 06 takes about
/// 100.
pub(super) const COMPARED_MAX: u64 = 300;
/// One side of the circle has no partner.
const NONE: [u32; 3] = [u32::MAX; 3];

/// Range of a circle's four sides, relative to where each begins: smallest and largest step in u,
/// then in v, px.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Reach {
    pub to_previous_right: [i16; 4],
    pub to_current_right: [i16; 4],
    pub to_current_left: [i16; 4],
    pub to_previous_left: [i16; 4],
}

impl Reach {
    /// Returns the most features that the search for the partners of one can compare, where an
    /// image has at most so many.
    pub(super) fn most_compared(config: &SceneFlowConfig, features: usize) -> usize {
        let far = config.search_radius_px as usize;
        let rows = 2 * config.stereo_tolerance_px as usize + 1;
        // Runs of features end at cells; no square of this side holds two of a class.
        const APART_PX: usize = 4;
        let within = |width: usize, height: usize| {
            ((width + 2 * CELL_U) / APART_PX + 1) * ((height + 2 * CELL_V) / APART_PX + 1)
        };
        let least = |a: usize, b: usize| if a < b { a } else { b };
        let (stereo, flow) = (within(far, rows), within(2 * far + 1, 2 * far + 1));
        2 * least(stereo, features) + 2 * least(flow, features)
    }

    /// Returns the widest reach that the configuration allows.
    pub(super) fn widest(config: &SceneFlowConfig) -> Self {
        let (far, rows) = (config.search_radius_px as i16, i16::from(config.stereo_tolerance_px));
        Self {
            to_previous_right: [-far, -1, -rows, rows],
            to_current_right: [-far, far, -far, far],
            to_current_left: [1, far, -rows, rows],
            to_previous_left: [-far, far, -far, far],
        }
    }

    /// Moves the sides between the two frames by a flow, px.
    pub(super) fn moved_by(self, [du, dv]: [f32; 2]) -> Self {
        // The casts saturate; a flow fits by far.
        let (du, dv) = (du as i16, dv as i16);
        let moved = |[left, right, up, down]: [i16; 4], du: i16, dv: i16| {
            let add = i16::saturating_add;
            [add(left, du), add(right, du), add(up, dv), add(down, dv)]
        };
        Self {
            to_current_right: moved(self.to_current_right, du, dv),
            to_previous_left: moved(self.to_previous_left, -du, -dv),
            ..self
        }
    }
}

/// The four images' features.
#[derive(Clone, Copy)]
pub(super) struct Corners<'a, 's> {
    pub previous_left: &'a Features<'s>,
    pub previous_right: &'a Features<'s>,
    pub current_right: &'a Features<'s>,
    pub current_left: &'a Features<'s>,
}

/// The circles of some of the previous left features, as work that compares descriptors.
struct TraceBand<'t, 'a, 's, R> {
    corners: &'t Corners<'a, 's>,
    reach: &'t R,
    /// The first of them.
    first: usize,
    traced: &'t mut [[u32; 3]],
    /// Descriptors to compare for a feature, on average, at most.
    most: u64,
    /// Descriptors that were compared.
    compared: &'t mut u64,
}

impl<R: Fn([u16; 2]) -> Reach> Comparison for TraceBand<'_, '_, '_, R> {
    #[inline(always)]
    fn run(self, kernels: &impl Kernels) {
        let (len, compared) = (self.traced.len() as u64, self.compared);
        let (mut every, mut enough) = (1, u64::MAX);
        for is_sample in [true, false] {
            for (at, partners) in self.traced.iter_mut().enumerate() {
                if at.is_multiple_of(SAMPLED) != is_sample {
                    continue;
                }
                let is_traced = (at as u64).is_multiple_of(every) && *compared <= enough;
                let index = self.first + at;
                let circle =
                    is_traced.then(|| self.corners.circle(index, self.reach, kernels, compared));
                *partners = circle.flatten().unwrap_or(NONE);
            }
            // Samples of all parts of the band tell how many comparisons the rest would take; they
            // may be lucky ones.
            let samples = len.div_ceil(SAMPLED as u64);
            every = compared.div_ceil(samples.saturating_mul(self.most).max(1)).max(1);
            enough = compared.saturating_add(len.saturating_mul(self.most).saturating_mul(2));
        }
    }
}

impl Corners<'_, '_> {
    /// Traces every circle. `traced[i]` becomes the partners of previous-left feature i, in the
    /// circle's order. If a feature took more than `most` comparisons on average, only some of them
    /// are traced, evenly spread. Returns the number of descriptors that were compared.
    pub(super) fn trace<E: Executor>(
        &self,
        reach: impl Fn([u16; 2]) -> Reach + Sync,
        most: u64,
        traced: &mut [[u32; 3]],
        executor: &E,
    ) -> u64 {
        let len = self.previous_left.len();
        let Some(traced) = traced.get_mut(..len) else { return 0 };
        let bands = Bands::new(len);
        let jobs = zip2(bands.first(), bands.split_mut(traced, 1));
        let compared = each(executor, jobs, |(first, traced)| {
            let (reach, mut compared) = (&reach, 0);
            let band =
                TraceBand { corners: self, reach, first, traced, most, compared: &mut compared };
            compare(executor.vectors(), band);
            compared
        });
        compared.iter().sum()
    }

    /// The circle that begins with one feature, if it closes.
    #[inline(always)]
    fn circle(
        &self,
        first: usize,
        reach: impl Fn([u16; 2]) -> Reach,
        kernels: &impl Kernels,
        compared: &mut u64,
    ) -> Option<[u32; 3]> {
        // The class stays along the circle: a maximum never matches a minimum.
        let class = self.previous_left.class(first);
        let reach = reach(self.previous_left.at(first)?);
        // Previous left, previous right, current right, current left, and back.
        let sides = [
            (self.previous_left, self.previous_right, reach.to_previous_right),
            (self.previous_right, self.current_right, reach.to_current_right),
            (self.current_right, self.current_left, reach.to_current_left),
            (self.current_left, self.previous_left, reach.to_previous_left),
        ];
        let mut corners = [first; 5];
        let mut index = first;
        for ((from, to, by), corner) in sides.into_iter().zip(corners.iter_mut().skip(1)) {
            // Each window lies around the feature just found, so that errors do not add up.
            let ([u, v], by) = (from.at(index)?.map(i32::from), by.map(i32::from));
            let window =
                Window { u_min: u + by[0], u_max: u + by[1], v_min: v + by[2], v_max: v + by[3] };
            let sought = Sought { class, window, descriptor: from.descriptor(index)? };
            index = to.nearest(sought, kernels, compared)?;
            *corner = index;
        }
        let [_, previous_right, current_right, current_left, back] = corners;
        // A circle that ends elsewhere has a mismatch on its way.
        (back == first).then_some([
            previous_right as u32,
            current_right as u32,
            current_left as u32,
        ])
    }

    /// The closed circles as matches, in the order of the previous left features. Returns how many
    /// there were; those beyond the capacity in `out` are dropped.
    pub(super) fn gather(&self, traced: &[[u32; 3]], out: &mut [Match]) -> usize {
        let mut slots = out.iter_mut();
        let mut found = 0;
        for (first, partners) in traced.iter().enumerate().take(self.previous_left.len()) {
            if let Some(closed) = self.closed(first, *partners) {
                // Counted also where there is no space, so that the report tells what was dropped.
                found += 1;
                if let Some(slot) = slots.next() {
                    *slot = closed;
                }
            }
        }
        found
    }

    fn closed(
        &self,
        first: usize,
        [previous_right, current_right, current_left]: [u32; 3],
    ) -> Option<Match> {
        let position = |set: &Features<'_>, index: usize| set.at(index).map(|at| at.map(f32::from));
        Some(Match {
            previous_left: position(self.previous_left, first)?,
            previous_right: position(self.previous_right, previous_right as usize)?,
            current_right: position(self.current_right, current_right as usize)?,
            current_left: position(self.current_left, current_left as usize)?,
        })
    }
}
