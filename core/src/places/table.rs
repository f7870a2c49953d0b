//! Keyframes in a table of fixed size.
//!
//! A full table thins out: the keyframe leaves whose neighbours on the way, in its own segment, are
//! nearest to each other; of equals the oldest one. So keyframes stay spread over the whole way,
//! and get sparser on it. Where no segment has three of them the oldest leaves.

use super::{descriptor::Descriptor, keypoint::Keypoint};
use crate::{
    geometry::{MapSegment, Transform},
    memory::{Carver, region_bytes},
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

/// Points of a keyframe.
pub const KEYFRAME_POINTS: usize = 128;

/// Pose of a keyframe and number of its points.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    rotation: [f64; 4],
    translation_m: [f64; 3],
    segment: u32,
    points: u32,
}

impl Head {
    fn t_world_camera(&self) -> Transform {
        Transform { rotation: self.rotation, translation_m: self.translation_m }
    }

    fn segment(&self) -> MapSegment {
        MapSegment::new(self.segment as u16)
    }
}

/// Pose in a segment of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPose {
    /// Segment of the map.
    pub segment: MapSegment,
    /// Camera coordinates to the segment's world coordinates.
    pub t_world_camera: Transform,
}

impl SegmentPose {
    /// Visits segment and pose.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { segment, t_world_camera } = self;
        visitor.transform(t_world_camera);
        visitor.code(
            segment,
            |segment| u32::from(segment.get()),
            |code| MapSegment::new(code as u16),
        );
    }
}

/// The keyframes.
#[derive(Debug)]
pub(super) struct Table<'s> {
    heads: &'s mut [Head],
    points: &'s mut [[Keypoint; KEYFRAME_POINTS]],
    descriptors: &'s mut [[Descriptor; KEYFRAME_POINTS]],
    /// Slots of the keyframes, in the order in which they were taken.
    order: &'s mut [u32],
    len: usize,
}

impl<'s> Table<'s> {
    pub(super) const fn bytes(keyframes: usize) -> usize {
        region_bytes::<Head>(keyframes)
            + region_bytes::<[Keypoint; KEYFRAME_POINTS]>(keyframes)
            + region_bytes::<[Descriptor; KEYFRAME_POINTS]>(keyframes)
            + region_bytes::<u32>(keyframes)
    }

    pub(super) fn new_in(keyframes: usize, carver: &mut Carver<'s>) -> Self {
        Self {
            heads: carver.alloc("places.head", keyframes),
            points: carver.alloc("places.point", keyframes),
            descriptors: carver.alloc("places.descriptor", keyframes),
            order: carver.alloc("places.order", keyframes),
            len: 0,
        }
    }

    /// Slots of the keyframes, oldest first.
    pub(super) fn slots(&self) -> impl DoubleEndedIterator<Item = usize> + Clone {
        self.order.iter().take(self.len).map(|&slot| slot as usize)
    }

    /// Poses of the keyframes, oldest first.
    pub(super) fn poses(&self) -> impl Iterator<Item = SegmentPose> {
        self.slots().filter_map(|slot| self.pose(slot))
    }

    pub(super) fn pose(&self, slot: usize) -> Option<SegmentPose> {
        self.heads.get(slot).map(|head| SegmentPose {
            segment: head.segment(),
            t_world_camera: head.t_world_camera(),
        })
    }

    /// Points of a keyframe with their descriptors.
    pub(super) fn points(&self, slot: usize) -> impl Iterator<Item = (&Keypoint, &Descriptor)> {
        let count = self.heads.get(slot).map_or(0, |head| head.points as usize);
        let (points, descriptors) = (self.points.get(slot), self.descriptors.get(slot));
        points.into_iter().flatten().zip(descriptors.into_iter().flatten()).take(count)
    }

    /// Descriptor of a number that [`Table::insert`] gave, and the slot of its keyframe.
    pub(super) fn described(&self, number: u32) -> Option<(usize, &Descriptor)> {
        let (slot, point) = (number as usize / KEYFRAME_POINTS, number as usize % KEYFRAME_POINTS);
        Some((slot, self.descriptors.get(slot)?.get(point)?))
    }

    /// Number of a point's descriptor.
    pub(super) fn number(slot: usize, point: usize) -> u32 {
        (slot * KEYFRAME_POINTS + point) as u32
    }

    /// Slot for the next keyframe, and whether one has to leave it first.
    pub(super) fn next_slot(&self) -> Option<(usize, bool)> {
        if self.len < self.heads.len() {
            // Slots are given out in turn until the table is full.
            return Some((self.len, false));
        }
        self.most_crowded().or_else(|| self.slots().next()).map(|slot| (slot, true))
    }

    /// The keyframe between the two nearest to each other.
    fn most_crowded(&self) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        let neighbours = self.slots().zip(self.slots().skip(1).zip(self.slots().skip(2)));
        for (before, (slot, after)) in neighbours {
            let poses = [before, slot, after].map(|slot| self.pose(slot));
            let [Some(before), Some(middle), Some(after)] = poses else { continue };
            if before.segment != middle.segment || after.segment != middle.segment {
                continue;
            }
            let gap_m = (before.t_world_camera.inverse() * after.t_world_camera).distance_m();
            if best.is_none_or(|(least_m, _)| gap_m < least_m) {
                best = Some((gap_m, slot));
            }
        }
        best.map(|(_, slot)| slot)
    }

    /// Puts a keyframe into a slot of [`Table::next_slot`], as the newest.
    pub(super) fn insert<'p>(
        &mut self,
        slot: usize,
        pose: &SegmentPose,
        points: impl Iterator<Item = (&'p Keypoint, &'p Descriptor)>,
    ) {
        let (Some(head), Some(to), Some(described)) =
            (self.heads.get_mut(slot), self.points.get_mut(slot), self.descriptors.get_mut(slot))
        else {
            return;
        };
        let mut count = 0;
        for ((to, described), (point, descriptor)) in to.iter_mut().zip(described).zip(points) {
            (*to, *described) = (*point, *descriptor);
            count += 1;
        }
        *head = Head {
            rotation: pose.t_world_camera.rotation,
            translation_m: pose.t_world_camera.translation_m,
            segment: u32::from(pose.segment.get()),
            points: count,
        };
        self.make_newest(slot);
    }

    /// Moves a slot to the end of the order; one that is not in it is added.
    fn make_newest(&mut self, slot: usize) {
        let known = self.slots().position(|other| other == slot);
        match known {
            Some(at) => {
                // Each of those after it moves down by one; `rotate_left` could panic.
                let mut next = slot as u32;
                let later = self.order.get_mut(at..self.len).unwrap_or_default();
                later.iter_mut().rev().for_each(|entry| core::mem::swap(entry, &mut next));
            }
            None => {
                if let Some(last) = self.order.get_mut(self.len) {
                    *last = slot as u32;
                    self.len += 1;
                }
            }
        }
    }

    /// Moves the keyframes of a segment into another one, whose frame of reference is known now.
    pub(super) fn join(&mut self, from: MapSegment, to: MapSegment, t_to_from: &Transform) {
        let joined = |head: &&mut Head| head.segment() == from;
        for head in self.heads.iter_mut().take(self.len).filter(joined) {
            let t_world_camera = (*t_to_from * head.t_world_camera()).normalized();
            (head.rotation, head.translation_m) =
                (t_world_camera.rotation, t_world_camera.translation_m);
            head.segment = u32::from(to.get());
        }
    }

    /// Visits the keyframes in use.
    pub(super) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { heads, points: _, descriptors: _, order, len } = self;
        visitor.count(len, heads.len());
        visitor.u32s(order.iter_mut().take(*len));
        // Slots are given out in turn, so those in use are the first ones.
        (0..*len).for_each(|slot| self.visit_keyframe(slot, visitor));
    }

    /// Visits the keyframes by themselves, oldest first; those that are read come into the first
    /// slots of an empty table.
    pub(super) fn visit_in_order(&mut self, visitor: &mut impl Visitor) {
        let mut count = self.len;
        visitor.count(&mut count, self.heads.len());
        let is_read = self.len == 0;
        for at in 0..count {
            if let Some(slot) = self.order.get_mut(at).filter(|_| is_read) {
                *slot = at as u32;
            }
            let slot = self.order.get(at).copied().unwrap_or_default();
            self.visit_keyframe(slot as usize, visitor);
        }
        self.len = count;
    }

    fn visit_keyframe(&mut self, slot: usize, visitor: &mut impl Visitor) {
        let (Some(head), Some(points), Some(descriptors)) =
            (self.heads.get_mut(slot), self.points.get_mut(slot), self.descriptors.get_mut(slot))
        else {
            return;
        };
        let Head { rotation, translation_m, segment, points: count } = head;
        visitor.f64s(&mut *rotation);
        visitor.f64s(&mut *translation_m);
        visitor.u32(segment);
        let mut points_used = *count as usize;
        visitor.count(&mut points_used, KEYFRAME_POINTS);
        *count = points_used as u32;
        for Keypoint { u_q3, v_q3, disparity_q8 } in points {
            let mut integers = [*u_q3, *v_q3, *disparity_q8];
            visitor.u16s(&mut integers);
            [*u_q3, *v_q3, *disparity_q8] = integers;
        }
        for Descriptor(words) in descriptors {
            visitor.u64s(words);
        }
        // A pose that no camera can have would make all that follows from it meaningless.
        let pose = Transform { rotation: *rotation, translation_m: *translation_m };
        if !(pose.is_finite() && pose.is_rotation()) {
            visitor.refuse();
        }
    }

    /// Forgets all keyframes.
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::SLAB_ALIGN;
    use std::{vec, vec::Vec};

    fn with_table<R>(keyframes: usize, test: impl FnOnce(&mut Table<'_>) -> R) -> R {
        let bytes = Table::bytes(keyframes);
        let mut slab = vec![0; bytes + SLAB_ALIGN];
        test(&mut Table::new_in(keyframes, &mut Carver::new(&mut slab, bytes).unwrap()))
    }

    fn at(segment: u16, ahead_m: f64) -> SegmentPose {
        SegmentPose {
            segment: MapSegment::new(segment),
            t_world_camera: Transform::from_translation([0.0, 0.0, ahead_m]),
        }
    }

    fn take(table: &mut Table<'_>, pose: &SegmentPose) {
        let (slot, _) = table.next_slot().unwrap();
        table.insert(slot, pose, core::iter::empty());
    }

    fn ways_m(table: &Table<'_>) -> Vec<f64> {
        table.poses().map(|pose| pose.t_world_camera.translation_m[2]).collect()
    }

    #[test]
    fn a_full_table_stays_spread_over_the_way() {
        with_table(8, |table| {
            (0..64).for_each(|metre| take(table, &at(0, f64::from(metre))));
            let ways_m = ways_m(table);
            assert_eq!((ways_m.len(), ways_m[0], ways_m[7]), (8, 0.0, 63.0));
            let gaps = ways_m.windows(2).map(|pair| pair[1] - pair[0]);
            assert!(gaps.clone().all(|gap_m| (1.0..=20.0).contains(&gap_m)), "{ways_m:?}");
        });
    }

    #[test]
    fn neighbours_of_another_segment_do_not_crowd() {
        with_table(4, |table| {
            [at(0, 0.0), at(1, 0.1), at(0, 0.2), at(1, 0.3), at(2, 9.0)]
                .iter()
                .for_each(|pose| take(table, pose));
            assert_eq!(ways_m(table), [0.1, 0.2, 0.3, 9.0], "the oldest left");
        });
    }

    #[test]
    fn a_joined_segment_moves_with_its_keyframes() {
        with_table(3, |table| {
            [at(0, 1.0), at(1, 2.0)].iter().for_each(|pose| take(table, pose));
            let [first, second] = [0, 1].map(MapSegment::new);
            table.join(second, first, &Transform::from_translation([0.0, 0.0, 10.0]));
            assert!(table.poses().all(|pose| pose.segment == first));
            assert_eq!(ways_m(table), [1.0, 12.0]);
        });
    }
}
