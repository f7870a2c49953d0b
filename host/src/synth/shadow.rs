//! Light from the sun and how much sky the road sees. Both live in pictures whose texels are fixed
//! in the street, so that a shadow's edge stays where it is from frame to frame and from left to
//! right.

use nalgebra::Vector3;

use super::matrix_pose::MatrixPose;
use super::mesh::{Mesh, Point};

const SIDE: usize = 1024;
const TEXEL_M: f64 = 0.10;
/// Depth where nothing stands.
const FAR_M: f32 = -1e6;
/// Distance by which a surface is moved towards the light before it is compared, m.
const BIAS_M: f32 = 0.07;

/// The sun's view of the street: two axes across the light and one towards it.
#[derive(Clone, Copy)]
pub struct SunAxes([Vector3<f64>; 3]);

impl SunAxes {
    /// Axes for a direction.
    pub fn new(to_sun: Point) -> Self {
        let u = to_sun.cross(&Vector3::y()).normalize();
        Self([u, to_sun.cross(&u), to_sun])
    }

    /// Texel coordinates and way towards the sun of a point in the street.
    fn texel(&self, point: Point) -> Point {
        Point::new(
            point.dot(&self.0[0]) / TEXEL_M,
            point.dot(&self.0[1]) / TEXEL_M,
            point.dot(&self.0[2]),
        )
    }
}

/// Occluders of the sun in a segment of street or a car, on the texels of the whole street. Depths
/// count from `base_m`.
pub struct ShadowTile {
    corner: [i64; 2],
    size: [usize; 2],
    base_m: f64,
    depth_m: Vec<f32>,
}

impl ShadowTile {
    /// Draws meshes, each with its pose in the street. Only faces towards the sun count: what is
    /// closed throws the same shadow.
    pub fn new<'a>(
        axes: &SunAxes,
        meshes: impl Iterator<Item = (&'a Mesh, MatrixPose)> + Clone,
    ) -> Self {
        // First the extent in texels, then the tile.
        let (mut low, mut high) = (Point::repeat(f64::MAX), Point::repeat(f64::MIN));
        for (mesh, pose) in meshes.clone() {
            for vertex in &mesh.vertices {
                let texel = axes.texel(pose.point(vertex.position_m));
                (low, high) = (low.inf(&texel), high.sup(&texel));
            }
        }
        let corner = [libm::floor(low.x) as i64, libm::floor(low.y) as i64];
        let size = [(high.x - low.x) as usize + 2, (high.y - low.y) as usize + 2];
        let mut tile =
            Self { corner, size, base_m: high.z, depth_m: vec![FAR_M; size[0] * size[1]] };
        let origin = Point::new(corner[0] as f64, corner[1] as f64, high.z);
        for (mesh, pose) in meshes {
            let positions: Vec<Point> = mesh
                .vertices
                .iter()
                .map(|vertex| axes.texel(pose.point(vertex.position_m)) - origin)
                .collect();
            for triangle in &mesh.triangles {
                tile.rasterize(
                    triangle.corners.map(|corner| positions[corner as usize]),
                    mesh.surfaces[triangle.surface as usize].two_sided,
                );
            }
        }
        tile
    }

    fn rasterize(&mut self, [a, b, c]: [Point; 3], two_sided: bool) {
        // Faces away from the sun are skipped.
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if area.abs() < 1e-9 || (area < 0.0 && !two_sided) {
            return;
        }
        let low = |p: f64, q: f64, r: f64| libm::ceil(p.min(q).min(r)).max(0.0);
        let high = |p: f64, q: f64, r: f64, last: usize| {
            libm::floor(p.max(q).max(r)).min(last as f64 - 1.0)
        };
        let (first, last) = (low(a.y, b.y, c.y), high(a.y, b.y, c.y, self.size[1]));
        if first > last || low(a.x, b.x, c.x) > high(a.x, b.x, c.x, self.size[0]) {
            return;
        }
        // Depth is linear over the triangle.
        let (d1, d2) = (b.z - a.z, c.z - a.z);
        let slope_u = (d1 * (c.y - a.y) - d2 * (b.y - a.y)) / area;
        let slope_v = (d2 * (b.x - a.x) - d1 * (c.x - a.x)) / area;
        for row in first as usize..=last as usize {
            let v = row as f64;
            let (mut from, mut to) = (f64::MAX, f64::MIN);
            // The row's first and last texel from the two edges it crosses.
            for (p, q) in [(a, b), (b, c), (c, a)] {
                if (p.y <= v) != (q.y <= v) {
                    let u = p.x + (q.x - p.x) * ((v - p.y) / (q.y - p.y));
                    from = from.min(u);
                    to = to.max(u);
                }
            }
            let (from, to) =
                (libm::ceil(from).max(0.0), libm::floor(to).min(self.size[0] as f64 - 1.0));
            if from > to {
                continue;
            }
            let begin = a.z + slope_u * (from - a.x) + slope_v * (v - a.y);
            let cells = &mut self.depth_m
                [row * self.size[0] + from as usize..=row * self.size[0] + to as usize];
            for (k, cell) in cells.iter_mut().enumerate() {
                let here = (begin + slope_u * k as f64) as f32;
                *cell = if here > *cell { here } else { *cell };
            }
        }
    }
}

/// Depth towards the sun over a square of the street.
pub struct ShadowMap {
    axes: SunAxes,
    corner: [i64; 2],
    base_m: f64,
    /// Texel coordinates of the anchor.
    offset: [f64; 2],
    depth_m: Vec<f32>,
}

impl ShadowMap {
    /// An empty map around `focus`; positions are given relative to `anchor`, a point of the
    /// street.
    pub fn new(axes: SunAxes, anchor: Point, focus: Point) -> Self {
        let (middle, anchor) = (axes.texel(focus), axes.texel(anchor));
        let corner =
            [middle.x, middle.y].map(|value| libm::floor(value) as i64 - (SIDE / 2) as i64);
        let offset = [anchor.x - corner[0] as f64, anchor.y - corner[1] as f64];
        Self { axes, corner, base_m: anchor.z, offset, depth_m: vec![FAR_M; SIDE * SIDE] }
    }

    /// Lays a tile into the map; the highest towards the sun stays.
    pub fn lay(&mut self, tile: &ShadowTile) {
        let shift = [tile.corner[0] - self.corner[0], tile.corner[1] - self.corner[1]];
        let span = |k: usize| {
            let (from, to) = (shift[k].max(0), (shift[k] + tile.size[k] as i64).min(SIDE as i64));
            (from < to).then(|| (from as usize, to as usize, (from - shift[k]) as usize))
        };
        let (Some((left, right, skip_u)), Some((top, bottom, skip_v))) = (span(0), span(1)) else {
            return;
        };
        // Tiles have bases of their own: heights are brought to the map's.
        let lift = (tile.base_m - self.base_m) as f32;
        for row in top..bottom {
            let source = &tile.depth_m[(row - top + skip_v) * tile.size[0] + skip_u..];
            for (cell, &here) in
                self.depth_m[row * SIDE + left..row * SIDE + right].iter_mut().zip(source)
            {
                let here = here + lift;
                *cell = if here > *cell { here } else { *cell };
            }
        }
    }

    /// Shares of sunlight that reach `point` (relative to the anchor), 0 to 1; outside the map it
    /// shines.
    pub fn light(&self, point: Vector3<f32>, normal: Vector3<f32>) -> f32 {
        let axis = |k: usize| self.axes.0[k].map(|value| value as f32);
        // Lifted off the surface, so that it does not shade itself.
        let lifted = point + normal * 0.06;
        let scale = 1.0 / TEXEL_M as f32;
        // Two look-ups half a texel to either side, averaged: a tent over three texels each way.
        let u = lifted.dot(&axis(0)) * scale + self.offset[0] as f32 - 0.5;
        let v = lifted.dot(&axis(1)) * scale + self.offset[1] as f32 - 0.5;
        let limit = SIDE as f32 - 4.0;
        if !(u > 3.0 && v > 3.0 && u < limit && v < limit) {
            return 1.0;
        }
        let depth = lifted.dot(&axis(2)) + BIAS_M;
        let (u0, v0) = (u as usize, v as usize);
        let weights = |f: f32| [0.5 * (1.0 - f), 0.5, 0.5 * f];
        let (wu, wv) = (weights(u - u0 as f32), weights(v - v0 as f32));
        let mut sum = 0.0;
        for (k, row_weight) in wv.into_iter().enumerate() {
            let cells = &self.depth_m[(v0 + k) * SIDE + u0..][..3];
            let open = |k: usize| f32::from(u8::from(cells[k] < depth));
            sum += row_weight * (wu[0] * open(0) + wu[1] * open(1) + wu[2] * open(2));
        }
        // The map's rim fades out instead of ending.
        let edge = (u.min(v).min(limit - u).min(limit - v) * 0.02).min(1.0);
        1.0 + (sum - 1.0) * edge
    }
}

const GROUND_SIDE: usize = 640;
const GROUND_TEXEL_M: f64 = 0.2;

/// Share of the sky that the ground sees: dark under cars.
pub struct GroundLight {
    offset: [f64; 2],
    open: Vec<f32>,
}

impl GroundLight {
    /// Open ground around `focus`.
    pub fn new(anchor: Point, focus: Point) -> Self {
        let offset = [anchor.x, anchor.z].map(|value| value / GROUND_TEXEL_M);
        let corner = [focus.x, focus.z]
            .map(|value| libm::floor(value / GROUND_TEXEL_M) - 0.5 * GROUND_SIDE as f64);
        let offset = [offset[0] - corner[0], offset[1] - corner[1]];
        Self { offset, open: vec![1.0; GROUND_SIDE * GROUND_SIDE] }
    }

    /// Darkens the ground under and beside a box: `middle` relative to the anchor, `right` and
    /// `ahead` its axes, half sizes in m.
    pub fn cover(&mut self, middle: Point, right: Point, ahead: Point, half_m: [f64; 2]) {
        let reach = half_m[0] + half_m[1] + 1.0;
        let (u, v) = (
            middle.x / GROUND_TEXEL_M + self.offset[0],
            middle.z / GROUND_TEXEL_M + self.offset[1],
        );
        let span = |at: f64| {
            let low = (at - reach / GROUND_TEXEL_M).max(0.0) as usize;
            (low, (at + reach / GROUND_TEXEL_M).clamp(0.0, GROUND_SIDE as f64 - 1.0) as usize)
        };
        let ((u0, u1), (v0, v1)) = (span(u), span(v));
        for row in v0..=v1 {
            for column in u0..=u1 {
                let (x, z) =
                    ((column as f64 - u) * GROUND_TEXEL_M, (row as f64 - v) * GROUND_TEXEL_M);
                // Inside the box distances are negative, to -0.6 m.
                let across = ((x * right.x + z * right.z).abs() - half_m[0]).max(-0.6);
                let along = ((x * ahead.x + z * ahead.z).abs() - half_m[1]).max(-0.6);
                let outside =
                    libm::sqrt(across.max(0.0) * across.max(0.0) + along.max(0.0) * along.max(0.0));
                let distance = if outside > 0.0 { outside } else { across.max(along) };
                // A smooth step from dark under the car to open beside it.
                let x = ((distance + 0.35) / 0.95).clamp(0.0, 1.0);
                let open = 0.16 + 0.84 * x * x * (3.0 - 2.0 * x);
                let cell = &mut self.open[row * GROUND_SIDE + column];
                *cell = cell.min(open as f32);
            }
        }
    }

    /// Share of sky seen from `point`, relative to the anchor.
    pub fn open(&self, point: Vector3<f32>) -> f32 {
        let scale = 1.0 / GROUND_TEXEL_M as f32;
        let (u, v) =
            (point.x * scale + self.offset[0] as f32, point.z * scale + self.offset[1] as f32);
        let limit = GROUND_SIDE as f32 - 2.0;
        // Beyond the map of the ground the sky is open; negated, so that NaN is beyond.
        if !(u > 0.0 && v > 0.0 && u < limit && v < limit) {
            return 1.0;
        }
        // Between the four texels around.
        let (u0, v0) = (u as usize, v as usize);
        let (fu, fv) = (u - u0 as f32, v - v0 as f32);
        let at = |row: usize, column: usize| self.open[row * GROUND_SIDE + column];
        let top = at(v0, u0) + (at(v0, u0 + 1) - at(v0, u0)) * fu;
        let bottom = at(v0 + 1, u0) + (at(v0 + 1, u0 + 1) - at(v0 + 1, u0)) * fu;
        top + (bottom - top) * fv
    }
}
