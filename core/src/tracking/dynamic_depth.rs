//! Which depth the static map does not get.

use super::{InstancesConfig, Tracker, track::Track};
use crate::{
    image::ViewMut,
    masks::{MaskStore, ScaledMask},
    slices::clipped_mut,
};

/// Frames over which the depth under an undetected track's predicted mask is removed: detectors
/// miss an object now and then.
const UNDETECTED_FRAMES: u32 = 3;

impl Tracker<'_> {
    /// Sets the depth under the delete masks to 0: of every instance, and of tracks with at least
    /// two sightings that are not detected in this frame; but not of what is tracked only, unless
    /// it is known to move. Returns how many pixels had depth.
    pub(super) fn mask_dynamic_depth(&self, depth_m: &mut ViewMut<'_, f32>) -> u32 {
        let mut removed = 0;
        for instance in self.instances.all() {
            let moves = || self.track_of(instance).is_some_and(Track::moves);
            if !instance.tracked_only.get() || moves() {
                removed += remove_depth(depth_m, &instance.delete_mask(self.masks.current()));
            }
        }
        for track in self.tracks.all().iter().filter(|track| !track.instance.is_some()) {
            let gap = self.frame.wrapping_sub(track.last_frame);
            if gap <= UNDETECTED_FRAMES
                && track.sightings > 1
                && (!track.tracked_only.get() || track.moves())
            {
                let predicted = predicted_delete_mask(
                    self.instances.config(),
                    track,
                    gap,
                    self.masks.previous(),
                    depth_m.width(),
                );
                removed += remove_depth(depth_m, &predicted);
            }
        }
        removed
    }
}

/// The delete mask of a track last detected `gap` frames ago, where its velocity in the image
/// predicts it.
fn predicted_delete_mask<'m, 's>(
    config: &InstancesConfig,
    track: &Track,
    gap: u32,
    previous: &'m MaskStore<'s>,
    width: usize,
) -> ScaledMask<'m, 's> {
    let permille = config.delete_permille(track.mask.pixels.area(), width);
    ScaledMask::new(previous, track.mask, permille).moved(track.predicted_shift_px(gap))
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
