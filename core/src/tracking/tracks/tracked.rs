//! A frame's instances with their tracks: which depth and which matches are kept from the static
//! map and from egomotion, and what a pixel shows.

use super::Track;
use crate::tracking::{
    instances::{Class, Instance, InstancesConfig},
    matches::{Excluded, InstanceMasks, MAX_MOVING},
    motion::MotionState,
};
use crate::{
    image::ViewMut,
    masks::{MaskStore, ScaledMask, TwoFrames},
    slices::clipped_mut,
};

/// Frames over which the depth under an undetected track's predicted mask is removed: detectors
/// miss an object now and then.
const UNDETECTED_FRAMES: u32 = 3;

/// Instances of a frame, tracks and masks.
#[derive(Clone, Copy)]
pub(in super::super) struct TrackedInstances<'a, 's> {
    /// Number of the frame.
    pub frame: u32,
    pub instances: &'a [Instance],
    pub tracks: &'a [Track],
    pub masks: &'a TwoFrames<MaskStore<'s>>,
}

impl<'a, 's> TrackedInstances<'a, 's> {
    /// The track of an instance; `None` where the table of tracks was full.
    pub fn track_of(&self, instance: &Instance) -> Option<&'a Track> {
        self.tracks.get(instance.track.get()?)
    }

    fn state_of(&self, instance: &Instance) -> MotionState {
        self.track_of(instance).map_or(MotionState::Uncertain, |track| track.motion_state.state())
    }

    /// Returns true if the instance is to be reconstructed or known to move.
    fn is_distinct(&self, instance: &Instance) -> bool {
        !instance.tracked_only.get() || self.track_of(instance).is_some_and(Track::moves)
    }

    /// The instances and masks that matches are assigned to. Two cars parked one behind the other
    /// in the distance keep their matches: neither is distinct.
    pub fn instance_masks(&self) -> InstanceMasks<'a, 's> {
        let bits = (0..).zip(self.instances);
        let distinct =
            bits.fold(0, |bits, (at, one)| bits | u64::from(self.is_distinct(one)) << at);
        InstanceMasks { instances: self.instances, masks: self.masks.current(), distinct }
    }

    /// The objects whose matches egomotion may not use: dynamic ones, and those of unknown state
    /// whose mask has more than `large_px` pixels.
    pub fn excluded(&self, large_px: f64) -> Excluded {
        let mut instances = 0u64;
        for (bit, instance) in self.instances.iter().enumerate() {
            let is_excluded = match self.state_of(instance) {
                MotionState::Dynamic => true,
                MotionState::Static => false,
                MotionState::Uncertain => {
                    self.masks.current().area(&instance.mask) as f64 > large_px
                }
            };
            instances |= u64::from(is_excluded) << bit;
        }
        let is_missing = |track: &&Track| {
            track.class() == Class::MovingObject
                && track.moves()
                && !track.instance.is_some()
                && self.frame.wrapping_sub(track.last_frame) == 1
        };
        let moving = self.tracks.iter().filter(is_missing).map(|track| track.mask);
        Excluded { instances, moving: moving.take(MAX_MOVING).collect() }
    }

    /// Sets the depth under the delete masks to 0: of every instance, and of tracks with at least
    /// two sightings that are not detected in this frame; but not of what is tracked only, unless
    /// it is known to move. Returns how many pixels had depth.
    pub fn remove_depth(&self, config: &InstancesConfig, depth_m: &mut ViewMut<'_, f32>) -> u32 {
        let mut removed = 0;
        for instance in self.instances.iter().filter(|instance| self.is_distinct(instance)) {
            removed += remove_depth(depth_m, &instance.delete_mask(self.masks.current()));
        }
        for track in self.tracks.iter().filter(|track| !track.instance.is_some()) {
            let gap = self.frame.wrapping_sub(track.last_frame);
            if gap <= UNDETECTED_FRAMES
                && track.sightings > 1
                && (!track.tracked_only.get() || track.moves())
            {
                // The delete mask, where the track's velocity in the image predicts it.
                let permille = config.delete_permille(track.mask.pixels.area(), depth_m.width());
                let predicted = ScaledMask::new(self.masks.previous(), track.mask, permille)
                    .moved(track.predicted_shift_px(gap));
                removed += remove_depth(depth_m, &predicted);
            }
        }
        removed
    }

    /// The best instance whose copy mask has the pixel, in constant time per instance; `None` for
    /// the static map.
    pub fn instance_at(&self, u: i32, v: i32) -> Option<InstanceAt> {
        let masks = self.masks.current();
        let instance =
            self.instances.iter().find(|instance| masks.contains(&instance.mask, u, v))?;
        Some(InstanceAt {
            class: instance.class(),
            track: self.track_of(instance).map(|track| track.id),
            state: self.state_of(instance),
        })
    }
}

/// A detected instance, as a pixel shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstanceAt {
    /// Class that the detector gives.
    pub class: Class,
    /// Number of its track; `None` where the table of tracks was full.
    pub track: Option<u32>,
    /// Motion state of the object.
    pub state: MotionState,
}

/// Sets the depth under a mask to 0. Returns how many pixels had depth.
fn remove_depth(depth_m: &mut ViewMut<'_, f32>, mask: &ScaledMask<'_, '_>) -> u32 {
    let width = depth_m.width();
    let rows = depth_m.pixels_mut().chunks_exact_mut(width.max(1));
    let (skip, take) = (mask.pixels.top.max(0), (mask.pixels.top + mask.pixels.height).max(0));
    let mut removed = 0;
    for (v, row) in (0..).zip(rows).take(take as usize).skip(skip as usize) {
        mask.runs(v, width, |run| {
            let depths = clipped_mut(row, run);
            removed += depths.iter().map(|&depth_m| u32::from(depth_m != 0.0)).sum::<u32>();
            depths.fill(0.0);
        });
    }
    removed
}
