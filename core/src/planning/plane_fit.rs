//! A plane fitted to the ground around a column, by least squares.

use crate::geometry::scalar::max_f32;

/// Fewest points of a fit.
const FIT_MIN: u32 = 6;

/// Sums of a least-squares plane.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlaneFit {
    count: u32,
    x: f32,
    y: f32,
    z: f32,
    xx: f32,
    xy: f32,
    yy: f32,
    xz: f32,
    yz: f32,
    zz: f32,
}

impl PlaneFit {
    /// Takes in a point.
    pub fn add(&mut self, x: f32, y: f32, z: f32) {
        self.count += 1;
        (self.x, self.y, self.z) = (self.x + x, self.y + y, self.z + z);
        (self.xx, self.xy, self.yy) = (self.xx + x * x, self.xy + x * y, self.yy + y * y);
        (self.xz, self.yz, self.zz) = (self.xz + x * z, self.yz + y * z, self.zz + z * z);
    }

    /// The plane's gradient and the root mean square distance from it; `None` where the points lie
    /// too close to a line.
    pub fn solve(&self) -> Option<([f32; 2], f32)> {
        if self.count < FIT_MIN {
            return None;
        }
        let n = self.count as f32;
        // Sums about the mean: heights are large compared with their differences.
        let central = |sum: f32, a: f32, b: f32| sum - a * b / n;
        let (xx, xy, yy) = (
            central(self.xx, self.x, self.x),
            central(self.xy, self.x, self.y),
            central(self.yy, self.y, self.y),
        );
        let (xz, yz, zz) = (
            central(self.xz, self.x, self.z),
            central(self.yz, self.y, self.z),
            central(self.zz, self.z, self.z),
        );
        // A determinant below the count means points close to a line: their slope across it is
        // unknown.
        let determinant = xx * yy - xy * xy;
        if determinant < n {
            return None;
        }
        let slope = [(xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant];
        // What the plane leaves of the squares; rounding may make it negative.
        let rest = zz - slope[0] * xz - slope[1] * yz;
        Some((slope, libm::sqrtf(max_f32(rest, 0.0) / n)))
    }
}
