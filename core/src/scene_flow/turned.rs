//! Flow that a turn of the camera causes by itself: the centre of the search for features.
//!
//! A point far away moves by the homography `K R K^-1` of the turn `R`. A near one moves further by
//! what the camera's way adds, which the search radius covers.

use crate::geometry::{StereoRig, Transform};
use bytemuck::{Pod, Zeroable};

/// Smallest share of a ray's depth that stays ahead of the camera: other points leave the view.
const AHEAD_MIN: f32 = 0.1;
/// Largest flow in one direction, px: no image is larger.
const FLOW_MAX_PX: f32 = 8_000.0;

/// Flow of points far away from the previous image to the current one; 0 if zeroed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct TurnFlow {
    /// Homography, row by row.
    rows: [[f32; 3]; 3],
}

impl TurnFlow {
    /// Flow of a camera that does not turn, or may turn anyhow.
    pub(super) const NONE: Self = Self { rows: [[0.0; 3]; 3] };

    /// Flow of a camera that turns by the rotation of `t_before_now`.
    pub(super) fn new(rig: &StereoRig, t_before_now: &Transform) -> Self {
        let (focal_px, u, v) = (rig.focal_px, rig.center_u_px, rig.center_v_px);
        let turn = t_before_now.inverse();
        // Image of a direction, in homogeneous pixels.
        let image = |direction: [f64; 3]| {
            let [x, y, z] = turn.rotate(direction);
            [focal_px * x + u * z, focal_px * y + v * z, z]
        };
        // Pixels are linear in three directions: the two steps and the first pixel.
        let columns = [
            image([1.0 / focal_px, 0.0, 0.0]),
            image([0.0, 1.0 / focal_px, 0.0]),
            image([-u / focal_px, -v / focal_px, 1.0]),
        ];
        let row = |at: fn(&[f64; 3]) -> f64| columns.each_ref().map(|column| at(column) as f32);
        Self { rows: [row(|[u, ..]| *u), row(|[_, v, _]| *v), row(|[.., depth]| *depth)] }
    }

    /// Flow of a point far away that was at a position in the previous image, px; 0 without a turn,
    /// and where the point leaves the view.
    pub(super) fn at(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let [to_u, to_v, depth] = self.rows.map(|[by_u, by_v, first]| by_u * u + by_v * v + first);
        if depth < AHEAD_MIN {
            return [0.0; 2];
        }
        let flow = [to_u / depth - u, to_v / depth - v];
        let is_near = flow.iter().all(|px| (-FLOW_MAX_PX..FLOW_MAX_PX).contains(px));
        if is_near { flow } else { [0.0; 2] }
    }
}
