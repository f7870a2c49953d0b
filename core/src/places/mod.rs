//! Places: keyframes by which a camera recognises where it has been.
//!
//! While the camera moves, a keyframe is taken after each further 6 % of the scene's depth, or 9
//! degrees: 128 points with their disparities and binary descriptors, and the pose in the map's
//! segment. In a segment that began because the camera was lost, frames are compared with the
//! keyframes of all other segments. A place is believed where descriptors and the motion from the
//! keyframe's points agree (`recognition`), no other place fits nearly as well, and three frames
//! say the same, moved on by the camera's own motion. Then the camera goes on in the older segment.
//!
//! All of it is integers but the motion, which is the camera's own estimator's. There is no trained
//! vocabulary: `index` looks up parts of descriptors, in lists of bounded length.
//!
//! **Memory.** 11.8 KiB for each of `Capacity::keyframes`, and 200 KiB; nothing where it is 0, and
//! then nothing is computed either.
//!
//! **Time.** 1,024 descriptors, as many look-ups, and at most six keyframes compared: only in
//! segments that are not joined yet, in each of their first frames and every fourth one afterwards.
//! Elsewhere 128 descriptors in each frame.
//!
//! **What can go wrong.** Lists that are full refuse entries. A full table thins out. A
//! place is not found from the opposite direction, nor where it looks otherwise; the camera then
//! goes on in its own segment.

mod closing;
mod descriptor;
mod graph;
mod index;
mod keypoint;
mod pending;
mod query;
mod recognition;
mod saved;
mod table;

pub use table::{KEYFRAME_POINTS, SegmentPose};

/// Most keyframes of a mapper.
pub const MAX_KEYFRAMES: usize = 1 << 16;

pub use graph::{HeldLoop, LoopCounts, PoseFix};

use graph::{Graph, Measured, Recognized};
use index::Index;
use pending::Pending;
use query::Query;
use recognition::{Candidate, Recognition};
use table::Table;

use crate::{
    egomotion::{EgomotionConfig, Estimator, MotionCovariance},
    geometry::{MapSegment, StereoRig, Transform},
    image::View,
    memory::{Capacity, Carver},
    random::Random,
    scene_flow::Match,
};

/// Seed of the draws of motions from keyframes.
const SEED: u64 = 0x0070_6c61_6365;
/// Way from one keyframe to the next, as a share of the scene's mean depth, and angle, rad.
const SPACING_DEPTH_SHARE: f64 = 0.06;
const SPACING_RAD: f64 = 0.16;
/// Fewest points of a keyframe.
const POINTS_MIN: usize = 40;
/// Way after which a keyframe is a place that the camera has left, in depths of the scene; a turn
/// of a radian counts as one. What is nearer is seen all the time.
const LOOP_DEPTHS: f64 = 3.0;
/// Least way from one closure to the next, and between keyframes where there are older ones.
const LOOP_SPACING_DEPTHS: f64 = 0.5;
/// Depth of the scene before the first keyframe, m.
const DEPTH_UNKNOWN_M: f64 = 10.0;
/// First frames of a segment, all compared, and the interval of those compared afterwards.
const FIRST_FRAMES: u32 = 30;
const INTERVAL: u32 = 4;

/// A frame as places see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaceView<'a> {
    pub rig: &'a StereoRig,
    pub egomotion: &'a EgomotionConfig,
    pub image: View<'a, u8>,
}

/// The camera in a frame: its pose in a segment, and how it came there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaceCamera<'a> {
    /// Number of the frame.
    pub frame: u32,
    pub pose: SegmentPose,
    /// Motion since the last frame; `None` where it was not measured.
    pub t_current_previous: Option<Transform>,
    /// Covariance of the motion since the last pose measured, where it is known.
    pub covariance: Option<&'a MotionCovariance>,
    /// The caller says where the camera is: no loop can tell it better.
    pub is_given: bool,
}

/// Keyframe after all loops that were closed so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrectedKeyframe {
    /// Number of the frame, from 0.
    pub frame: u32,
    /// Pose of its camera.
    pub pose: SegmentPose,
}

/// Keyframes, and the place that frames begin to recognise.
#[derive(Debug)]
pub(crate) struct Places<'s> {
    table: Table<'s>,
    index: Index<'s>,
    query: Query<'s>,
    graph: Graph<'s>,
    pending: Pending,
    /// Depth of the scene in the last frame, m.
    depth_m: f64,
    /// Loops changed the poses of keyframes in this frame.
    has_moved: bool,
    /// Segment of the last frame, and frames in it, up to [`FIRST_FRAMES`] and in turns of
    /// [`INTERVAL`] from there on.
    segment: MapSegment,
    frames: u32,
    /// Keyframes that left a full table.
    thinned: u32,
    random: Random,
    is_on: bool,
    /// Keyframes are those of an old map: none is taken, and the camera is placed among them again
    /// and again.
    is_fixed: bool,
}

impl<'s> Places<'s> {
    /// Bytes of the slab.
    pub(crate) const fn bytes(capacity: &Capacity) -> usize {
        let keyframes = capacity.keyframes;
        if keyframes == 0 {
            return 0;
        }
        Table::bytes(keyframes)
            + Index::bytes(keyframes * KEYFRAME_POINTS)
            + Query::bytes(keyframes)
            + Graph::bytes(keyframes)
    }

    /// Allocates its regions; none where the capacity has no keyframes.
    pub(crate) fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let keyframes = capacity.keyframes;
        let is_on = keyframes > 0;
        // Regions of no bytes would still have a row in every table of memory.
        let mut nowhere = Carver::without_slab();
        let make = |carver: &mut Carver<'s>| {
            let table = Table::new_in(keyframes, carver);
            let index = Index::new_in(keyframes * KEYFRAME_POINTS, carver);
            let query = Query::new_in(keyframes, carver);
            (table, index, query, Graph::new_in(keyframes, carver))
        };
        let (table, index, query, graph) =
            if is_on { carver.group("places", make) } else { make(&mut nowhere) };
        Self {
            table,
            index,
            query,
            graph,
            pending: Pending::default(),
            depth_m: DEPTH_UNKNOWN_M,
            has_moved: false,
            segment: MapSegment::FIRST,
            frames: 0,
            thinned: 0,
            random: Random::new(SEED),
            is_on,
            is_fixed: false,
        }
    }

    /// Takes in a frame: recognises a place where the camera's segment is not joined with an
    /// older one, and keeps the frame where it is due. Returns the pose in another segment in which
    /// the camera is.
    pub(crate) fn observe<'m>(
        &mut self,
        view: &PlaceView<'_>,
        camera: &PlaceCamera<'_>,
        matches: FramePoints<
            impl Iterator<Item = &'m Match> + Clone,
            impl Iterator<Item = &'m Match> + Clone,
        >,
        estimator: &mut Estimator<'_>,
    ) -> Option<SegmentPose> {
        if !self.is_on {
            return None;
        }
        self.count(camera.pose.segment);
        self.pending.advance(camera.t_current_previous.as_ref());
        self.has_moved = self.graph.step(self.table.slots());
        // A guessed pose is no place.
        camera.t_current_previous?;
        let (covariance, depth_m) = (camera.covariance, self.depth_m);
        self.graph.advance(&Measured { pose: &camera.pose, covariance, depth_m });
        let is_due = self.is_due(camera.pose.segment) || self.may_close(camera);
        let found = is_due.then(|| {
            self.query.describe(view.image, matches.all, usize::MAX);
            self.recognise(view, camera, estimator)
        });
        let joined = found.flatten().and_then(|found| self.take_place(camera, &found));
        if !self.is_fixed {
            self.keep(view, camera, &joined.unwrap_or(camera.pose), matches.still);
        }
        joined
    }

    /// Takes a place that enough frames recognised: a closure in the camera's own segment, or the
    /// pose in another one, where the camera goes on.
    #[inline(never)]
    fn take_place(&mut self, camera: &PlaceCamera<'_>, found: &Candidate) -> Option<SegmentPose> {
        if self.is_fixed {
            return Some(found.pose);
        }
        let Self { table, query, graph, pending, depth_m, .. } = self;
        // The next closure needs three frames of its own.
        *pending = Pending::default();
        let keyframe = table.pose(found.slot)?;
        let recognized = Recognized {
            slot: found.slot,
            t_world_keyframe: keyframe.t_world_camera,
            t_keyframe_camera: keyframe.t_world_camera.inverse() * found.pose.t_world_camera,
            covariance: query.covariance(),
            depth_m: *depth_m,
        };
        if found.pose.segment == camera.pose.segment {
            graph.close(table.slots(), &recognized);
            return None;
        }
        // The graph joins first: it needs the keyframes' poses as they were driven.
        graph.join(table.slots(), &recognized);
        graph.close(table.slots(), &recognized);
        graph.go_on_at(&found.pose);
        // The young segment's own keyframes are places of the old one from now on.
        let t_old_young = found.pose.t_world_camera * camera.pose.t_world_camera.inverse();
        table.join(camera.pose.segment, found.pose.segment, &t_old_young);
        Some(found.pose)
    }

    /// Counts the frames of a segment.
    fn count(&mut self, segment: MapSegment) {
        if segment != self.segment {
            (self.segment, self.frames, self.pending) = (segment, 0, Pending::default());
        }
        self.frames = self.frames.saturating_add(1);
        if self.frames > FIRST_FRAMES + INTERVAL {
            self.frames -= INTERVAL;
        }
    }

    /// Tells that this frame is compared with the keyframes of other segments, if there are any.
    fn is_due(&self, segment: MapSegment) -> bool {
        let is_turn = self.frames <= FIRST_FRAMES || self.frames == FIRST_FRAMES + INTERVAL;
        (is_turn || self.pending.frames > 0)
            && (self.is_fixed || self.table.poses().any(|pose| pose.segment != segment))
    }

    /// Tells that this frame is compared with keyframes of the camera's own segment.
    fn may_close(&self, camera: &PlaceCamera<'_>) -> bool {
        let is_turn = self.frames % INTERVAL == FIRST_FRAMES % INTERVAL;
        let graph = &self.graph;
        !(camera.is_given || self.is_fixed)
            && (is_turn || self.pending.frames > 0)
            && graph.way_since_closure() >= LOOP_SPACING_DEPTHS
            && graph.way_since(self.table.slots().next()) >= LOOP_DEPTHS
    }

    /// Compares the frame with the keyframes of other segments, and with those that the camera left
    /// some way ago.
    fn recognise(
        &mut self,
        view: &PlaceView<'_>,
        camera: &PlaceCamera<'_>,
        estimator: &mut Estimator<'_>,
    ) -> Option<Candidate> {
        let Self { table, index, query, graph, pending, random, is_fixed, .. } = self;
        let depth_m = depth_m(view.rig, query)?;
        let may_close = !camera.is_given;
        let elsewhere = |slot: usize| {
            let segment = table.pose(slot).map(|pose| pose.segment);
            *is_fixed
                || segment.is_some_and(|segment| segment != camera.pose.segment)
                || (may_close && graph.way_since(Some(slot)) >= LOOP_DEPTHS)
        };
        let recognition = Recognition { table, index, query, random };
        let found = recognition.find(view, estimator, elsewhere);
        let is_place = pending.take(found.as_ref(), depth_m);
        found.filter(|_| is_place)
    }

    /// Keeps the frame as a keyframe, unless one is near.
    fn keep<'m>(
        &mut self,
        view: &PlaceView<'_>,
        camera: &PlaceCamera<'_>,
        pose: &SegmentPose,
        matches: impl Iterator<Item = &'m Match> + Clone,
    ) {
        let Self { table, index, query, graph, thinned, depth_m: depth, .. } = self;
        query.describe(view.image, matches, KEYFRAME_POINTS);
        let Some(depth_m) = depth_m(view.rig, query) else { return };
        *depth = depth_m;
        let is_sparse = graph.way_since(table.slots().next_back()) >= LOOP_SPACING_DEPTHS;
        let is_near = |slot: usize| {
            let Some(other) = table.pose(slot) else { return false };
            // A loop needs keyframes to hang on, but fewer than a new way.
            let is_left = is_sparse && graph.way_since(Some(slot)) >= LOOP_DEPTHS;
            let apart = pose.t_world_camera.inverse() * other.t_world_camera;
            !is_left
                && other.segment == pose.segment
                && apart.distance_m() < SPACING_DEPTH_SHARE * depth_m
                && apart.angle_rad() < SPACING_RAD
        };
        if query.points().count() < POINTS_MIN || table.slots().any(is_near) {
            return;
        }
        let Some((slot, must_leave)) = table.next_slot() else { return };
        let numbers = |point: usize| Table::number(slot, point);
        if must_leave {
            *thinned = thinned.saturating_add(1);
            graph.remove(table.slots(), slot);
            for (point, (_, descriptor)) in table.points(slot).enumerate() {
                index.remove(descriptor, numbers(point));
            }
        }
        table.insert(slot, pose, query.points());
        graph.insert(table.slots(), &pose.t_world_camera, camera.frame);
        for (point, (_, descriptor)) in table.points(slot).enumerate() {
            index.insert(descriptor, numbers(point));
        }
    }

    /// Number of keyframes.
    pub(crate) fn len(&self) -> usize {
        self.table.len()
    }

    /// Keyframes of this run after all loops that were closed so far, oldest first.
    pub(crate) fn corrected(&self) -> impl Iterator<Item = CorrectedKeyframe> {
        self.table.slots().filter_map(|slot| {
            let (frame, t_world_camera) = self.graph.corrected(slot)?;
            let segment = self.table.pose(slot)?.segment;
            Some(CorrectedKeyframe { frame, pose: SegmentPose { segment, t_world_camera } })
        })
    }

    /// Takes a pose of the camera of the last frame that the caller knows. Returns whether it was
    /// taken.
    pub(crate) fn fix(&mut self, fix: &PoseFix) -> bool {
        self.graph.fix(self.table.slots(), fix)
    }

    /// Counts of the loops.
    pub(crate) fn loops(&self) -> LoopCounts {
        self.graph.counts()
    }

    /// Loops that the graph holds.
    pub(crate) fn held_loops(&self) -> impl Iterator<Item = HeldLoop> {
        self.graph.held()
    }

    /// Tells that loops changed the poses of keyframes in this frame.
    pub(crate) fn has_moved(&self) -> bool {
        self.has_moved
    }
}

/// Matches of a frame.
#[derive(Clone, Debug)]
pub(crate) struct FramePoints<A, S> {
    /// Matches that are compared with keyframes.
    pub all: A,
    /// Matches on what does not move, which a keyframe keeps.
    pub still: S,
}

/// Depth of the scene by the mean disparity of the points described.
fn depth_m(rig: &StereoRig, query: &Query<'_>) -> Option<f64> {
    Some(rig.focal_baseline_px_m() / query.mean_disparity_px()?)
}
