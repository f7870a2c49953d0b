//! Poses that something else measured: closures from the world itself.

use super::{
    Graph,
    closures::{Closure, WORLD},
    twist::squared,
};
use crate::{
    egomotion::MotionCovariance,
    geometry::{MapSegment, Transform},
};

/// Standard deviation of a rotation that was not measured, rad: more than any there is.
const UNMEASURED_RAD: f64 = 10.0;
/// Standard deviation of a position that was not measured, m.
const UNMEASURED_M: f64 = 1e4;

/// Pose of the camera that something else measured: a surveyed mark, a satellite receiver, a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseFix {
    /// Pose of the left camera, camera to world: the camera of the first frame is the world.
    pub t_world_camera: Transform,
    /// Covariance of the pose, in the camera's frame.
    pub covariance: MotionCovariance,
}

impl PoseFix {
    /// A position, with its standard deviations along the world's axes, m, of a camera that stands
    /// about so: the turn counts for nothing.
    ///
    /// ```
    /// use dynvox_core::{geometry::Transform, places::PoseFix};
    ///
    /// let about = Transform::from_translation([0.0, 0.0, 10.4]);
    /// // A receiver that knows height (the world's y) less well.
    /// let fix = PoseFix::of_position([0.1, 0.0, 10.0], [0.02, 0.05, 0.02], &about);
    /// assert_eq!(fix.t_world_camera.translation_m, [0.1, 0.0, 10.0]);
    /// assert_eq!(fix.covariance.translation_sigma_m(), [0.02, 0.05, 0.02]);
    /// ```
    pub fn of_position(
        position_m: [f64; 3],
        sigma_m: [f64; 3],
        t_world_camera: &Transform,
    ) -> Self {
        let mut matrix = [[0.0; 6]; 6];
        let sigmas = [UNMEASURED_RAD; 3].into_iter().chain(sigma_m);
        for ((at, row), sigma) in matrix.iter_mut().enumerate().zip(sigmas) {
            if let Some(entry) = row.get_mut(at) {
                *entry = sigma * sigma;
            }
        }
        Self::in_world(Transform { translation_m: position_m, ..*t_world_camera }, &matrix)
    }

    /// The direction that is up, in the camera's axes and in the world's, with the standard
    /// deviation of its angle, rad, of a camera that stands about so: the turn about the vertical
    /// and the position count for nothing. The pose is not a finite one where a direction is
    /// zero, or the camera stands on its head.
    ///
    /// ```
    /// use dynvox_core::{geometry::Transform, places::PoseFix};
    ///
    /// // The world's y points down; the camera takes itself for level, and is rolled by a degree.
    /// let rolled = Transform::new([0.0, 0.0, 1f64.to_radians()], [0.0; 3]);
    /// let up_camera = rolled.inverse().rotate([0.0, -1.0, 0.0]);
    /// let fix =
    ///     PoseFix::of_vertical(up_camera, [0.0, -1.0, 0.0], 0.002, &Transform::IDENTITY);
    /// assert!((fix.t_world_camera.inverse() * rolled).angle_rad() < 1e-12);
    /// let [_, yaw_rad, roll_rad] = fix.covariance.rotation_sigma_rad();
    /// assert!((roll_rad - 0.002).abs() < 1e-9 && yaw_rad > 9.0);
    /// ```
    pub fn of_vertical(
        up_camera: [f64; 3],
        up_world: [f64; 3],
        sigma_rad: f64,
        t_world_camera: &Transform,
    ) -> Self {
        let unit = |[x, y, z]: [f64; 3]| {
            let length = libm::sqrt(x * x + y * y + z * z);
            [x / length, y / length, z / length]
        };
        let (driven, up) = (unit(t_world_camera.rotate(up_camera)), unit(up_world));
        let ([a, b, c], [x, y, z]) = (driven, up);
        // The shortest turn from one direction to the other.
        let shortest = [b * z - c * y, c * x - a * z, a * y - b * x, 1.0 + a * x + b * y + c * z];
        let upright = Transform { rotation: shortest, translation_m: [0.0; 3] }.normalized();
        let turned = Transform {
            translation_m: t_world_camera.translation_m,
            ..(upright * *t_world_camera).normalized()
        };
        let [tilt, unmeasured] = [sigma_rad, UNMEASURED_RAD].map(|sigma| sigma * sigma);
        let mut matrix = [[0.0; 6]; 6];
        for (row, entries) in matrix.iter_mut().enumerate() {
            for (column, entry) in entries.iter_mut().enumerate() {
                let diagonal = if row == column { 1.0 } else { 0.0 };
                *entry = match (up.get(row), up.get(column)) {
                    (Some(a), Some(b)) => tilt * diagonal + (unmeasured - tilt) * a * b,
                    (None, None) => UNMEASURED_M * UNMEASURED_M * diagonal,
                    _ => 0.0,
                };
            }
        }
        Self::in_world(turned, &matrix)
    }

    /// A pose whose covariance is given along the world's axes.
    fn in_world(t_world_camera: Transform, matrix: &[[f64; 6]; 6]) -> Self {
        let turn = Transform { translation_m: [0.0; 3], ..t_world_camera };
        let in_world = MotionCovariance::from_matrix(matrix);
        let covariance = MotionCovariance::ZERO.after(&in_world, &turn.inverse());
        Self { t_world_camera, covariance }
    }

    /// Tells that each direction has an error, in finite numbers.
    pub(crate) fn has_errors(&self) -> bool {
        self.covariance.lower().iter().all(|entry| entry.is_finite())
            && squared(&[0.0; 6], &self.covariance).is_some()
    }
}

impl Graph<'_> {
    /// Takes a pose of the camera as it is now. Returns whether it was taken: the camera must be in
    /// the segment that is the world, the way from the newest keyframe known, and that keyframe
    /// without such a pose.
    #[inline(never)]
    pub(in crate::places) fn fix(
        &mut self,
        slots: impl DoubleEndedIterator<Item = usize>,
        fix: &PoseFix,
    ) -> bool {
        let Some(to) = self.newest(slots) else { return false };
        let Some(way) = self.way.as_deref().filter(|way| !way.is_loose) else { return false };
        let is_in_world = way.last.is_some_and(|last| last.segment == MapSegment::FIRST);
        if !is_in_world || self.is_held(to, |from| from == WORLD) {
            return false;
        }
        let t_node_camera = way.t_camera_node.inverse();
        let closure = Closure {
            t_from_to: (fix.t_world_camera * way.t_camera_node).normalized(),
            covariance: MotionCovariance::ZERO.after(&fix.covariance, &t_node_camera),
            from: WORLD,
            to: to as u32,
            weight: 1.0,
        };
        let is_taken = self.take(closure);
        self.counts.fixes = self.counts.fixes.saturating_add(u32::from(is_taken));
        is_taken
    }
}
