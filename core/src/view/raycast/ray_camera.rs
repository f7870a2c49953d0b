//! The camera in lattice units, relative to a block near it: coordinates stay small, so `f32` stays exact however far the camera has come.

use crate::{
    geometry::scalar::{floor_i32, max_f32, min_f32},
    volume::{BLOCK_SIDE, BlockCoord, Viewpoint},
};

/// Farthest block from the camera's that can be looked at, on each axis: what the table's keys can tell apart.
pub(super) const MAX_REACH_BLOCKS: i32 = 4_000;
/// Rays nearly along a plane of the lattice are bent to this slope, in lattice units per m: a thousandth of a cell in 100 m, and the
/// depth of no plane within reach overflows 64 bits.
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
    /// Lattice units per metre of depth: the ray of pixel (0, 0), and its change per column and row.
    rays: [[f32; 3]; 3],
    /// From lattice units to camera axes: rows for focal length times x, focal length times y, and depth, in m.
    rows: [[f32; 3]; 3],
    /// Their magnitudes: how far a box reaches.
    reaches: [[f32; 3]; 3],
    center_px: [f32; 2],
    /// Camera from world.
    pub rotation: [[f32; 3]; 3],
    pub width: usize,
    pub height: usize,
}

/// What of the image and of depth a box can cover.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// First and last column, within the image.
    pub columns: [usize; 2],
    /// First and last row, within the image.
    pub rows: [usize; 2],
    /// Nearest and farthest depth, m.
    pub depth_m: [f32; 2],
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl RayCamera {
    /// `None` when the pose is no rigid motion or beyond the map, or the rig is absurd.
    pub fn new(view: &Viewpoint, voxel_size_m: f32) -> Option<Self> {
        view.rig.validate().ok()?;
        let voxel_m = f64::from(voxel_size_m);
        let camera = view.t_world_camera.translation() / voxel_m;
        let bound = f64::from(i16::MAX) * BLOCK_SIDE as f64;
        if !view.t_world_camera.is_rotation() || !camera.iter().all(|c| *c > -bound && *c < bound) {
            return None;
        }
        let base = [camera.x, camera.y, camera.z].map(|c| libm::floor(c / BLOCK_SIDE as f64) as i32);
        let side = BLOCK_SIDE as i32;
        let local = |axis: f64, base: i32| (axis - f64::from(base * side)) as f32;
        let rotation = view.camera_from_world().0;
        let row = |r: usize, scale: f64| [0, 1, 2].map(|c| (rotation.matrix().get((r, c)).copied().unwrap_or_default() * scale) as f32);
        let rows = [row(0, voxel_m * view.rig.focal_px), row(1, voxel_m * view.rig.focal_px), row(2, voxel_m)];
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

    /// The pixels and depths that a box, given by its centre and half its sides in lattice units, may cover within `near_m..=far_m`.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn extent(&self, center: [f32; 3], half: [f32; 3], near_m: f32, far_m: f32) -> Option<Extent> {
        let from_eye = [center[0] - self.origin[0], center[1] - self.origin[1], center[2] - self.origin[2]];
        let projected = |axis: usize| (dot(self.rows[axis], from_eye), dot(self.reaches[axis], half));
        let (across, down, (z, z_reach)) = (projected(0), projected(1), projected(2));
        let depth_m = [max_f32(z - z_reach, near_m), min_f32(z + z_reach, far_m)];
        if depth_m[0] > depth_m[1] {
            return None;
        }
        let inverse = depth_m.map(|depth| 1.0 / depth);
        // The box in camera axes; its left rim looks leftmost from the nearest depth when left of the axis, from the farthest when right.
        let span = |(middle, reach): (f32, f32), center_px: f32, size: usize| {
            let (low, high) = (middle - reach, middle + reach);
            let first = center_px + low * if low < 0.0 { inverse[0] } else { inverse[1] } - SLACK_PX;
            let last = center_px + high * if high > 0.0 { inverse[0] } else { inverse[1] } + SLACK_PX;
            let end = size as f32 - 1.0;
            // Pixel centres at integers: the first at or after, the last at or before.
            (first <= end && last >= 0.0).then(|| {
                let first = if first > 0.0 { -floor_i32(-first) as usize } else { 0 };
                [first, if last < end { floor_i32(last) as usize } else { size - 1 }]
            })
        };
        let columns = span(across, self.center_px[0], self.width)?;
        let rows = span(down, self.center_px[1], self.height)?;
        (columns[0] <= columns[1] && rows[0] <= rows[1]).then_some(Extent { columns, rows, depth_m })
    }

    /// The ray through a pixel.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn ray(&self, u: usize, v: usize) -> Ray {
        let [corner, column, row] = self.rays;
        let (u, v) = (u as f32, v as f32);
        let mut ray = Ray {
            origin: self.origin,
            slope: [0.0; 3],
            zero: [0; 3],
            per_plane: [0; 3],
            ahead: [0; 3],
        };
        for axis in AXES {
            let exact = corner[axis] + row[axis] * v + column[axis] * u;
            let slope = if exact > -LEAST_SLOPE && exact < LEAST_SLOPE { LEAST_SLOPE } else { exact };
            let per_plane = f64::from(1.0 / slope) * DEPTH_ONE_M;
            ray.slope[axis] = slope;
            ray.ahead[axis] = i32::from(slope > 0.0);
            ray.per_plane[axis] = per_plane as i64;
            ray.zero[axis] = (per_plane * f64::from(-self.origin[axis])) as i64;
        }
        ray
    }
}

/// The axes of the lattice. Loops over them keep arrays in registers, which `map` on arrays does not.
pub(super) const AXES: [usize; 3] = [0, 1, 2];

/// A depth in units of 2^-28 m. In integers the depths of lattice planes come out the same whether they are multiplied or added up, so
/// that a ray meets the same cells at the same depths wherever its march begins.
pub(super) type Depth = i64;

const DEPTH_ONE_M: f64 = (1u64 << 28) as f64;

/// Metres as a [`Depth`].
#[inline]
pub(super) fn depth_from_m(depth_m: f32) -> Depth {
    (f64::from(depth_m) * DEPTH_ONE_M) as i64
}

/// A [`Depth`] in metres.
#[inline]
pub(super) fn depth_in_m(depth: Depth) -> f32 {
    const UNIT_M: f32 = (1.0 / DEPTH_ONE_M) as f32;
    depth as f32 * UNIT_M
}

/// A ray through the lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub origin: [f32; 3],
    /// Lattice units per metre of depth.
    pub slope: [f32; 3],
    /// Depth at which plane 0 is crossed.
    zero: [Depth; 3],
    /// Depth from plane to plane, negative where the ray runs towards smaller coordinates.
    per_plane: [Depth; 3],
    /// 1 where the ray runs towards larger coordinates, so that it leaves a cell by the upper face; else 0.
    pub ahead: [i32; 3],
}

impl Ray {
    /// Depth at which the ray crosses lattice plane `plane` of an axis.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn crossing(&self, axis: usize, plane: i32) -> Depth {
        self.zero[axis] + i64::from(plane) * self.per_plane[axis]
    }

    /// Whether the ray runs towards larger coordinates of an axis, so that it leaves a cell by the upper face.
    #[inline(always)]
    pub fn is_ahead(&self, axis: usize) -> bool {
        self.ahead.get(axis).is_some_and(|&ahead| ahead != 0)
    }

    /// Depth from plane to plane, positive.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn stride(&self, axis: usize) -> Depth {
        self.per_plane[axis].abs()
    }

    /// Where the ray, at depth 0, would be from the first cell of a block, in lattice units.
    #[inline(always)]
    pub fn offset(&self, block: [i32; 3]) -> [f32; 3] {
        let side = BLOCK_SIDE as i32;
        let [x, y, z] = self.origin;
        [x - (block[0] * side) as f32, y - (block[1] * side) as f32, z - (block[2] * side) as f32]
    }

    /// The cell in which the ray is just after `depth`, so that all planes crossed up to there are behind it, and the depths at which the ray
    /// leaves that cell along each axis.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn cell_and_exits(&self, depth: Depth) -> ([i32; 3], [Depth; 3]) {
        let depth_m = depth_in_m(depth);
        let (mut cell, mut exits) = ([0; 3], [0; 3]);
        for axis in AXES {
            let guess = floor_i32(self.origin[axis] + self.slope[axis] * depth_m);
            let (ahead, stride) = (self.ahead[axis], self.stride(axis));
            let exit = self.crossing(axis, guess + ahead);
            // Rounding seldom takes the guess a cell too far, or not far enough: a branch, which need not wait for it.
            (cell[axis], exits[axis]) = if exit <= depth {
                (guess + 2 * ahead - 1, exit + stride)
            } else if exit - stride > depth {
                (guess - 2 * ahead + 1, exit - stride)
            } else {
                (guess, exit)
            };
        }
        (cell, exits)
    }

    /// Where the ray leaves a block, and across which axis.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn leaves(&self, block: [i32; 3]) -> (Depth, usize) {
        let out = |axis: usize| self.crossing(axis, (block[axis] + self.ahead[axis]) * BLOCK_SIDE as i32);
        let (x, y, z) = (out(0), out(1), out(2));
        let first = x.min(y).min(z);
        (first, if x == first { 0 } else { 2 - usize::from(y == first) })
    }
}
