//! A scan as pixels with a true disparity.

use crate::formats::Image;
use crate::input::LidarScan;
use dynvox_core::geometry::StereoRig;
use serde::{Deserialize, Serialize};

/// Rows of a point's two projections may differ by this much, px.
pub const EPIPOLAR_PX: f64 = 1.2;
/// Pixels taken of exact depth at most: every n-th column and row.
pub const EXACT_POINTS: usize = 1 << 16;

/// The image area and depth range that is evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Image width, px.
    pub width: usize,
    /// Image height, px.
    pub height: usize,
    /// Nearest depth, m: that of fusion.
    pub near_m: f64,
    /// Farthest depth, m.
    pub far_m: f64,
}

impl Field {
    fn contains(&self, depth_m: f64) -> bool {
        depth_m >= self.near_m && depth_m <= self.far_m
    }
}

/// A pixel of the left image whose disparity is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedPoint {
    /// Column, px.
    pub u: u16,
    /// Row, px.
    pub v: u16,
    /// True disparity, px.
    pub disparity_px: f32,
}

/// A scan's points by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScanCount {
    /// Points in all.
    pub points: u32,
    /// Nearer or farther than what is fused, behind the camera, or not finite.
    pub out_of_range: u32,
    /// In range, but outside the left image.
    pub outside: u32,
    /// Evaluated although their rows differ by more than [`EPIPOLAR_PX`].
    pub epipolar: u32,
}

/// A scan in the left image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectedScan {
    /// Points to compare, in the scan's order; a pixel may occur more than once.
    pub points: Vec<ProjectedPoint>,
    /// All points by outcome.
    pub count: ScanCount,
}

/// Projects a scan into the left and the right camera.
pub fn project_scan(scan: &LidarScan, field: &Field) -> ProjectedScan {
    let mut projected = ProjectedScan {
        points: Vec::new(),
        count: ScanCount { points: scan.points_m.len() as u32, ..ScanCount::default() },
    };
    for point in &scan.points_m {
        let [[u, v, depth_m], [u_right, v_right, _]] =
            scan.cameras.map(|camera| seen(&camera, point));
        let disparity_px = u - u_right;
        // False for NaN.
        // The disparity is measured in the images, so that both calibrations are used.
        let measures = field.contains(depth_m) && disparity_px > 0.0;
        if !measures {
            projected.count.out_of_range += 1;
            continue;
        }
        // A point between pixels belongs to the nearest one.
        let (column, row) = (u.round(), v.round());
        if !((0.0..field.width as f64).contains(&column)
            && (0.0..field.height as f64).contains(&row))
        {
            projected.count.outside += 1;
            continue;
        }
        // The two projections of one point share a row, or the calibration is off.
        projected.count.epipolar += u32::from((v - v_right).abs() > EPIPOLAR_PX);
        projected.points.push(ProjectedPoint {
            u: column as u16,
            v: row as u16,
            disparity_px: disparity_px as f32,
        });
    }
    projected
}

/// Column, row and depth of a point.
fn seen(camera: &[f64; 12], [x, y, z]: &[f64; 3]) -> [f64; 3] {
    let row = |at: usize| camera[at] * x + camera[at + 1] * y + camera[at + 2] * z + camera[at + 3];
    let depth = row(8);
    [row(0) / depth, row(4) / depth, depth]
}

/// Takes a renderer's exact depth instead of a scan, thinned evenly to at most [`EXACT_POINTS`].
pub fn sample_exact_depth(depth_m: &Image<f32>, rig: &StereoRig, field: &Field) -> ProjectedScan {
    let (width, height) = (depth_m.width(), depth_m.height());
    // The finest grid of pixels with at most that many points.
    let step = (1..)
        .find(|step| width.div_ceil(*step) * height.div_ceil(*step) <= EXACT_POINTS)
        .unwrap_or(1);
    let mut projected = ProjectedScan::default();
    for v in (0..height).step_by(step) {
        for u in (0..width).step_by(step) {
            let depth_m = f64::from(depth_m.get(u, v).unwrap_or_default());
            projected.count.points += 1;
            if field.contains(depth_m) {
                let disparity_px = (rig.focal_baseline_px_m() / depth_m) as f32;
                projected.points.push(ProjectedPoint { u: u as u16, v: v as u16, disparity_px });
            } else {
                projected.count.out_of_range += 1;
            }
        }
    }
    projected
}
