//! Turns that images measured, for a unit to learn from.

use crate::{
    geometry::{MapSegment, Transform},
    state::Visitor,
};

/// Motion that images measured in a frame, for the unit to learn from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredMotion {
    /// From the frame that matches were sought with: the camera now to the camera then. `None`
    /// without an estimate.
    pub t_reference_now: Option<Transform>,
    /// Standard deviation of its turn about one axis, rad.
    pub sigma_rad: f64,
    /// Standard deviation of its way, m.
    pub way_sigma_m: f64,
    /// Half of the matches and more agree with it.
    pub strong: bool,
    /// True if that frame is not the one before.
    pub over_several: bool,
    /// The pose is a guess, turned as predicted.
    pub turned: bool,
    /// The estimate was refused, because it contradicts the prediction.
    pub refused: bool,
    /// Pose of the camera before, where both it and the one now were measured in one segment.
    pub t_world_before: Option<Transform>,
    pub t_world_camera: Transform,
    pub segment: MapSegment,
}

/// Turn that images measured, in the unit's axes, until samples cover it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PendingTurn {
    pub start_ns: u64,
    pub span_s: f64,
    /// Rotation vector, rad.
    pub turn_rad: [f64; 3],
    pub sigma_rad: f64,
    /// 1 if it was not compared with the unit's yet.
    pub open: u32,
}

impl PendingTurn {
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { start_ns, span_s, turn_rad, sigma_rad, open } = self;
        visitor.u64(start_ns);
        visitor.u32(open);
        visitor.f64s(turn_rad);
        visitor.f64s([span_s, sigma_rad]);
    }
}
