//! Forces between two frames: the vertical, and the way of a camera whose images show none.

use super::InertialPrior;
use crate::{
    geometry::Transform,
    inertial::{
        turn::MeasuredMotion,
        velocity::{Acceleration, Velocity},
        vertical::{UnitMotion, VerticalFilter},
    },
};
use nalgebra::{Point3, Vector3};

impl InertialPrior {
    /// Mean acceleration over the frame's interval, at whose start the unit stood there.
    fn acceleration(&self, t_world_unit: &Transform) -> Option<Acceleration> {
        let (integral, (held, sigma)) = (self.integral.as_ref()?, self.vertical.held(&self.unit)?);
        let mean = t_world_unit.rotate(integral.mean_force) - held;
        Some(Acceleration { mean, sigma, span_s: self.span_s })
    }

    /// Position of the camera after the frame's interval in its axes before it, and the standard
    /// deviation of an axis, m; `None` where forces or the velocity are known too little.
    pub(super) fn way_m(&self, t_world_camera: &Transform) -> Option<([f64; 3], f64)> {
        let from = *t_world_camera * self.unit.t_camera_unit;
        let (way_m, sigma_m) = self.velocity.way_m(&self.acceleration(&from)?)?;
        let turned = from * self.integral.as_ref()?.t_start_end;
        let to = Transform { translation_m: (from.translation() + way_m).into(), ..turned };
        let camera = to * self.unit.t_camera_unit.inverse();
        Some(((t_world_camera.inverse() * camera).translation_m, sigma_m))
    }

    /// Learns the vertical and the velocity.
    pub(super) fn observe_force(&mut self, measured: &MeasuredMotion) {
        if self.segment != measured.segment {
            self.segment = measured.segment;
            (self.vertical, self.velocity) = (VerticalFilter::default(), Velocity::default());
        }
        let unit_at = |camera: &Transform| *camera * self.unit.t_camera_unit;
        let to = unit_at(&measured.t_world_camera);
        let Some((before, integral)) = measured.t_world_before.as_ref().zip(self.integral) else {
            // A guess at either end says nothing of the acceleration but what forces say.
            let start = self.integral.map(|integral| to * integral.t_start_end.inverse());
            let acceleration = start.and_then(|start| self.acceleration(&start));
            self.velocity.pass(acceleration.as_ref());
            self.vertical.interrupt();
            return;
        };
        let from = unit_at(before);
        let acceleration = self.acceleration(&from);
        self.velocity.pass(acceleration.as_ref());
        if let Some(acceleration) = &acceleration {
            let way_m: Vector3<f64> = to.translation() - from.translation();
            if !self.velocity.measure(&way_m, measured.way_sigma_m, acceleration) {
                // Nor would its acceleration tell what is up.
                self.vertical.interrupt();
                return;
            }
        }
        self.vertical.add(&UnitMotion {
            force_world: from.rotate(integral.mean_force),
            from: Point3::from(from.translation_m),
            to: Point3::from(to.translation_m),
            span_s: self.span_s,
        });
    }
}
