//! Free space from a disparity image: what a cell is seen through, is free.
//!
//! A cell's centre at depth z falls on pixels of disparity d at most. With the disparity error m
//! that is to be expected, the surface lies beyond `f b / (d + m)`; where that is more than `z` and
//! half the cell's diagonal, the cell is free. Where the surface is not nearer than the cell it was
//! looked at, and keeps what it was. The disparity is the greatest of all pixels that a cell
//! covers: free is what is seen through as a whole, so nothing thin is lost. A surface of the map
//! in a cell that several frames in a row saw through is a ghost of what moved on. Pixels without a
//! disparity say nothing: sky is unknown. This is the inverse sensor model of occupancy grids
//! (Elfes: *Using Occupancy Grids for Mobile Robot Perception and Navigation*, 1989) with
//! certainties for probabilities: surfaces come from the map, whose averages are better evidence
//! than a count of hits.
//!
//! Time: linear in the cells in view within `far_m`. Order: columns by y, then x, cells upwards; no
//! cell's result depends on another's.

use super::{
    PlanningConfig,
    cells::{Cells, seen_surface, seen_through},
    grid::Grid,
    pyramid::Pyramid,
};
use crate::{
    geometry::{
        GroundPlane, StereoRig, Transform,
        scalar::{floor_i32, min_f32},
    },
    image::View,
};

/// Half the diagonal of a cube, in its sides.
const HALF_DIAGONAL: f32 = 0.866_025_4;
/// Units of disparity a pixel.
const DISPARITY_ONE: f32 = 256.0;
/// Disparity error to be expected, px: a cell is free where the surface behind it is seen beyond it
/// in spite of such an error.
pub(crate) const MARGIN_PX: f32 = 0.5;

/// Depth of a frame, with the camera, as free space needs it.
#[derive(Clone, Copy, Debug)]
pub struct DepthView<'a> {
    /// The cameras, of the disparity image.
    pub rig: &'a StereoRig,
    /// Left camera to world.
    pub t_world_camera: &'a Transform,
    /// Disparity, 1/256 px, 0 none; of everything, moving objects too: they hide what is behind
    /// them and show what is before them.
    pub disparity_q8: View<'a, u16>,
    /// The ground plane of the disparity image; `None` where it shows too little ground, or
    /// [`Planning::seeks_ground`](super::Planning::seeks_ground) says that it is not needed.
    pub ground: Option<GroundPlane>,
    /// Depth up to which the map holds what the frame shows, m: farther cells count as not seen.
    pub within_m: f32,
}

/// A frame's geometry, per cell.
struct Rays<'a> {
    disparity_q8: View<'a, u16>,
    pyramid: &'a Pyramid<'a>,
    /// Half a cell's side in the image, px times m.
    half_side_px_m: f32,
    focal_px: f32,
    /// Principal point and half a pixel, so that rounding down gives the nearest.
    center_px: [f32; 2],
    /// Change of the camera coordinates from cell to cell, m: along the grid's axes.
    steps: [[f32; 3]; 3],
    /// Camera coordinates of the centre of the window's first cell, m.
    first: [f32; 3],
    near_m: f32,
    far_m: f32,
    half_m: f32,
    margin_q8: f32,
    /// Focal length times baseline, in disparity units times m.
    focal_baseline_q8: f32,
}

/// Marks what a frame sees through. The window must lie around the camera.
pub(super) fn mark(
    config: &PlanningConfig,
    grid: &Grid,
    sight: &DepthView<'_>,
    pyramid: &Pyramid<'_>,
    cells: &mut Cells<'_>,
) {
    let rays = Rays::new(config, grid, sight, pyramid, cells);
    let [width, length, _] = cells.size;
    for y in 0..length {
        for x in 0..width {
            rays.column(x, y, cells);
        }
    }
}

impl<'a> Rays<'a> {
    fn new(
        config: &PlanningConfig,
        grid: &Grid,
        sight: &DepthView<'a>,
        pyramid: &'a Pyramid<'a>,
        cells: &Cells<'_>,
    ) -> Self {
        let (turn, camera) = grid.of_camera(sight.t_world_camera);
        let cell_m = grid.cell_m();
        // The grid's axes in the camera: the rotation backwards.
        let axes = turn.map(|row| row.map(|c| c * cell_m));
        let mut first = [0.0; 3];
        // The camera coordinates of the first cell's centre; all others are steps along the axes.
        for ((axis, origin), camera) in axes.iter().zip(cells.origin).zip(camera) {
            let offset = f64::from(origin) + 0.5 - camera;
            first.iter_mut().zip(axis).for_each(|(first, along)| *first += along * offset);
        }
        Self {
            disparity_q8: sight.disparity_q8,
            pyramid,
            half_side_px_m: 0.5 * (cell_m * sight.rig.focal_px) as f32,
            focal_px: sight.rig.focal_px as f32,
            center_px: [sight.rig.center_u_px as f32 + 0.5, sight.rig.center_v_px as f32 + 0.5],
            steps: axes.map(|axis| axis.map(|c| c as f32)),
            first: first.map(|c| c as f32),
            near_m: config.near_m,
            far_m: min_f32(config.far_m, sight.within_m),
            half_m: HALF_DIAGONAL * cell_m as f32,
            margin_q8: MARGIN_PX * DISPARITY_ONE,
            focal_baseline_q8: sight.rig.focal_baseline_px_m() as f32 * DISPARITY_ONE,
        }
    }

    /// Marks the cells above each other at (x, y).
    fn column(&self, x: usize, y: usize, cells: &mut Cells<'_>) {
        let [right, ahead, up] = self.steps;
        let mut at = [0.0; 3];
        for (((at, first), right), ahead) in at.iter_mut().zip(self.first).zip(right).zip(ahead) {
            *at = first + x as f32 * right + y as f32 * ahead;
        }
        let height = cells.size[2];
        let top =
            |axis: usize, at: f32| at + up.get(axis).copied().unwrap_or_default() * height as f32;
        // A column that the camera cannot see at all is passed over.
        let depths = [at[2], top(2, at[2])];
        if depths.iter().all(|z| *z < self.near_m)
            || depths.iter().all(|z| *z > self.far_m)
            || self.is_beside(at, up, height)
        {
            return;
        }
        let (column, now) = (cells.column(x, y), cells.now());
        for z in 0..height {
            let n = z as f32;
            let seen = self.seen([at[0] + n * up[0], at[1] + n * up[1], at[2] + n * up[2]]);
            if seen == Visibility::Not {
                continue;
            }
            let position = column + cells.level(z);
            // A cell seen through counts towards free; one with a surface in it keeps it.
            if let (Some(observed_at), Some(bits)) =
                (cells.observed_at.get_mut(position), cells.bits.get_mut(position))
            {
                *bits = if seen == Visibility::Through {
                    seen_through(*bits)
                } else {
                    seen_surface(*bits)
                };
                *observed_at = now;
            }
        }
    }

    /// Returns true if a whole column lies left or right of the camera's view.
    fn is_beside(&self, at: [f32; 3], up: [f32; 3], height: usize) -> bool {
        let (width, height) = (self.disparity_q8.width() as f32, height as f32);
        // Points of the left edge have x f + z c = 0, those of the right edge x f + z (c - width) =
        // 0.
        let side = |edge: f32, x: f32, z: f32| x * self.focal_px + z * (self.center_px[0] - edge);
        let (x, z) = (at[0] + up[0] * height, at[2] + up[2] * height);
        (side(0.0, at[0], at[2]) < 0.0 && side(0.0, x, z) < 0.0)
            || (side(width, at[0], at[2]) > 0.0 && side(width, x, z) > 0.0)
    }

    /// Returns the visibility of a cell whose centre has these camera coordinates.
    #[inline]
    fn seen(&self, [x, y, z]: [f32; 3]) -> Visibility {
        // False for NaN as well.
        if !(z >= self.near_m && z <= self.far_m) {
            return Visibility::Not;
        }
        let scale = self.focal_px / z;
        let half_px = self.half_side_px_m / z;
        let image = self.disparity_q8;
        let (Some(columns), Some(rows)) = (
            // The pixels that the cell can cover; none, and the cell is not in view.
            span(x * scale + self.center_px[0], half_px, image.width()),
            span(y * scale + self.center_px[1], half_px, image.height()),
        ) else {
            return Visibility::Not;
        };
        // The nearest surface among these pixels decides: one ray past an obstacle does not free a
        // cell.
        let disparity_q8 = f32::from(self.pyramid.greatest(image, columns, rows));
        if disparity_q8 == 0.0 {
            Visibility::Not
        } else if (disparity_q8 + self.margin_q8) * (z + self.half_m) < self.focal_baseline_q8 {
            Visibility::Through
        } else if disparity_q8 * (z - self.half_m) <= self.focal_baseline_q8 {
            Visibility::AtSurface
        } else {
            Visibility::Not
        }
    }
}

/// The pixels around a middle that lie in an image; `None` where the middle does not.
#[inline]
fn span(middle_px: f32, half_px: f32, size: usize) -> Option<[usize; 2]> {
    let middle = usize::try_from(floor_i32(middle_px)).ok().filter(|middle| *middle < size)?;
    let low = floor_i32(middle_px - half_px).max(0) as usize;
    let high = floor_i32(middle_px + half_px).max(0) as usize;
    Some([low.min(middle), high.max(middle).min(size - 1)])
}

/// Visibility of a cell in a frame.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Visibility {
    /// Outside the image, hidden, or without a disparity.
    Not,
    /// About where the surface is.
    AtSurface,
    /// Before the surface.
    Through,
}
