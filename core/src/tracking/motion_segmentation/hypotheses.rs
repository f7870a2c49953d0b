//! Groups over frames: a group becomes an object when it is found again with the same motion, and
//! is predicted where it is not.

use super::{
    SegmentationConfig,
    groups::{Extent, GROUPS_MAX, Group},
    trail::Trail,
};
use crate::{
    geometry::{
        Transform,
        scalar::{max_f64, min_f64},
    },
    slices::clipped,
    state::Visitor,
    tracking::association::remove_at,
};
use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

/// Most groups followed over frames.
pub(super) const HYPOTHESES_MAX: usize = 64;
/// How far a group may lie from where the last one's motion predicts it, m, and by metre of depth.
const DISTANCE_M: f64 = 1.5;
const DISTANCE_PER_DEPTH: f64 = 0.06;
/// How far the motions in two frames may differ, m, and by metre of depth.
const MOTION_M: f64 = 0.25;
const MOTION_PER_DEPTH: f64 = 0.02;
/// Share of an extent that is kept where a frame's members do not reach.
const KEPT_SHARE: f64 = 0.9;
/// Largest extent that is kept, m: width, height, length.
const KEPT_MAX_M: [f64; 3] = [1.8, 1.4, 4.0];
/// Frames in which an object that was hidden is searched for where it must be, after those over
/// which its mask is predicted.
const HIDDEN_FRAMES: u32 = 7;
/// Frames of the history that count.
const RECENT: u32 = 0b111;

/// A group that is followed over frames.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(in crate::tracking) struct Hypothesis {
    /// Centre in the world, m.
    center_m: [f64; 3],
    /// Motion over ground in a frame, in the world's axes, m.
    motion_m: [f64; 3],
    /// Half its sizes along the camera's axes, m.
    half_m: [f64; 3],
    /// Frames in which a group agreed: a bit a frame, the last one lowest.
    history: u32,
    /// Whether it is an object: 0 or 1.
    confirmed: u32,
    /// Frames without a group.
    missed: u32,
    /// Frames up to now in which its mask was not shown, as far as they count.
    unmasked: u32,
    /// Those over which what it left in the static map is to be erased, told in this frame.
    trail_frames: u32,
    /// Unused.
    padding: u32,
}

impl Hypothesis {
    fn center(&self) -> Vector3<f64> {
        Vector3::from(self.center_m)
    }

    /// Visits every field.
    fn visit(&mut self, visitor: &mut impl Visitor) {
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

    /// Where it is in the camera's axes.
    pub fn extent(&self, t_world_camera: &Transform) -> Extent {
        let center: [f64; 3] = t_world_camera.inverse().transform_point(self.center_m);
        let mut extent = Extent { low: center, high: center };
        for ((low, high), half_m) in extent.low.iter_mut().zip(&mut extent.high).zip(self.half_m) {
            (*low, *high) = (*low - half_m, *high + half_m);
        }
        extent
    }

    /// Where it is supposed to be in the next frame's camera, and how it moves there.
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

    /// Whether its mask is in this frame.
    pub fn is_shown(&self, config: &SegmentationConfig) -> bool {
        self.is_confirmed() && self.missed <= u32::from(config.predict_frames)
    }

    /// Whether a group of this frame is its own.
    pub fn is_observed(&self) -> bool {
        self.missed == 0
    }

    /// Its mask is shown in this frame, or it is given up: what it left in the frames before
    /// without one is to be erased.
    fn end_unmasked(&mut self) {
        self.trail_frames = core::mem::take(&mut self.unmasked);
    }

    /// Updates it by the group of this frame.
    fn update(
        &mut self,
        config: &SegmentationConfig,
        found: &Observed,
        t_world_camera: &Transform,
    ) {
        let is_known = self.history != 0;
        let expected = self.center() + Vector3::from(self.motion_m);
        let offset_m = t_world_camera.inverse().rotate(expected - found.center);
        self.history = self.history << 1 | 1;
        self.missed = 0;
        if (self.history & RECENT).count_ones() >= u32::from(config.confirm_frames) {
            self.confirmed = 1;
        }
        // The members are now on one part of it, now on another: its extent is theirs, and for a
        // while that of the frames before.
        let mut shift_m = Vector3::zeros();
        for (((half_m, found_m), (offset_m, shift_m)), most_m) in self
            .half_m
            .iter_mut()
            .zip(found.half)
            .zip(offset_m.iter().zip(shift_m.iter_mut()))
            .zip(KEPT_MAX_M)
        {
            let kept_m = if is_known { KEPT_SHARE * *half_m } else { 0.0 };
            let free_m = max_f64(found_m, most_m - found_m);
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
            (*half_m, *shift_m) = (0.5 * (high_m - low_m), 0.5 * (high_m + low_m));
        }
        self.center_m = (found.center + t_world_camera.rotate(shift_m)).into();
        self.motion_m = found.motion.into();
    }

    /// A frame without a group: it moves on.
    fn miss(&mut self) {
        self.history <<= 1;
        self.missed += 1;
        self.center_m = (self.center() + Vector3::from(self.motion_m)).into();
    }
}

/// A group in the world.
struct Observed {
    center: Vector3<f64>,
    motion: Vector3<f64>,
    half: [f64; 3],
    depth_m: f64,
    depth_sigma_m: f64,
}

/// All hypotheses, oldest first.
#[derive(Debug)]
pub(in crate::tracking) struct Hypotheses<'s> {
    table: &'s mut [Hypothesis],
    len: usize,
}

impl<'s> Hypotheses<'s> {
    pub fn new(table: &'s mut [Hypothesis]) -> Self {
        Self { table, len: 0 }
    }

    /// Visits all hypotheses.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { table, len } = self;
        visitor.count(len, table.len());
        table.iter_mut().take(*len).for_each(|hypothesis| hypothesis.visit(visitor));
    }

    pub fn all(&self) -> &[Hypothesis] {
        debug_assert!(self.len <= self.table.len());
        clipped(self.table, ..self.len)
    }

    /// Continues hypotheses with a frame's groups, the nearest first for each, begins new ones and
    /// drops those missed for too long. Returns how many groups found the table full.
    pub fn update(
        &mut self,
        config: &SegmentationConfig,
        groups: &[Group],
        t_world_camera: &Transform,
    ) -> u32 {
        let mut used = [false; GROUPS_MAX];
        let observed = |group: &Group| {
            let half = group
                .extent
                .high
                .iter()
                .zip(&group.extent.low)
                .map(|(high, low)| 0.5 * (high - low));
            let mut halves = [0.0; 3];
            halves.iter_mut().zip(half).for_each(|(slot, half)| *slot = half);
            Observed {
                center: t_world_camera.transform_point(group.extent.center()),
                motion: t_world_camera.rotate(group.motion_m),
                half: halves,
                depth_m: group.extent.center().z,
                depth_sigma_m: group.depth_sigma_m,
            }
        };
        for hypothesis in self.table.iter_mut().take(self.len) {
            let predicted = hypothesis.center() + Vector3::from(hypothesis.motion_m);
            let mut best: Option<(f64, usize, Observed)> = None;
            for (index, group) in groups.iter().enumerate() {
                let found = observed(group);
                let distance_m = (found.center - predicted).norm();
                let difference_m = (found.motion - Vector3::from(hypothesis.motion_m)).norm();
                let is_near = distance_m < DISTANCE_M + DISTANCE_PER_DEPTH * found.depth_m;
                let is_alike = difference_m
                    < MOTION_M + MOTION_PER_DEPTH * found.depth_m + found.depth_sigma_m;
                let is_free = used.get(index) == Some(&false);
                if is_near
                    && is_alike
                    && is_free
                    && best.as_ref().is_none_or(|(least_m, ..)| distance_m < *least_m)
                {
                    best = Some((distance_m, index, found));
                }
            }
            match best {
                Some((_, index, found)) => {
                    hypothesis.update(config, &found, t_world_camera);
                    used.get_mut(index).into_iter().for_each(|used| *used = true);
                }
                None => hypothesis.miss(),
            }
        }
        self.drop_missed(config);
        let mut refused = 0;
        for (group, _) in groups.iter().zip(used).filter(|(_, used)| !used) {
            let Some(slot) = self.table.get_mut(self.len) else {
                refused += 1;
                continue;
            };
            *slot =
                Hypothesis { unmasked: u32::from(config.erase_frames), ..Hypothesis::default() };
            slot.update(config, &observed(group), t_world_camera);
            self.len += 1;
        }
        refused
    }

    /// Drops the hypotheses missed for too long: an unconfirmed one once no recent frame agrees, a
    /// confirmed one after a frame in which it is given up.
    fn drop_missed(&mut self, config: &SegmentationConfig) {
        let mut kept = 0;
        let frames_most = u32::from(config.predict_frames) + HIDDEN_FRAMES;
        for index in 0..self.len {
            let Some(mut hypothesis) = self.table.get(index).copied() else { break };
            let is_given_up = hypothesis.is_confirmed() && hypothesis.missed == frames_most + 1;
            if is_given_up {
                hypothesis.end_unmasked();
            }
            let is_recent = hypothesis.history & RECENT != 0;
            let stays = if hypothesis.is_confirmed() {
                is_given_up || hypothesis.missed <= frames_most
            } else {
                is_recent
            };
            if let Some(slot) = self.table.get_mut(kept).filter(|_| stays) {
                *slot = hypothesis;
                kept += 1;
            }
        }
        self.len = kept;
    }

    /// Notes whether the mask of the hypothesis at that position is shown in this frame.
    pub fn note_shown(&mut self, config: &SegmentationConfig, index: usize, shown: bool) {
        let Some(hypothesis) = self.table.get_mut(..self.len).and_then(|all| all.get_mut(index))
        else {
            return;
        };
        if shown {
            hypothesis.end_unmasked();
        } else {
            hypothesis.unmasked = (hypothesis.unmasked + 1).min(u32::from(config.erase_frames));
        }
    }

    /// Visits where objects were in frames in which their depth was not kept out of the static map,
    /// each once.
    pub fn take_trails(&mut self, t_world_camera: &Transform, mut visit: impl FnMut(&Trail)) {
        for hypothesis in
            self.table.iter_mut().take(self.len).filter(|hypothesis| hypothesis.trail_frames > 0)
        {
            let frames = core::mem::take(&mut hypothesis.trail_frames);
            visit(&Trail::new(
                &hypothesis.extent(t_world_camera),
                t_world_camera,
                Vector3::from(hypothesis.motion_m),
                frames,
            ));
        }
    }

    /// Drops the hypothesis at that position.
    pub fn remove(&mut self, index: usize) {
        if index < self.len {
            remove_at(self.table.get_mut(..self.len).unwrap_or_default(), index);
            self.len -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;

    fn group(x: f64, width_m: f64) -> Group {
        let half = 0.5 * width_m;
        let extent = Extent { low: [x - half, 0.0, 10.0], high: [x + half, 1.0, 10.5] };
        Group {
            extent,
            depth_m: 10.0,
            motion_m: Vector3::zeros(),
            members: 9,
            first: 0,
            depth_sigma_m: 0.0,
        }
    }

    #[test]
    fn the_extent_of_members_on_another_part_of_it_is_kept_for_a_while() {
        let (mut table, config) = (vec![Hypothesis::default(); 2], SegmentationConfig::default());
        let mut hypotheses = Hypotheses::new(&mut table);
        for (x, width_m, [left, right]) in
            [(0.0, 1.6, [-0.8, 0.8]), (0.5, 0.4, [-0.72, 0.72]), (0.5, 0.4, [-0.648, 0.7])]
        {
            hypotheses.update(&config, &[group(x, width_m)], &Transform::IDENTITY);
            let extent = hypotheses.all()[0].extent(&Transform::IDENTITY);
            assert!(
                (extent.low[0] - left).abs() < 1e-9 && (extent.high[0] - right).abs() < 1e-9,
                "{extent:?}"
            );
        }
        // It never gets larger than a car by that.
        hypotheses.update(&config, &[group(-0.9, 1.0)], &Transform::IDENTITY);
        let extent = hypotheses.all()[0].extent(&Transform::IDENTITY);
        assert!(extent.high[0] - extent.low[0] <= 1.8 + 1e-9, "{extent:?}");
    }

    #[test]
    fn a_hidden_object_is_searched_for_longer_than_its_mask_is_shown() {
        let (mut table, config) = (vec![Hypothesis::default(); 2], SegmentationConfig::default());
        let mut hypotheses = Hypotheses::new(&mut table);
        for _ in 0..2 {
            hypotheses.update(&config, &[group(0.0, 1.6)], &Transform::IDENTITY);
        }
        let mut counts = [0, 0];
        for _ in 0..20 {
            hypotheses.update(&config, &[], &Transform::IDENTITY);
            counts[0] += hypotheses.all().len() as u32;
            counts[1] +=
                u32::from(hypotheses.all().iter().any(|hypothesis| hypothesis.is_shown(&config)));
        }
        // One frame more, in which it is given up.
        assert_eq!(
            counts,
            [
                u32::from(config.predict_frames) + HIDDEN_FRAMES + 1,
                u32::from(config.predict_frames)
            ]
        );
    }

    #[test]
    fn what_was_left_before_the_mask_and_while_it_was_lost_is_told_once() {
        let (mut table, config) = (vec![Hypothesis::default(); 2], SegmentationConfig::default());
        let mut hypotheses = Hypotheses::new(&mut table);
        let (camera, moving) = (
            Transform::IDENTITY,
            Group { motion_m: Vector3::new(0.2, 0.0, 0.0), ..group(0.0, 1.6) },
        );
        let mut frame = |groups: &[Group], shown: bool| {
            hypotheses.update(&config, groups, &camera);
            hypotheses.note_shown(&config, 0, shown);
            let mut trails = vec![];
            hypotheses.take_trails(&camera, |trail| trails.push(*trail));
            trails
        };
        assert!(frame(&[moving], false).is_empty(), "nothing is known yet");
        let first = frame(&[moving], true);
        let boxes: std::vec::Vec<_> = first[0].boxes().collect();
        assert_eq!((first.len(), boxes.len()), (1, usize::from(config.erase_frames)));
        assert!(
            boxes[0].contains([-0.9, 0.5, 10.0]) && !boxes[0].contains([-1.4, 0.5, 10.0]),
            "0.2 m back and a margin of 0.3 m"
        );
        assert!(
            boxes[7].contains([-2.3, 0.5, 10.0]) && !boxes[7].contains([-0.2, 0.5, 10.0]),
            "1.6 m back"
        );
        assert!(!boxes[0].contains([-0.2, 1.1, 10.0]), "not the ground below it");
        assert!(frame(&[moving], true).is_empty(), "its mask was shown");
        let lost: u32 =
            (0..20).map(|_| frame(&[], false).iter().map(Trail::frames).sum::<u32>()).sum();
        assert_eq!(
            lost,
            u32::from(config.erase_frames),
            "all frames in which it was searched for, up to the most"
        );
    }
}
