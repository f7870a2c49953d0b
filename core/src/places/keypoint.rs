//! Points of a keyframe: where the left camera saw them, and their disparity, as integers.

use crate::scene_flow::Match;
use bytemuck::{Pod, Zeroable};

/// Image point with its depth. Three integers, so that a keyframe of another machine is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Keypoint {
    /// Column in the left image, 1/8 px.
    pub u_q3: u16,
    /// Row, 1/8 px.
    pub v_q3: u16,
    /// Disparity, 1/256 px; above 0.
    pub disparity_q8: u16,
}

/// Least disparity of a point, px: beyond, depth says nothing.
const DISPARITY_MIN_PX: f32 = 0.5;

impl Keypoint {
    /// The point that a match shows in the current frame; `None` beyond what the integers hold.
    pub(super) fn from_match(m: &Match) -> Option<Self> {
        let disparity_px = m.current_left[0] - m.current_right[0];
        // Not finite is not within.
        let is_within = |value: f32, least: f32| value >= least && value < f32::from(u16::MAX);
        let scaled = [m.current_left[0] * 8.0, m.current_left[1] * 8.0, disparity_px * 256.0];
        let fits = scaled.into_iter().zip([0.0, 0.0, DISPARITY_MIN_PX * 256.0]);
        fits.clone().all(|(value, least)| is_within(value, least)).then(|| {
            let [u_q3, v_q3, disparity_q8] = scaled.map(|value| (value + 0.5) as u16);
            Self { u_q3, v_q3, disparity_q8 }
        })
    }

    /// Position in the left image, px.
    pub(super) fn left(&self) -> [f32; 2] {
        [self.u_q3, self.v_q3].map(|at| f32::from(at) / 8.0)
    }

    /// Position in the right image, px.
    pub(super) fn right(&self) -> [f32; 2] {
        let [u, v] = self.left();
        [u - self.disparity_px(), v]
    }

    /// Disparity, px.
    pub(super) fn disparity_px(&self) -> f32 {
        f32::from(self.disparity_q8) / 256.0
    }

    /// Returns true if both lie within 4 px of each other.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        self.u_q3.abs_diff(other.u_q3) <= 32 && self.v_q3.abs_diff(other.v_q3) <= 32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_keeps_its_place_to_a_sixteenth_of_a_pixel() {
        let m = Match {
            current_left: [700.30, 120.71],
            current_right: [689.17, 120.60],
            ..Match::default()
        };
        let point = Keypoint::from_match(&m).unwrap();
        assert!((point.left()[0] - 700.30).abs() <= 0.0626);
        assert!((point.left()[1] - 120.71).abs() <= 0.0626);
        assert!((point.disparity_px() - 11.13).abs() <= 0.002);
    }

    #[test]
    fn a_point_without_depth_or_beyond_the_integers_is_none() {
        let with = |current_left, current_right| {
            Keypoint::from_match(&Match { current_left, current_right, ..Match::default() })
        };
        assert!(with([10.0, 10.0], [9.0, 10.0]).is_some());
        assert!(with([10.0, 10.0], [9.9, 10.0]).is_none(), "half a pixel of disparity at least");
        assert!(with([f32::NAN, 10.0], [9.0, 10.0]).is_none());
        assert!(with([9_000.0, 10.0], [8_990.0, 10.0]).is_none());
        assert!(with([600.0, 10.0], [10.0, 10.0]).is_none(), "256 px of disparity");
        assert!(with([10.0, -1.0], [9.0, -1.0]).is_none());
    }
}
