//! Submaps: stretches of the camera's way, whose blocks move together where loops are closed.
//!
//! Each block belongs to the submap in which it was visible last. A submap ends after so much way,
//! and where the camera enters another segment. A block that was not visible for some submaps is
//! one the camera came back to: by then the pose has an error, so that what is seen now must not be
//! averaged into it (docs/decisions/0090-submaps.md).
//!
//! **Memory.** 2 bytes a block and 80 for each of `Capacity::keyframes`; nothing where it is 0, and
//! then nothing is computed either.
//!
//! **What can go wrong.** The last submap of a full table does not end.

use super::{BLOCK_SIDE, BlockCoord, Slot};
use crate::{
    geometry::{MapSegment, Transform},
    memory::{Capacity, Carver, region_bytes},
    slices::clipped_mut,
    state::Visitor,
};
use bytemuck::{Pod, Zeroable};

/// Way of a submap, voxels: 10 m at 5 cm.
const SUBMAP_VOXELS: f64 = 200.0;
/// Way that a turn of a radian counts as, voxels.
const RADIAN_VOXELS: f64 = 20.0;
/// Submaps after which a block that was not visible is one that the camera came back to.
pub(crate) const LEFT_AFTER: u16 = 4;
/// Most submaps: archives have half of the segments' numbers.
const SUBMAPS_MAX: usize = 1 << 15;

/// Camera, for submaps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubmapCamera<'a> {
    /// Number of the frame.
    pub frame: u32,
    /// Pose as driven.
    pub t_world_camera: &'a Transform,
    /// Maps coordinates as driven to those after all loops, at the newest keyframe.
    pub t_closed_driven: Transform,
}

/// Stretch of the camera's way.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Submap {
    /// Maps coordinates as driven to those after all loops.
    pub t_closed_driven: Transform,
    /// Number of its first frame.
    pub first_frame: u32,
    /// Segment that the camera was in.
    pub segment: MapSegment,
    /// Bounds of the blocks that were ever visible in it; empty where `low` is above `high`.
    low: [i16; 3],
    high: [i16; 3],
    padding: [u16; 3],
}

impl Submap {
    /// Returns true if a block at these coordinates, blocks, may be one of the submap or touch one.
    pub fn may_hold(&self, at: [f64; 3]) -> bool {
        let bounds = self.low.iter().zip(&self.high);
        at.iter()
            .zip(bounds)
            .all(|(at, (low, high))| *at > f64::from(*low) - 2.0 && *at < f64::from(*high) + 3.0)
    }

    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { t_closed_driven, first_frame, segment, low, high, padding: _ } = self;
        visitor.transform(t_closed_driven);
        visitor.u32(first_frame);
        let mut number = segment.get();
        visitor.u16s(core::slice::from_mut(&mut number));
        *segment = MapSegment::new(number);
        visitor.i16s(low);
        visitor.i16s(high);
    }
}

/// Way of the camera.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Way {
    /// Last pose.
    last: Transform,
    /// Way since the newest submap began, voxels.
    voxels: f64,
    /// Submaps begun.
    len: u32,
    /// 1 if no more submaps begin.
    is_off: u32,
}

/// Submaps of a volume.
#[derive(Debug)]
pub(crate) struct Submaps<'s> {
    /// Submap of the block in each slot.
    of_slot: &'s mut [u16],
    table: &'s mut [Submap],
    /// One, or none where there are no keyframes.
    way: &'s mut [Way],
}

impl<'s> Submaps<'s> {
    const fn most(capacity: &Capacity) -> usize {
        if capacity.keyframes < SUBMAPS_MAX { capacity.keyframes } else { SUBMAPS_MAX }
    }

    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        if capacity.keyframes == 0 {
            return 0;
        }
        region_bytes::<u16>(capacity.blocks)
            + region_bytes::<Submap>(Self::most(capacity))
            + region_bytes::<Way>(1)
    }

    /// Allocates an empty table; nothing where the capacity has no keyframes.
    pub fn new_in(capacity: &Capacity, carver: &mut Carver<'s>) -> Self {
        let make = |carver: &mut Carver<'s>| Self {
            of_slot: carver.alloc("of_slot", capacity.blocks),
            table: carver.alloc("table", Self::most(capacity)),
            way: carver.alloc("way", 1),
        };
        match capacity.keyframes {
            0 => carver.absent(make),
            _ => carver.group("volume.submaps", make),
        }
    }

    /// Returns true if there is memory for submaps.
    pub fn is_on(&self) -> bool {
        !self.way.is_empty()
    }

    fn len(&self) -> usize {
        self.way.first().map_or(0, |way| way.len as usize)
    }

    /// Begins no submap from here on.
    pub fn turn_off(&mut self) {
        self.way.iter_mut().for_each(|way| way.is_off = 1);
    }

    /// Takes the camera of a frame that is fused: a submap begins after so much way, and in
    /// another segment.
    pub fn advance(&mut self, camera: &SubmapCamera<'_>, segment: MapSegment, voxel_size_m: f32) {
        let goes_on = self.newest().is_some_and(|newest| newest.segment == segment);
        let Some(way) = self.way.first_mut().filter(|way| way.is_off == 0) else { return };
        let moved = way.last.inverse() * *camera.t_world_camera;
        way.last = *camera.t_world_camera;
        way.voxels +=
            moved.distance_m() / f64::from(voxel_size_m) + RADIAN_VOXELS * moved.angle_rad();
        if goes_on && way.voxels < SUBMAP_VOXELS {
            return;
        }
        if let Some(next) = self.table.get_mut(way.len as usize) {
            *next = Submap {
                t_closed_driven: camera.t_closed_driven,
                first_frame: camera.frame,
                segment,
                low: [i16::MAX; 3],
                high: [i16::MIN; 3],
                padding: [0; 3],
            };
            way.len += 1;
            way.voxels = 0.0;
        }
    }

    fn newest(&self) -> Option<&Submap> {
        self.table.get(self.len().checked_sub(1)?)
    }

    /// Submap of a number.
    pub fn get(&self, number: u16) -> Option<&Submap> {
        self.table.get(..self.len())?.get(usize::from(number))
    }

    /// Numbers of all submaps, oldest first.
    pub fn numbers(&self) -> impl DoubleEndedIterator<Item = u16> + use<> {
        // At most half of what 16 bits can say.
        0..self.len() as u16
    }

    /// Submap of the block in a slot.
    pub fn of(&self, slot: Slot) -> Option<u16> {
        self.of_slot.get(slot.index()).copied()
    }

    /// Makes the block in a slot one of the newest submap.
    pub fn insert(&mut self, slot: Slot, coord: BlockCoord) {
        let Some(newest) = self.len().checked_sub(1) else { return };
        if let (Some(of), Some(submap)) =
            (self.of_slot.get_mut(slot.index()), self.table.get_mut(newest))
        {
            *of = newest as u16;
            let bounds = submap.low.iter_mut().zip(&mut submap.high);
            for ((low, high), at) in bounds.zip([coord.x, coord.y, coord.z]) {
                *low = if at < *low { at } else { *low };
                *high = if at > *high { at } else { *high };
            }
        }
    }

    /// Returns true if the block in a slot is one of the newest submap.
    pub fn is_newest(&self, slot: Slot) -> bool {
        self.of(slot).is_some_and(|of| usize::from(of) + 1 == self.len())
    }

    /// Returns true if the block in a slot was not visible for so long that the camera came back to
    /// it.
    pub fn is_left(&self, slot: Slot) -> bool {
        self.of(slot).is_some_and(|of| usize::from(of) + usize::from(LEFT_AFTER) < self.len())
    }

    /// Moves each submap to where `correction` says for a segment and a
    /// frame; frames ascend, and `None` leaves a submap where it is.
    pub fn close(&mut self, mut correction: impl FnMut(MapSegment, u32) -> Option<Transform>) {
        for at in 0..self.len() {
            let next_frame = self.get(at as u16 + 1);
            let next_frame = next_frame.map(|next| next.first_frame);
            let Some(submap) = self.table.get_mut(at) else { return };
            let first = submap.first_frame;
            let length = next_frame.unwrap_or(first).wrapping_sub(first);
            let middle = first.wrapping_add(length / 2);
            if let Some(t_closed_driven) = correction(submap.segment, middle) {
                submap.t_closed_driven = t_closed_driven;
            }
        }
    }

    /// Visits what lives from frame to frame, of blocks in the first `slots` slots.
    pub fn visit(&mut self, slots: usize, visitor: &mut impl Visitor) {
        let Self { of_slot, table, way } = self;
        let Some(Way { last, voxels, len, is_off }) = way.first_mut() else { return };
        visitor.u16s(clipped_mut(of_slot, ..slots));
        let mut begun = *len as usize;
        visitor.count(&mut begun, table.len());
        *len = begun as u32;
        table.iter_mut().take(begun).for_each(|submap| submap.visit(visitor));
        visitor.transform(last);
        visitor.f64(voxels);
        visitor.u32(is_off);
    }
}

/// Coordinates of a point in blocks.
pub(crate) fn in_blocks(point_m: [f64; 3], voxel_size_m: f32) -> [f64; 3] {
    let block_m = f64::from(voxel_size_m) * BLOCK_SIDE as f64;
    point_m.map(|at| at / block_m)
}
