//! Best rigid alignment of two lists of positions.

use super::rms;
use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Matrix4, Point3, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};

/// Root mean square distance after the rigid motion that minimises it (Horn, *Closed-form solution
/// of absolute orientation using unit quaternions*, JOSA A 1987): the rotation is the eigenvector
/// of the largest eigenvalue of a symmetric 4 x 4 matrix.
pub(super) fn aligned_error_m(truth: &[Transform], estimate: &[Transform]) -> f64 {
    let positions = |poses: &[Transform]| {
        poses.iter().map(|pose| Vector3::from(pose.translation_m)).collect::<Vec<_>>()
    };
    let (truth, estimate) = (positions(truth), positions(estimate));
    let centre =
        |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    // The best translation maps one centre to the other, so that the rotation is found alone.
    let (to, from) = (centre(&truth), centre(&estimate));
    let spread: Matrix3<f64> =
        estimate.iter().zip(&truth).map(|(a, b)| (a - from) * (b - to).transpose()).sum();
    let rotation = horn_rotation(&spread);
    rms(estimate
        .iter()
        .zip(&truth)
        .map(|(a, b)| (rotation.transform_point(&Point3::from(a - from)).coords - (b - to)).norm()))
}

fn horn_rotation(s: &Matrix3<f64>) -> UnitQuaternion<f64> {
    // Differences and sums of the off-diagonal elements, as in Horn's paper.
    let (yz, zx, xy) = (s[(1, 2)] - s[(2, 1)], s[(2, 0)] - s[(0, 2)], s[(0, 1)] - s[(1, 0)]);
    let (sxy, sxz, syz) = (s[(0, 1)] + s[(1, 0)], s[(0, 2)] + s[(2, 0)], s[(1, 2)] + s[(2, 1)]);
    let (xx, yy, zz) = (s[(0, 0)], s[(1, 1)], s[(2, 2)]);
    #[rustfmt::skip]
    let n = Matrix4::new(
        xx + yy + zz, yz,           zx,           xy,
        yz,           xx - yy - zz, sxy,          sxz,
        zx,           sxy,          yy - xx - zz, syz,
        xy,           sxz,          syz,          zz - xx - yy,
    );
    let eigen = SymmetricEigen::new(n);
    let column = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    UnitQuaternion::from_quaternion(Quaternion::new(column[0], column[1], column[2], column[3]))
}
