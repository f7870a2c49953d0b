//! The loop: a square with rounded corners along the middle of a lane.

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

use super::block::PITCH_M;
use crate::synth::layout::LANE_M;

const QUARTER_RAD: f64 = 0.5 * core::f64::consts::PI;
/// Radius of corners in the inner lane, m.
const CORNER_M: f64 = 9.0;

/// One lane of the loop. Cars keep to the right: the inner lane is driven clockwise as seen from
/// above.
#[derive(Clone, Copy, Debug)]
pub struct Route {
    /// Middle of the loop, m, along x and z.
    middle_m: f64,
    /// Distance of the lane from the middle, m.
    half_m: f64,
    /// Radius of the corners, m.
    radius_m: f64,
    inner: bool,
}

impl Route {
    /// The inner or the outer lane of a loop around `blocks` by `blocks`, driven `shift_m` to the
    /// left of its middle.
    pub fn new(blocks: u32, inner: bool, shift_m: f64) -> Self {
        let middle_m = 0.5 * f64::from(blocks) * PITCH_M;
        let outwards_m = if inner { shift_m - 0.5 * LANE_M } else { 0.5 * LANE_M - shift_m };
        Self {
            middle_m,
            half_m: middle_m + outwards_m,
            radius_m: CORNER_M + 0.5 * LANE_M + outwards_m,
            inner,
        }
    }

    /// Half of the straight part of a side, m.
    fn straight_m(&self) -> f64 {
        self.half_m - self.radius_m
    }

    /// Length of a side with one corner, m.
    fn quarter_m(&self) -> f64 {
        2.0 * self.straight_m() + QUARTER_RAD * self.radius_m
    }

    /// Length of a lap, m.
    pub fn length_m(&self) -> f64 {
        4.0 * self.quarter_m()
    }

    /// The frame on the road `along_m` from the middle of the western side, `right_m` to the right
    /// of the lane's middle, turned by `yaw_rad` against it.
    pub fn t_town_local(&self, along_m: f64, right_m: f64, yaw_rad: f64) -> Transform {
        // Against the clock the way runs back, and cars look the other way.
        let clockwise_m = if self.inner { along_m } else { -along_m } + self.straight_m();
        let (right_m, turn_rad) =
            if self.inner { (right_m, 0.0) } else { (-right_m, 2.0 * QUARTER_RAD) };
        let quarter = libm::floor(clockwise_m / self.quarter_m());
        let within_m = clockwise_m - quarter * self.quarter_m();
        let straight_m = self.straight_m();
        // On the western side north is ahead and right is inwards.
        let (x, z, heading_rad) = if within_m < 2.0 * straight_m {
            (right_m - self.half_m, within_m - straight_m, 0.0)
        } else {
            let heading = (within_m - 2.0 * straight_m) / self.radius_m;
            let radius_m = self.radius_m - right_m;
            let (x, z) = (-radius_m * libm::cos(heading), radius_m * libm::sin(heading));
            (x - straight_m, z + straight_m, heading)
        };
        // Other sides are the western one, turned about the middle.
        let middle = Vector3::new(self.middle_m, 0.0, self.middle_m);
        let side = Transform::new([0.0, quarter % 4.0 * QUARTER_RAD, 0.0], middle);
        (side * Transform::new([0.0, heading_rad + turn_rad + yaw_rad, 0.0], [x, 0.0, z]))
            .normalized()
    }
}
