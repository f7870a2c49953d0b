//! Trajectory errors: KITTI's relative errors over sub-lengths, relative error per frame, absolute error after alignment.
//!
//! `E = (est_i^-1 est_j)^-1 (true_i^-1 true_j)` is the error of a piece from frame i to frame j. A piece of length L ends at the first
//! frame whose distance travelled along the truth is at least L beyond frame i's; every frame is a start; the errors of all pieces of
//! all lengths are averaged (Geiger, Lenz, Urtasun, *Are we ready for autonomous driving?*, CVPR 2012: 100 to 800 m). A path shorter than
//! 200 m would give few pieces of few lengths: it is measured over 5 to 50 m, and the result says so.

use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Matrix4, Point3, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};

/// Sub-lengths of the benchmark, m.
pub const LONG_M: [f64; 8] = [100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 800.0];
/// Sub-lengths for clips, m.
pub const SHORT_M: [f64; 6] = [5.0, 10.0, 20.0, 30.0, 40.0, 50.0];

/// Errors of a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryErrors {
    /// Mean translation error of the pieces, percent of their length; `None` where the path is shorter than every length.
    pub t_err_percent: Option<f64>,
    /// Mean rotation error of the pieces, degrees per metre.
    pub r_err_deg_per_m: Option<f64>,
    /// Root mean square translation error from frame to frame, m.
    pub rpe_t_m: f64,
    /// Root mean square rotation error from frame to frame, degrees.
    pub rpe_r_deg: f64,
    /// Root mean square distance of the positions after the best rigid alignment, m.
    pub ate_m: f64,
    /// Each sub-length that fits at least once: length in m, translation in percent, rotation in deg/m, pieces.
    pub per_length: Vec<(f64, f64, f64, usize)>,
}

/// Compares an estimated with a true `t_world_camera` per frame. `None` with fewer than two frames or unequal lists.
pub fn errors(truth: &[Transform], estimate: &[Transform]) -> Option<TrajectoryErrors> {
    if truth.len() < 2 || truth.len() != estimate.len() {
        return None;
    }
    let travelled = travelled_m(truth);
    let lengths: &[f64] = if travelled.last()? >= &LONG_M[1] { &LONG_M } else { &SHORT_M };
    let piece = |from: usize, to: usize| {
        let moved = estimate[from].inverse() * estimate[to];
        moved.inverse() * (truth[from].inverse() * truth[to])
    };
    let mut all = Vec::new();
    let mut per_length = Vec::new();
    for &length_m in lengths {
        let pieces: Vec<(f64, f64)> = (0..truth.len())
            .map_while(|from| {
                let to = travelled.partition_point(|&at| at < travelled[from] + length_m);
                (to < truth.len()).then(|| {
                    let error = piece(from, to);
                    (error.translation.vector.norm() / length_m * 100.0, rotation_deg(&error) / length_m)
                })
            })
            .collect();
        if let Some((t, r)) = means(&pieces) {
            per_length.push((length_m, t, r, pieces.len()));
        }
        all.extend(pieces);
    }
    let steps: Vec<Transform> = (1..truth.len()).map(|to| piece(to - 1, to)).collect();
    let overall = means(&all);
    Some(TrajectoryErrors {
        t_err_percent: overall.map(|(t, _)| t),
        r_err_deg_per_m: overall.map(|(_, r)| r),
        rpe_t_m: rms(steps.iter().map(|error| error.translation.vector.norm())),
        rpe_r_deg: rms(steps.iter().map(rotation_deg)),
        ate_m: aligned_error_m(truth, estimate),
        per_length,
    })
}

/// Distance travelled up to each frame, m.
pub fn travelled_m(poses: &[Transform]) -> Vec<f64> {
    let steps = poses.windows(2).map(|pair| (pair[1].translation.vector - pair[0].translation.vector).norm());
    std::iter::once(0.0)
        .chain(steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum)
        }))
        .collect()
}

fn means(pieces: &[(f64, f64)]) -> Option<(f64, f64)> {
    let count = pieces.len() as f64;
    let sum = pieces.iter().fold((0.0, 0.0), |sum, piece| (sum.0 + piece.0, sum.1 + piece.1));
    (!pieces.is_empty()).then_some((sum.0 / count, sum.1 / count))
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Angle of a rotation. By the quaternion's vector part: an arc cosine would lose small angles.
fn rotation_deg(motion: &Transform) -> f64 {
    let q = motion.rotation.quaternion();
    (2.0 * q.imag().norm().atan2(q.w.abs())).to_degrees()
}

/// Root mean square distance after the rigid motion that minimises it (Horn, *Closed-form solution of absolute orientation using unit
/// quaternions*, JOSA A 1987): the rotation is the eigenvector of the largest eigenvalue of a symmetric 4 x 4 matrix.
fn aligned_error_m(truth: &[Transform], estimate: &[Transform]) -> f64 {
    let positions = |poses: &[Transform]| poses.iter().map(|pose| pose.translation.vector).collect::<Vec<_>>();
    let (truth, estimate) = (positions(truth), positions(estimate));
    let centre = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (to, from) = (centre(&truth), centre(&estimate));
    let spread: Matrix3<f64> = estimate.iter().zip(&truth).map(|(a, b)| (a - from) * (b - to).transpose()).sum();
    let rotation = horn_rotation(&spread);
    rms(estimate.iter().zip(&truth).map(|(a, b)| (rotation.transform_point(&Point3::from(a - from)).coords - (b - to)).norm()))
}

fn horn_rotation(s: &Matrix3<f64>) -> UnitQuaternion<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::geometry::exp;

    /// A drive along an arc of `count` frames, and the same with a known error in every step.
    fn arc(count: usize, step: Transform) -> Vec<Transform> {
        std::iter::successors(Some(Transform::identity()), |pose| Some(pose * step)).take(count).collect()
    }

    #[test]
    fn a_trajectory_one_percent_too_long_has_one_percent_error() {
        let step = |length: f64| exp(Vector3::zeros(), Vector3::new(0.0, 0.0, length));
        let found = errors(&arc(80, step(1.0)), &arc(80, step(1.01))).unwrap();
        assert!((found.t_err_percent.unwrap() - 1.0).abs() < 1e-9, "{found:?}");
        assert!(found.r_err_deg_per_m.unwrap() < 1e-9 && found.rpe_r_deg < 1e-9);
        assert!((found.rpe_t_m - 0.01).abs() < 1e-12);
        assert_eq!(
            found.per_length.iter().map(|row| (row.0 as usize, row.3)).collect::<Vec<_>>(),
            [(5, 75), (10, 70), (20, 60), (30, 50), (40, 40), (50, 30)]
        );
        let long = errors(&arc(260, step(1.0)), &arc(260, step(1.01))).unwrap();
        assert_eq!(
            long.per_length.iter().map(|row| row.0).collect::<Vec<_>>(),
            [100.0, 200.0],
            "a path over 200 m is measured as the benchmark does"
        );
    }

    #[test]
    fn a_trajectory_turned_and_moved_as_a_whole_has_no_error() {
        let truth = arc(60, exp(Vector3::new(0.0, 0.02, 0.001), Vector3::new(0.0, 0.0, 0.8)));
        let away = exp(Vector3::new(0.3, -2.0, 0.1), Vector3::new(5.0, -3.0, 9.0));
        let moved: Vec<Transform> = truth.iter().map(|pose| away * pose).collect();
        let found = errors(&truth, &moved).unwrap();
        assert!(found.ate_m < 1e-9 && found.rpe_t_m < 1e-9 && found.t_err_percent.unwrap() < 1e-9, "{found:?}");
    }

    /// The same drive in Python gave the figures of the test below: numpy with a singular value decomposition for the alignment.
    fn swerving(count: usize, noise: f64) -> Vec<Transform> {
        let step = |i: f64| {
            let turn = [1e-3 * (0.3 * i).sin() + noise * 2e-4 * (1.7 * i).cos(), 0.015 * (0.11 * i).sin() + noise * 3e-4 * (2.3 * i).sin()];
            let ahead = 0.9 + 0.2 * (0.2 * i).sin() + noise * (0.01 * (1.1 * i).cos() + 0.005);
            let sideways = [0.01 * i.cos() + noise * 4e-3 * (1.3 * i).sin(), noise * 3e-3 * (0.7 * i).cos()];
            exp(Vector3::new(turn[0], turn[1], noise * 1e-4 * (0.9 * i).cos()), Vector3::new(sideways[0], sideways[1], ahead))
        };
        let poses = (1..count).scan(Transform::identity(), |pose, i| {
            *pose *= step(i as f64);
            Some(*pose)
        });
        std::iter::once(Transform::identity()).chain(poses).collect()
    }

    #[test]
    fn agrees_with_an_evaluation_in_numpy() {
        let found = errors(&swerving(70, 0.0), &swerving(70, 1.0)).unwrap();
        let close =
            |name: &str, value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-5, "{name}: {value} for {expected}");
        close("t_err", found.t_err_percent.unwrap(), 0.583_875_637_2);
        close("r_err", found.r_err_deg_per_m.unwrap(), 0.001_243_667_17);
        close("rpe_t", found.rpe_t_m, 0.009_383_868_18);
        close("rpe_r", found.rpe_r_deg, 0.015_194_045_0);
        close("ate", found.ate_m, 0.100_734_890_1);
        let expected = [(5.0, 0.613_154_659_0, 65), (10.0, 0.593_158_881_8, 59), (20.0, 0.567_203_337_7, 46), (50.0, 0.560_707_572_6, 13)];
        for (length_m, percent, pieces) in expected {
            let row = found.per_length.iter().find(|row| row.0 == length_m).unwrap();
            close("piece", row.1, percent);
            assert_eq!(row.3, pieces);
        }
    }

    #[test]
    fn too_little_to_compare_is_none() {
        let truth = arc(3, exp(Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0)));
        assert!(errors(&truth[..1], &truth[..1]).is_none() && errors(&truth, &truth[..2]).is_none());
        assert_eq!(errors(&truth, &truth).unwrap().t_err_percent, None, "two metres are shorter than every length");
    }
}
