//! Matches: one scene point in four images.

use bytemuck::{Pod, Zeroable};

/// Largest way of a match that stays in place, px, and largest change of its disparity.
pub(crate) const STILL_PX: f32 = 0.5;
/// Farthest distance of a part of the camera, in baselines: what is farther and keeps its distance
/// is a vehicle.
pub(crate) const NEAR_BASELINES: f32 = 13.0;

/// One scene point seen four times. Positions are (u, v) in px from the centre of the top left
/// pixel; of a refined match those of the middle of its patch, half a pixel above and to the left
/// of the feature's pixel.
///
/// ```
/// use dynvox_core::scene_flow::Match;
///
/// let m = Match {
///     previous_left: [100.0, 50.0],
///     previous_right: [90.0, 50.0],
///     current_left: [104.0, 51.0],
///     current_right: [92.0, 51.0],
/// };
/// // The disparity grew from 10 to 12 px: the point came nearer.
/// assert!(m.current_left[0] - m.current_right[0] > m.previous_left[0] - m.previous_right[0]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Match {
    /// In the left image of the previous frame.
    pub previous_left: [f32; 2],
    /// In the right image of the previous frame.
    pub previous_right: [f32; 2],
    /// In the left image of the current frame.
    pub current_left: [f32; 2],
    /// In the right image of the current frame.
    pub current_right: [f32; 2],
}

impl Match {
    /// Disparity in the previous frame, px.
    pub(crate) fn previous_disparity_px(&self) -> f32 {
        self.previous_left[0] - self.previous_right[0]
    }

    /// Disparity in the current frame, px.
    pub(crate) fn current_disparity_px(&self) -> f32 {
        self.current_left[0] - self.current_right[0]
    }

    /// Moves the positions in both right images.
    pub(crate) fn with_right(&self, moved: impl Fn([f32; 2]) -> [f32; 2]) -> Self {
        Self {
            previous_right: moved(self.previous_right),
            current_right: moved(self.current_right),
            ..*self
        }
    }

    /// Returns the position in the current right image, and the distance, px, by which the left
    /// image has the match lower.
    pub(crate) fn row_difference(&self) -> ([f64; 2], f64) {
        (self.current_right.map(f64::from), f64::from(self.current_left[1] - self.current_right[1]))
    }

    /// Tells that it stays in place at its disparity.
    pub(crate) fn is_still(&self) -> bool {
        let [du, dv] = self.flow_px();
        let change = self.current_disparity_px() - self.previous_disparity_px();
        [du, dv, change].iter().all(|px| px.abs() < STILL_PX)
    }

    /// Tells that it is so near that it may be a part of the camera, with this focal length, px.
    pub(crate) fn is_near(&self, focal_px: f64) -> bool {
        self.current_disparity_px() * NEAR_BASELINES > focal_px as f32
    }

    /// Movement in the left image, px.
    pub(crate) fn flow_px(&self) -> [f32; 2] {
        [self.current_left[0] - self.previous_left[0], self.current_left[1] - self.previous_left[1]]
    }
}
