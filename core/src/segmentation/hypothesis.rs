//! One group over frames.

use super::{SegmentationConfig, extent::Extent};
use crate::{
    geometry::{
        Transform,
        scalar::{max_f64, min_f64},
    },
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

/// Number of the last three frames in which a group's motion must agree before it is an object.
const CONFIRM_FRAMES: u8 = 2;
/// Frames without a group over which an object's mask is predicted.
pub(super) const PREDICT_FRAMES: u8 = 3;
/// Share of an extent that is kept where a frame's members do not reach.
const KEPT_SHARE: f64 = 0.9;
/// Largest extent that is kept, m: width, height, length.
const KEPT_MAX_M: [f64; 3] = [1.8, 1.4, 4.0];
/// Frames of the history that count.
pub(super) const RECENT: u32 = 0b111;

/// A group that is followed over frames.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Hypothesis {
    /// Centre in the world, m.
    center_m: [f64; 3],
    /// Motion over ground in a frame, in the world's axes, m.
    pub(super) motion_m: [f64; 3],
    /// Half its sizes along the camera's axes, m.
    half_m: [f64; 3],
    /// Frames in which a group agreed: a bit a frame, the last one lowest.
    pub(super) history: u32,
    /// 1 if the hypothesis is an object, else 0.
    confirmed: u32,
    /// Frames without a group.
    pub(super) missed: u32,
    /// Frames up to now in which its mask was not shown, as far as they count.
    pub(super) unmasked: u32,
    /// Number of frames over which its trail in the static map is to be erased, set in this frame.
    pub(super) trail_frames: u32,
    /// Unused.
    padding: u32,
}

impl Hypothesis {
    /// A hypothesis that no frame has updated yet: its mask was not shown in the frames before.
    pub fn new(config: &SegmentationConfig) -> Self {
        Self { unmasked: u32::from(config.erase_frames), ..Self::default() }
    }

    pub(super) fn center(&self) -> Vector3<f64> {
        Vector3::from(self.center_m)
    }

    /// Visits every field.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            center_m,
            motion_m,
            half_m,
            history,
            confirmed,
            missed,
            unmasked,
            trail_frames,
            padding: _,
        } = self;
        visitor.f64s(center_m);
        visitor.f64s(motion_m);
        visitor.f64s(half_m);
        visitor.u32s([history, confirmed, missed, unmasked, trail_frames]);
    }

    /// Returns the extent in the camera's axes.
    pub fn extent(&self, t_world_camera: &Transform) -> Extent {
        let center: [f64; 3] = t_world_camera.inverse().transform_point(self.center_m);
        let mut extent = Extent { low: center, high: center };
        for ((low, high), half_m) in extent.low.iter_mut().zip(&mut extent.high).zip(self.half_m) {
            (*low, *high) = (*low - half_m, *high + half_m);
        }
        extent
    }

    /// Predicts extent and motion in the next frame's camera.
    pub fn predicted(&self, t_world_camera: &Transform) -> (Extent, Vector3<f64>) {
        let moved =
            Self { center_m: (self.center() + Vector3::from(self.motion_m)).into(), ..*self };
        (
            moved.extent(t_world_camera),
            t_world_camera.inverse().rotate(Vector3::from(self.motion_m)),
        )
    }

    pub fn is_confirmed(&self) -> bool {
        self.confirmed > 0
    }

    /// Returns true if its mask is in this frame.
    pub fn is_shown(&self) -> bool {
        self.is_confirmed() && self.missed <= u32::from(PREDICT_FRAMES)
    }

    /// Returns true if it has a group in this frame.
    pub fn is_observed(&self) -> bool {
        self.missed == 0
    }

    /// Ends the frames without a mask, because the mask is shown or the hypothesis is given up: the
    /// trail of those frames is to be erased.
    pub(super) fn end_unmasked(&mut self) {
        self.trail_frames = core::mem::take(&mut self.unmasked);
    }

    /// Updates it by the group of this frame.
    pub(super) fn update(&mut self, found: &Observed, t_world_camera: &Transform) {
        let is_known = self.history != 0;
        let expected = self.center() + Vector3::from(self.motion_m);
        // The difference to the prediction, in the camera's axes, in which extents are measured.
        let offset_m = t_world_camera.inverse().rotate(expected - found.center);
        // A bit for each frame, the latest lowest.
        self.history = self.history << 1 | 1;
        self.missed = 0;
        if (self.history & RECENT).count_ones() >= u32::from(CONFIRM_FRAMES) {
            self.confirmed = 1;
        }
        // The members are now on one part of it, now on another: its extent is theirs, and for a
        // while that of the frames before.
        let mut shift_m = Vector3::zeros();
        for (((half_m, found_m), (offset_m, shift_m)), max_m) in self
            .half_m
            .iter_mut()
            .zip(found.half)
            .zip(offset_m.iter().zip(shift_m.iter_mut()))
            .zip(KEPT_MAX_M)
        {
            let kept_m = if is_known { KEPT_SHARE * *half_m } else { 0.0 };
            // The object may grow on either side, but not beyond the largest size allowed.
            let free_m = max_f64(found_m, max_m - found_m);
            let low_m = if is_known {
                max_f64(-free_m, min_f64(-found_m, offset_m - kept_m))
            } else {
                -found_m
            };
            let high_m = if is_known {
                min_f64(free_m, max_f64(found_m, offset_m + kept_m))
            } else {
                found_m
            };
            // The new box need not lie about the members' centre: the shift moves it.
            (*half_m, *shift_m) = (0.5 * (high_m - low_m), 0.5 * (high_m + low_m));
        }
        self.center_m = (found.center + t_world_camera.rotate(shift_m)).into();
        self.motion_m = found.motion.into();
    }

    /// A frame without a group: it moves on.
    pub(super) fn miss(&mut self) {
        self.history <<= 1;
        self.missed = self.missed.saturating_add(1);
        self.center_m = (self.center() + Vector3::from(self.motion_m)).into();
    }
}

/// A group in the world.
pub(super) struct Observed {
    pub center: Vector3<f64>,
    pub motion: Vector3<f64>,
    pub half: [f64; 3],
    pub depth_m: f64,
    pub depth_sigma_m: f64,
}
