//! Circular matching: left-previous -> right-previous -> right-current -> left-current -> left-previous. A circle that does not close
//! on the feature it began with is no match, nor is one without positive disparity in both frames.

use super::{
    SceneFlowConfig,
    features::{Features, Window},
    matches::Match,
};
use crate::parallel::{Bands, Executor, each, zip2};
use bytemuck::{Pod, Zeroable};

/// One side of the circle has no partner.
const NONE: [u32; 3] = [u32::MAX; 3];

/// Where a circle's four sides may lead, relative to where each begins: smallest and largest step in u, then in v, px.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Reach {
    pub to_previous_right: [i16; 4],
    pub to_current_right: [i16; 4],
    pub to_current_left: [i16; 4],
    pub to_previous_left: [i16; 4],
}

impl Reach {
    /// As far as the configuration allows.
    pub(super) fn widest(config: &SceneFlowConfig) -> Self {
        let (far, rows) = (config.search_radius_px as i16, i16::from(config.stereo_tolerance_px));
        Self {
            to_previous_right: [-far, -1, -rows, rows],
            to_current_right: [-far, far, -far, far],
            to_current_left: [1, far, -rows, rows],
            to_previous_left: [-far, far, -far, far],
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

impl Corners<'_, '_> {
    /// Traces every circle. `traced[i]` becomes the partners of previous-left feature i, in the circle's order.
    pub(super) fn trace<E: Executor>(&self, reach: impl Fn([u16; 2]) -> Reach + Sync, traced: &mut [[u32; 3]], executor: &E) {
        let len = self.previous_left.len();
        let Some(traced) = traced.get_mut(..len) else { return };
        let bands = Bands::of(len);
        each(executor, zip2(bands.first(), bands.split_mut(traced, 1)), |(first, traced)| {
            for (index, partners) in (first..).zip(traced) {
                *partners = self.circle(index, &reach).unwrap_or(NONE);
            }
        });
    }

    /// The circle that begins with one feature, if it closes.
    fn circle(&self, first: usize, reach: impl Fn([u16; 2]) -> Reach) -> Option<[u32; 3]> {
        let class = self.previous_left.class(first);
        let reach = reach(self.previous_left.at(first)?);
        let step = |from: &Features<'_>, index: usize, to: &Features<'_>, by: [i16; 4]| {
            let [u, v] = from.at(index)?.map(i32::from);
            let by = by.map(i32::from);
            let window = Window { u_min: u + by[0], u_max: u + by[1], v_min: v + by[2], v_max: v + by[3] };
            to.nearest(class, window, from.descriptor(index)?)
        };
        let previous_right = step(self.previous_left, first, self.previous_right, reach.to_previous_right)?;
        let current_right = step(self.previous_right, previous_right, self.current_right, reach.to_current_right)?;
        let current_left = step(self.current_right, current_right, self.current_left, reach.to_current_left)?;
        let back = step(self.current_left, current_left, self.previous_left, reach.to_previous_left)?;
        (back == first).then_some([previous_right as u32, current_right as u32, current_left as u32])
    }

    /// The closed circles as matches, in the order of the previous left features. Returns how many there were; those beyond the capacity
    /// in `out` are dropped.
    pub(super) fn gather(&self, traced: &[[u32; 3]], out: &mut [Match]) -> usize {
        let mut slots = out.iter_mut();
        let mut found = 0;
        for (first, partners) in traced.iter().enumerate().take(self.previous_left.len()) {
            if let Some(closed) = self.closed(first, *partners) {
                found += 1;
                if let Some(slot) = slots.next() {
                    *slot = closed;
                }
            }
        }
        found
    }

    fn closed(&self, first: usize, [previous_right, current_right, current_left]: [u32; 3]) -> Option<Match> {
        let position = |set: &Features<'_>, index: usize| set.at(index).map(|at| at.map(f32::from));
        Some(Match {
            previous_left: position(self.previous_left, first)?,
            previous_right: position(self.previous_right, previous_right as usize)?,
            current_right: position(self.current_right, current_right as usize)?,
            current_left: position(self.current_left, current_left as usize)?,
        })
    }
}
