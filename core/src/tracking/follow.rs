//! Each track's motion, state and pose in a frame.

use super::{
    CameraMotion, InstancesConfig, State, Tracker,
    claim::{near, pixel},
    look::{Outline, Seen, look},
    measure::{Ground, measure},
    pose::{numbers, transform},
    state::Evidence,
    track::Track,
};
use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
    scene_flow::Match,
};

/// Seed of the objects' draws.
const SEED: u64 = 0x006F_626A_6563_7473;

impl<'s> Tracker<'s> {
    /// Each track's motion, state and pose in this frame, from the matches handed to [`Tracker::claim`].
    pub fn follow(&mut self, rig: &StereoRig, seen: &Seen<'_, '_>, camera: &CameraMotion, estimator: &mut Estimator<'_>) {
        let Seen { refined, sparse, images } = *seen;
        let [a, b] = &self.masks;
        let (now, before) = if self.now == 0 { (a, b) } else { (b, a) };
        let (detections, looked) = (self.detections.all(), &mut *self.looked);
        let known = |track: &Track| track.judgement.state() != State::Uncertain;
        for track in self.tracks.all_mut() {
            let was_known = known(track);
            let interval_s = f64::from(self.config.frame_interval_s);
            track.filter.predict(&self.config.motion, interval_s);
            (track.matches, track.inliers, track.measured) = (0, 0, 0);
            if let (Some(t_current_previous), true) = (&camera.t_current_previous, track.detection > 0 && track.sightings > 1) {
                let place = track.place;
                let was_mine = |m: &Match| {
                    let (u, v) = pixel(m.previous_left);
                    before.contains(&place, u, v)
                };
                // Few of all matches are one track's: whose they are is asked first.
                let mine = |&(m, &owner): &(&Match, &u8)| u32::from(owner) == track.detection && was_mine(m);
                let own = refined.iter().zip(&*self.owner).filter(mine).map(|(m, _)| m);
                let enough = own.clone().count() >= usize::from(self.config.motion.matches_enough);
                // Sparse matches of the same features say nothing new.
                for (m, owner) in sparse.iter().zip(self.sparse_owner.iter_mut()).filter(|(_, owner)| u32::from(**owner) == track.detection)
                {
                    if enough || own.clone().any(|other| near(m.current_left, other.current_left)) {
                        *owner = 0;
                    }
                }
                let own = own.chain(sparse.iter().zip(&*self.sparse_owner).filter(mine).map(|(m, _)| m));
                let ground = Ground { rig, t_world_camera: &camera.t_world_camera, t_current_previous, interval_s };
                let seed = SEED ^ u64::from(track.id) << 32 ^ u64::from(self.frame);
                let detection = track.detection.checked_sub(1).and_then(|at| detections.get(at as usize));
                let look = images.zip(detection).filter(|_| !enough).map(|(images, detection)| {
                    let outline = Outline { now: (now, detection.place), before: (before, place) };
                    (move |motion: &Transform, found: &mut [Match]| look(images, rig, &outline, motion, found), &mut *looked)
                });
                let seen = measure(&self.config.motion, &ground, own, look, &mut track.filter, seed, estimator);
                (track.matches, track.inliers, track.measured) = (seen.matches, seen.inliers, u32::from(seen.measured));
            }
            judge(&self.config, rig, camera, track);
            if track.measured == 0 && track.filter.is_known() {
                track.filter.coast(interval_s);
            }
            place(track, &camera.t_world_camera, was_known, interval_s);
        }
    }
}

/// Takes a frame's motion, or its lack, into a track's state.
fn judge(config: &InstancesConfig, rig: &StereoRig, camera: &CameraMotion, track: &mut Track) {
    let evidence = camera.t_current_previous.filter(|_| track.measured == 1).map(|t_current_previous| {
        let interval_s = f64::from(config.frame_interval_s);
        let [speed, sigma, spread] = track.filter.speed();
        let camera_world = camera.t_world_camera.inverse();
        let standing = camera_world.transform_point(track.filter.center_world());
        let now = standing + camera_world.rotate(track.filter.velocity()) * interval_s;
        let passing = (now - t_current_previous.inverse().transform_point(standing)).norm() / interval_s;
        let turned = f64::from(config.motion.camera_rad) * standing.z / interval_s;
        track.sigma_m_s = libm::sqrt(sigma * sigma + turned * turned) as f32;
        // Depth goes with the inverse of disparity, its change with the inverse square.
        let side = rig.focal_px * standing.x / (standing.z * rig.center_u_px);
        let error_px = f64::from(config.motion.bias_px) + f64::from(config.motion.lens_px) * side * side * side * side;
        let bias = passing * 2.0 * error_px * standing.z / rig.focal_baseline_px_m();
        Evidence {
            speed_m_s: speed as f32,
            sigma_m_s: track.sigma_m_s,
            spread_m_s: libm::sqrt(spread * spread + turned * turned) as f32,
            bias_m_s: bias as f32,
        }
    });
    track.judgement.advance(&config.state, evidence);
}

/// Motion over ground in this frame: none for an object that stands.
pub(super) fn motion_world(track: &Track, interval_s: f64) -> Transform {
    if track.judgement.state() == State::Static || !track.filter.is_known() {
        return Transform::IDENTITY;
    }
    track.filter.motion(interval_s)
}

/// Moves a track's chain of poses on, begins a new one or breaks it.
fn place(track: &mut Track, t_world_camera: &Transform, was_known: bool, interval_s: f64) {
    let is_known = track.judgement.state() != State::Uncertain;
    let connects = track.chain > 0 && (track.measured == 1 || is_known);
    if connects {
        let moved = (motion_world(track, interval_s) * transform(&track.t_world_object)).normalized();
        let stands = track.judgement.state() == State::Static;
        track.t_world_object = if stands && !was_known { track.t_world_origin } else { numbers(&moved) };
        track.chain += 1;
    } else if track.detection > 0 {
        let here = numbers(t_world_camera);
        (track.t_world_origin, track.t_world_object) = (here, here);
        (track.chain, track.chains) = (1, track.chains + 1);
    } else {
        track.chain = 0;
    }
}
