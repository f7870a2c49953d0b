use super::*;
use crate::formats::{Trajectory, kitti_line, tum_line};
use dynvox_core::geometry::Transform;
use nalgebra::Vector3;
use std::path::Path;

/// A trajectory of `count` poses that repeat one step.
fn arc(count: usize, step: Transform) -> Vec<Transform> {
    std::iter::successors(Some(Transform::IDENTITY), |pose| Some(pose * step)).take(count).collect()
}

#[test]
fn a_trajectory_one_percent_too_long_has_one_percent_error() {
    let step = |length: f64| Transform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, length));
    // Steps of a metre, and of a centimetre more.
    let found = errors(&arc(80, step(1.0)), &arc(80, step(1.01))).unwrap();
    assert!((found.t_err_percent.unwrap() - 1.0).abs() < 1e-9, "{found:?}");
    assert!(found.r_err_deg_per_m.unwrap() < 1e-9 && found.rpe_r_deg < 1e-9);
    assert!((found.rpe_t_m - 0.01).abs() < 1e-12);
    // A path of less than 100 m is measured over shorter lengths, from every frame on.
    assert_eq!(
        found.per_length.iter().map(|row| (row.0 as usize, row.3)).collect::<Vec<_>>(),
        [(5, 75), (10, 70), (20, 60), (30, 50), (40, 40), (50, 30)]
    );
    let long = errors(&arc(260, step(1.0)), &arc(260, step(1.01))).unwrap();
    let rows: Vec<(usize, usize)> =
        long.per_length.iter().map(|row| (row.0 as usize, row.3)).collect();
    assert_eq!(
        rows,
        [(100, 16), (200, 6)],
        "a path over 200 m is measured as the benchmark does, from every tenth frame on"
    );
}

#[test]
fn a_trajectory_turned_and_moved_as_a_whole_has_no_error() {
    let truth =
        arc(60, Transform::new(Vector3::new(0.0, 0.02, 0.001), Vector3::new(0.0, 0.0, 0.8)));
    let away = Transform::new(Vector3::new(0.3, -2.0, 0.1), Vector3::new(5.0, -3.0, 9.0));
    let moved: Vec<Transform> = truth.iter().map(|pose| away * pose).collect();
    let found = errors(&truth, &moved).unwrap();
    assert!(
        found.ate_m < 1e-9 && found.rpe_t_m < 1e-9 && found.t_err_percent.unwrap() < 1e-9,
        "{found:?}"
    );
}

#[test]
fn a_turned_camera_and_a_wrong_scale_are_told_from_noise() {
    let truth = swerving(120, 0.0);
    // A camera that looks 0.5 degrees to the right of the truth's, and 1 % too long: what lies
    // ahead appears at its left.
    let turned = Transform::new(Vector3::new(0.0, 0.5_f64.to_radians(), 0.0), Vector3::zeros());
    let estimate = truth.iter().map(|pose| {
        let pose = turned.inverse() * *pose * turned;
        Transform { translation_m: pose.translation_m.map(|metres| 1.01 * metres), ..pose }
    });
    let found = errors(&truth, &estimate.collect::<Vec<_>>()).unwrap();
    let [right, down, forward] = found.mean_error_percent.unwrap();
    assert!(
        (right + 100.0 * 0.5_f64.to_radians()).abs() < 0.05
            && down.abs() < 0.01
            && (forward - 1.0).abs() < 0.05,
        "{found:?}"
    );
    let left = found.without_boresight.unwrap();
    assert!(
        (left.angle_deg - 0.5).abs() < 0.01 && (left.t_err_percent - 1.0).abs() < 0.05,
        "the scale is left: {left:?}"
    );
    assert!(left.rpe_t_m < 0.9 * found.rpe_t_m, "{found:?}");
    let beside = |(at, pose): (usize, &Transform)| {
        let [x, y, z] = pose.translation_m;
        Transform { translation_m: [x + 0.05 * (1.3 * at as f64).sin(), y, z], ..*pose }
    };
    let noisy = errors(&truth, &truth.iter().enumerate().map(beside).collect::<Vec<_>>()).unwrap();
    let mean = Vector3::from(noisy.mean_error_percent.unwrap()).norm();
    assert!(mean < 0.1 * noisy.t_err_percent.unwrap(), "{noisy:?}");
    assert!(
        noisy.without_boresight.unwrap().t_err_percent > 0.95 * noisy.t_err_percent.unwrap(),
        "noise is no rotation: {noisy:?}"
    );
}

/// Makes a swerving trajectory. Its expected figures in the tests below come from numpy, which
/// aligned the same trajectory by a singular value decomposition.
fn swerving(count: usize, noise: f64) -> Vec<Transform> {
    let step = |i: f64| {
        let turn = [
            1e-3 * (0.3 * i).sin() + noise * 2e-4 * (1.7 * i).cos(),
            0.015 * (0.11 * i).sin() + noise * 3e-4 * (2.3 * i).sin(),
        ];
        let ahead = 0.9 + 0.2 * (0.2 * i).sin() + noise * (0.01 * (1.1 * i).cos() + 0.005);
        let sideways =
            [0.01 * i.cos() + noise * 4e-3 * (1.3 * i).sin(), noise * 3e-3 * (0.7 * i).cos()];
        Transform::new(
            Vector3::new(turn[0], turn[1], noise * 1e-4 * (0.9 * i).cos()),
            Vector3::new(sideways[0], sideways[1], ahead),
        )
    };
    let poses = (1..count).scan(Transform::IDENTITY, |pose, i| {
        *pose = *pose * step(i as f64);
        Some(*pose)
    });
    std::iter::once(Transform::IDENTITY).chain(poses).collect()
}

#[test]
fn agrees_with_an_evaluation_in_numpy() {
    let found = errors(&swerving(70, 0.0), &swerving(70, 1.0)).unwrap();
    let close = |name: &str, value: f64, expected: f64| {
        assert!((value / expected - 1.0).abs() < 1e-5, "{name}: {value} for {expected}")
    };
    close("t_err", found.t_err_percent.unwrap(), 0.583_875_637_2);
    close("r_err", found.r_err_deg_per_m.unwrap(), 0.001_243_667_17);
    close("rpe_t", found.rpe_t_m, 0.009_383_868_18);
    close("rpe_r", found.rpe_r_deg, 0.015_194_045_0);
    close("ate", found.ate_m, 0.100_734_890_1);
    let expected = [
        (5.0, 0.613_154_659_0, 65),
        (10.0, 0.593_158_881_8, 59),
        (20.0, 0.567_203_337_7, 46),
        (50.0, 0.560_707_572_6, 13),
    ];
    for (length_m, percent, pieces) in expected {
        let row = found.per_length.iter().find(|row| row.0 == length_m).unwrap();
        close("piece", row.1, percent);
        assert_eq!(row.3, pieces);
    }
}

#[test]
fn too_little_to_compare_is_none() {
    let truth = arc(3, Transform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0)));
    assert!(errors(&truth[..1], &truth[..1]).is_none() && errors(&truth, &truth[..2]).is_none());
    assert_eq!(
        errors(&truth, &truth).unwrap().t_err_percent,
        None,
        "two metres are shorter than every length"
    );
}

#[test]
fn agrees_with_evo() {
    // The files that evo was given, and its figures.
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/evaluate/trajectory/evo");
    let [estimate, truth] =
        ["estimate.txt", "truth.txt"].map(|name| read_trajectory(&here.join(name)).unwrap());
    let MatchedPoses { first: estimate, second: truth, .. } = matched(&estimate, &truth).unwrap();
    let found = errors(&truth, &estimate).unwrap();
    let evo: serde_json::Value = serde_json::from_str(include_str!("evo/figures.json")).unwrap();
    let close = |name: &str, value: f64, expected: &serde_json::Value| {
        let expected = expected.as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 1e-7, "{name}: {value} for {expected}");
    };
    close("ate", found.ate_m, &evo["ate_m"]);
    close("rpe_t", found.rpe_t_m, &evo["rpe_t_m"]);
    close("rpe_r", found.rpe_r_deg, &evo["rpe_r_deg"]);
    close("t_err", found.t_err_percent.unwrap(), &evo["t_err_percent"]);
    close("r_err", found.r_err_deg_per_m.unwrap(), &evo["r_err_deg_per_m"]);
    let rows = evo["pieces"].as_array().unwrap();
    assert_eq!(found.per_length.len(), rows.len());
    for ((length_m, percent, deg_per_m, pieces), row) in found.per_length.iter().zip(rows) {
        close("length", *length_m, &row[0]);
        close("translation", *percent, &row[1]);
        close("rotation", *deg_per_m, &row[2]);
        assert_eq!(*pieces as u64, row[3].as_u64().unwrap());
    }
}

/// Rows of a file that a pair of trajectories keeps.
#[derive(serde::Deserialize)]
struct KeptRows {
    first: usize,
    last: usize,
    step: usize,
    gap: [usize; 2],
}

/// A pair of trajectories, and what evo says of it.
#[derive(serde::Deserialize)]
struct EvoPair {
    name: String,
    estimate: KeptRows,
    truth: KeptRows,
    late_s: f64,
    poses: usize,
    ate_m: Option<f64>,
}

impl KeptRows {
    fn of(&self, whole: &Trajectory, late_s: f64) -> Trajectory {
        let rows = (self.first..self.last.min(whole.poses.len())).step_by(self.step);
        let rows: Vec<usize> =
            rows.filter(|row| !(self.gap[0]..self.gap[1]).contains(row)).collect();
        Trajectory {
            times_s: Some(rows.iter().map(|&row| 1_000.0 + 0.1 * row as f64 + late_s).collect()),
            poses: rows.iter().map(|&row| whole.poses[row]).collect(),
            ..Trajectory::default()
        }
    }
}

#[test]
fn pairs_of_other_rates_and_overlaps_agree_with_evo() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/evaluate/trajectory/evo");
    let [estimate, truth] =
        ["estimate.txt", "truth.txt"].map(|name| read_trajectory(&here.join(name)).unwrap());
    let pairs: Vec<EvoPair> = serde_json::from_str(include_str!("evo/pairs.json")).unwrap();
    assert_eq!(pairs.len(), 12);
    for pair in pairs {
        let first = pair.estimate.of(&estimate, pair.late_s);
        let joined = matched(&first, &pair.truth.of(&truth, 0.0));
        let Some(expected_m) = pair.ate_m else {
            assert!(joined.unwrap_err().to_string().contains("same clock"), "{}", pair.name);
            continue;
        };
        let MatchedPoses { first: estimate, second: truth, .. } = joined.unwrap();
        assert_eq!(estimate.len(), pair.poses, "{}", pair.name);
        let found_m = errors(&truth, &estimate).unwrap().ate_m;
        let off = (found_m / expected_m - 1.0).abs();
        assert!(off < 1e-6, "{}: {found_m} m, evo {expected_m} m", pair.name);
    }
}

#[test]
fn both_formats_are_read_and_poses_are_joined_by_time() {
    let folder = tempfile::TempDir::new().unwrap();
    let poses = arc(12, Transform::new(Vector3::new(0.01, 0.03, 0.0), Vector3::new(0.1, 0.0, 1.0)));
    let times_ns: Vec<u64> = (0..12).map(|at| 100_000_000_000 + 100_000_000 * at).collect();
    let times: Vec<f64> = times_ns.iter().map(|&ns| ns as f64 / 1e9).collect();
    let write = |name: &str, lines: &[String]| {
        std::fs::write(folder.path().join(name), format!("# a comment\n{}", lines.concat()))
            .unwrap();
        folder.path().join(name)
    };
    let kitti_lines: Vec<String> = poses.iter().map(kitti_line).collect();
    let tum_lines: Vec<String> =
        times_ns.iter().zip(&poses).map(|(time_ns, pose)| tum_line(*time_ns, pose)).collect();
    let kitti = read_trajectory(&write("kitti.txt", &kitti_lines)).unwrap();
    let tum = read_trajectory(&write("trajectory_tum.txt", &tum_lines)).unwrap();
    assert_eq!((&kitti.times_s, tum.times_s.as_deref()), (&None, Some(&times[..])));
    let MatchedPoses { first: a, second: b, .. } = matched(&kitti, &tum).unwrap();
    assert!(errors(&a, &b).unwrap().ate_m < 1e-9, "one trajectory in two formats");
    assert_eq!(read_trajectory(folder.path()).unwrap(), tum, "a run folder's own");
    // Every second pose, by another clock that is 4 ms late.
    let half = Trajectory {
        times_s: Some(times.iter().step_by(2).map(|time| time + 0.004).collect()),
        poses: poses.iter().step_by(2).copied().collect(),
        ..Trajectory::default()
    };
    let MatchedPoses { first: a, second: b, of } = matched(&half, &tum).unwrap();
    assert!(of == [6, 12] && a.len() == 6 && errors(&a, &b).unwrap().ate_m < 1e-9);
    assert!(matched(&half, &kitti).unwrap_err().to_string().contains("has 6 poses, the second 12"));
    let late = Trajectory {
        times_s: half
            .times_s
            .iter()
            .map(|times| times.iter().map(|time| time + 5e3).collect())
            .next(),
        ..half
    };
    assert!(matched(&late, &tum).unwrap_err().to_string().contains("same clock"));
    let still = Trajectory { poses: vec![poses[0]; 12], ..Trajectory::default() };
    assert!(matched(&kitti, &still).unwrap_err().to_string().contains("stands still"));
    // The numbered rows of some frames, and those of all of them.
    let numbered = Trajectory {
        numbers: Some((3..9).collect()),
        poses: poses[3..9].to_vec(),
        ..Trajectory::default()
    };
    let MatchedPoses { first: a, second: b, .. } = matched(&numbered, &kitti).unwrap();
    assert!(a.len() == 6 && errors(&b, &a).unwrap().ate_m < 1e-9);
    let twice: Vec<String> =
        tum_lines.iter().flat_map(|line| [line.clone(), line.clone()]).collect();
    let refused = read_trajectory(&write("twice.txt", &twice)).unwrap_err().to_string();
    assert!(refused.contains("has a time that is not after"), "{refused}");
    let mixed = write("mixed.txt", &[kitti_lines[0].clone(), tum_lines[0].clone()]);
    assert!(
        read_trajectory(&mixed).unwrap_err().to_string().contains("line 3 is of another format")
    );
    assert!(
        read_trajectory(&folder.path().join("none"))
            .unwrap_err()
            .to_string()
            .contains("cannot be read")
    );
}
