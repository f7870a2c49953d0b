//! The camera in lattice units, relative to a block near it: coordinates stay small, so `f32` stays
//! exact however far the camera has come.

use crate::{
    geometry::scalar::{floored_i32, max_f32, min_f32},
    volume::{BLOCK_SIDE, BlockCoord, Viewpoint},
};

/// Farthest block from the camera's that can be looked at, on each axis: what the table's keys can
/// tell apart.
pub(super) const MAX_REACH_BLOCKS: i32 = 4_000;
/// Rays nearly along a plane of the lattice are bent to this slope, in lattice units per m: a
/// thousandth of a cell in 100 m.
const LEAST_SLOPE: f32 = 1e-5;
/// Slack on projected boxes, px: rounding never takes a box from a pixel it touches.
const SLACK_PX: f32 = 0.02;

/// The camera as rays and boxes need it.
#[derive(Clone, Debug)]
pub(super) struct RayCamera {
    /// The camera's block: local block coordinates count from here.
    pub base: [i32; 3],
    /// The camera, in local lattice units.
    pub origin: [f32; 3],
    /// Lattice units per metre of depth: the ray of pixel (0, 0), and its change per column and
    /// row.
    rays: [[f32; 3]; 3],
    /// From lattice units to camera axes: rows for focal length times x, focal length times y, and
    /// depth, in m.
    rows: [[f32; 3]; 3],
    /// Magnitudes of the axes: the reach of a box.
    reaches: [[f32; 3]; 3],
    center_px: [f32; 2],
    /// Camera from world.
    pub rotation: [[f32; 3]; 3],
    pub width: usize,
    pub height: usize,
}

/// Bounds in image and depth of what a box can cover.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// First and last column, within the image.
    pub columns: [i32; 2],
    /// First and last row, within the image.
    pub rows: [i32; 2],
    /// Nearest and farthest depth, m.
    pub depth_m: [f32; 2],
}

impl Extent {
    /// Returns true if the extent is empty.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        (self.columns[0] > self.columns[1])
            | (self.rows[0] > self.rows[1])
            | (self.depth_m[0] > self.depth_m[1])
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl RayCamera {
    /// `None` when the pose is no rigid motion or beyond the map, or the rig is absurd.
    pub fn new(view: &Viewpoint, voxel_size_m: f32) -> Option<Self> {
        view.rig.validate().ok()?;
        let voxel_m = f64::from(voxel_size_m);
        let camera = view.t_world_camera.translation() / voxel_m;
        // Block coordinates are 16 bits wide.
        let bound = f64::from(i16::MAX) * BLOCK_SIDE as f64;
        if !view.t_world_camera.is_rotation() || !camera.iter().all(|c| *c > -bound && *c < bound) {
            return None;
        }
        let base =
            [camera.x, camera.y, camera.z].map(|c| libm::floor(c / BLOCK_SIDE as f64) as i32);
        let side = BLOCK_SIDE as i32;
        // Coordinates relative to the camera's block keep their precision far from the origin.
        let local = |axis: f64, base: i32| (axis - f64::from(base * side)) as f32;
        let rotation = view.camera_from_world().0;
        let row = |r: usize, scale: f64| {
            [0, 1, 2].map(|c| {
                (rotation.matrix().get((r, c)).copied().unwrap_or_default() * scale) as f32
            })
        };
        let rows = [
            row(0, voxel_m * view.rig.focal_px),
            row(1, voxel_m * view.rig.focal_px),
            row(2, voxel_m),
        ];
        Some(Self {
            base,
            origin: [local(camera.x, base[0]), local(camera.y, base[1]), local(camera.z, base[2])],
            rays: view.rays_world().map(|ray| (ray / voxel_m).cast::<f32>().into()),
            rows,
            reaches: rows.map(|row| row.map(f32::abs)),
            center_px: [view.rig.center_u_px as f32, view.rig.center_v_px as f32],
            rotation: [row(0, 1.0), row(1, 1.0), row(2, 1.0)],
            width: view.width,
            height: view.height,
        })
    }

    /// A block relative to the camera's; `None` beyond [`MAX_REACH_BLOCKS`].
    #[inline]
    pub fn local(&self, coord: BlockCoord) -> Option<[i32; 3]> {
        let [x, y, z] = self.base;
        let local = [i32::from(coord.x) - x, i32::from(coord.y) - y, i32::from(coord.z) - z];
        local.iter().all(|c| c.abs() <= MAX_REACH_BLOCKS).then_some(local)
    }

    /// The pixels and depths that a box, given by its centre and half its sides in lattice units,
    /// may cover within `near_m..=far_m`.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn extent(&self, center: [f32; 3], half: [f32; 3], near_m: f32, far_m: f32) -> Extent {
        let from_eye =
            [center[0] - self.origin[0], center[1] - self.origin[1], center[2] - self.origin[2]];
        let projected =
            |axis: usize| (dot(self.rows[axis], from_eye), dot(self.reaches[axis], half));
        let (across, down, (z, z_reach)) = (projected(0), projected(1), projected(2));
        let depth_m = [max_f32(z - z_reach, near_m), min_f32(z + z_reach, far_m)];
        // Perspective divides by depth: the box's rims are bounded by its nearest and farthest
        // depth.
        let inverse = [1.0 / depth_m[0], 1.0 / depth_m[1]];
        // The box in camera axes; its left rim looks leftmost from the nearest depth when left of
        // the axis, from the farthest when right.
        let span = |(middle, reach): (f32, f32), center_px: f32, size: usize| {
            let (low, high) = (middle - reach, middle + reach);
            let first =
                center_px + low * if low < 0.0 { inverse[0] } else { inverse[1] } - SLACK_PX;
            let last =
                center_px + high * if high > 0.0 { inverse[0] } else { inverse[1] } + SLACK_PX;
            // Pixel centres at integers: the first at or after, the last at or before.
            let (first, last) = (
                min_f32(max_f32(first, 0.0), size as f32),
                max_f32(min_f32(last, size as f32 - 1.0), -1.0),
            );
            [-floored_i32(-first), floored_i32(last)]
        };
        Extent {
            columns: span(across, self.center_px[0], self.width),
            rows: span(down, self.center_px[1], self.height),
            depth_m,
        }
    }

    /// The rays of a row of the picture.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn row(&self, v: usize) -> RowOfRays {
        let [corner, column, row] = self.rays;
        let mut first = [0.0; 3];
        for axis in AXES {
            first[axis] = corner[axis] + row[axis] * v as f32;
        }
        RowOfRays { first, column }
    }
}

/// The axes of the lattice. Loops over them keep arrays in registers, which `map` on arrays does
/// not.
pub(super) const AXES: [usize; 3] = [0, 1, 2];

/// The rays of one row of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowOfRays {
    /// Slope in column 0.
    first: [f32; 3],
    /// Change per column.
    column: [f32; 3],
}

impl RowOfRays {
    /// The ray of a column.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn ray(&self, u: f32) -> Ray {
        let slope = |axis: usize| {
            let exact = self.first[axis] + self.column[axis] * u;
            if exact > -LEAST_SLOPE && exact < LEAST_SLOPE { LEAST_SLOPE } else { exact }
        };
        // Single values: arrays that are copied keep compilers from making vectors of the lanes of
        // a loop.
        let (x, y, z) = (slope(0), slope(1), slope(2));
        // One division for the three of them.
        let inverse = 1.0 / (x * y * z);
        Ray { slope: [x, y, z], per_unit: [y * z * inverse, x * z * inverse, x * y * inverse] }
    }
}

/// A ray through the lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// Lattice units per metre of depth, never 0.
    pub slope: [f32; 3],
    /// Metres of depth per lattice unit.
    pub per_unit: [f32; 3],
}
