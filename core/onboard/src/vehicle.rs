//! Place and heading of the vehicle in the planner's window.

use dynvox_core::geometry::Transform;
use dynvox_core::planning::Planning;

/// Turn from the axes of a camera that looks ahead (x right, y down, z ahead) to a vehicle's
/// (x ahead, y right, z down), as MAVLink's `MAV_FRAME_BODY_FRD` has them: quaternion x, y, z, w.
const LOOKS_AHEAD: [f64; 4] = [0.5, 0.5, 0.5, 0.5];
/// Shortest horizontal part of a heading, as a share of its length.
const HEADING_MIN: f64 = 1e-3;

/// A vehicle that carries the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    t_world_body: Transform,
    is_placed: bool,
}

/// A vehicle on the grid of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OnGrid {
    /// Position, in cells.
    pub center: [f64; 3],
    /// Heading, a unit vector (right, ahead).
    pub heading: [f64; 2],
    /// Side of a cell, m.
    pub cell_m: f64,
}

impl Vehicle {
    /// A vehicle whose camera looks ahead and stands where the vehicle does. `is_placed` is false
    /// where the pose is a guess (`PoseOrigin::Extrapolated`): then nothing around is known.
    pub fn new(t_world_camera: &Transform, is_placed: bool) -> Self {
        let t_body_camera = Transform { rotation: LOOKS_AHEAD, translation_m: [0.0; 3] };
        Self::with_mount(t_world_camera, &t_body_camera, is_placed)
    }

    /// A vehicle with a mounted camera: `t_body_camera` maps the camera's coordinates to the
    /// vehicle's, x ahead, y right, z down, m.
    ///
    /// ```
    /// use dynvox_core::geometry::Transform;
    /// use dynvox_onboard::Vehicle;
    ///
    /// // The camera stands 0.3 m before the vehicle's centre.
    /// let mount = Transform { rotation: [0.5, 0.5, 0.5, 0.5], translation_m: [0.3, 0.0, 0.0] };
    /// let vehicle = Vehicle::with_mount(&Transform::IDENTITY, &mount, true);
    /// assert!((vehicle.position_m()[2] + 0.3).abs() < 1e-12);
    /// ```
    pub fn with_mount(
        t_world_camera: &Transform,
        t_body_camera: &Transform,
        is_placed: bool,
    ) -> Self {
        let t_world_body = t_world_camera * t_body_camera.inverse();
        let is_sound = t_world_body.is_finite() && t_world_body.is_rotation();
        Self { t_world_body, is_placed: is_placed && is_sound }
    }

    /// Position in the world, m.
    pub fn position_m(&self) -> [f64; 3] {
        self.t_world_body.translation_m
    }

    /// Turns a point of the world into the vehicle's axes, m.
    pub(crate) fn in_body(&self, point_m: [f64; 3]) -> [f64; 3] {
        self.t_world_body.inverse().transform_point(point_m)
    }

    /// The vehicle on a window's grid; `None` where its pose is a guess, or it points straight up
    /// or down and has no heading.
    pub(crate) fn on_grid(&self, planning: &Planning<'_>) -> Option<OnGrid> {
        if !self.is_placed {
            return None;
        }
        let grid = planning.grid();
        let center = grid.of_world(self.position_m());
        let ahead = self.t_world_body.transform_point([1.0, 0.0, 0.0]);
        let [x, y, z] = grid.of_world(ahead);
        let [dx, dy, dz] = [x - center[0], y - center[1], z - center[2]];
        let (level, whole) = (libm::hypot(dx, dy), libm::sqrt(dx * dx + dy * dy + dz * dz));
        let heading = [dx / level, dy / level];
        (level > HEADING_MIN * whole).then_some(OnGrid { center, heading, cell_m: grid.cell_m() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_looks_ahead_gives_its_own_axes_turned() {
        let vehicle = Vehicle::new(&Transform::IDENTITY, true);
        let [ahead, right, down] = vehicle.in_body([2.0, 3.0, 5.0]);
        assert!((ahead - 5.0).abs() < 1e-12 && (right - 2.0).abs() < 1e-12);
        assert!((down - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_pose_that_is_none_is_not_placed() {
        let lost = Transform { translation_m: [f64::NAN; 3], ..Transform::IDENTITY };
        assert!(
            !Vehicle::new(&lost, true).is_placed
                && !Vehicle::new(&Transform::IDENTITY, false).is_placed
        );
    }
}
