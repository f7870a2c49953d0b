//! Closures: taken, thinned out, moved to neighbours, solved for, and taken out again.

use super::{Graph, LINKED, LOOSE, Node, ROUNDS, UNUSED, twist::isotropic};
use crate::{egomotion::MotionCovariance, geometry::Transform, state::Visitor};
use bytemuck::{Pod, Zeroable};

/// Errors of a closure beyond those that its covariance holds: points are rounded, and a keyframe
/// may show it in another light. A share of the scene's depth, and rad.
const CLOSURE_DEPTH_SHARE: f64 = 0.005;
const CLOSURE_RAD: f64 = 2e-3;
/// Most that a way drifts: shares of its length and of the scene's depth, and the turn, rad and
/// rad/m.
const DRIFT_SHARE: f64 = 0.05;
const DRIFT_DEPTH_SHARE: f64 = 0.1;
const DRIFT_RAD: f64 = 0.1;
const DRIFT_RAD_PER_M: f64 = 2e-3;
/// Stands for the world where a closure names the slot of a keyframe.
pub(super) const WORLD: u32 = u32::MAX;
/// Weight of a closure below which others contradict it: some five standard deviations.
const WEIGHT_MIN: f64 = 0.1;

/// Motion between two keyframes that show one place.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Closure {
    /// Pose of the later keyframe in the camera of the earlier one.
    pub t_from_to: Transform,
    /// In the later camera's frame.
    pub covariance: MotionCovariance,
    /// Slots of the keyframes; the earlier one may be [`WORLD`].
    pub from: u32,
    pub to: u32,
    /// Weight in the last round.
    pub weight: f64,
}

impl Closure {
    /// Visits a closure between keyframes in the first `len` slots.
    pub(super) fn visit(&mut self, len: usize, visitor: &mut impl Visitor) {
        let Self { t_from_to, covariance, from, to, weight } = self;
        visitor.transform(t_from_to);
        covariance.visit(visitor);
        visitor.u32s([&mut *from, &mut *to]);
        visitor.f64(weight);
        let may_be_from = (*from as usize) < len || *from == WORLD;
        if !may_be_from || *to as usize >= len {
            visitor.refuse();
        }
    }

    /// Pose from which the closure is, in the solution under way.
    pub(super) fn t_world_from(&self, nodes: &[Node]) -> Option<Transform> {
        match self.from {
            WORLD => Some(Transform::IDENTITY),
            slot => nodes.get(slot as usize).map(|node| node.working),
        }
    }
}

/// Loop that the pose graph holds: two keyframes that show one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldLoop {
    /// Number of the earlier keyframe's frame, from 0.
    pub from_frame: u32,
    /// Number of the later one's.
    pub to_frame: u32,
    /// Pose of the later camera in the earlier one, by what both see.
    pub t_from_to: Transform,
}

/// Place that the camera recognises.
#[derive(Clone, Copy, Debug)]
pub(in crate::places) struct Recognized<'a> {
    /// Slot of the keyframe that shows it.
    pub slot: usize,
    /// Pose of that keyframe in its segment.
    pub t_world_keyframe: Transform,
    /// Pose of the camera in that of the keyframe.
    pub t_keyframe_camera: Transform,
    /// In the camera's frame; `None` where it is not known.
    pub covariance: Option<&'a MotionCovariance>,
    /// Depth of the scene, m.
    pub depth_m: f64,
}

impl Graph<'_> {
    /// Closures that the graph holds.
    pub(in crate::places) fn held(&self) -> impl Iterator<Item = HeldLoop> {
        self.closures.iter().take(self.closure_len).filter_map(|closure| {
            let [from, to] = [closure.from, closure.to].map(|slot| self.used(slot as usize));
            Some(HeldLoop {
                from_frame: from?.frame,
                to_frame: to?.frame,
                t_from_to: closure.t_from_to,
            })
        })
    }

    /// Takes a closure from a keyframe to the last one of the chain of `slots`. Returns whether it
    /// was taken.
    #[inline(never)]
    pub(in crate::places) fn close(
        &mut self,
        slots: impl DoubleEndedIterator<Item = usize> + Clone,
        recognized: &Recognized<'_>,
    ) -> bool {
        let Some(to) = self.newest(slots.clone()) else { return false };
        self.closed_at_depths = self.way_depths();
        let is_known = self.is_held(to, |from| from != WORLD);
        let Some(way) = self.way.as_deref() else { return false };
        if way.is_loose || is_known || self.used(recognized.slot).is_none() || recognized.slot == to
        {
            return false;
        }
        // The place was seen from the camera now; the closure is of the keyframe before it.
        let t_from_to = (recognized.t_keyframe_camera * way.t_camera_node).normalized();
        let own = isotropic(CLOSURE_RAD, CLOSURE_DEPTH_SHARE * recognized.depth_m);
        let seen = recognized.covariance.unwrap_or(&MotionCovariance::ZERO);
        let covariance = own.after(seen, &way.t_camera_node.inverse());
        let (from, to) = (recognized.slot as u32, to as u32);
        let closure = Closure { t_from_to, covariance, from, to, weight: 1.0 };
        if !self.may_drift_so_far(slots, &closure, recognized.depth_m) {
            self.counts.refused = self.counts.refused.saturating_add(1);
            return false;
        }
        let is_taken = self.take(closure);
        self.counts.closures = self.counts.closures.saturating_add(u32::from(is_taken));
        is_taken
    }

    /// The newest keyframe.
    pub(super) fn newest(
        &self,
        mut slots: impl DoubleEndedIterator<Item = usize>,
    ) -> Option<usize> {
        slots.rfind(|&slot| self.used(slot).is_some())
    }

    /// Tells that a closure from such an end holds a keyframe already.
    pub(super) fn is_held(&self, slot: usize, is_from: impl Fn(u32) -> bool) -> bool {
        let holds = |closure: &Closure| closure.to == slot as u32 && is_from(closure.from);
        self.closures.iter().take(self.closure_len).any(holds)
    }

    /// Takes a closure, which is solved for from the next frame on.
    pub(super) fn take(&mut self, closure: Closure) -> bool {
        // A new closure says more than one of many on an old way.
        if self.closure_len == self.closures.len() {
            self.thin_out();
        }
        let Some(free) = self.closures.get_mut(self.closure_len) else { return false };
        *free = closure;
        self.closure_len += 1;
        self.is_due = true;
        true
    }

    /// Tells that the way between the ends of a closure may drift by as much as it says. A
    /// camera that was lost in between may be anywhere.
    fn may_drift_so_far(
        &self,
        slots: impl Iterator<Item = usize>,
        closure: &Closure,
        depth_m: f64,
    ) -> bool {
        let ends = [closure.from, closure.to].map(|slot| self.used(slot as usize));
        let [Some(from), Some(to)] = ends else { return false };
        let mut between = slots.skip_while(|&slot| slot != closure.from as usize).skip(1);
        if between.any(|slot| self.used(slot).is_some_and(|node| node.link == LOOSE)) {
            return true;
        }
        // Closures so far have taken their share of the drift out of the poses in use.
        let way_m = to.way_m - from.way_m;
        let off = to.corrected.inverse() * from.corrected * closure.t_from_to;
        off.distance_m() <= DRIFT_SHARE * way_m + DRIFT_DEPTH_SHARE * depth_m
            && off.angle_rad() <= DRIFT_RAD + DRIFT_RAD_PER_M * way_m
    }

    /// Takes out the closure that is nearest to the one before it, by its later keyframe's way:
    /// those that are left stay spread over it.
    fn thin_out(&mut self) {
        let way_m = |closure: &Closure| self.used(closure.to as usize).map(|node| node.way_m);
        let (mut least, mut before): (Option<(f64, usize)>, _) = (None, None);
        for (at, closure) in self.closures.iter().take(self.closure_len).enumerate() {
            let Some(way_m) = way_m(closure) else { continue };
            if let Some(before_m) = before.replace(way_m) {
                let gap_m: f64 = way_m - before_m;
                if least.is_none_or(|(least_m, _)| gap_m < least_m) {
                    least = Some((gap_m, at));
                }
            }
        }
        let at = least.map_or(0, |(_, at)| at);
        self.retain_closures(|at_now, _| at_now != at);
    }

    /// Keeps the closures that `may` takes, by position and value.
    fn retain_closures(&mut self, mut may: impl FnMut(usize, &Closure) -> bool) {
        let mut kept = 0;
        for at in 0..self.closure_len {
            let Some(closure) = self.closures.get(at).copied() else { break };
            if may(at, &closure) {
                if let Some(to) = self.closures.get_mut(kept) {
                    *to = closure;
                }
                kept += 1;
            }
        }
        self.closure_len = kept;
    }

    /// Moves the closures of a keyframe that leaves to the one before it; without one they go.
    pub(super) fn move_closures(
        &mut self,
        slot: usize,
        before: Option<usize>,
        t_before_node: &Transform,
    ) {
        let slot = slot as u32;
        if let Some(before) = before.map(|before| before as u32) {
            for closure in self.closures.iter_mut().take(self.closure_len) {
                if closure.from == slot {
                    closure.t_from_to = (*t_before_node * closure.t_from_to).normalized();
                    closure.from = before;
                }
                if closure.to == slot {
                    closure.t_from_to = (closure.t_from_to * t_before_node.inverse()).normalized();
                    closure.covariance =
                        MotionCovariance::ZERO.after(&closure.covariance, t_before_node);
                    closure.to = before;
                }
            }
        }
        // Both ends may have come to be one keyframe, which says nothing.
        self.retain_closures(|_, closure| {
            closure.from != slot && closure.to != slot && closure.from != closure.to
        });
    }

    /// Does one round of a solution, if one is due. Returns whether the poses in use changed.
    #[inline(never)]
    pub(in crate::places) fn step(
        &mut self,
        slots: impl DoubleEndedIterator<Item = usize> + Clone,
    ) -> bool {
        let round = match self.round {
            Some(round) => round,
            None if self.is_due => {
                self.is_due = false;
                self.nodes.iter_mut().for_each(|node| node.working = node.corrected);
                0
            }
            None => return false,
        };
        let last = ROUNDS - 1;
        if self.solve_round(slots.clone(), last.saturating_sub(round)).is_none() {
            // Equations without a solution are those of the newest closure.
            // The poses in use have not been touched.
            self.round = None;
            self.closure_len = self.closure_len.saturating_sub(1);
            self.counts.taken_out = self.counts.taken_out.saturating_add(1);
            return false;
        }
        self.round = (round < last).then_some(round + 1);
        if self.round.is_none() {
            self.commit(slots);
        }
        self.round.is_none()
    }

    /// Puts the poses that were worked on to use, and takes out the closures they contradict.
    fn commit(&mut self, slots: impl DoubleEndedIterator<Item = usize>) {
        let newest = slots.rev().find_map(|slot| self.used(slot));
        let moved_m =
            newest.map_or(0.0, |node| (node.corrected.inverse() * node.working).distance_m());
        for node in self.nodes.iter_mut().filter(|node| node.link != UNUSED) {
            node.corrected = node.working;
        }
        // Weights are those of the last round, at the true scale.
        let before = self.closure_len;
        self.retain_closures(|_, closure| closure.weight >= WEIGHT_MIN);
        let taken_out = (before - self.closure_len) as u32;
        self.counts.taken_out = self.counts.taken_out.saturating_add(taken_out);
        self.counts.moved = self.counts.moved.saturating_add(1);
        self.counts.last_moved_m = moved_m;
    }

    /// Moves the keyframes since the camera was lost last, and the camera itself, into the frame of
    /// reference of a place that was recognised.
    #[inline(never)]
    pub(in crate::places) fn join(
        &mut self,
        slots: impl DoubleEndedIterator<Item = usize> + Clone,
        recognized: &Recognized<'_>,
    ) {
        // Keyframes of an old map are not part of the graph: they stay where they are.
        let from =
            self.used(recognized.slot).map_or(recognized.t_world_keyframe, |node| node.corrected);
        let newest = slots.clone().rev().find_map(|slot| self.used(slot));
        let Some(way) = self.way.as_deref().filter(|way| !way.is_loose) else { return };
        let Some(newest) = newest else { return };
        // The newest keyframe comes to be where the place says.
        let joined = from * recognized.t_keyframe_camera * way.t_camera_node;
        let t_new_old = joined * newest.corrected.inverse();
        // Back to the keyframe before which the camera was lost.
        for slot in slots.rev() {
            let Some(node) = self.nodes.get_mut(slot) else { continue };
            if node.link == UNUSED {
                continue;
            }
            node.corrected = (t_new_old * node.corrected).normalized();
            node.working = node.corrected;
            if node.link != LINKED {
                break;
            }
        }
    }
}
