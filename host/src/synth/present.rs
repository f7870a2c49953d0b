//! Cars near the camera at one frame.

use std::sync::Arc;

use dynvox_core::geometry::Transform;

use super::config::CarKind;
use super::frame::ObjectTruth;
use super::mesh::Mesh;
use super::segment::ParkedCar;
use super::surface::Tone;

/// Slower than this a car stands, m/s.
const STANDS_M_S: f64 = 1e-9;

/// A car near the camera at one frame.
pub struct PresentCar {
    /// Number that stays the car's for ever.
    pub id: u32,
    /// Body of the car.
    pub kind: CarKind,
    /// Paint of the car.
    pub paint: Tone,
    /// Pose of the car on the street.
    pub t_street_car: Transform,
    /// Speed of the car, m/s.
    pub speed_m_s: f64,
}

impl From<&ParkedCar> for PresentCar {
    fn from(&ParkedCar { id, kind, paint, t_street_car }: &ParkedCar) -> Self {
        Self { id, kind, paint, t_street_car, speed_m_s: 0.0 }
    }
}

impl PresentCar {
    /// Body, paint and pose, as a scene takes them.
    pub fn posed(&self) -> (CarKind, Tone, Transform) {
        (self.kind, self.paint, self.t_street_car)
    }

    /// Truth about the car, in a world that begins at the first camera.
    pub fn truth(&self, bodies: &[Arc<Mesh>; 5], t_camera0_street: &Transform) -> ObjectTruth {
        let (low, high) = bodies[self.kind as usize].bounds_m();
        ObjectTruth {
            id: self.id,
            class: self.kind.class(),
            t_world_object: (*t_camera0_street * self.t_street_car).normalized(),
            dimensions_m: [2.0 * high.x, -low.y, 2.0 * high.z],
            moving: self.speed_m_s > STANDS_M_S,
            speed_m_s: self.speed_m_s,
        }
    }
}

/// Puts cars in order of their ids, and keeps as many as a mask can number.
pub fn number(cars: &mut Vec<PresentCar>) {
    cars.sort_by_key(|car| car.id);
    cars.truncate(usize::from(u8::MAX));
}
