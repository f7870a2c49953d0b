//! One cell of the lattice as a ray meets it: the trilinear field between its corners.

use super::eye::{AXES, Depth, Ray, depth_in_m};
use crate::geometry::scalar::{max_f32, min_f32};

/// Most steps towards a root; the first hits it where the field is linear.
const MAX_REFINEMENTS: usize = 6;
/// A root is good when the field is this near 0, in units of truncation / 32,767.
const GOOD_ENOUGH: f32 = 8.0;

/// The eight corners of a cell; corner `x + 2 y + 4 z`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corners {
    /// Signed distances.
    pub sdf: [f32; 8],
    /// Which were seen often enough, a bit per corner.
    pub seen: u8,
}

impl Corners {
    /// Gives unseen corners the value of the plane through the seen ones, its slope along each axis the mean over the edges with both
    /// ends seen. Exact for a plane, hence no bias to either side. `None` when no edge tells the slope along some axis.
    pub fn complete(mut self) -> Option<Self> {
        if self.seen == u8::MAX {
            return Some(self);
        }
        let seen = self.seen;
        let is_seen = |corner: usize| seen >> corner & 1 == 1;
        let mut slope = [0.0; 3];
        for (axis, slope) in slope.iter_mut().enumerate() {
            let (mut sum, mut edges) = (0.0, 0.0);
            for (corner, low) in self.sdf.iter().enumerate().filter(|(corner, _)| corner >> axis & 1 == 0) {
                let high = corner | 1 << axis;
                if let (true, true, Some(high)) = (is_seen(corner), is_seen(high), self.sdf.get(high)) {
                    sum += high - low;
                    edges += 1.0;
                }
            }
            if edges == 0.0 {
                return None;
            }
            *slope = sum / edges;
        }
        let rise = |corner: usize| (0..).zip(slope).filter(|(axis, _)| corner >> axis & 1 == 1).fold(0.0, |sum, (_, slope)| sum + slope);
        let known = self.sdf.iter().enumerate().filter(|(corner, _)| is_seen(*corner));
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), (corner, sdf)| (sum + (sdf - rise(corner)), count + 1.0));
        for (corner, sdf) in self.sdf.iter_mut().enumerate().filter(|(corner, _)| !is_seen(*corner)) {
            *sdf = sum / count + rise(corner);
        }
        Some(self)
    }
}

/// The trilinear field in a cell, as the coefficients of 1, x, y, z, xy, xz, yz, xyz for x, y, z from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    one: f32,
    x: f32,
    y: f32,
    z: f32,
    xy: f32,
    xz: f32,
    yz: f32,
    xyz: f32,
}

impl Field {
    #[inline]
    pub fn new(corners: &[f32; 8]) -> Self {
        let [a, b, c, d, e, f, g, h] = *corners;
        let (x, y, z) = (b - a, c - a, e - a);
        let (xy, xz, yz) = (d - c - x, f - e - x, g - e - y);
        Self { one: a, x, y, z, xy, xz, yz, xyz: (h - g) - (f - e) - xy }
    }

    #[inline]
    pub fn at(&self, [x, y, z]: [f32; 3]) -> f32 {
        (self.one + self.z * z) + y * (self.y + self.yz * z) + x * ((self.x + self.xz * z) + y * (self.xy + self.xyz * z))
    }

    #[inline]
    pub fn gradient(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        [
            (self.x + self.xz * z) + y * (self.xy + self.xyz * z),
            (self.y + self.yz * z) + x * (self.xy + self.xyz * z),
            (self.z + self.yz * y) + x * (self.xz + self.xyz * y),
        ]
    }
}

/// A ray's way through a cell, from where it enters to where it leaves, in the cell's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
    from: [f32; 3],
    to: [f32; 3],
}

impl Passage {
    /// The way through `cell` between two depths. Coordinates on a wall are exactly 0 or 1.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn new(ray: &Ray, cell: [i32; 3], depths: [Depth; 2]) -> Self {
        let mut ends = [[0.0; 3]; 2];
        for (end, depth) in ends.iter_mut().zip(depths) {
            for axis in AXES {
                end[axis] = if ray.crossing(axis, cell[axis]) == depth {
                    0.0
                } else if ray.crossing(axis, cell[axis] + 1) == depth {
                    1.0
                } else {
                    within(ray, axis, cell[axis], depth_in_m(depth))
                };
            }
        }
        let [from, to] = ends;
        Self { from, to }
    }

    /// The point a share of the way through.
    #[inline]
    pub fn at(&self, share: f32) -> [f32; 3] {
        let ([x, y, z], [to_x, to_y, to_z]) = (self.from, self.to);
        [x + (to_x - x) * share, y + (to_y - y) * share, z + (to_z - z) * share]
    }

    /// Where the ray enters, or where it leaves.
    #[inline]
    pub fn end(&self, leaves: bool) -> [f32; 3] {
        if leaves { self.to } else { self.from }
    }

    /// The share of the way at which `field` falls from `first` > 0 to 0, where it ends at `last` <= 0: false position, which halves the
    /// weight of an end that stays (the Illinois rule), so that both ends close in.
    #[inline]
    pub fn root(&self, field: &Field, first: f32, last: f32) -> f32 {
        let (mut low, mut high) = ([0.0, first], [1.0, last]);
        let mut share = 0.0;
        let mut side = 0;
        for _ in 0..MAX_REFINEMENTS {
            share = low[0] + (high[0] - low[0]) * (low[1] / (low[1] - high[1]));
            let value = field.at(self.at(share));
            if value < GOOD_ENOUGH && value > -GOOD_ENOUGH {
                break;
            }
            if value > 0.0 {
                low = [share, value];
                high[1] *= if side > 0 { 0.5 } else { 1.0 };
                side = 1;
            } else {
                high = [share, value];
                low[1] *= if side < 0 { 0.5 } else { 1.0 };
                side = -1;
            }
        }
        max_f32(0.0, min_f32(share, 1.0))
    }
}

/// The ray's coordinate in a cell, held within it.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "axes are below 3")]
pub(super) fn within(ray: &Ray, axis: usize, cell: i32, depth_m: f32) -> f32 {
    let offset = ray.origin[axis] - cell as f32;
    min_f32(max_f32(offset + ray.slope[axis] * depth_m, 0.0), 1.0)
}

/// The trilinear mean of the corners at a point: the field's value, for one look.
#[inline(always)]
pub(super) fn mean(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> f32 {
    let [a, b, c, d, e, f, g, h] = *corners;
    let (a, b, c, d) = (a + (e - a) * z, b + (f - b) * z, c + (g - c) * z, d + (h - d) * z);
    let (a, b) = (a + (c - a) * y, b + (d - b) * y);
    a + (b - a) * x
}

/// What each corner counts at a point of the cell.
#[inline]
pub(super) fn shares([x, y, z]: [f32; 3]) -> [f32; 8] {
    let (nx, ny, nz) = (1.0 - x, 1.0 - y, 1.0 - z);
    let [a, b, c, d] = [nx * ny, x * ny, nx * y, x * y];
    [a * nz, b * nz, c * nz, d * nz, a * z, b * z, c * z, d * z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn the_field_meets_its_corners_and_their_weighted_mean_in_between() {
        let mut random = Random::new(1);
        for _ in 0..1_000 {
            let corners = [(); 8].map(|()| random.below(65_535) as f32 - 32_767.0);
            let field = Field::new(&corners);
            for (corner, &value) in corners.iter().enumerate() {
                assert_eq!(field.at([0, 1, 2].map(|axis| (corner >> axis & 1) as f32)), value);
            }
            let point = [(); 3].map(|()| random.below(1_000) as f32 / 1_000.0);
            let mean: f32 = shares(point).iter().zip(corners).map(|(share, value)| share * value).sum();
            assert!((field.at(point) - mean).abs() < 0.05 && (super::mean(&corners, point) - mean).abs() < 0.05);
            for axis in 0..3 {
                let mut beside = point;
                beside[axis] += 0.5;
                let slope = (field.at(beside) - field.at(point)) / 0.5;
                assert!((field.gradient(point)[axis] - slope).abs() < 0.2, "linear along each axis");
            }
        }
    }

    #[test]
    fn unseen_corners_of_a_plane_are_told_exactly() {
        let plane = |corner: usize| 100.0 + 300.0 * (corner & 1) as f32 - 50.0 * (corner >> 1 & 1) as f32 - 700.0 * (corner >> 2) as f32;
        let whole: [f32; 8] = core::array::from_fn(plane);
        let mut told = 0;
        for seen in 0..=u8::MAX {
            let sdf = core::array::from_fn(|corner| if seen >> corner & 1 == 1 { plane(corner) } else { 9_999.0 });
            if let Some(corners) = (Corners { sdf, seen }).complete() {
                told += 1;
                corners.sdf.iter().zip(whole).for_each(|(sdf, whole)| assert!((sdf - whole).abs() < 1e-3));
            }
        }
        assert!(told > 100, "{told} of 256");
    }
}
