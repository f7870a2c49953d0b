//! The camera's motion from frame to frame, also where it cannot be estimated.

use super::{EgomotionConfig, Estimator, MotionEstimate};
use crate::{
    geometry::{StereoRig, Transform},
    random::Random,
    scene_flow::Match,
    state::{Hasher, Visitor},
};

/// Seed of the camera's own draws.
const SEED: u64 = 0x6361_6D65_7261;

/// Where the camera is and how it last moved.
#[derive(Clone, Debug)]
pub struct Egomotion {
    t_world_camera: Transform,
    t_current_previous: Transform,
    held: u32,
    random: Random,
}

impl Default for Egomotion {
    /// A camera at the world's origin that has not moved.
    fn default() -> Self {
        Self {
            t_world_camera: Transform::IDENTITY,
            t_current_previous: Transform::IDENTITY,
            held: 0,
            random: Random::new(SEED),
        }
    }
}

impl Egomotion {
    /// Moves the camera by one frame: as estimated or, failing that, as before (constant velocity).
    pub fn step<'m>(
        &mut self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        matches: impl IntoIterator<Item = &'m Match>,
        estimator: &mut Estimator<'_>,
    ) -> MotionEstimate {
        let estimate = estimator.estimate(config, rig, matches, &mut self.random, Some(&self.t_current_previous));
        self.advance(estimate.t_current_previous);
        estimate
    }

    /// Moves the camera by one frame: as found or, failing that, as before.
    pub fn advance(&mut self, t_current_previous: Option<Transform>) {
        match t_current_previous {
            Some(motion) => (self.t_current_previous, self.held) = (motion, 0),
            None => self.held = self.held.saturating_add(1),
        }
        self.t_world_camera = (self.t_world_camera * self.t_current_previous.inverse()).normalized();
    }

    /// Sets the camera's pose to a given one; its motion is the difference from the pose before.
    pub fn set_pose(&mut self, t_world_camera: &Transform) {
        self.t_current_previous = (t_world_camera.inverse() * self.t_world_camera).normalized();
        self.t_world_camera = t_world_camera.normalized();
        self.held = 0;
    }

    #[cfg(test)]
    pub(super) fn pose_mut(&mut self) -> &mut Transform {
        &mut self.t_world_camera
    }

    /// Digest of the pose, of the motion to be extrapolated, of the random numbers to come, and of this frame's estimate.
    pub fn digest(&mut self, estimate: Option<&MotionEstimate>) -> u64 {
        let mut hasher = Hasher::default();
        self.visit(&mut hasher);
        let mut digest = hasher.0;
        if let Some(estimate) = estimate {
            let counts = [estimate.status as u32, estimate.matches, estimate.inliers, estimate.samples, estimate.steps];
            counts.iter().for_each(|&count| digest.u64(u64::from(count)));
            digest.f64(estimate.residual_rms_px);
        }
        digest.finish()
    }

    /// Visits every field.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { t_world_camera, t_current_previous, held, random } = self;
        visitor.transform(t_world_camera);
        visitor.transform(t_current_previous);
        visitor.u32(held);
        random.visit(visitor);
    }

    /// Maps camera coordinates to world coordinates, which are the first camera's.
    pub fn t_world_camera(&self) -> &Transform {
        &self.t_world_camera
    }

    /// The last motion, estimated or held.
    pub fn t_current_previous(&self) -> &Transform {
        &self.t_current_previous
    }

    /// Frames in a row for which the motion has been held; 0 when the last one was estimated.
    pub fn held_frames(&self) -> u32 {
        self.held
    }
}
