//! Where objects are supposed to be.

use super::{extent::Extent, groups::Group};
use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

/// Most supposed objects of a frame.
pub(super) const MAX_SEEDS: usize = 32;
/// How far an object reaches beyond a few members, m.
const REACH_M: f64 = 0.3;
/// The same along the depth, m for each m^2 of squared depth.
const REACH_PER_SQUARED_DEPTH: f64 = 0.001;

/// An object that is supposed to be there: its extent in the current camera, and its motion against
/// the static prediction.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Seed {
    low_m: [f64; 3],
    high_m: [f64; 3],
    motion_m: [f64; 3],
    /// Whether it was an object before: 0 or 1.
    known: u64,
}

impl Seed {
    pub fn new(extent: &Extent, motion_m: Vector3<f64>) -> Self {
        Self { low_m: extent.low, high_m: extent.high, motion_m: motion_m.into(), known: 0 }
    }

    /// Marks it as an object that was found before, or not.
    pub fn known(self, known: bool) -> Self {
        Self { known: u64::from(known), ..self }
    }

    /// Whether it was an object before.
    pub fn is_known(&self) -> bool {
        self.known > 0
    }

    /// Its motion against the static prediction, m.
    pub fn motion_m(&self) -> Vector3<f64> {
        Vector3::from(self.motion_m)
    }

    /// Its extent and a little more.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent { low: self.low_m, high: self.high_m };
        let depth_m = extent.center().z;
        let reaches = [REACH_M, REACH_M, REACH_M + REACH_PER_SQUARED_DEPTH * depth_m * depth_m];
        for ((low, high), reach_m) in extent.low.iter_mut().zip(&mut extent.high).zip(reaches) {
            (*low, *high) = (*low - reach_m, *high + reach_m);
        }
        extent
    }

    /// Whether a group lies where it is.
    pub fn is_at(&self, group: &Group) -> bool {
        Extent { low: self.low_m, high: self.high_m }.gap(&group.extent) < REACH_M
    }
}
