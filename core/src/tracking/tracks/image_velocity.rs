//! How far each track moves in the image from the last frame to this one, as the matches under its
//! mask say.
//!
//! The middle of a box says it badly: the box jumps by a cell of the network's grid, is cut at the
//! image's border, and shrinks where something passes in front. Matches are of what is seen in both
//! frames.
//!
//! Time: one look at each match for each track. Memory: 4 KiB of the stack.

use super::Track;
use crate::{
    geometry::{
        histogram::{BINS, Histogram},
        scalar::floor_i32,
    },
    masks::MaskStore,
    tracking::matches::{FrameMatches, pixel},
};

/// Fewest matches whose median is taken.
const MATCHES_MIN: u32 = 5;
/// Largest movement, px a frame: what moves farther is counted as moving that far.
const MOVEMENT_MAX_PX: i32 = BINS as i32 / 2 - 1;

/// Measures the velocity of each track that was detected in the frame before `frame` and has
/// matches enough.
pub(in super::super) fn measure_image_velocities(
    tracks: &mut [Track],
    frame: u32,
    matches: &FrameMatches<'_>,
    previous: &MaskStore<'_>,
) {
    for track in tracks {
        track.velocity_measured = false.into();
        if frame.wrapping_sub(track.last_frame) != 1 {
            continue;
        }
        let mask = track.mask;
        let mut movements = [Movements::new(), Movements::new()];
        for m in matches.refined.iter().chain(matches.sparse) {
            let (u, v) = pixel(m.previous_left);
            if previous.contains(&mask, u, v) {
                let moved = m
                    .current_left
                    .into_iter()
                    .zip(m.previous_left)
                    .map(|(current, previous)| current - previous);
                movements.iter_mut().zip(moved).for_each(|(axis, px)| axis.add(px));
            }
        }
        if let [Some(u), Some(v)] = movements.map(|axis| axis.median_px()) {
            (track.velocity_px, track.velocity_measured) = ([u, v], true.into());
        }
    }
}

/// Movements along one axis, a bin for each pixel.
struct Movements(Histogram);

impl Movements {
    const fn new() -> Self {
        Self(Histogram::new())
    }

    /// Counts a movement; what is not a number is left out.
    fn add(&mut self, px: f32) {
        if px.is_finite() {
            self.0.add(
                (floor_i32(px + 0.5).clamp(-MOVEMENT_MAX_PX, MOVEMENT_MAX_PX) + MOVEMENT_MAX_PX)
                    as usize,
            );
        }
    }

    /// The median, to the pixel; `None` of fewer than [`MATCHES_MIN`].
    fn median_px(&self) -> Option<i32> {
        self.0
            .median()
            .filter(|_| self.0.total() >= MATCHES_MIN)
            .map(|bin| bin as i32 - MOVEMENT_MAX_PX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn median_px(movements_px: impl Iterator<Item = f32>) -> Option<i32> {
        let mut movements = Movements::new();
        movements_px.for_each(|px| movements.add(px));
        movements.median_px()
    }

    #[test]
    fn the_median_of_movements_ignores_what_moves_otherwise() {
        let movements = |background: usize| {
            [-7.4f32, -6.8, -7.1, -7.0, -6.6]
                .into_iter()
                .chain(core::iter::repeat_n(30.0, background))
        };
        assert_eq!(median_px(movements(0)), Some(-7));
        assert_eq!(median_px(movements(4)), Some(-7));
        assert_eq!(median_px(movements(6)), Some(30));
    }

    #[test]
    fn few_movements_and_what_is_no_number_say_nothing() {
        assert_eq!(median_px([1.0, 1.0, 1.0, 1.0].into_iter()), None);
        assert_eq!(median_px([1.0, 1.0, 1.0, 1.0, f32::NAN].into_iter()), None);
        assert_eq!(median_px([1e30; 5].into_iter()), Some(MOVEMENT_MAX_PX));
        assert_eq!(median_px([-1e30; 5].into_iter()), Some(-MOVEMENT_MAX_PX));
    }
}
