//! LiDAR scans, as points of the rectified cameras.

use crate::formats::calibration::Projection;
use dynvox_core::geometry::StereoRig;

/// One scan, and the two cameras it is seen with.
#[derive(Clone, Debug, PartialEq)]
pub struct LidarScan {
    /// Points in the axes of rectified camera 0, m: x right, y down, z forward.
    pub points_m: Vec<[f64; 3]>,
    /// Projection of the left and of the right camera, row by row, from these axes to pixels.
    pub cameras: [Projection; 2],
}

impl LidarScan {
    /// Points in the left camera's own axes, seen by an ideal rig.
    pub fn of_rig(points_m: Vec<[f64; 3]>, rig: &StereoRig) -> Self {
        let (f, u, v) = (rig.focal_px, rig.center_u_px, rig.center_v_px);
        let camera = |shift: f64| [f, 0.0, u, shift, 0.0, f, v, 0.0, 0.0, 0.0, 1.0, 0.0];
        Self { points_m, cameras: [camera(0.0), camera(-rig.focal_baseline_px_m())] }
    }

    /// Scales the projections to images scaled by `scale`: pixel centres lie at whole numbers,
    /// areas begin half a pixel before them.
    pub fn scaled(mut self, scale: f64) -> Self {
        let shift = 0.5 * scale - 0.5;
        for camera in &mut self.cameras {
            let (pixels, depth) = camera.split_at_mut(8);
            for (at, value) in pixels.iter_mut().enumerate() {
                *value = *value * scale + shift * depth.get(at % 4).copied().unwrap_or_default();
            }
        }
        self
    }
}
