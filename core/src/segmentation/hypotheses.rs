//! Groups over frames: a group becomes an object when it is found again with the same motion, and
//! is predicted where it is not.

use super::hypothesis::PREDICT_FRAMES;
use super::{
    SegmentationConfig,
    groups::{Group, MAX_GROUPS},
    hypothesis::{Hypothesis, Observed, RECENT},
    trail::Trail,
};
use crate::{
    geometry::Transform,
    slices::{clipped, remove_at},
    state::Visitor,
};
use nalgebra::Vector3;

/// Most groups followed over frames.
pub(super) const MAX_HYPOTHESES: usize = 64;
/// Largest distance of a group from the position that the last one's motion predicts, m, and by
/// metre of depth.
const DISTANCE_M: f64 = 1.5;
const DISTANCE_PER_DEPTH: f64 = 0.06;
/// Largest difference of the motions in two frames, m, and by metre of depth.
const MOTION_M: f64 = 0.25;
const MOTION_PER_DEPTH: f64 = 0.02;
/// Frames in which an object that was hidden is searched for where it must be, after those over
/// which its mask is predicted.
const HIDDEN_FRAMES: u32 = 7;

/// All hypotheses, oldest first.
#[derive(Debug)]
pub(crate) struct Hypotheses<'s> {
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
        let mut used = [false; MAX_GROUPS];
        // In the order of the table, which is that of age: older hypotheses choose first.
        for hypothesis in self.table.iter_mut().take(self.len) {
            match hypothesis.nearest(groups, &used, t_world_camera) {
                Some((index, found)) => {
                    hypothesis.update(&found, t_world_camera);
                    used.get_mut(index).into_iter().for_each(|used| *used = true);
                }
                None => hypothesis.miss(),
            }
        }
        self.drop_missed();
        let mut refused = 0;
        // Groups that continue nothing begin a hypothesis each.
        for (group, _) in groups.iter().zip(used).filter(|(_, used)| !used) {
            let Some(slot) = self.table.get_mut(self.len) else {
                refused += 1;
                continue;
            };
            *slot = Hypothesis::new(config);
            slot.update(&Observed::new(group, t_world_camera), t_world_camera);
            self.len += 1;
        }
        refused
    }

    /// Drops the hypotheses missed for too long: an unconfirmed one once no recent frame agrees, a
    /// confirmed one after a frame in which it is given up.
    fn drop_missed(&mut self) {
        let mut kept = 0;
        let frames_most = u32::from(PREDICT_FRAMES) + HIDDEN_FRAMES;
        for index in 0..self.len {
            let Some(mut hypothesis) = self.table.get(index).copied() else { break };
            // It stays for one more frame, in which its trail is told.
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
            // The kept ones move up in place.
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
            // So many frames can be erased at most.
            hypothesis.unmasked = (hypothesis.unmasked + 1).min(u32::from(config.erase_frames));
        }
    }

    /// Visits where objects were in frames in which their depth was not kept out of the static map,
    /// each once.
    pub fn take_trails(&mut self, t_world_camera: &Transform, mut visit: impl FnMut(&Trail)) {
        for hypothesis in
            self.table.iter_mut().take(self.len).filter(|hypothesis| hypothesis.trail_frames > 0)
        {
            // Taken, so that a trail is told once.
            let frames = core::mem::take(&mut hypothesis.trail_frames);
            visit(&Trail::new(
                &hypothesis.extent(t_world_camera),
                t_world_camera,
                Vector3::from(hypothesis.motion_m),
                frames,
            ));
        }
    }

    /// Drops all hypotheses.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Drops the hypothesis at that position.
    pub fn remove(&mut self, index: usize) {
        if index < self.len {
            remove_at(self.table.get_mut(..self.len).unwrap_or_default(), index);
            self.len -= 1;
        }
    }
}

impl Hypothesis {
    /// The nearest group that is not used and moves alike, by position.
    fn nearest(
        &self,
        groups: &[Group],
        used: &[bool; MAX_GROUPS],
        t_world_camera: &Transform,
    ) -> Option<(usize, Observed)> {
        let predicted = self.center() + Vector3::from(self.motion_m);
        let mut best: Option<(f64, usize, Observed)> = None;
        for (index, group) in groups.iter().enumerate() {
            let found = Observed::new(group, t_world_camera);
            let distance_m = (found.center - predicted).norm();
            let difference_m = (found.motion - Vector3::from(self.motion_m)).norm();
            // Depth is less certain far away: both bounds grow with it.
            let is_near = distance_m < DISTANCE_M + DISTANCE_PER_DEPTH * found.depth_m;
            let is_alike =
                difference_m < MOTION_M + MOTION_PER_DEPTH * found.depth_m + found.depth_sigma_m;
            let is_free = used.get(index) == Some(&false);
            if is_near
                && is_alike
                && is_free
                && best.as_ref().is_none_or(|(least_m, ..)| distance_m < *least_m)
            {
                best = Some((distance_m, index, found));
            }
        }
        best.map(|(_, index, found)| (index, found))
    }
}

impl Observed {
    /// A group of a frame, moved into the world.
    fn new(group: &Group, t_world_camera: &Transform) -> Self {
        let extent = &group.extent;
        let mut half = [0.0; 3];
        for (half, (high, low)) in half.iter_mut().zip(extent.high.iter().zip(&extent.low)) {
            *half = 0.5 * (high - low);
        }
        Self {
            center: t_world_camera.transform_point(extent.center()),
            motion: t_world_camera.rotate(group.motion_m),
            half,
            depth_m: extent.center().z,
            depth_sigma_m: group.depth_sigma_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::extent::Extent;
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
            counts[1] += u32::from(hypotheses.all().iter().any(|hypothesis| hypothesis.is_shown()));
        }
        // One frame more, in which it is given up.
        assert_eq!(
            counts,
            [u32::from(PREDICT_FRAMES) + HIDDEN_FRAMES + 1, u32::from(PREDICT_FRAMES)]
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
        // Twenty frames are more than a hypothesis is searched for.
        let lost: u32 =
            (0..20).map(|_| frame(&[], false).iter().map(Trail::frames).sum::<u32>()).sum();
        assert_eq!(
            lost,
            u32::from(config.erase_frames),
            "all frames in which it was searched for, up to the most"
        );
    }
}
