//! Pose graph: keyframes held together by the camera's motion, and by places seen again.
//!
//! Keyframes form a chain in the order in which they were taken. A link of the chain is the motion
//! from one to the next, with its covariance; a closure is the motion between two that show one
//! place. A solution moves the keyframes so that links and closures give way by their covariances
//! (Gauss-Newton, `round`). Closures are few and the chain is a tree, so the equations are solved
//! for what each closure pulls: six unknowns for each closure instead of six for each keyframe.
//! A pose that the caller knows is a closure too, from the world itself (`fix`).
//!
//! **Robustness.** A closure far from where the way can lead by its drift is refused. Those taken
//! are weighted anew in each round (Geman-McClure, from a wide scale to the true one), so that the
//! majority and the links overrule a wrong one; it is taken out after the last round.
//!
//! **Memory.** 580 bytes for each of `Capacity::keyframes` and at most 160 KiB.
//!
//! **Time.** At most one round in a frame: linear in the keyframes, cubic in at most
//! [`CLOSURES_MAX`] closures. The poses in use change after the last of [`ROUNDS`] rounds, at once.

mod closures;
mod dense;
mod fix;
mod round;
mod twist;

#[cfg(test)]
mod tests;

use super::table::SegmentPose;
use crate::{
    egomotion::MotionCovariance,
    geometry::{MapSegment, Transform},
    memory::{Carver, region_bytes},
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};
use closures::Closure;
pub use closures::HeldLoop;
pub(super) use closures::Recognized;
use dense::entries;
pub use fix::PoseFix;
use twist::{Twist, isotropic};

/// Most closures of a graph, and keyframes for each.
const CLOSURES_MAX: usize = 32;
const KEYFRAMES_PER_CLOSURE: usize = 4;
/// Rounds of a solution.
const ROUNDS: u32 = 10;
/// Errors of a link beyond those that its covariance holds: shares of its way and of its turn, and
/// the least ones, rad and m.
const LINK_SHARE: f64 = 0.01;
const LINK_RAD: f64 = 3e-4;
const LINK_M: f64 = 1e-3;

/// Links of a keyframe to the one before.
const UNUSED: u32 = 0;
const LINKED: u32 = 1;
/// The camera was lost in between: only a closure says where the keyframe is.
const LOOSE: u32 = 2;

/// Keyframe of the graph.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Node {
    /// Pose in use, and the one that the rounds work on.
    corrected: Transform,
    working: Transform,
    /// Pose in the camera of the keyframe before, and its covariance, in this camera's frame.
    t_before_node: Transform,
    covariance: MotionCovariance,
    /// Way since the first keyframe: m, and in depths of the scene.
    way_m: f64,
    way_depths: f64,
    /// Number of the frame.
    frame: u32,
    /// [`UNUSED`], [`LINKED`] or [`LOOSE`].
    link: u32,
}

impl Node {
    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { corrected, working, t_before_node, covariance, .. } = self;
        for transform in [corrected, working, t_before_node] {
            visitor.transform(transform);
        }
        covariance.visit(visitor);
        visitor.f64s([&mut self.way_m, &mut self.way_depths]);
        visitor.u32s([&mut self.frame, &mut self.link]);
        if self.link > LOOSE {
            visitor.refuse();
        }
    }
}

/// Sums along the chain, up to a keyframe.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ChainSum {
    spread: MotionCovariance,
    /// Errors of the links.
    error: Twist,
}

/// Bytes of the slab for the way, on machines of any width.
const WAY_BYTES: usize = 512;
const _: () = assert!(size_of::<Way>() <= WAY_BYTES);

/// Way of the camera since the last keyframe.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// Last pose that was measured; `None` before the first one.
    last: Option<SegmentPose>,
    /// Maps coordinates of the keyframe to those of the camera in that pose.
    t_camera_node: Transform,
    covariance: MotionCovariance,
    length_m: f64,
    length_depths: f64,
    /// The camera was lost in between.
    is_loose: bool,
}

impl Way {
    const NONE: Self = Self {
        last: None,
        t_camera_node: Transform::IDENTITY,
        covariance: MotionCovariance::ZERO,
        length_m: 0.0,
        length_depths: 0.0,
        is_loose: false,
    };

    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { last, t_camera_node, covariance, length_m, length_depths, is_loose } = self;
        let blank =
            || SegmentPose { segment: MapSegment::FIRST, t_world_camera: Transform::IDENTITY };
        visitor.option(last, blank, |visitor, pose| pose.visit(visitor));
        visitor.transform(t_camera_node);
        covariance.visit(visitor);
        visitor.f64s([length_m, length_depths]);
        let mut loose = u8::from(*is_loose);
        visitor.u8(&mut loose);
        *is_loose = loose != 0;
    }
}

/// Pose of the camera that was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    pub pose: &'a SegmentPose,
    /// Covariance of the motion since the last pose measured; `None` where it is not known.
    pub covariance: Option<&'a MotionCovariance>,
    /// Depth of the scene, m.
    pub depth_m: f64,
}

/// Counts of a graph's closures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LoopCounts {
    /// Closures that were taken.
    pub closures: u32,
    /// Closures that were too far from where the way can lead by its drift.
    pub refused: u32,
    /// Poses of the caller's that were taken.
    pub fixes: u32,
    /// Closures and poses of the caller's that others contradicted and that were taken out again.
    pub taken_out: u32,
    /// Times that the poses of keyframes were changed.
    pub moved: u32,
    /// Distance by which the last change moved the last keyframe, m.
    pub last_moved_m: f64,
}

/// The graph.
#[derive(Debug)]
pub(super) struct Graph<'s> {
    /// By slot of the table of keyframes.
    nodes: &'s mut [Node],
    closures: &'s mut [Closure],
    closure_len: usize,
    /// In the slab, since a mapper is moved when it is made; `None` without keyframes.
    way: Option<&'s mut Way>,
    /// Way up to the newest keyframe and up to the last closure, in depths of the scene.
    node_depths: f64,
    closed_at_depths: f64,
    /// Next round of the solution under way.
    round: Option<u32>,
    /// A closure was taken since the solution began.
    is_due: bool,
    counts: LoopCounts,
    // Scratch memory of a round: sums by place in the chain, places by slot, and the equations.
    sums: &'s mut [ChainSum],
    positions: &'s mut [u32],
    matrix: &'s mut [f64],
    pulls: &'s mut [Twist],
}

impl<'s> Graph<'s> {
    pub(super) const fn bytes(keyframes: usize) -> usize {
        let closures = closures_max(keyframes);
        region_bytes::<Node>(keyframes)
            + region_bytes::<Closure>(closures)
            + region_bytes::<ChainSum>(keyframes)
            + region_bytes::<u32>(keyframes)
            + region_bytes::<f64>(entries(6 * closures))
            + region_bytes::<Twist>(closures)
            + region_bytes::<u8>(WAY_BYTES)
    }

    /// Takes the region of the way. Never inlined: what is made lies on the stack until then.
    #[inline(never)]
    fn alloc_way(carver: &mut Carver<'s>) -> Option<&'s mut Way> {
        carver.alloc_value("places.way", WAY_BYTES, Way::NONE)
    }

    pub(super) fn new_in(keyframes: usize, carver: &mut Carver<'s>) -> Self {
        let closures = closures_max(keyframes);
        Self {
            nodes: carver.alloc("places.node", keyframes),
            closures: carver.alloc("places.closure", closures),
            closure_len: 0,
            node_depths: 0.0,
            closed_at_depths: 0.0,
            round: None,
            is_due: false,
            counts: LoopCounts::default(),
            sums: carver.alloc("places.chain_sum", keyframes),
            positions: carver.alloc("places.chain_position", keyframes),
            matrix: carver.alloc("places.equation", entries(6 * closures)),
            pulls: carver.alloc("places.pull", closures),
            way: Self::alloc_way(carver),
        }
    }

    /// Moves on with the camera.
    #[inline(never)]
    pub(super) fn advance(&mut self, measured: &Measured<'_>) {
        let Some(way) = self.way.as_deref_mut() else { return };
        let pose = measured.pose;
        let last = way.last.replace(*pose);
        let Some(last) = last.filter(|last| last.segment == pose.segment) else {
            way.is_loose = true;
            return;
        };
        let motion = (pose.t_world_camera.inverse() * last.t_world_camera).normalized();
        // Without a covariance the least errors of a link stand for the motion.
        let covariance = measured.covariance.unwrap_or(&MotionCovariance::ZERO);
        way.covariance = covariance.after(&way.covariance, &motion);
        way.t_camera_node = (motion * way.t_camera_node).normalized();
        let length_m = motion.distance_m();
        way.length_m += length_m;
        // A camera that turns sees something else as well.
        way.length_depths += length_m / measured.depth_m + motion.angle_rad();
    }

    /// Takes a keyframe into the chain of `slots`, as the last one.
    #[inline(never)]
    pub(super) fn insert(
        &mut self,
        slots: impl DoubleEndedIterator<Item = usize>,
        pose: &Transform,
        frame: u32,
    ) {
        // Slots of an old map are in the table too, but not in the graph.
        let mut slots = slots.rev();
        let Some(slot) = slots.next() else { return };
        let before = slots.find_map(|slot| self.used(slot));
        let before = before.map(|node| (node.corrected, node.working, node.way_m));
        let Some(kept) = self.way.as_deref_mut() else { return };
        let way = *kept;
        *kept = Way { last: way.last, ..Way::NONE };
        let t_before_node = way.t_camera_node.inverse();
        // A way on which the camera was lost counts as well: it leads away from older keyframes.
        self.node_depths += way.length_depths;
        let way_depths = self.node_depths;
        let Some(node) = self.nodes.get_mut(slot) else { return };
        *node = match before.filter(|_| !way.is_loose) {
            Some((corrected, working, way_m)) => {
                // What is systematic in odometry adds up faster than its covariances say.
                let (length_m, angle_rad) = (t_before_node.distance_m(), t_before_node.angle_rad());
                let mut covariance =
                    isotropic(LINK_RAD + LINK_SHARE * angle_rad, LINK_M + LINK_SHARE * length_m);
                covariance.add_scaled(&way.covariance, 1.0);
                Node {
                    corrected: (corrected * t_before_node).normalized(),
                    working: (working * t_before_node).normalized(),
                    t_before_node,
                    covariance,
                    way_m: way_m + way.length_m,
                    way_depths,
                    frame,
                    link: LINKED,
                }
            }
            None => Node {
                corrected: *pose,
                working: *pose,
                t_before_node: Transform::IDENTITY,
                covariance: MotionCovariance::ZERO,
                way_m: before.map_or(0.0, |(_, _, way_m)| way_m),
                way_depths,
                frame,
                link: LOOSE,
            },
        };
    }

    /// Takes a keyframe out of the chain of `slots`; those before and after it are linked instead.
    #[inline(never)]
    pub(super) fn remove(&mut self, slots: impl Iterator<Item = usize> + Clone, slot: usize) {
        // Neighbours in the chain, not in the table.
        let used = slots.filter(|&slot| self.used(slot).is_some());
        let before = used.clone().take_while(|&other| other != slot).last();
        let after = used.skip_while(|&other| other != slot).nth(1);
        let Some(&removed) = self.used(slot) else { return };
        self.move_closures(slot, before.filter(|_| removed.link == LINKED), &removed.t_before_node);
        match after.and_then(|after| self.nodes.get_mut(after)) {
            Some(after) if after.link == LINKED && removed.link == LINKED => {
                let motion = after.t_before_node.inverse();
                after.covariance = after.covariance.after(&removed.covariance, &motion);
                after.t_before_node = (removed.t_before_node * after.t_before_node).normalized();
            }
            // A link needs both motions.
            Some(after) => after.link = LOOSE,
            // The newest keyframe never leaves a table of three; the next one begins a chain.
            None => self.way.iter_mut().for_each(|way| way.is_loose = true),
        }
        if let Some(node) = self.nodes.get_mut(slot) {
            node.link = UNUSED;
        }
    }

    fn used(&self, slot: usize) -> Option<&Node> {
        self.nodes.get(slot).filter(|node| node.link != UNUSED)
    }

    /// Way from a keyframe to the camera, in depths of the scene; 0 where the keyframe is not part
    /// of the graph.
    pub(super) fn way_since(&self, slot: Option<usize>) -> f64 {
        let node = slot.and_then(|slot| self.used(slot));
        node.map_or(0.0, |node| self.way_depths() - node.way_depths)
    }

    /// Way from the last closure to the camera, in depths of the scene.
    pub(super) fn way_since_closure(&self) -> f64 {
        self.way_depths() - self.closed_at_depths
    }

    /// Way of the camera in depths of the scene.
    fn way_depths(&self) -> f64 {
        self.node_depths + self.way.as_deref().map_or(0.0, |way| way.length_depths)
    }

    /// Goes on in another segment, whose pose is known by a place.
    pub(super) fn go_on_at(&mut self, pose: &SegmentPose) {
        self.way.iter_mut().for_each(|way| way.last = Some(*pose));
    }

    /// Pose of a keyframe after all closures so far, and the number of its frame.
    pub(super) fn corrected(&self, slot: usize) -> Option<(u32, Transform)> {
        self.used(slot).map(|node| (node.frame, node.corrected))
    }

    pub(super) fn counts(&self) -> LoopCounts {
        self.counts
    }

    /// Visits what lives from frame to frame, of keyframes in the first `len` slots.
    pub(super) fn visit(&mut self, len: usize, visitor: &mut impl Visitor) {
        // Sums, places and equations are scratch memory.
        let Self { nodes, closures, closure_len, way, round, is_due, counts, .. } = self;
        visitor.f64s([&mut self.node_depths, &mut self.closed_at_depths]);
        for node in nodes.iter_mut().take(len) {
            node.visit(visitor);
        }
        visitor.count(closure_len, closures.len());
        for closure in closures.iter_mut().take(*closure_len) {
            closure.visit(len, visitor);
        }
        way.iter_mut().for_each(|way| way.visit(visitor));
        visitor.option(round, || 0, |visitor, round| visitor.u32(round));
        let mut due = u8::from(*is_due);
        visitor.u8(&mut due);
        *is_due = due != 0;
        let LoopCounts { closures, refused, fixes, taken_out, moved, last_moved_m } = counts;
        visitor.u32s([closures, refused, fixes, taken_out, moved]);
        visitor.f64(last_moved_m);
    }

    /// Forgets all keyframes.
    pub(super) fn clear(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.link = UNUSED);
        (self.closure_len, self.round, self.is_due) = (0, None, false);
        self.way.iter_mut().for_each(|way| **way = Way::NONE);
        (self.node_depths, self.closed_at_depths) = (0.0, 0.0);
        self.counts = LoopCounts::default();
    }
}

/// Most closures of so many keyframes.
const fn closures_max(keyframes: usize) -> usize {
    let closures = keyframes.div_ceil(KEYFRAMES_PER_CLOSURE);
    if closures < CLOSURES_MAX { closures } else { CLOSURES_MAX }
}
