//! What the static map does not get.

use super::{InstancesConfig, Tracker, track::Track};
use crate::{
    image::ViewMut,
    masks::{MaskStore, ScaledMask},
};

/// Frames over which a thing that is not seen is kept out all the same, where it would be by now: detectors miss one now and then.
const UNSEEN_FRAMES: u32 = 3;

impl<'s> Tracker<'s> {
    /// Sets the depth under the delete masks to 0: of what was detected, and of what was seen twice or more and is missed in this frame; but
    /// not of what is too small to be reconstructed and not known to move. Colour is only ever fused where there is depth. Call before
    /// [`Tracker::reconstruct`].
    pub fn clear(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        let (now, before) = if self.now == 0 { (&self.masks[0], &self.masks[1]) } else { (&self.masks[1], &self.masks[0]) };
        let mut cleared = 0;
        for detection in self.detections.all() {
            let moves = || self.track_of(detection).is_some_and(Track::moves);
            if detection.small == 0 || moves() {
                cleared += wipe(depth_m, &detection.delete(now));
            }
        }
        for track in self.tracks.all().iter().filter(|track| track.detection == 0) {
            let gap = self.frame.wrapping_sub(track.last_frame);
            if gap <= UNSEEN_FRAMES && track.sightings > 1 && (track.small == 0 || track.moves()) {
                cleared += wipe(depth_m, &missed(&self.config, track, gap, before, depth_m.width()));
            }
        }
        self.report.pixels_cleared = cleared;
    }
}

/// The delete mask of a track last seen `gap` frames ago, where it would be by now.
fn missed<'m, 's>(config: &InstancesConfig, track: &Track, gap: u32, before: &'m MaskStore<'s>, width: usize) -> ScaledMask<'m, 's> {
    let permille = config.delete_permille(track.place.pixels.area(), width);
    ScaledMask::new(before, track.place, permille).moved(track.drifted(gap))
}

/// Sets the depth under a mask to 0. Returns how many pixels had one.
fn wipe(depth_m: &mut ViewMut<'_, f32>, mask: &ScaledMask<'_, '_>) -> u32 {
    let width = depth_m.width();
    let rows = depth_m.pixels_mut().chunks_exact_mut(width.max(1));
    let (skip, take) = (mask.pixels.top.max(0), (mask.pixels.top + mask.pixels.height).max(0));
    let mut cleared = 0;
    for (v, row) in (0..).zip(rows).take(take as usize).skip(skip as usize) {
        mask.row(v, width as i32, |u| {
            if let Some(depth) = row.get_mut(u).filter(|depth| **depth != 0.0) {
                *depth = 0.0;
                cleared += 1;
            }
        });
    }
    cleared
}
