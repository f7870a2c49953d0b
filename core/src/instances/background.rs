//! What the static map does not get.

use super::{Instances, track::Track};
use crate::image::ViewMut;

impl<'s> Instances<'s> {
    /// Sets the depth under the delete masks to 0: under all but those of what is too small to be reconstructed and not known to move. Colour is only ever fused where there is depth.
    pub fn clear(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        let width = depth_m.width();
        let masks = if self.now == 0 { &self.masks[0] } else { &self.masks[1] };
        let mut cleared = 0;
        for detection in self.detections.all() {
            let moves = || self.track_of(detection).is_some_and(Track::moves);
            if detection.small == 1 && !moves() {
                continue;
            }
            let mask = detection.delete(masks);
            let rows = depth_m.pixels_mut().chunks_exact_mut(width.max(1));
            let (skip, take) = (mask.pixels.top.max(0), (mask.pixels.top + mask.pixels.height).max(0));
            for (v, row) in (0..).zip(rows).take(take as usize).skip(skip as usize) {
                mask.row(v, width as i32, |u| {
                    if let Some(depth) = row.get_mut(u).filter(|depth| **depth != 0.0) {
                        *depth = 0.0;
                        cleared += 1;
                    }
                });
            }
        }
        self.report.pixels_cleared = cleared;
    }
}
