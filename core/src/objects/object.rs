//! The objects' own volumes.
//!
//! An object that is static or dynamic and of a class to be reconstructed gets a volume: a map of
//! its own whose frame moves with it. Its frame is the camera's at the first pose of the track's
//! trajectory segment. What was observed before its motion was known is fused first.
//!
//! | when | then |
//! |---|---|
//! | all volumes are in use | the object fused longest ago retires, of equals the older track's |
//! | that object was fused in this very frame | the new object is refused, and counted |
//! | a track is forgotten or evicted | its volume retires |
//! | a track's trajectory segment ended (a gap, a motion lost for too long) | its volume retires when the next segment fuses |
//! | the sequence ends | every volume retires |
//!
//! A retired object is handed to an [`ObjectSink`] first, so that nothing reconstructed is lost.
//!
//! Every `prune_frames` fused frames, and before it retires, voxels of the whole volume that weigh
//! at most `prune_weight` are reset: the paper prunes objects whole at every frame (Section III-F);
//! a voxel needs time to be observed twice, hence the interval.
//!
//! Memory: `capacity.objects` times a [`Volume`] of `capacity.object_blocks` blocks and 640 bytes,
//! and 6 bytes a pixel of the largest image.

use super::ObjectsConfig;
use crate::{
    geometry::Transform,
    memory::{Capacity, Carver, region_bytes},
    state::Hasher,
    tracking::{Class, MotionState},
    volume::Volume,
};
use heapless::Vec;

/// Most object volumes a capacity can ask for.
pub const MAX_OBJECTS: usize = 16;

/// Reason why an object retires.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Retirement {
    /// Track that was forgotten.
    #[default]
    Forgotten,
    /// Volume that was needed for another object.
    Displaced,
    /// Trajectory segment that ended: the object is reconstructed anew.
    Restarted,
    /// The sequence ended.
    Finished,
}

/// Class, motion state and counts of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ObjectSummary {
    /// Number of its track, from 1; a track of several trajectory segments has several objects.
    pub id: u32,
    /// Number of the track's trajectory segment, from 1.
    pub segment_id: u32,
    /// Class of the object.
    pub class: Class,
    /// Last motion state.
    pub state: MotionState,
    /// First frame fused.
    pub first_frame: u32,
    /// Last frame fused.
    pub last_frame: u32,
    /// Frames fused.
    pub frames: u32,
    /// Last pose: the volume's frame to the world.
    pub t_world_object: Transform,
}

/// An object that retires.
#[derive(Clone, Copy, Debug)]
pub struct RetiredObject<'v, 's> {
    /// Summary of the object.
    pub summary: ObjectSummary,
    /// Reason why the object retires.
    pub reason: Retirement,
    /// Volume of the object, in its own frame.
    pub volume: &'v Volume<'s>,
}

/// Takes objects that retire.
///
/// ```
/// use dynvox_core::objects::{ObjectSink, RetiredObject};
///
/// /// Counts the objects that left.
/// struct Count(u32);
/// impl ObjectSink for Count {
///     fn retire(&mut self, object: RetiredObject<'_, '_>) {
///         assert!(object.summary.first_frame <= object.summary.last_frame);
///         self.0 += 1;
///     }
/// }
/// ```
pub trait ObjectSink {
    /// Takes one; its volume is empty afterwards.
    fn retire(&mut self, object: RetiredObject<'_, '_>);
}

/// Drops them.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoSink;

impl ObjectSink for NoSink {
    fn retire(&mut self, _: RetiredObject<'_, '_>) {}
}

/// An object with its volume.
#[derive(Debug)]
pub struct Object<'s> {
    pub(super) volume: Volume<'s>,
    pub(super) summary: Option<ObjectSummary>,
}

impl<'s> Object<'s> {
    /// The object's map, in its own frame.
    pub fn volume(&self) -> &Volume<'s> {
        &self.volume
    }

    /// Returns the summary of the object; `None` while the volume is free.
    pub(crate) fn summary(&self) -> Option<&ObjectSummary> {
        self.summary.as_ref()
    }

    /// Number of its track, and the digest of what is known of it and of its map; `None` while the
    /// volume is free.
    pub(crate) fn digest(&mut self) -> Option<(u32, u64)> {
        let id = self.summary.as_ref()?.id;
        Some((id, Hasher::digest(|hasher| self.visit(hasher))))
    }

    pub(super) fn retire(
        &mut self,
        config: &ObjectsConfig,
        reason: Retirement,
        sink: &mut impl ObjectSink,
    ) -> bool {
        let Some(summary) = self.summary.take() else { return false };
        self.volume.prune_whole(if summary.frames > u32::from(config.prune_frames) {
            config.prune_weight
        } else {
            0
        });
        sink.retire(RetiredObject { summary, reason, volume: &self.volume });
        // No voxel weighs more.
        self.volume.prune_whole(u8::MAX);
        true
    }
}

/// Bounds of one object's volume.
const fn bounds(capacity: &Capacity) -> Capacity {
    Capacity {
        blocks: capacity.object_blocks,
        visible_blocks: capacity.object_blocks,
        history_frames: 1,
        // An object has no places, and no submaps.
        keyframes: 0,
        ..*capacity
    }
}

/// Bytes for an [`Object`] with 64-bit pointers.
const OBJECT_BYTES: usize = 640;
const _: () = assert!(size_of::<Object<'_>>() <= OBJECT_BYTES);

/// All object volumes.
#[derive(Debug)]
pub(super) struct ObjectVolumes<'s> {
    pub objects: Vec<&'s mut Object<'s>, MAX_OBJECTS>,
    /// Depth of one crop, m.
    pub depth_m: &'s mut [f32],
    /// Disparity of one crop.
    pub disparity_q8: &'s mut [u16],
}

impl<'s> ObjectVolumes<'s> {
    const fn volumes(capacity: &Capacity) -> usize {
        if capacity.objects < MAX_OBJECTS { capacity.objects } else { MAX_OBJECTS }
    }

    /// Bytes of the volumes, which belong in large memory.
    pub const fn cold_bytes(capacity: &Capacity) -> usize {
        Self::volumes(capacity)
            * (Volume::bytes(&bounds(capacity)) + region_bytes::<u8>(OBJECT_BYTES))
    }

    pub const fn bytes(capacity: &Capacity) -> usize {
        Self::cold_bytes(capacity)
            + region_bytes::<f32>(capacity.pixels())
            + region_bytes::<u16>(capacity.pixels())
    }

    pub fn new_in(capacity: &Capacity, config: &ObjectsConfig, carver: &mut Carver<'s>) -> Self {
        let (bounds, config, pixels) = (bounds(capacity), config.volume(), capacity.pixels());
        let mut made = Self {
            depth_m: carver.alloc("objects.depth_m", pixels),
            disparity_q8: carver.alloc("objects.disparity", pixels),
            objects: Vec::new(),
        };
        for _ in 0..Self::volumes(capacity) {
            // One name for all of them: the footprint lists a row, not one for each object.
            let object = carver.group("objects.volumes", |carver| {
                let volume = Volume::new_in(&bounds, &config, carver);
                carver.alloc_value("object", OBJECT_BYTES, Object { volume, summary: None })
            });
            // More volumes than the list can have are not made; `volumes` is bounded by it.
            object.and_then(|object| made.objects.push(object).err());
        }
        made
    }

    /// Position of the object of a track.
    pub fn position_of(&self, id: u32) -> Option<usize> {
        self.objects
            .iter()
            .position(|object| object.summary.is_some_and(|summary| summary.id == id))
    }

    /// A volume for a new object in frame `frame`: a free one, or that of the object fused longest
    /// ago, which retires.
    pub fn allocate(
        &mut self,
        config: &ObjectsConfig,
        frame: u32,
        retired: &mut u32,
        sink: &mut impl ObjectSink,
    ) -> Option<usize> {
        if let Some(free) = self.objects.iter().position(|object| object.summary.is_none()) {
            return Some(free);
        }
        let summaries =
            self.objects.iter().enumerate().filter_map(|(at, object)| Some((at, object.summary?)));
        // The object fused longest ago, between equals the older track's: a stated order.
        let (oldest, summary) =
            summaries.min_by_key(|(_, summary)| (summary.last_frame, summary.id))?;
        // One fused in this very frame is in view: the new object is refused instead.
        if summary.last_frame == frame {
            return None;
        }
        *retired +=
            u32::from(self.objects.get_mut(oldest)?.retire(config, Retirement::Displaced, sink));
        Some(oldest)
    }

    /// Blocks in use.
    pub fn blocks(&self) -> usize {
        self.objects.iter().map(|object| object.volume.pool().len()).sum()
    }
}
