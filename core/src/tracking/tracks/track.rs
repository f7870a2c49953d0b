//! One track: an object over time.

use crate::tracking::{
    instances::{Class, Flag, Instance, OptionalIndex},
    motion::{MotionFilter, MotionHysteresis, MotionState},
};
use crate::{
    geometry::Transform,
    masks::{MaskHandle, PixelBox},
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

/// A box with less than this share of the area that was expected is cut, 1/10.
const CUT_TENTHS: i64 = 7;

/// An object over time.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Track {
    /// Filter of the motion over ground.
    pub filter: MotionFilter,
    /// Pose of the object in the world; a trajectory segment begins with the camera's pose.
    pub t_world_object: Transform,
    /// Pose of the object at the segment's first pose.
    pub t_world_origin: Transform,
    /// Last mask of the object.
    pub mask: MaskHandle,
    /// Box in the image when the object was last seen whole, moved since with its velocity.
    pub extent: PixelBox,
    /// Velocity in the image between the last two sightings, px a frame: of its matches or, where
    /// these are few, of its box's centre unless that is cut.
    pub velocity_px: [i32; 2],
    pub motion_state: MotionHysteresis,
    /// From 1, never used again.
    pub id: u32,
    pub class: u32,
    /// By how many sightings the class leads over others.
    pub class_margin: u32,
    /// Score of the last sighting.
    pub score: f32,
    pub first_frame: u32,
    pub last_frame: u32,
    /// Frames in which it was detected.
    pub sightings: u32,
    /// Position of this frame's instance, if it was detected.
    pub instance: OptionalIndex,
    /// Poses of the trajectory segment; 0 between two segments.
    pub segment_len: u32,
    /// Number of the trajectory segment, from 1.
    pub segment_id: u32,
    /// Matches assigned to it in this frame, and their inliers.
    pub matches: u32,
    pub inliers: u32,
    /// Set if this frame's motion was measured.
    pub measured: Flag,
    /// Error of the speed, m/s.
    pub sigma_m_s: f32,
    /// Set if the last instance was too small to be reconstructed.
    pub tracked_only: Flag,
    /// Set if the matches determine the velocity in this frame.
    pub velocity_measured: Flag,
}

impl Track {
    /// A track that begins in frame `frame` with the instance at `index`.
    pub fn begun(id: u32, frame: u32, index: usize, instance: &Instance) -> Self {
        Self {
            mask: instance.mask,
            extent: instance.mask.pixels,
            id,
            class: instance.class,
            class_margin: 1,
            score: instance.score,
            first_frame: frame,
            last_frame: frame,
            sightings: 1,
            instance: OptionalIndex::some(index),
            tracked_only: instance.tracked_only,
            ..Self::default()
        }
    }

    /// Continues it in frame `frame` with the instance at `index`; its mask stays that of the frame
    /// before until the frame is committed.
    pub fn continue_with(&mut self, frame: u32, index: usize, instance: &Instance) {
        let gap = frame.wrapping_sub(self.last_frame).clamp(1, 1 << 16) as i32;
        // The middle of what is left of a box does not move with the object.
        if !self.velocity_measured.get() && !is_cut(&instance.mask.pixels, &self.expected_extent())
        {
            let twice_center = |mask: &MaskHandle| {
                [2 * mask.pixels.left + mask.pixels.width, 2 * mask.pixels.top + mask.pixels.height]
            };
            let ([u, v], [u_before, v_before]) =
                (twice_center(&instance.mask), twice_center(&self.mask));
            self.velocity_px = [(u - u_before) / (2 * gap), (v - v_before) / (2 * gap)];
        }
        self.vote_class(instance.class);
        self.score = instance.score;
        self.last_frame = frame;
        self.sightings = self.sightings.saturating_add(1);
        self.instance = OptionalIndex::some(index);
        self.tracked_only = instance.tracked_only;
    }

    /// Returns true if it was seen first and last in this order, up to frame `frame`.
    pub fn was_seen_until(&self, frame: u32) -> bool {
        self.first_frame <= self.last_frame && self.last_frame <= frame
    }

    /// Forgets motion, state and poses, and ends the trajectory segment.
    pub fn restart_motion(&mut self) {
        (self.filter, self.motion_state) = (MotionFilter::default(), MotionHysteresis::default());
        (self.t_world_object, self.t_world_origin) = (Transform::IDENTITY, Transform::IDENTITY);
        (self.segment_len, self.sigma_m_s) = (0, 0.0);
    }

    pub fn class(&self) -> Class {
        Class::from_code(self.class)
    }

    /// Returns true if the track is too small to be reconstructed and no motion was ever measured:
    /// it is not reported then.
    pub fn is_tentative(&self) -> bool {
        self.tracked_only.get() && !self.filter.is_known()
    }

    /// Returns true if the speed is known: measured in this frame, or lately enough for a state.
    pub fn has_speed(&self) -> bool {
        self.filter.is_known()
            && (self.measured.get() || self.motion_state.state() != MotionState::Uncertain)
    }

    /// Predicts the shift of the mask within `gap` frames by its velocity, px.
    pub fn predicted_shift_px(&self, gap: u32) -> [i32; 2] {
        let frames = gap.min(4) as i32;
        self.velocity_px.map(|px| px.clamp(-4096, 4096) * frames)
    }

    /// Predicts the extent in the next frame by its velocity.
    pub fn expected_extent(&self) -> PixelBox {
        self.extent.moved(self.predicted_shift_px(1))
    }

    /// Returns true if the object is known to move.
    pub fn moves(&self) -> bool {
        self.motion_state.state() == MotionState::Dynamic
    }

    /// Motion over ground in this frame: the identity for a static object.
    pub fn motion_world(&self, interval_s: f64) -> Transform {
        if self.motion_state.state() == MotionState::Static || !self.filter.is_known() {
            return Transform::IDENTITY;
        }
        self.filter.motion(interval_s)
    }

    /// Continues the trajectory segment, begins a new one or ends it. `was_known` tells if the
    /// motion state was known before this frame.
    pub fn advance_pose(&mut self, t_world_camera: &Transform, was_known: bool, interval_s: f64) {
        let state = self.motion_state.state();
        let connects =
            self.segment_len > 0 && (self.measured.get() || state != MotionState::Uncertain);
        if connects {
            let advanced = (self.motion_world(interval_s) * self.t_world_object).normalized();
            let is_new_static = state == MotionState::Static && !was_known;
            self.t_world_object = if is_new_static { self.t_world_origin } else { advanced };
            self.segment_len = self.segment_len.saturating_add(1);
        } else if self.instance.is_some() {
            (self.t_world_origin, self.t_world_object) = (*t_world_camera, *t_world_camera);
            (self.segment_len, self.segment_id) = (1, self.segment_id.wrapping_add(1));
        } else {
            self.segment_len = 0;
        }
    }

    /// Majority vote (Boyer, Moore): a class holds until others were detected more often.
    fn vote_class(&mut self, class: u32) {
        let by_motion = Class::MovingObject.code();
        if class == self.class {
            self.class_margin = self.class_margin.saturating_add(1);
        } else if class == by_motion {
            // That it moves says nothing about its class.
        } else if self.class == by_motion {
            (self.class, self.class_margin) = (class, 1);
        } else if self.class_margin > 1 {
            self.class_margin -= 1;
        } else {
            (self.class, self.class_margin) = (class, 1);
        }
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            filter,
            t_world_object,
            t_world_origin,
            mask,
            extent,
            velocity_px,
            motion_state,
            id,
            class,
            class_margin,
            score,
            first_frame,
            last_frame,
            sightings,
            instance,
            segment_len,
            segment_id,
            matches,
            inliers,
            measured,
            sigma_m_s,
            tracked_only,
            velocity_measured,
        } = self;
        filter.visit(visitor);
        visitor.transform(t_world_object);
        visitor.transform(t_world_origin);
        mask.visit(visitor);
        extent.visit(visitor);
        visitor.i32s(velocity_px);
        motion_state.visit(visitor);
        visitor.f32(score);
        visitor.f32(sigma_m_s);
        visitor.u32s([id, class, class_margin, first_frame, last_frame, sightings]);
        visitor.code(instance, OptionalIndex::to_bits, OptionalIndex::from_bits);
        visitor.u32s([
            segment_len,
            segment_id,
            matches,
            inliers,
            measured.bits_mut(),
            tracked_only.bits_mut(),
            velocity_measured.bits_mut(),
        ]);
    }
}

/// Returns true if a box shows less of the object than was expected.
pub(super) fn is_cut(seen: &PixelBox, expected: &PixelBox) -> bool {
    10 * seen.area() < CUT_TENTHS * expected.area()
}
