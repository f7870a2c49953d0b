//! From a scan to pixels with a true disparity.

use crate::formats::Image;
use crate::input::LidarScan;
use dynvox_core::geometry::StereoRig;

/// Rows of a point's two projections may differ by this much, px.
pub const EPIPOLAR_PX: f64 = 1.2;
/// Pixels taken of exact depth at most: every n-th column and row.
pub const EXACT_POINTS: usize = 1 << 16;

/// What is evaluated.
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
    fn holds(&self, depth_m: f64) -> bool {
        depth_m >= self.near_m && depth_m <= self.far_m
    }
}

/// A pixel of the left image whose disparity is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Column, px.
    pub u: u16,
    /// Row, px.
    pub v: u16,
    /// True disparity, px.
    pub disparity_px: f32,
}

/// What became of a scan's points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanCount {
    /// Points in all.
    pub points: u32,
    /// Nearer or farther than what is fused, behind the camera, or no number.
    pub out_of_range: u32,
    /// In range, but beside the left image.
    pub outside: u32,
    /// Evaluated although their rows differ by more than [`EPIPOLAR_PX`].
    pub epipolar: u32,
}

/// Where a scan's points are seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aim {
    /// Points to compare, in the scan's order; a pixel may occur more than once.
    pub targets: Vec<Target>,
    /// What became of all.
    pub count: ScanCount,
}

/// Projects a scan into the left and the right camera.
pub fn aim(scan: &LidarScan, field: &Field) -> Aim {
    let mut aim = Aim {
        targets: Vec::new(),
        count: ScanCount { points: scan.points_m.len() as u32, ..ScanCount::default() },
    };
    for point in &scan.points_m {
        let [[u, v, depth_m], [u_right, v_right, _]] = scan.cameras.map(|camera| seen(&camera, point));
        let disparity_px = u - u_right;
        // Not so for NaN.
        let measures = field.holds(depth_m) && disparity_px > 0.0;
        if !measures {
            aim.count.out_of_range += 1;
            continue;
        }
        let (column, row) = (u.round(), v.round());
        if !((0.0..field.width as f64).contains(&column) && (0.0..field.height as f64).contains(&row)) {
            aim.count.outside += 1;
            continue;
        }
        aim.count.epipolar += u32::from((v - v_right).abs() > EPIPOLAR_PX);
        aim.targets.push(Target { u: column as u16, v: row as u16, disparity_px: disparity_px as f32 });
    }
    aim
}

/// Column, row and depth of a point.
fn seen(camera: &[f64; 12], [x, y, z]: &[f64; 3]) -> [f64; 3] {
    let row = |at: usize| camera[at] * x + camera[at + 1] * y + camera[at + 2] * z + camera[at + 3];
    let depth = row(8);
    [row(0) / depth, row(4) / depth, depth]
}

/// Takes a renderer's exact depth for a scan, thinned evenly to at most [`EXACT_POINTS`].
pub fn aim_at_exact(depth_m: &Image<f32>, rig: &StereoRig, field: &Field) -> Aim {
    let (width, height) = (depth_m.width(), depth_m.height());
    let step = (1..).find(|step| width.div_ceil(*step) * height.div_ceil(*step) <= EXACT_POINTS).unwrap_or(1);
    let mut aim = Aim::default();
    for v in (0..height).step_by(step) {
        for u in (0..width).step_by(step) {
            let depth_m = f64::from(depth_m.get(u, v).unwrap_or_default());
            aim.count.points += 1;
            if field.holds(depth_m) {
                let disparity_px = (rig.focal_baseline_px_m() / depth_m) as f32;
                aim.targets.push(Target { u: u as u16, v: v as u16, disparity_px });
            } else {
                aim.count.out_of_range += 1;
            }
        }
    }
    aim
}
