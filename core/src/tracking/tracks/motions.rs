//! Each track's motion, state and pose in a frame.

use super::Track;
use crate::tracking::{
    instances::Instance,
    matches::{
        AssignedMatches, FrameMatches, GuidedMatching, ObjectMasks, OwnMatches, pixel,
        search_by_projection,
    },
    motion::{
        CameraMotion, GuidedSearch, MotionConfig, MotionEvidence, MotionFrame, MotionState,
        ObjectMotion, StateConfig,
    },
};
use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
    masks::{MaskStore, TwoFrames},
    scene_flow::Match,
};

/// Seed of the objects' random samples.
const SEED: u64 = 0x006F_626A_6563_7473;

/// Matches and camera motion from which a frame's motions are estimated.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct MotionInput<'a, 's> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// The camera's own motion.
    pub camera: CameraMotion,
    /// The matches that were assigned.
    pub matches: FrameMatches<'a>,
    /// Images in which more matches are searched for, if any.
    pub search: Option<GuidedMatching<'a, 's>>,
}

/// Instances, masks and owners of matches by which the tracks of a frame are estimated.
pub(in super::super) struct TrackMotions<'t, 's> {
    pub motion: &'t MotionConfig,
    pub state: &'t StateConfig,
    /// Time since the frame before, s.
    pub interval_s: f64,
    /// Number of the frame.
    pub frame: u32,
    pub instances: &'t [Instance],
    pub masks: &'t TwoFrames<MaskStore<'s>>,
    pub matches: &'t mut AssignedMatches<'s>,
}

impl TrackMotions<'_, '_> {
    /// Estimates each track's motion, state and pose from the matches assigned to it.
    pub fn estimate(
        &mut self,
        tracks: &mut [Track],
        input: &MotionInput<'_, '_>,
        estimator: &mut Estimator<'_>,
    ) {
        let &MotionInput {
            rig, camera: CameraMotion { t_world_camera, t_current_previous }, ..
        } = input;
        let interval_s = self.interval_s;
        for track in tracks {
            let was_known = track.motion_state.state() != MotionState::Uncertain;
            // The motion, where the track was seen before.
            track.filter.predict(self.motion, interval_s);
            let outcome = t_current_previous
                .filter(|_| track.sightings > 1)
                .and_then(|motion| self.estimate_track(track, &motion, input, estimator));
            let ObjectMotion { matches, inliers, measured } = outcome.unwrap_or_default();
            (track.matches, track.inliers, track.measured) = (matches, inliers, measured.into());
            // The state, by the speed or its lack.
            let (config, camera, filter) = (self.motion, &input.camera, &track.filter);
            let observe = || MotionEvidence::new(config, rig, camera, filter, interval_s);
            let observed = measured.then(observe).flatten();
            if let Some(MotionEvidence { sigma_m_s, .. }) = observed {
                track.sigma_m_s = sigma_m_s;
            }
            track.motion_state.update(self.state, observed);
            // The pose.
            if !measured && track.filter.is_known() {
                track.filter.coast(interval_s);
            }
            track.advance_pose(&t_world_camera, was_known, interval_s);
        }
    }

    /// Estimates the motion of a track; `None` unless it is detected in this frame.
    fn estimate_track(
        &mut self,
        track: &mut Track,
        t_current_previous: &Transform,
        input: &MotionInput<'_, '_>,
        estimator: &mut Estimator<'_>,
    ) -> Option<ObjectMotion> {
        let at = track.instance.get()?;
        let Some(instance) = self.instances.get(at) else {
            debug_assert!(false, "a track names an instance of this frame");
            return None;
        };
        let (current, previous, previous_mask) =
            (self.masks.current(), self.masks.previous(), track.mask);
        let was_under_mask = |m: &Match| {
            let (u, v) = pixel(m.previous_left);
            previous.contains(&previous_mask, u, v)
        };
        let OwnMatches { matches, enough, found } =
            self.matches.own(input.matches, at, was_under_mask);
        let frame = MotionFrame {
            config: self.motion,
            rig: input.rig,
            t_world_camera: &input.camera.t_world_camera,
            t_current_previous,
            interval_s: self.interval_s,
            seed: SEED ^ u64::from(track.id) << 32 ^ u64::from(self.frame),
        };
        // Few matches: more are searched for in the images.
        let masks =
            ObjectMasks { current: (current, instance.mask), previous: (previous, previous_mask) };
        let search = input.search.filter(|_| !enough).map(|search| GuidedSearch {
            find: move |motion: &Transform, found: &mut [Match]| {
                search_by_projection(&search, input.rig, &masks, motion, found)
            },
            found,
        });
        Some(frame.estimate(matches, search, &mut track.filter, estimator))
    }
}
