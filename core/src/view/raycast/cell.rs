//! One cell of the lattice as a ray meets it: the trilinear field between its corners.

use super::ray_camera::{AXES, Ray};
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
    pub observed: u8,
}

impl Corners {
    /// Gives unseen corners the value of the plane through the seen ones, its slope along each axis the mean over the edges with both
    /// ends seen. Exact for a plane, hence no bias to either side. `None` when no edge tells the slope along some axis.
    #[expect(clippy::indexing_slicing, reason = "masks keep corners below 8")]
    pub fn complete(&self) -> Option<[f32; 8]> {
        let mut known = [0.0; 8];
        (0..).zip(&mut known).for_each(|(corner, known)| *known = f32::from(self.observed >> corner & 1));
        let slope = |low: [usize; 4], step: usize| {
            let (mut sum, mut edges) = (0.0, 0.0);
            for low in low {
                let (low, high) = (low & 7, (low + step) & 7);
                let both = known[low] * known[high];
                sum += both * (self.sdf[high] - self.sdf[low]);
                edges += both;
            }
            (sum, edges)
        };
        let (x, edges_x) = slope([0, 2, 4, 6], 1);
        let (y, edges_y) = slope([0, 1, 4, 5], 2);
        let (z, edges_z) = slope([0, 1, 2, 3], 4);
        if edges_x == 0.0 || edges_y == 0.0 || edges_z == 0.0 {
            return None;
        }
        let (x, y, z) = (x / edges_x, y / edges_y, z / edges_z);
        let rise = [0.0, x, y, x + y, z, x + z, y + z, x + y + z];
        let (mut sum, mut count) = (0.0, 0.0);
        for ((known, sdf), rise) in known.iter().zip(self.sdf).zip(rise) {
            sum += known * (sdf - rise);
            count += known;
        }
        let base = sum / count;
        let mut all = self.sdf;
        for ((sdf, known), rise) in all.iter_mut().zip(known).zip(rise) {
            *sdf = if known == 0.0 { base + rise } else { *sdf };
        }
        Some(all)
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
pub(super) struct RaySegment {
    from: [f32; 3],
    to: [f32; 3],
}

/// In place of an axis: within a cell, not on a face.
pub(super) const NO_AXIS: usize = 3;

impl RaySegment {
    /// The way between two depths through a cell that the ray enters and leaves across `axes` ([`NO_AXIS`] where it begins within), given
    /// where the ray would be at depth 0 from the cell's first corner. Coordinates on these faces are exactly 0 or 1.
    #[inline(always)]
    #[expect(clippy::indexing_slicing, reason = "axes are below 3")]
    pub fn new(ray: &Ray, offset: [f32; 3], depths_m: [f32; 2], axes: [usize; 2]) -> Self {
        let (mut from, mut to) = ([0.0; 3], [0.0; 3]);
        for axis in AXES {
            let ahead = ray.ahead[axis] as f32;
            let first = within(offset[axis], ray.slope[axis], depths_m[0]);
            let last = within(offset[axis], ray.slope[axis], depths_m[1]);
            from[axis] = if axes[0] == axis { 1.0 - ahead } else { first };
            to[axis] = if axes[1] == axis { ahead } else { last };
        }
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

/// The coordinate in a cell of a ray that begins `offset` from its first corner, held within the cell.
#[inline(always)]
pub(super) fn within(offset: f32, slope: f32, depth_m: f32) -> f32 {
    min_f32(max_f32(offset + slope * depth_m, 0.0), 1.0)
}

/// The trilinear mean of the corners at a point: the field's value, for one look.
#[inline(always)]
pub(super) fn mean(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> f32 {
    let [a, b, c, d, e, f, g, h] = *corners;
    let (a, b, c, d) = (a + (e - a) * z, b + (f - b) * z, c + (g - c) * z, d + (h - d) * z);
    let (a, b) = (a + (c - a) * y, b + (d - b) * y);
    a + (b - a) * x
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
            assert!((field.at(point) - mean(&corners, point)).abs() < 0.05);
            for axis in 0..3 {
                let mut beside = point;
                beside[axis] += 0.5;
                let slope = (field.at(beside) - field.at(point)) / 0.5;
                assert!((field.gradient(point)[axis] - slope).abs() < 0.2, "linear along each axis");
            }
        }
    }

    #[test]
    fn unseen_corners_of_a_plane_are_completed_exactly() {
        let plane = |corner: usize| 100.0 + 300.0 * (corner & 1) as f32 - 50.0 * (corner >> 1 & 1) as f32 - 700.0 * (corner >> 2) as f32;
        let exact: [f32; 8] = core::array::from_fn(plane);
        let mut completed = 0;
        for observed in 0..=u8::MAX {
            let sdf = core::array::from_fn(|corner| if observed >> corner & 1 == 1 { plane(corner) } else { 9_999.0 });
            if let Some(corners) = (Corners { sdf, observed }).complete() {
                completed += 1;
                corners.iter().zip(exact).for_each(|(sdf, exact)| assert!((sdf - exact).abs() < 1e-3));
            }
        }
        assert!(completed > 100, "{completed} of 256");
    }
}
