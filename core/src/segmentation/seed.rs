//! Seeds: places where objects are supposed to be.

use super::{extent::Extent, groups::Group};
use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

/// Most supposed objects of a frame.
pub(super) const MAX_SEEDS: usize = 32;
/// Reach of an object beyond a few members, m.
const REACH_M: f64 = 0.3;
/// Reach along the depth, m for each m² of squared depth.
const REACH_PER_SQUARED_DEPTH: f64 = 0.001;

/// An object that is supposed to be there: its extent in the current camera, and its motion against
/// the static prediction.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Seed {
    low_m: [f64; 3],
    high_m: [f64; 3],
    motion_m: [f64; 3],
    /// 1 if it was an object before, else 0.
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

    /// Returns true if it was an object before.
    pub fn is_known(&self) -> bool {
        self.known > 0
    }

    /// Returns the motion relative to the static prediction, m.
    pub fn motion_m(&self) -> Vector3<f64> {
        Vector3::from(self.motion_m)
    }

    /// Returns the extent with a margin.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent { low: self.low_m, high: self.high_m };
        let depth_m = extent.center().z;
        let reaches = [REACH_M, REACH_M, REACH_M + REACH_PER_SQUARED_DEPTH * depth_m * depth_m];
        for ((low, high), reach_m) in extent.low.iter_mut().zip(&mut extent.high).zip(reaches) {
            (*low, *high) = (*low - reach_m, *high + reach_m);
        }
        extent
    }

    /// Returns true if a group lies at the patch's position.
    pub fn is_at(&self, group: &Group) -> bool {
        Extent { low: self.low_m, high: self.high_m }.gap(&group.extent) < REACH_M
    }
}
