//! One cell of the lattice as a ray meets it: where the ray passes it, and the trilinear field
//! between its corners.

use super::ray_camera::{AXES, Ray};
use crate::geometry::scalar::{max_f32, min_f32};

/// The eight corners of a cell; corner `x + 2 y + 4 z`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corners {
    /// Signed distances.
    pub sdf: [f32; 8],
    /// Corners that were observed often enough, a bit per corner.
    pub observed: u8,
}

impl Corners {
    /// Gives unseen corners the value of the plane through the seen ones, its slope along each axis
    /// the mean over the edges with both ends seen. Exact for a plane, hence no bias to either
    /// side. `None` when no edge tells the slope along some axis.
    #[expect(clippy::indexing_slicing, reason = "masks keep corners below 8")]
    pub fn complete(&self) -> Option<[f32; 8]> {
        let mut known = [0.0; 8];
        (0..)
            .zip(&mut known)
            .for_each(|(corner, known)| *known = f32::from(self.observed >> corner & 1));
        // Slopes along each axis come from edges with both ends known.
        let slope = |low: [usize; 4], step: usize| {
            let (mut sum, mut edges) = (0.0, 0.0);
            // Multiplied instead of branched on: the compiler makes vectors of it.
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
        // A plane through the known corners fills the unknown ones.
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

/// The trilinear field in a cell, as the coefficients of 1, x, y, z, xy, xz, yz, xyz for x, y, z
/// from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field(pub [f32; 8]);

impl Field {
    #[inline(always)]
    pub fn new(corners: &[f32; 8]) -> Self {
        let [a, b, c, d, e, f, g, h] = *corners;
        let (x, y, z) = (b - a, c - a, e - a);
        let (xy, xz, yz) = (d - c - x, f - e - x, g - e - y);
        Self([a, x, y, z, xy, xz, yz, (h - g) - (f - e) - xy])
    }

    #[inline(always)]
    pub fn at(&self, [x, y, z]: [f32; 3]) -> f32 {
        let [one, by_x, by_y, by_z, by_xy, by_xz, by_yz, by_xyz] = self.0;
        (one + by_z * z)
            + y * (by_y + by_yz * z)
            + x * ((by_x + by_xz * z) + y * (by_xy + by_xyz * z))
    }

    #[inline(always)]
    pub fn gradient(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [_, by_x, by_y, by_z, by_xy, by_xz, by_yz, by_xyz] = self.0;
        [
            (by_x + by_xz * z) + y * (by_xy + by_xyz * z),
            (by_y + by_yz * z) + x * (by_xy + by_xyz * z),
            (by_z + by_yz * y) + x * (by_xz + by_xyz * y),
        ]
    }
}

/// Distances of a cell's lower (0) and upper (1) face from the camera along each axis, in lattice
/// units. Neighbouring cells have the same values at their common face, so that everything derived
/// from them agrees.
pub(super) type Faces = [[f32; 3]; 2];

/// The depths at which a ray enters and leaves a cell, m, no nearer than `near_m`. It does not pass
/// the cell where the second is not the larger one.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "axes are below 3")]
pub(super) fn depths_m(ray: &Ray, [lower, upper]: &Faces, near_m: f32) -> [f32; 2] {
    let (mut enters_m, mut leaves_m) = (near_m, f32::MAX);
    for axis in AXES {
        let [low_m, high_m] = [lower[axis] * ray.per_unit[axis], upper[axis] * ray.per_unit[axis]];
        enters_m = max_f32(enters_m, min_f32(low_m, high_m));
        leaves_m = min_f32(leaves_m, max_f32(low_m, high_m));
    }
    [enters_m, leaves_m]
}

/// Returns the position of a ray at a depth, in a cell's coordinates: exactly 0 or 1 at a face that
/// it crosses there, and never outside.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "axes are below 3")]
pub(super) fn position(ray: &Ray, [lower, upper]: &Faces, depth_m: f32) -> [f32; 3] {
    let mut position = [0.0; 3];
    for axis in AXES {
        let between = min_f32(max_f32(ray.slope[axis] * depth_m - lower[axis], 0.0), 1.0);
        let below_upper = if upper[axis] * ray.per_unit[axis] == depth_m { 1.0 } else { between };
        position[axis] =
            if lower[axis] * ray.per_unit[axis] == depth_m { 0.0 } else { below_upper };
    }
    position
}

/// The point a share of a ray's way through a cell, from where it enters to where it leaves.
#[inline(always)]
pub(super) fn along([[x, y, z], [to_x, to_y, to_z]]: [[f32; 3]; 2], share: f32) -> [f32; 3] {
    [x + (to_x - x) * share, y + (to_y - y) * share, z + (to_z - z) * share]
}

/// The trilinear mean of the corners at a point. On a face it is that of the face's corners, to the
/// bit: the others count 0, so that cells side by side agree at the face between them.
#[inline(always)]
pub(super) fn mean(corners: &[f32; 8], [x, y, z]: [f32; 3]) -> f32 {
    let [a, b, c, d, e, f, g, h] = *corners;
    let between = |low: f32, high: f32, share: f32| low * (1.0 - share) + high * share;
    let (a, b, c, d) = (between(a, e, z), between(b, f, z), between(c, g, z), between(d, h, z));
    between(between(a, c, y), between(b, d, y), x)
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
            // Bit by bit of the corner's number: x, y, z.
            for (corner, &value) in corners.iter().enumerate() {
                assert_eq!(field.at([0, 1, 2].map(|axis| (corner >> axis & 1) as f32)), value);
            }
            let point = [(); 3].map(|()| random.below(1_000) as f32 / 1_000.0);
            // Sums of numbers up to 32,767 in `f32` are off by some hundredths.
            assert!((field.at(point) - mean(&corners, point)).abs() < 0.05);
            for axis in 0..3 {
                let mut beside = point;
                beside[axis] += 0.5;
                let slope = (field.at(beside) - field.at(point)) / 0.5;
                // Along one axis a trilinear field is linear, so that a step of a half gives the
                // slope.
                assert!(
                    (field.gradient(point)[axis] - slope).abs() < 0.2,
                    "linear along each axis"
                );
            }
        }
    }

    #[test]
    fn unseen_corners_of_a_plane_are_completed_exactly() {
        let plane = |corner: usize| {
            100.0 + 300.0 * (corner & 1) as f32
                - 50.0 * (corner >> 1 & 1) as f32
                - 700.0 * (corner >> 2) as f32
        };
        let exact: [f32; 8] = core::array::from_fn(plane);
        let mut completed = 0;
        for observed in 0..=u8::MAX {
            let sdf = core::array::from_fn(|corner| {
                // 9,999 where nothing was observed: it must not be looked at.
                if observed >> corner & 1 == 1 { plane(corner) } else { 9_999.0 }
            });
            if let Some(corners) = (Corners { sdf, observed }).complete() {
                completed += 1;
                corners
                    .iter()
                    .zip(exact)
                    .for_each(|(sdf, exact)| assert!((sdf - exact).abs() < 1e-3));
            }
        }
        // Not all of them: few corners do not determine a plane.
        assert!(completed > 100, "{completed} of 256");
    }
}
