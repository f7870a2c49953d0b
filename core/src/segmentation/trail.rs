//! Trail that a moving object leaves in the static map in the frames before it is known to move,
//! and in those in which it is not found.

use super::extent::Extent;
use crate::geometry::{OrientedBox, Transform};
use nalgebra::Vector3;

/// Margin around an object's extent within which its trail lies: sideways, upwards and along the
/// line of sight, m, and of the last by squared depth.
const MARGIN_M: [f64; 3] = [0.3, 0.3, 0.6];
const DEPTH_MARGIN: f64 = 0.002;

/// Boxes of an object in frames in which its depth was not kept out of the static map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trail {
    /// Box in the current frame.
    now: OrientedBox,
    /// Motion in a frame, in the box's axes, m.
    motion_m: [f64; 3],
    frames: u32,
}

impl Trail {
    /// Makes the trail of an object with an extent in the camera's axes and a motion in the
    /// world's.
    pub(super) fn new(
        extent: &Extent,
        t_world_camera: &Transform,
        motion_m: Vector3<f64>,
        frames: u32,
    ) -> Self {
        let t_camera_world = t_world_camera.inverse();
        let depth_m = extent.center().z;
        // In the camera's present axes; only the motion has to be turned.
        let mut now =
            OrientedBox { t_box_world: t_camera_world, low_m: extent.low, high_m: extent.high };
        for (axis, ((low, high), margin_m)) in
            now.low_m.iter_mut().zip(&mut now.high_m).zip(MARGIN_M).enumerate()
        {
            let margin_m =
                margin_m + if axis == 2 { DEPTH_MARGIN * depth_m * depth_m } else { 0.0 };
            // Not downwards: there is the ground.
            (*low, *high) = (*low - margin_m, *high + if axis == 1 { 0.0 } else { margin_m });
        }
        Self { now, motion_m: t_camera_world.rotate(motion_m).into(), frames }
    }

    /// Returns the number of frames that the trail reaches back.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Returns the object's box in each of them, the last frame first.
    pub fn boxes(&self) -> impl Iterator<Item = OrientedBox> {
        (1..=self.frames).map(|frame| {
            let mut before = self.now;
            for ((low, high), motion_m) in
                before.low_m.iter_mut().zip(&mut before.high_m).zip(self.motion_m)
            {
                // The motion is per frame, and assumed to have been the same.
                let moved_m = f64::from(frame) * motion_m;
                (*low, *high) = (*low - moved_m, *high - moved_m);
            }
            before
        })
    }
}
