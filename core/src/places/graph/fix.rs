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

/// Pose of the camera that something else measured: a surveyed mark, a satellite receiver.
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
        let turn = Transform { translation_m: [0.0; 3], ..*t_world_camera };
        let in_world = MotionCovariance::from_matrix(&matrix);
        Self {
            t_world_camera: Transform { translation_m: position_m, ..*t_world_camera },
            covariance: MotionCovariance::ZERO.after(&in_world, &turn.inverse()),
        }
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
        mut slots: impl DoubleEndedIterator<Item = usize>,
        fix: &PoseFix,
    ) -> bool {
        let Some(to) = slots.rfind(|&slot| self.used(slot).is_some()) else { return false };
        let Some(way) = self.way.as_deref().filter(|way| !way.is_loose) else { return false };
        let is_in_world = way.last.is_some_and(|last| last.segment == MapSegment::FIRST);
        let has_one = |closure: &Closure| closure.to == to as u32 && closure.from == WORLD;
        if !is_in_world || self.closures.iter().take(self.closure_len).any(has_one) {
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
