//! Light from the sun and how much sky the road sees. Both live in pictures whose texels are fixed in the street, so that a shadow's edge
//! stays where it is from frame to frame and from left to right.

use nalgebra::Vector3;

use super::mesh::Point;

const SIDE: usize = 1024;
const TEXEL_M: f64 = 0.10;
/// How far a surface is moved towards the light before it is compared, m.
const BIAS_M: f32 = 0.07;

/// Depth towards the sun over a square of the street.
pub struct ShadowMap {
    axes: [Vector3<f64>; 3],
    /// Texel coordinates of the anchor.
    offset: [f64; 2],
    depth_m: Vec<f32>,
}

impl ShadowMap {
    /// An empty map around `focus`; places are given relative to `anchor`, a point of the street.
    pub fn new(to_sun: Point, anchor: Point, focus: Point) -> Self {
        let u = to_sun.cross(&Vector3::y()).normalize();
        let v = to_sun.cross(&u);
        let axes = [u, v, to_sun];
        let offset = [0, 1].map(|k| {
            let corner = libm::floor(focus.dot(&axes[k]) / TEXEL_M) - 0.5 * SIDE as f64;
            anchor.dot(&axes[k]) / TEXEL_M - corner
        });
        Self { axes, offset, depth_m: vec![-1e6; SIDE * SIDE] }
    }

    fn texel(&self, place: Point) -> (f64, f64, f64) {
        (place.dot(&self.axes[0]) / TEXEL_M + self.offset[0], place.dot(&self.axes[1]) / TEXEL_M + self.offset[1], place.dot(&self.axes[2]))
    }

    /// Whether a ball may touch the map.
    pub fn may_see(&self, middle: Point, radius_m: f64) -> bool {
        let (u, v, _) = self.texel(middle);
        let (reach, side) = (radius_m / TEXEL_M, SIDE as f64);
        u > -reach && v > -reach && u < side + reach && v < side + reach
    }

    /// Draws a triangle; the highest towards the sun stays.
    pub fn draw(&mut self, corners: [Point; 3]) {
        let [a, b, c] = corners.map(|corner| self.texel(corner));
        let area = (b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1);
        if area.abs() < 1e-9 {
            return;
        }
        let low = |p: f64, q: f64, r: f64| libm::ceil(p.min(q).min(r)).max(0.0);
        let high = |p: f64, q: f64, r: f64| libm::floor(p.max(q).max(r)).min(SIDE as f64 - 1.0);
        let (first, last) = (low(a.1, b.1, c.1), high(a.1, b.1, c.1));
        if first > last || low(a.0, b.0, c.0) > high(a.0, b.0, c.0) {
            return;
        }
        let gradient = |p: f64, q: f64, r: f64| {
            let (d1, d2) = (q - p, r - p);
            ((d1 * (c.1 - a.1) - d2 * (b.1 - a.1)) / area, (d2 * (b.0 - a.0) - d1 * (c.0 - a.0)) / area)
        };
        let (slope_u, slope_v) = gradient(a.2, b.2, c.2);
        for row in first as usize..=last as usize {
            let v = row as f64;
            let (mut from, mut to) = (f64::MAX, f64::MIN);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                if (p.1 <= v) != (q.1 <= v) {
                    let u = p.0 + (q.0 - p.0) * ((v - p.1) / (q.1 - p.1));
                    from = from.min(u);
                    to = to.max(u);
                }
            }
            let (from, to) = (libm::ceil(from).max(0.0), libm::floor(to).min(SIDE as f64 - 1.0));
            if from > to {
                continue;
            }
            let begin = a.2 + slope_u * (from - a.0) + slope_v * (v - a.1);
            let cells = &mut self.depth_m[row * SIDE + from as usize..=row * SIDE + to as usize];
            for (k, cell) in cells.iter_mut().enumerate() {
                let here = (begin + slope_u * k as f64) as f32;
                *cell = if here > *cell { here } else { *cell };
            }
        }
    }

    /// Shares of sunlight that reach `place` (relative to the anchor), 0 to 1; outside the map it shines.
    pub fn light(&self, place: Vector3<f32>, normal: Vector3<f32>) -> f32 {
        let axis = |k: usize| self.axes[k].map(|value| value as f32);
        let lifted = place + normal * 0.06;
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
        let edge = (u.min(v).min(limit - u).min(limit - v) * 0.02).min(1.0);
        1.0 + (sum - 1.0) * edge
    }
}

const GROUND_SIDE: usize = 640;
const GROUND_TEXEL_M: f64 = 0.2;

/// How much sky the ground sees: dark under cars.
pub struct GroundLight {
    offset: [f64; 2],
    open: Vec<f32>,
}

impl GroundLight {
    /// Open ground around `focus`.
    pub fn new(anchor: Point, focus: Point) -> Self {
        let offset = [anchor.x, anchor.z].map(|value| value / GROUND_TEXEL_M);
        let corner = [focus.x, focus.z].map(|value| libm::floor(value / GROUND_TEXEL_M) - 0.5 * GROUND_SIDE as f64);
        let offset = [offset[0] - corner[0], offset[1] - corner[1]];
        Self { offset, open: vec![1.0; GROUND_SIDE * GROUND_SIDE] }
    }

    /// Darkens the ground under and beside a box: `middle` relative to the anchor, `right` and `ahead` its axes, half sizes in m.
    pub fn cover(&mut self, middle: Point, right: Point, ahead: Point, half_m: (f64, f64)) {
        let reach = half_m.0 + half_m.1 + 1.0;
        let (u, v) = (middle.x / GROUND_TEXEL_M + self.offset[0], middle.z / GROUND_TEXEL_M + self.offset[1]);
        let span = |at: f64| {
            let low = (at - reach / GROUND_TEXEL_M).max(0.0) as usize;
            (low, (at + reach / GROUND_TEXEL_M).clamp(0.0, GROUND_SIDE as f64 - 1.0) as usize)
        };
        let ((u0, u1), (v0, v1)) = (span(u), span(v));
        for row in v0..=v1 {
            for column in u0..=u1 {
                let (x, z) = ((column as f64 - u) * GROUND_TEXEL_M, (row as f64 - v) * GROUND_TEXEL_M);
                let across = ((x * right.x + z * right.z).abs() - half_m.0).max(-0.6);
                let along = ((x * ahead.x + z * ahead.z).abs() - half_m.1).max(-0.6);
                let outside = libm::sqrt(across.max(0.0) * across.max(0.0) + along.max(0.0) * along.max(0.0));
                let distance = if outside > 0.0 { outside } else { across.max(along) };
                let x = ((distance + 0.35) / 0.95).clamp(0.0, 1.0);
                let open = 0.16 + 0.84 * x * x * (3.0 - 2.0 * x);
                let cell = &mut self.open[row * GROUND_SIDE + column];
                *cell = cell.min(open as f32);
            }
        }
    }

    /// Share of sky seen from `place`, relative to the anchor.
    pub fn open(&self, place: Vector3<f32>) -> f32 {
        let scale = 1.0 / GROUND_TEXEL_M as f32;
        let (u, v) = (place.x * scale + self.offset[0] as f32, place.z * scale + self.offset[1] as f32);
        let limit = GROUND_SIDE as f32 - 2.0;
        if !(u > 0.0 && v > 0.0 && u < limit && v < limit) {
            return 1.0;
        }
        let (u0, v0) = (u as usize, v as usize);
        let (fu, fv) = (u - u0 as f32, v - v0 as f32);
        let at = |row: usize, column: usize| self.open[row * GROUND_SIDE + column];
        let top = at(v0, u0) + (at(v0, u0 + 1) - at(v0, u0)) * fu;
        let bottom = at(v0 + 1, u0) + (at(v0 + 1, u0 + 1) - at(v0 + 1, u0)) * fu;
        top + (bottom - top) * fv
    }
}
