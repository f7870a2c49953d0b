//! Which detection each match of the scene flow lies on.

use super::{Tracker, detection::Taken, track::Track};
use crate::{
    masks::{MaskStore, PixelBox},
    scene_flow::Match,
};

/// Owner of a match that may lie on either of two things.
pub(crate) const AMBIGUOUS: u8 = u8::MAX;

/// Half the width of what a feature is told by, px.
const FEATURE_PX: i32 = 5;

impl<'s> Tracker<'s> {
    /// Finds out which detection each match lies on: under its copy mask or else, for the best, under its delete mask.
    pub fn claim(&mut self, refined: &[Match], sparse: &[Match]) {
        let masks = if self.now == 0 { &self.masks[0] } else { &self.masks[1] };
        let (detections, tracks) = (self.detections.all(), self.tracks.all());
        // Of two cars parked one behind the other in the distance neither takes the other's matches.
        let distinct = |other: &Taken| {
            let moves = || other.track.checked_sub(1).and_then(|at| tracks.get(at as usize)).is_some_and(Track::moves);
            other.small == 0 || moves()
        };
        let owners = self.owner.iter_mut().zip(refined).chain(self.sparse_owner.iter_mut().zip(sparse));
        for (owner, m) in owners {
            let (u, v) = pixel(m.current_left);
            let lies = |mut under: &mut dyn FnMut(&Taken) -> bool| detections.iter().position(&mut under);
            let copy = lies(&mut |detection| masks.contains(&detection.place, u, v));
            let found = copy.or_else(|| lies(&mut |detection| detection.delete(masks).contains(u, v)));
            *owner = match found {
                Some(at) if between(detections, distinct, masks, at, u, v) => AMBIGUOUS,
                Some(at) => at as u8 + 1,
                None => 0,
            };
        }
    }
}

/// Whether a pixel of detection `at` lies beside the copy mask of another: what is seen there may belong to either, for a feature is
/// several pixels wide, and the silhouette of a thing in front moves with that thing. Only others that are `distinct` count.
fn between(detections: &[Taken], distinct: impl Fn(&Taken) -> bool, masks: &MaskStore<'_>, at: usize, u: i32, v: i32) -> bool {
    let around = PixelBox {
        left: u - FEATURE_PX,
        top: v - FEATURE_PX,
        width: 2 * FEATURE_PX + 1,
        height: 2 * FEATURE_PX + 1,
    };
    let rim = [-FEATURE_PX, 0, FEATURE_PX];
    detections.iter().enumerate().filter(|&(other, taken)| other != at && distinct(taken)).any(|(_, other)| {
        around.intersection(&other.place.pixels).area() > 0
            && rim.iter().any(|dv| rim.iter().any(|du| masks.contains(&other.place, u + du, v + dv)))
    })
}

/// Whether two keypoints are one.
pub(super) fn near(a: [f32; 2], b: [f32; 2]) -> bool {
    let [u, v] = [a[0] - b[0], a[1] - b[1]];
    u * u + v * v < 2.0
}

/// The pixel a keypoint lies in; one far beside every image for what is not a number.
pub(crate) fn pixel([u, v]: [f32; 2]) -> (i32, i32) {
    if !(u.is_finite() && v.is_finite()) {
        return (-1, -1);
    }
    (crate::geometry::scalar::floor_i32(u + 0.5), crate::geometry::scalar::floor_i32(v + 0.5))
}
