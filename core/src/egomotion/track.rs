//! The camera's motion from frame to frame, also where it cannot be estimated.

mod rivals;
mod weak;

use rivals::Contest;
pub use weak::WeakDirections;

use super::{
    EgomotionConfig, Estimator, MotionEstimate, MotionHypotheses, MotionStatus, PredictedTurn,
    RightAhead,
};
use crate::{
    geometry::{MapSegment, StereoRig, Transform},
    random::Random,
    scene_flow::Match,
    state::{Hasher, Visitor},
};

mod turn;

pub(crate) use turn::SeenMotion;
use turn::Sight;

/// Seed of the camera's own draws.
const SEED: u64 = 0x6361_6D65_7261;

/// An estimate with so many times fewer inliers than the one before it is not strong, however large
/// their share.
const MAX_FEWER_INLIERS: u32 = 4;

/// Times between frames of one motion, s: a nanosecond at least, and years at most.
const TIMES_S: (f64, f64) = (1e-10, 1e9);
/// Distance beyond all maps and motions, m.
const FARTHEST_M: f64 = 1e9;
/// Distance by which the estimate of one frame's motion may be wrong, m.
const NOISE_M: f64 = 0.1;

/// Frames without an estimate after which the camera is lost: matches are sought with the last
/// frame, although its pose is a guess.
pub const MAX_REFERENCE_FRAMES: u32 = 8;

/// Matches of a frame with the reference, and when it was taken.
#[derive(Clone, Debug)]
pub struct TimedMatches<M> {
    /// Time since the last frame, s.
    pub interval_s: f32,
    /// Matches with the reference: the last frame whose pose is not a guess.
    pub matches: M,
}

/// Pose of the camera and its last motion.
///
/// ```
/// use dynvox_core::{egomotion::Egomotion, geometry::Transform};
///
/// let mut camera = Egomotion::default();
/// // One metre ahead: what was 1 m away is at the camera now.
/// camera.advance(Some(Transform::from_translation([0.0, 0.0, -1.0])));
/// assert_eq!(camera.t_world_camera().translation_m, [0.0, 0.0, 1.0]);
/// ```
#[derive(Clone, Debug)]
pub struct Egomotion {
    t_world_camera: Transform,
    /// The camera of the frame that matches are sought with.
    t_world_reference: Transform,
    /// Frames from it to the last one.
    since_reference: u32,
    /// Time from the frame that matches are sought with to the last one, s.
    reference_s: f64,
    t_current_previous: Transform,
    /// Time that motion took, s; 0 where no motion was estimated yet.
    motion_s: f64,
    /// Matches that motion explained.
    inliers: u32,
    extrapolated: u32,
    /// Segment of the map that poses lie in, and the one begun last.
    segment: MapSegment,
    newest_segment: MapSegment,
    random: Random,
    /// Turn that an inertial unit predicts for this frame.
    predicted: Option<PredictedTurn>,
    /// Motion that images showed, where a turn is predicted.
    seen: Option<SeenMotion>,
}

impl Default for Egomotion {
    /// A camera at the world's origin that has not moved.
    fn default() -> Self {
        Self {
            t_world_camera: Transform::IDENTITY,
            t_world_reference: Transform::IDENTITY,
            since_reference: 0,
            reference_s: 0.0,
            t_current_previous: Transform::IDENTITY,
            motion_s: 0.0,
            inliers: 0,
            extrapolated: 0,
            segment: MapSegment::FIRST,
            newest_segment: MapSegment::FIRST,
            random: Random::new(SEED),
            predicted: None,
            seen: None,
        }
    }
}

impl Egomotion {
    /// Moves the camera by one frame: as estimated or, failing that, as before (constant velocity).
    /// The estimate is of the motion since the reference.
    #[inline(never)]
    pub fn step<'m>(
        &mut self,
        config: &EgomotionConfig,
        rig: &StereoRig,
        TimedMatches { interval_s, matches }: TimedMatches<
            impl IntoIterator<Item = &'m Match, IntoIter: Clone>,
        >,
        estimator: &mut Estimator<'_>,
    ) -> MotionEstimate {
        // The last motion is the first guess; the rows' differences tell whether cameras expose
        // together.
        let (expected, matches) = (self.expected(), matches.into_iter());
        let right_ahead = RightAhead::from_matches(rig, matches.clone());
        let hypotheses = MotionHypotheses { random: &mut self.random, initial: Some(&expected) };
        let mut found = estimator.estimate(config, rig, matches.clone(), hypotheses);
        self.reference_s += f64::from(interval_s);
        let contest = Contest { camera: self, config, rig, expected: &expected };
        contest.unmix(matches.clone(), estimator, &mut found);
        let winner = contest.choose(matches.clone(), estimator, &found);
        let found = contest.estimate(winner, matches.clone(), estimator, found);
        let found = self.hold_to_turn(Sight { config, rig, matches }, estimator, found);
        let found = self.hold_weak_directions(found);
        let mut estimate = MotionEstimate { right_ahead, ..found };
        // After lost frames the motion spans several: the share of one is checked.
        let frames = self.since_reference.saturating_add(1);
        let motion = estimate
            .t_current_previous
            .map(|motion| if frames == 1 { motion } else { motion.part_of(frames) });
        // A motion that no camera can make is not taken, however many matches agree.
        if let Some(status) = motion.and_then(|motion| self.doubt(config, &motion, &estimate)) {
            estimate =
                MotionEstimate { status, t_current_previous: None, covariance: None, ..estimate };
        }
        // A pose is chained to its reference frame, so that guesses in between leave no trace.
        match (&estimate.t_current_previous, motion) {
            (Some(t_current_reference), Some(motion)) => {
                (self.t_current_previous, self.motion_s, self.inliers) =
                    (motion, self.reference_s / f64::from(frames), estimate.inliers);
                self.t_world_camera =
                    (self.t_world_reference * t_current_reference.inverse()).normalized();
                self.extrapolated = 0;
                self.refer_to_last();
            }
            _ => {
                self.hold_from_reference();
                self.follow_turn(config, &estimate);
            }
        }
        estimate
    }

    /// Moves the camera by one frame: as found or, failing that, as before. The last frame is the
    /// reference.
    pub fn advance(&mut self, t_current_previous: Option<Transform>) {
        match t_current_previous {
            Some(motion) => (self.t_current_previous, self.extrapolated) = (motion, 0),
            None => {
                self.extrapolated = self.extrapolated.saturating_add(1);
                self.t_current_previous = self.next_motion();
            }
        }
        self.extrapolate();
        self.refer_to_last();
    }

    /// Moves the camera by one frame as before, `interval_s` after the last one. The reference
    /// stays, until it is too long ago.
    pub fn hold(&mut self, interval_s: f32) {
        self.reference_s += f64::from(interval_s);
        self.hold_from_reference();
    }

    /// Holds the camera where the time since the reference is counted already.
    fn hold_from_reference(&mut self) {
        self.extrapolated = self.extrapolated.saturating_add(1);
        self.since_reference = self.since_reference.saturating_add(1);
        self.t_current_previous = self.next_motion();
        self.extrapolate();
        if self.is_lost() {
            self.refer_to_last();
        }
    }

    /// Tells that the camera has not been located for so long that its pose says nothing any more.
    pub fn is_lost(&self) -> bool {
        self.extrapolated >= MAX_REFERENCE_FRAMES
    }

    /// Sets the pose at which a camera that was lost is found; its motion stays.
    pub fn relocalize(&mut self, t_world_camera: &Transform) {
        self.t_world_camera = t_world_camera.normalized();
        self.refer_to_last();
    }

    /// Corrects the pose that the last motion led to, and with it that motion.
    pub(super) fn correct_pose(&mut self, t_world_camera: &Transform) {
        self.t_current_previous = (t_world_camera.inverse() * self.t_world_previous()).normalized();
        self.t_world_camera = *t_world_camera;
        self.refer_to_last();
    }

    /// Pose of the frame before the last one, from which the last motion led.
    pub(super) fn t_world_previous(&self) -> Transform {
        (self.t_world_camera * self.t_current_previous).normalized()
    }

    /// Leads the camera into another segment, in which its pose is known now; its motion stays.
    pub fn join_segment(&mut self, segment: MapSegment, t_world_camera: &Transform) {
        self.segment = segment;
        self.relocalize(t_world_camera);
    }

    /// Places a camera that has not moved in the segment after another one. Returns false where no
    /// number is left for it.
    pub fn begin_after(&mut self, segment: MapSegment) -> bool {
        let next = segment.next();
        if let Some(next) = next {
            (self.segment, self.newest_segment) = (next, next);
        }
        next.is_some()
    }

    /// Begins another segment of the map, with the camera at its origin. Where no number is left
    /// for one, the camera stays lost, so that nothing is fused into a segment it is not in.
    pub fn begin_segment(&mut self) {
        match self.newest_segment.next() {
            Some(next) => {
                (self.segment, self.newest_segment) = (next, next);
                self.t_world_camera = Transform::IDENTITY;
            }
            None => self.extrapolated = MAX_REFERENCE_FRAMES,
        }
        self.refer_to_last();
    }

    /// The motion to the next frame from the reference, if the camera moves on as before.
    fn expected(&self) -> Transform {
        match self.since_reference {
            0 => self.next_motion(),
            _ => (self.next_motion() * self.t_world_camera.inverse() * self.t_world_reference)
                .normalized(),
        }
    }

    /// Returns the reason why a camera cannot have moved so since the reference, with `motion` a
    /// frame's share of it; `None` if it can.
    fn doubt(
        &self,
        config: &EgomotionConfig,
        motion: &Transform,
        estimate: &MotionEstimate,
    ) -> Option<MotionStatus> {
        // Few matches can agree on anything.
        let as_many = MAX_FEWER_INLIERS * estimate.inliers >= self.inliers;
        let agree = estimate.inliers as f32 >= config.inlier_share_strong * estimate.matches as f32;
        let after_gap = self.since_reference > 0;
        let strong = as_many && agree;
        // After lost frames a wrong motion would be applied several times over: ask for both signs.
        let vouched = if after_gap { strong } else { agree };
        let is_synchronous =
            |ahead: RightAhead| ahead.is_synchronous(config.right_ahead_max_m, vouched, after_gap);
        let can_accelerate = || {
            self.can_accelerate_to(
                config,
                motion,
                self.reference_s / f64::from(self.since_reference.saturating_add(1)),
            )
        };
        if !estimate.right_ahead.is_none_or(is_synchronous) {
            Some(MotionStatus::Unsynchronized)
        } else if strong || can_accelerate() {
            None
        } else {
            Some(MotionStatus::Implausible)
        }
    }

    /// Returns true if the camera, given its last motion, can move so in the next `frame_s`.
    fn can_accelerate_to(
        &self,
        config: &EgomotionConfig,
        motion: &Transform,
        frame_s: f64,
    ) -> bool {
        // Without a last motion there is nothing that it could contradict.
        if self.motion_s <= 0.0 {
            return true;
        }
        // The last motion, scaled to this frame's time: frames may be dropped.
        let (then, now) = (
            self.t_current_previous.translation() * (frame_s / self.motion_s),
            motion.translation(),
        );
        (now - then).norm() <= config.acceleration_max_m_s2 * frame_s * frame_s + NOISE_M
    }

    /// Returns true if the camera, given its last motion, can stand still for the next
    /// `interval_s`: if not, images that repeat the last ones are old.
    pub fn may_stand(&self, config: &EgomotionConfig, interval_s: f32) -> bool {
        self.can_accelerate_to(config, &Transform::IDENTITY, f64::from(interval_s))
    }

    fn extrapolate(&mut self) {
        self.t_world_camera =
            (self.t_world_camera * self.t_current_previous.inverse()).normalized();
    }

    /// Tells that a motion was estimated or given since the camera began.
    pub(crate) fn has_moved(&self) -> bool {
        self.motion_s > 0.0 || self.t_current_previous != Transform::IDENTITY
    }

    /// Makes the last frame the one that matches are sought with, also if its pose is a guess.
    pub(crate) fn refer_to_last(&mut self) {
        (self.t_world_reference, self.since_reference, self.reference_s) =
            (self.t_world_camera, 0, 0.0);
    }

    /// Frames from the reference to the last one: 0 where the last one is the reference.
    pub fn since_reference(&self) -> u32 {
        self.since_reference
    }

    /// Segment of the map that the pose lies in.
    pub fn segment(&self) -> MapSegment {
        self.segment
    }

    /// Sets the camera's pose to a given one, which lies in the map's first segment. Its motion is
    /// the difference from the pose before if that lies there as well; if not, it stays.
    ///
    /// ```
    /// use dynvox_core::{egomotion::Egomotion, geometry::Transform};
    ///
    /// let mut camera = Egomotion::default();
    /// camera.set_pose(&Transform::from_translation([0.0, 0.0, 2.0]));
    /// assert_eq!(camera.t_world_camera().distance_m(), 2.0);
    /// ```
    pub fn set_pose(&mut self, t_world_camera: &Transform) {
        if self.segment == MapSegment::FIRST {
            self.t_current_previous = (t_world_camera.inverse() * self.t_world_camera).normalized();
        }
        self.segment = MapSegment::FIRST;
        self.t_world_camera = t_world_camera.normalized();
        (self.extrapolated, self.motion_s) = (0, 0.0);
        self.refer_to_last();
    }

    #[cfg(test)]
    pub(super) fn pose_mut(&mut self) -> &mut Transform {
        &mut self.t_world_reference
    }

    /// Digest of the pose, of the motion to be extrapolated, of the random numbers to come, and of
    /// this frame's estimate.
    pub fn digest(&mut self, estimate: Option<&MotionEstimate>) -> u64 {
        let mut hasher = Hasher::default();
        // Everything the next frame depends on, in the order of a snapshot.
        self.visit(&mut hasher);
        let mut digest = hasher.0;
        if let Some(estimate) = estimate {
            let counts = [
                estimate.status as u32,
                estimate.matches,
                estimate.inliers,
                estimate.samples,
                estimate.steps,
            ];
            counts.iter().for_each(|&count| digest.u64(u64::from(count)));
            digest.f64(estimate.residual_rms_px);
        }
        digest.finish()
    }

    /// Visits every field.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        // Without `..`, so that a new field must be visited to compile.
        let Self {
            t_world_camera,
            t_world_reference,
            since_reference,
            reference_s,
            t_current_previous,
            motion_s,
            inliers,
            extrapolated,
            segment,
            newest_segment,
            random,
            // Belong to one frame.
            predicted: _,
            seen: _,
        } = self;
        // Two halves of one word.
        let mut segments = u32::from(newest_segment.get()) << 16 | u32::from(segment.get());
        visitor.transform(t_world_camera);
        visitor.transform(t_world_reference);
        visitor.u32(since_reference);
        visitor.f64(reference_s);
        visitor.transform(t_current_previous);
        visitor.f64(motion_s);
        visitor.u32(inliers);
        visitor.u32(extrapolated);
        visitor.u32(&mut segments);
        *segment = MapSegment::new(segments as u16);
        *newest_segment = MapSegment::new((segments >> 16) as u16);
        random.visit(visitor);
        if !self.is_possible() {
            visitor.refuse();
            *self = Self::default();
        }
    }

    /// Returns true for a state that steps can lead to. A forged snapshot's may scale a motion
    /// beyond all numbers.
    fn is_possible(&self) -> bool {
        let is_time = |seconds: f64| seconds == 0.0 || (TIMES_S.0..TIMES_S.1).contains(&seconds);
        let poses = [self.t_world_camera, self.t_world_reference, self.t_current_previous];
        is_time(self.reference_s)
            && is_time(self.motion_s)
            && poses.iter().all(Self::is_possible_pose)
    }

    /// Returns true for a pose or motion that steps can lead to.
    pub(super) fn is_possible_pose(pose: &Transform) -> bool {
        pose.is_rotation() && pose.translation_m.iter().all(|m| m.abs() < FARTHEST_M)
    }

    /// Maps camera coordinates to world coordinates, which are the first camera's.
    pub fn t_world_camera(&self) -> &Transform {
        &self.t_world_camera
    }

    /// The last motion, estimated or extrapolated.
    pub fn t_current_previous(&self) -> &Transform {
        &self.t_current_previous
    }

    /// Frames in a row whose motion was extrapolated; 0 when the last one was estimated.
    pub fn extrapolated_frames(&self) -> u32 {
        self.extrapolated
    }
}

#[cfg(test)]
mod tests;
