//! What a match is.

use bytemuck::{Pod, Zeroable};

/// One scene point seen four times. Positions are (u, v) in px from the centre of the top left pixel; of a refined match those of the middle
/// of its patch, half a pixel above and to the left of the feature's pixel.
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

    /// The same with the columns of both right images replaced.
    pub(crate) fn with_right(&self, column: impl Fn(f32) -> f32) -> Self {
        let ([u_previous, v_previous], [u_current, v_current]) = (self.previous_right, self.current_right);
        Self {
            previous_right: [column(u_previous), v_previous],
            current_right: [column(u_current), v_current],
            ..*self
        }
    }

    /// Movement in the left image, px.
    pub(crate) fn flow_px(&self) -> [f32; 2] {
        [self.current_left[0] - self.previous_left[0], self.current_left[1] - self.previous_left[1]]
    }
}
