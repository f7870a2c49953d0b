//! Forces between two frames: the vertical, and the way of a camera whose images show none.

use super::InertialPrior;
use crate::{
    geometry::Transform,
    inertial::{
        gravity::{Gravity, Interval},
        turn::MeasuredMotion,
    },
};

impl InertialPrior {
    /// The frame's interval, at whose start the unit stood there.
    fn interval(&self, t_world_unit: &Transform, turn_sigma_rad: f64) -> Interval {
        let force = self.integral.map(|integral| t_world_unit.rotate(integral.mean_force));
        Interval { span_s: self.span_s, force, turn_sigma_rad }
    }

    /// Position of the camera after the frame's interval in its axes before it, and the standard
    /// deviation of an axis, m; `None` where forces or the velocity are known too little.
    pub(super) fn way_m(&self, t_world_camera: &Transform) -> Option<([f64; 3], f64)> {
        let from = *t_world_camera * self.unit.t_camera_unit;
        let (way_m, sigma_m) = self.gravity.way_m(&self.interval(&from, 0.0))?;
        let turned = from * self.integral.as_ref()?.t_start_end;
        let to = Transform { translation_m: (from.translation() + way_m).into(), ..turned };
        let camera = to * self.unit.t_camera_unit.inverse();
        Some(((t_world_camera.inverse() * camera).translation_m, sigma_m))
    }

    /// Learns the vertical and the velocity.
    pub(super) fn observe_force(&mut self, measured: &MeasuredMotion) {
        if self.segment != measured.segment {
            (self.segment, self.gravity) = (measured.segment, Gravity::default());
        }
        let unit_at = |camera: &Transform| *camera * self.unit.t_camera_unit;
        let to = unit_at(&measured.t_world_camera);
        let (from, way, turn_sigma_rad) = match &measured.t_world_before {
            Some(before) => {
                let from = unit_at(before);
                let way_m = to.translation() - from.translation();
                (from, Some((way_m, measured.way_sigma_m)), measured.sigma_rad)
            }
            // A guess at either end tells no way: the turn is the unit's.
            None => {
                let turned = self.integral.map_or(Transform::IDENTITY, |one| one.t_start_end);
                (to * turned.inverse(), None, f64::from(self.report.turn_sigma_rad))
            }
        };
        let interval = self.interval(&from, turn_sigma_rad);
        self.gravity.pass(&interval, way);
    }
}
