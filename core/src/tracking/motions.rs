//! Each track's motion, state and pose in a frame.

use super::{
    CameraMotion, FrameMatches, MotionState, Tracker, TrackingConfig,
    guided_matching::{GuidedMatching, ObjectMasks, search_by_projection},
    match_assignment::{MatchOwner, OwnerCode, is_same_keypoint, pixel},
    motion_estimate::{GuidedSearch, MotionFrame, estimate_motion},
    motion_state::MotionEvidence,
    track::Track,
};
use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
    scene_flow::Match,
};

/// Refined matches from which on sparse ones are not used; the original: sparse ones only.
const MATCHES_ENOUGH: usize = 60;
/// Seed of the objects' random samples.
const SEED: u64 = 0x006F_626A_6563_7473;

/// Matches and camera motion from which a frame's motions are estimated.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a, 's> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// The camera's own motion.
    pub camera: CameraMotion,
    /// The matches that were assigned.
    pub matches: FrameMatches<'a>,
    /// Images in which more matches are searched for, if any.
    pub search: Option<GuidedMatching<'a, 's>>,
}

impl Tracker<'_> {
    /// Each track's motion, state and pose in this frame, from the matches assigned to it.
    pub(super) fn estimate_motions(
        &mut self,
        input: &MotionInput<'_, '_>,
        estimator: &mut Estimator<'_>,
    ) {
        let interval_s = f64::from(self.config.frame_interval_s);
        for index in 0..self.tracks.all().len() {
            let Some(track) = self.tracks.all_mut().get_mut(index) else { break };
            let was_known = track.motion_state.state() != MotionState::Uncertain;
            track.filter.predict(&self.config.motion, interval_s);
            (track.matches, track.inliers, track.measured) = (0, 0, false.into());
            if let (Some(t_current_previous), true) =
                (&input.camera.t_current_previous, track.sightings > 1)
            {
                self.estimate_motion(index, t_current_previous, input, estimator);
            }
            let Some(track) = self.tracks.all_mut().get_mut(index) else { break };
            classify(&self.config, input.rig, &input.camera, track);
            if !track.measured.get() && track.filter.is_known() {
                track.filter.coast(interval_s);
            }
            advance_pose(track, &input.camera.t_world_camera, was_known, interval_s);
        }
    }

    /// Estimates the motion of the track at `index` if it is detected in this frame.
    fn estimate_motion(
        &mut self,
        index: usize,
        t_current_previous: &Transform,
        input: &MotionInput<'_, '_>,
        estimator: &mut Estimator<'_>,
    ) {
        let Some(track) = self.tracks.all_mut().get_mut(index) else { return };
        let Some(at) = track.instance.get() else { return };
        let Some(instance) = self.instances.all().get(at) else {
            debug_assert!(false, "a track names an instance of this frame");
            return;
        };
        let (current, previous, previous_mask) =
            (self.masks.current(), self.masks.previous(), track.mask);
        let was_under_mask = |m: &Match| {
            let (u, v) = pixel(m.previous_left);
            previous.contains(&previous_mask, u, v)
        };
        // Few matches belong to one track: the owner code, which costs less, is compared first.
        let is_own = |&(m, code): &(&Match, &OwnerCode)| code.is_instance(at) && was_under_mask(m);
        let own =
            input.matches.refined.iter().zip(&*self.refined_owner).filter(is_own).map(|(m, _)| m);
        let enough = own.clone().count() >= MATCHES_ENOUGH;
        // Sparse matches of the same features say nothing new.
        for (m, code) in input
            .matches
            .sparse
            .iter()
            .zip(self.sparse_owner.iter_mut())
            .filter(|(_, code)| code.is_instance(at))
        {
            if enough
                || own.clone().any(|other| is_same_keypoint(m.current_left, other.current_left))
            {
                *code = MatchOwner::None.into();
            }
        }
        let own = own.chain(
            input.matches.sparse.iter().zip(&*self.sparse_owner).filter(is_own).map(|(m, _)| m),
        );
        let frame = MotionFrame {
            rig: input.rig,
            t_world_camera: &input.camera.t_world_camera,
            t_current_previous,
            interval_s: f64::from(self.config.frame_interval_s),
            seed: SEED ^ u64::from(track.id) << 32 ^ u64::from(self.frame),
        };
        let masks =
            ObjectMasks { current: (current, instance.mask), previous: (previous, previous_mask) };
        let search = input.search.filter(|_| !enough).map(|search| GuidedSearch {
            find: move |motion: &Transform, found: &mut [Match]| {
                search_by_projection(&search, input.rig, &masks, motion, found)
            },
            found: &mut *self.guided_matches,
        });
        let estimate =
            estimate_motion(&self.config.motion, &frame, own, search, &mut track.filter, estimator);
        (track.matches, track.inliers, track.measured) =
            (estimate.matches, estimate.inliers, estimate.measured.into());
    }
}

/// Updates a track's state by a frame's motion, or by its lack.
fn classify(config: &TrackingConfig, rig: &StereoRig, camera: &CameraMotion, track: &mut Track) {
    let motion_evidence =
        camera.t_current_previous.filter(|_| track.measured.get()).map(|t_current_previous| {
            let interval_s = f64::from(config.frame_interval_s);
            let [speed, sigma, spread] = track.filter.speed();
            let camera_world = camera.t_world_camera.inverse();
            let static_prediction = camera_world.transform_point(track.filter.center_world());
            let now = static_prediction + camera_world.rotate(track.filter.velocity()) * interval_s;
            let passing = (now - t_current_previous.inverse().transform_point(static_prediction))
                .norm()
                / interval_s;
            let rotation_error =
                f64::from(config.motion.camera_rad) * static_prediction.z / interval_s;
            track.sigma_m_s = libm::sqrt(sigma * sigma + rotation_error * rotation_error) as f32;
            // Depth goes with the inverse of disparity, its change with the inverse square.
            let side = rig.focal_px * static_prediction.x / (static_prediction.z * rig.center_u_px);
            let error_px = f64::from(config.motion.bias_px)
                + f64::from(config.motion.lens_px) * side * side * side * side;
            let bias = passing * 2.0 * error_px * static_prediction.z / rig.focal_baseline_px_m();
            MotionEvidence {
                speed_m_s: speed as f32,
                sigma_m_s: track.sigma_m_s,
                spread_m_s: libm::sqrt(spread * spread + rotation_error * rotation_error) as f32,
                bias_m_s: bias as f32,
            }
        });
    track.motion_state.update(&config.state, motion_evidence);
}

/// Motion over ground in this frame: the identity for a static object.
pub(super) fn motion_world(track: &Track, interval_s: f64) -> Transform {
    if track.motion_state.state() == MotionState::Static || !track.filter.is_known() {
        return Transform::IDENTITY;
    }
    track.filter.motion(interval_s)
}

/// Continues a track's trajectory segment, begins a new one or ends it.
fn advance_pose(track: &mut Track, t_world_camera: &Transform, was_known: bool, interval_s: f64) {
    let state = track.motion_state.state();
    let connects =
        track.segment_len > 0 && (track.measured.get() || state != MotionState::Uncertain);
    if connects {
        let advanced = (motion_world(track, interval_s) * track.t_world_object).normalized();
        let is_new_static = state == MotionState::Static && !was_known;
        track.t_world_object = if is_new_static { track.t_world_origin } else { advanced };
        track.segment_len += 1;
    } else if track.instance.is_some() {
        (track.t_world_origin, track.t_world_object) = (*t_world_camera, *t_world_camera);
        (track.segment_len, track.segment_id) = (1, track.segment_id + 1);
    } else {
        track.segment_len = 0;
    }
}
