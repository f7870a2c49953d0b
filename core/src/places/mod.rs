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
//! **Memory.** 11.2 KiB for each of `Capacity::keyframes`, and 46 KiB; nothing where it is 0, and
//! then nothing is computed either.
//!
//! **Time.** 1,024 descriptors, as many look-ups, and at most six keyframes compared: only in
//! segments that are not joined yet, in each of their first frames and every fourth one afterwards.
//! Elsewhere 128 descriptors in each frame.
//!
//! **What can go wrong.** Lists that are full refuse entries. A full table thins out. A
//! place is not found from the opposite direction, nor where it looks otherwise; the camera then
//! goes on in its own segment.

mod descriptor;
mod index;
mod keypoint;
mod query;
mod recognition;
mod table;

pub use table::{KEYFRAME_POINTS, SegmentPose};

/// Most keyframes of a mapper.
pub const MAX_KEYFRAMES: usize = 1 << 16;

use index::Index;
use query::Query;
use recognition::{Candidate, Recognition, agree};
use table::Table;

use crate::{
    egomotion::{EgomotionConfig, Estimator},
    geometry::{MapSegment, StereoRig, Transform},
    image::View,
    memory::{Capacity, Carver},
    random::Random,
    scene_flow::Match,
    state::Visitor,
};

/// Seed of the draws of motions from keyframes.
const SEED: u64 = 0x0070_6c61_6365;
/// Way from one keyframe to the next, as a share of the scene's mean depth, and angle, rad.
const SPACING_DEPTH_SHARE: f64 = 0.06;
const SPACING_RAD: f64 = 0.16;
/// Fewest points of a keyframe.
const POINTS_MIN: usize = 40;
/// Frames that must recognise one place.
const CONSISTENT: u32 = 3;
/// Frames in a row without a place after which the ones before are forgotten.
const MISSES_MAX: u32 = 5;
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
pub(crate) struct PlaceCamera {
    pub pose: SegmentPose,
    /// Motion since the last frame; `None` where it was not measured.
    pub t_current_previous: Option<Transform>,
}

/// Place that frames recognise, followed by the camera's motion until enough of them do.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    /// Pose of the camera in the segment recognised.
    t_world_camera: Transform,
    segment: MapSegment,
    /// Frames that recognised it; 0 where no place is pending.
    frames: u32,
    /// Frames since the last one that did.
    misses: u32,
}

impl Pending {
    fn pose(&self) -> SegmentPose {
        SegmentPose { segment: self.segment, t_world_camera: self.t_world_camera }
    }

    /// Moves the place on with the camera; without a motion it is forgotten.
    fn advance(&mut self, t_current_previous: Option<&Transform>) {
        match t_current_previous {
            Some(motion) => {
                self.t_world_camera = (self.t_world_camera * motion.inverse()).normalized();
            }
            None => *self = Self::default(),
        }
    }

    /// Takes in a frame that was compared. Returns whether enough frames recognised one place.
    fn take(&mut self, found: Option<&Candidate>, depth_m: f64) -> bool {
        match found {
            Some(found) => {
                let goes_on = self.frames > 0 && agree(&self.pose(), &found.pose, depth_m);
                *self = Self {
                    t_world_camera: found.pose.t_world_camera,
                    segment: found.pose.segment,
                    frames: if goes_on { self.frames + 1 } else { 1 },
                    misses: 0,
                };
            }
            None => {
                self.misses += 1;
                if self.misses > MISSES_MAX {
                    *self = Self::default();
                }
            }
        }
        self.frames >= CONSISTENT
    }
}

/// Keyframes, and the place that frames begin to recognise.
#[derive(Debug)]
pub(crate) struct Places<'s> {
    table: Table<'s>,
    index: Index<'s>,
    query: Query<'s>,
    pending: Pending,
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
            (table, index, Query::new_in(keyframes, carver))
        };
        let (table, index, query) =
            if is_on { carver.group("places", make) } else { make(&mut nowhere) };
        Self {
            table,
            index,
            query,
            pending: Pending::default(),
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
        camera: &PlaceCamera,
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
        // A guessed pose is no place.
        camera.t_current_previous?;
        let joined = self.is_due(camera.pose.segment).then(|| {
            self.query.describe(view.image, matches.all, usize::MAX);
            self.recognise(view, camera, estimator)
        });
        let joined = joined.flatten();
        if self.is_fixed {
            return joined;
        }
        if let Some(pose) = &joined {
            // The young segment's own keyframes are places of the old one from now on.
            let t_old_young = pose.t_world_camera * camera.pose.t_world_camera.inverse();
            self.table.join(camera.pose.segment, pose.segment, &t_old_young);
            self.pending = Pending::default();
        }
        self.keep(view, &joined.unwrap_or(camera.pose), matches.still);
        joined
    }

    /// Counts the frames of a segment.
    fn count(&mut self, segment: MapSegment) {
        if segment != self.segment {
            (self.segment, self.frames, self.pending) = (segment, 0, Pending::default());
        }
        self.frames += 1;
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

    /// Compares the frame with the keyframes of other segments.
    fn recognise(
        &mut self,
        view: &PlaceView<'_>,
        camera: &PlaceCamera,
        estimator: &mut Estimator<'_>,
    ) -> Option<SegmentPose> {
        let Self { table, index, query, pending, random, is_fixed, .. } = self;
        let depth_m = depth_m(view.rig, query)?;
        let elsewhere = |slot: usize| {
            let segment = table.pose(slot).map(|pose| pose.segment);
            *is_fixed || segment.is_some_and(|segment| segment != camera.pose.segment)
        };
        let recognition = Recognition { table, index, query, random };
        let found = recognition.find(view, estimator, elsewhere);
        pending.take(found.as_ref(), depth_m).then(|| pending.pose())
    }

    /// Keeps the frame as a keyframe, unless one is near.
    fn keep<'m>(
        &mut self,
        view: &PlaceView<'_>,
        pose: &SegmentPose,
        matches: impl Iterator<Item = &'m Match> + Clone,
    ) {
        let Self { table, index, query, thinned, .. } = self;
        query.describe(view.image, matches, KEYFRAME_POINTS);
        let Some(depth_m) = depth_m(view.rig, query) else { return };
        let is_near = |other: SegmentPose| {
            let apart = pose.t_world_camera.inverse() * other.t_world_camera;
            other.segment == pose.segment
                && apart.distance_m() < SPACING_DEPTH_SHARE * depth_m
                && apart.angle_rad() < SPACING_RAD
        };
        if query.points().count() < POINTS_MIN || table.poses().any(is_near) {
            return;
        }
        let Some((slot, must_leave)) = table.next_slot() else { return };
        let numbers = |point: usize| Table::number(slot, point);
        if must_leave {
            *thinned = thinned.saturating_add(1);
            for (point, (_, descriptor)) in table.points(slot).enumerate() {
                index.remove(descriptor, numbers(point));
            }
        }
        table.insert(slot, pose, query.points());
        for (point, (_, descriptor)) in table.points(slot).enumerate() {
            index.insert(descriptor, numbers(point));
        }
    }

    /// Number of keyframes.
    pub(crate) fn len(&self) -> usize {
        self.table.len()
    }

    /// Visits the keyframes for a file of their own.
    pub(crate) fn visit_keyframes(&mut self, visitor: &mut impl Visitor) {
        self.table.visit_in_order(visitor);
    }

    /// Makes keyframes that were read the places of an old map; with `is_fixed` none is added.
    /// Returns the last segment that one of them lies in; `None` without keyframes.
    pub(crate) fn take_up(&mut self, is_fixed: bool) -> Option<MapSegment> {
        let Self { table, index, .. } = self;
        index.clear();
        for slot in 0..table.len() {
            for (point, (_, descriptor)) in table.points(slot).enumerate() {
                index.insert(descriptor, Table::number(slot, point));
            }
        }
        self.is_fixed = is_fixed;
        table.poses().map(|pose| pose.segment).max()
    }

    /// Forgets all keyframes.
    pub(crate) fn clear(&mut self) {
        self.table.clear();
        self.index.clear();
        self.is_fixed = false;
    }

    /// Visits what lives from frame to frame; nothing where there are no keyframes.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        // The query is scratch memory.
        let Self {
            table,
            index,
            query: _,
            pending,
            segment,
            frames,
            thinned,
            random,
            is_on,
            is_fixed,
        } = self;
        if !*is_on {
            return;
        }
        table.visit(visitor);
        index.visit(visitor);
        let Pending { t_world_camera, segment: pending_segment, frames: times, misses } = pending;
        visitor.transform(t_world_camera);
        for segment in [pending_segment, segment] {
            visitor.code(
                segment,
                |segment| u32::from(segment.get()),
                |code| MapSegment::new(code as u16),
            );
        }
        visitor.u32s([times, misses, frames, thinned]);
        let mut fixed = u8::from(*is_fixed);
        visitor.u8(&mut fixed);
        *is_fixed = fixed != 0;
        random.visit(visitor);
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
