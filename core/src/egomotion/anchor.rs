//! Motion since an older frame, the anchor, where the camera moves slowly.
//!
//! Refinement places a match with a systematic error of some 0.01 px. Over a motion of a tenth of a
//! pixel that is a tenth of the way, and it is the same in every frame, so that a sum of short
//! motions is too long or too short. So scene points are kept from one frame and found again in
//! those after it, until they have flowed by [`SPENT_PX`]: the pose follows from the anchor's and
//! from that one longer motion, and the error counts once for all of it. A camera that stands keeps
//! its anchor, and does not drift. The covariance is that of the one longer motion as well.
//!
//! Flow decides, not a count of frames. Where the flow of one frame reaches [`FAST_PX`] there is no
//! anchor, and nothing changes.
//!
//! **Memory.** 140 bytes per point, for at most [`POINTS_MAX`] points and an eighth of the matches.
//!
//! **Time.** Two searches per point and one refinement of the motion; nothing where the camera is
//! fast, but for the mean of the flow.
//!
//! **What can go wrong.** Points get lost: where fewer than half of them agree on a motion, the
//! frame's own estimate stands and the next frame begins another anchor.

use super::{
    Egomotion, EgomotionConfig, Estimator, MotionCovariance, MotionEstimate,
    points::SinglePrecision,
};
use crate::{
    geometry::{StereoRig, Transform},
    memory::{Capacity, Carver, region_bytes},
    scene_flow::{AnchorPoint, FlowMatcher, Match},
    state::{Hasher, Visitor},
};

/// Most points of an anchor.
const POINTS_MAX: usize = 256;
/// Fewest points of one: fewer are no better than a frame's own matches.
const POINTS_MIN: usize = 24;
/// Mean flow of one frame from which on its own matches are as good, px.
const FAST_PX: f32 = 1.0;
/// Mean flow since the anchor from which on another one replaces it, px. Farther on, patches
/// change their shape.
const SPENT_PX: f32 = 3.0;
/// Distance within which a motion explains the points of an anchor, px over four coordinates.
const EXPLAINED_PX: f32 = 1.0;
/// Part of the points, as a divisor, that must be found, and that must agree.
const SHARE: usize = 2;

/// Scene points of an older frame and the camera's pose in it.
#[derive(Debug)]
pub(crate) struct Anchor<'s> {
    points: &'s mut [AnchorPoint],
    len: usize,
    t_world_anchor: Transform,
    /// Points have flowed far: the next frame begins another anchor.
    is_spent: bool,
}

/// A frame whose motion was estimated from its own matches.
pub(crate) struct SlowFrame<'a, 's, I> {
    pub config: &'a EgomotionConfig,
    pub rig: &'a StereoRig,
    pub matcher: &'a FlowMatcher<'s>,
    /// Matches with the last frame that the motion was estimated from.
    pub matches: I,
}

/// Motion since the anchor's frame.
struct Since {
    t_current_anchor: Transform,
    covariance: Option<MotionCovariance>,
}

impl<'s> Anchor<'s> {
    const fn points(capacity: &Capacity) -> usize {
        let share = capacity.matches / 8;
        if share < POINTS_MAX { share } else { POINTS_MAX }
    }

    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        region_bytes::<AnchorPoint>(Self::points(capacity))
    }

    /// Allocates its points. There is no anchor yet.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        Self {
            points: carver.alloc("egomotion.anchor", Self::points(capacity)),
            len: 0,
            t_world_anchor: Transform::IDENTITY,
            is_spent: false,
        }
    }

    /// Forgets the anchor.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Tells that there is no anchor.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Corrects the pose of a camera that moves slowly by what its anchor shows, and with it its
    /// last motion, which must be `estimate`.
    #[inline(never)]
    pub fn step<'m, I: Iterator<Item = &'m Match> + Clone>(
        &mut self,
        frame: &SlowFrame<'_, '_, I>,
        camera: &mut Egomotion,
        estimate: &mut MotionEstimate,
        estimator: &mut Estimator<'_>,
    ) {
        // What moves by itself says nothing of the camera's flow, and is not kept.
        let motion = SinglePrecision::new(camera.t_current_previous(), frame.rig);
        let agrees = |m: &&Match| motion.explains(m, frame.rig, EXPLAINED_PX);
        let still = frame.matches.clone().filter(agrees);
        let (count, flow_px) = mean_flow(still.clone());
        if flow_px >= FAST_PX {
            self.clear();
        } else if self.is_empty() || self.is_spent {
            // The frame's own matches are with the new anchor.
            self.begin(frame.matcher, still, count);
            self.t_world_anchor = camera.t_world_previous();
        } else {
            match self.since_anchor(frame, camera, estimator) {
                Some(Since { t_current_anchor, covariance }) => {
                    let pose = (self.t_world_anchor * t_current_anchor.inverse()).normalized();
                    camera.correct_pose(&pose);
                    estimate.t_current_previous = Some(*camera.t_current_previous());
                    // Short motions since the anchor no longer count, nor do their errors.
                    (estimate.covariance, estimate.anchored) = (covariance, true);
                }
                None => self.clear(),
            }
        }
    }

    /// Keeps points of the last frame, evenly spread over `count` matches.
    fn begin<'m>(
        &mut self,
        matcher: &FlowMatcher<'_>,
        matches: impl Iterator<Item = &'m Match>,
        count: usize,
    ) {
        let every = count.div_ceil(self.points.len().max(1)).max(1);
        let kept = matches.step_by(every).filter_map(|m| matcher.anchor_point(m));
        (self.len, self.is_spent) = (0, false);
        for (slot, point) in self.points.iter_mut().zip(kept) {
            *slot = point;
            self.len += 1;
        }
        if self.len < POINTS_MIN {
            self.clear();
        }
    }

    /// Motion since the anchor; `None` where too few points agree on one.
    fn since_anchor<I>(
        &mut self,
        frame: &SlowFrame<'_, '_, I>,
        camera: &Egomotion,
        estimator: &mut Estimator<'_>,
    ) -> Option<Since> {
        let expected = (camera.t_world_camera().inverse() * self.t_world_anchor).normalized();
        let needed = self.len / SHARE;
        let points = self.points.get_mut(..self.len)?;
        for point in &mut *points {
            frame.matcher.find_anchored(point, frame.rig, &expected);
        }
        // Matches that were not found are not finite, and left out.
        let matches = points.iter().map(AnchorPoint::matched);
        let found = estimator.estimate_near(frame.config, frame.rig, matches.clone(), &expected);
        let motion = found.t_current_previous?;
        let view = SinglePrecision::new(&motion, frame.rig);
        let agreeing = matches.filter(|m| view.explains(m, frame.rig, EXPLAINED_PX));
        let (count, flow_px) = mean_flow(agreeing);
        self.is_spent = flow_px > SPENT_PX;
        (count >= needed)
            .then_some(Since { t_current_anchor: motion, covariance: found.covariance })
    }

    /// Digest of the state.
    pub fn digest(&mut self) -> u64 {
        Hasher::digest(|hasher| self.visit(hasher))
    }

    /// Visits what lives from frame to frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { points, len, t_world_anchor, is_spent } = self;
        visitor.count(len, points.len());
        // Without points the rest says nothing.
        if *len == 0 {
            return;
        }
        let mut spent = u8::from(*is_spent);
        visitor.u8(&mut spent);
        *is_spent = spent != 0;
        visitor.transform(t_world_anchor);
        points.iter_mut().take(*len).for_each(|point| point.visit(visitor));
        if !Egomotion::is_possible_pose(t_world_anchor) {
            visitor.refuse();
            (*t_world_anchor, *len) = (Transform::IDENTITY, 0);
        }
    }
}

/// Matches and their mean flow, px.
fn mean_flow<'m>(matches: impl Iterator<Item = &'m Match>) -> (usize, f32) {
    let (mut count, mut sum_px) = (0, 0.0);
    for m in matches {
        let [along, down] = m.flow_px();
        sum_px += libm::sqrtf(along * along + down * down);
        count += 1;
    }
    (count, if count > 0 { sum_px / count as f32 } else { 0.0 })
}
