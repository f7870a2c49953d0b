//! Real clips, evaluated by KITTI's odometry metric: relative errors over all segment lengths, and
//! from frame to frame.
//!
//! With `--nocapture` the figures and the mean time of a frame are printed.

use super::at_10_hz;
use crate::egomotion::{Egomotion, EgomotionConfig, Estimator, MotionStatus};
use crate::{
    Config, Mapper, StereoFrame,
    geometry::{StereoRig, Transform},
    image::View,
    inertial::{InertialSample, InertialUnit},
    memory::{Capacity, Carver, SLAB_ALIGN},
    parallel::Serial,
    scene_flow::{FlowMatcher, SceneFlowConfig},
};
use nalgebra::Matrix4;
use std::{
    format, fs,
    path::{Path, PathBuf},
    println, vec,
    vec::Vec,
};

const LENGTHS_M: [f64; 6] = [5.0, 10.0, 20.0, 30.0, 40.0, 50.0];

struct Errors {
    translation_percent: f64,
    rotation_deg_per_m: f64,
    frame_rms_m: f64,
    frame_rms_deg: f64,
}

fn root() -> PathBuf {
    Path::new(dynvox_needs::data_folder!()).join("kitti-odometry")
}

fn numbers(path: &Path) -> Vec<f64> {
    fs::read_to_string(path)
        .unwrap()
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect()
}

fn rig(path: &Path) -> StereoRig {
    let values = numbers(path);
    let (p0, p1) = (&values[..12], &values[12..24]);
    StereoRig {
        focal_px: p0[0],
        center_u_px: p0[2],
        center_v_px: p0[6],
        baseline_m: -p1[3] / p1[0],
    }
}

fn poses(path: &Path) -> Vec<Matrix4<f64>> {
    let matrix = |row: &[f64]| {
        let mut matrix = Matrix4::identity();
        for (i, value) in row.iter().enumerate() {
            matrix[(i / 4, i % 4)] = *value;
        }
        matrix
    };
    numbers(path).chunks_exact(12).map(matrix).collect()
}

fn grey(folder: &Path, frame: usize) -> Option<(Vec<u8>, usize, usize)> {
    let picture = image::open(folder.join(format!("{frame:06}.png"))).ok()?.into_luma8();
    let (width, height) = picture.dimensions();
    Some((picture.into_raw(), width as usize, height as usize))
}

fn degrees(motion: &Matrix4<f64>) -> f64 {
    let cosine = (motion[(0, 0)] + motion[(1, 1)] + motion[(2, 2)] - 1.0) / 2.0;
    if cosine < 1.0 { cosine.acos().to_degrees() } else { 0.0 }
}

fn length(motion: &Matrix4<f64>) -> f64 {
    (motion[(0, 3)].powi(2) + motion[(1, 3)].powi(2) + motion[(2, 3)].powi(2)).sqrt()
}

fn inverse(motion: &Matrix4<f64>) -> Matrix4<f64> {
    motion.try_inverse().unwrap()
}

fn relative_errors(truth: &[Matrix4<f64>], estimate: &[Matrix4<f64>]) -> Errors {
    let between = |poses: &[Matrix4<f64>], i: usize, j: usize| inverse(&poses[i]) * poses[j];
    let error = |i: usize, j: usize| inverse(&between(estimate, i, j)) * between(truth, i, j);
    let frames = truth.len().min(estimate.len());
    let mut distance = vec![0.0];
    for i in 1..frames {
        distance.push(distance[i - 1] + length(&between(truth, i - 1, i)));
    }
    let (mut translation, mut rotation, mut count) = (0.0, 0.0, 0.0);
    for segment_m in LENGTHS_M {
        for i in 0..frames {
            // The first frame whose path since `i` is at least as long as the segment.
            let Some(j) = (i..frames).find(|&j| distance[j] >= distance[i] + segment_m) else {
                break;
            };
            translation += length(&error(i, j)) / segment_m * 100.0;
            rotation += degrees(&error(i, j)) / segment_m;
            count += 1.0;
        }
    }
    let (mut frame_m, mut frame_deg) = (0.0, 0.0);
    // Besides, errors from frame to frame, which longer segments average away.
    for i in 1..frames {
        frame_m += length(&error(i - 1, i)).powi(2);
        frame_deg += degrees(&error(i - 1, i)).powi(2);
    }
    let steps = (frames - 1) as f64;
    Errors {
        translation_percent: translation / count,
        rotation_deg_per_m: rotation / count,
        frame_rms_m: (frame_m / steps).sqrt(),
        frame_rms_deg: (frame_deg / steps).sqrt(),
    }
}

/// Runs a clip and returns its trajectory.
fn run(name: &str) -> Vec<Matrix4<f64>> {
    let folder = root().join("sequences").join(name);
    let rig = rig(&folder.join("calib.txt"));
    let capacity = Capacity::ONBOARD;
    let bytes = FlowMatcher::bytes(&capacity) + Estimator::bytes(&capacity);
    let mut slab: Vec<[u64; 8]> = vec![[0; 8]; bytes / 64 + 1];
    let slab: &mut [u8] = bytemuck::cast_slice_mut(&mut slab);
    // The carver asks for cache lines, and a Vec of arrays of u64 is aligned to 8 bytes only.
    let start = slab.as_ptr().align_offset(64);
    let mut carver = Carver::new(&mut slab[start..], bytes).unwrap();
    let mut matcher = FlowMatcher::new_in(&capacity, &mut carver);
    let mut estimator = Estimator::new_in(&capacity, &mut carver);
    let mut camera = Egomotion::default();
    let mut trajectory = Vec::new();
    let (mut matching_ms, mut moving_ms) = (0.0, 0.0);
    for frame in 0.. {
        let (Some(left), Some(right)) =
            (grey(&folder.join("image_0"), frame), grey(&folder.join("image_1"), frame))
        else {
            break;
        };
        let (left_view, right_view) = (
            View::new(&left.0, left.1, left.2).unwrap(),
            View::new(&right.0, right.1, right.2).unwrap(),
        );
        // Times of the process, not of the clock: other processes must not count.
        let begin = cpu_ms();
        let report = matcher.push(&SceneFlowConfig::default(), left_view, right_view, &Serial);
        let matched = cpu_ms();
        let estimate = (frame > 0).then(|| {
            camera.step(
                &EgomotionConfig::default(),
                &rig,
                at_10_hz(matcher.bucketed()),
                &mut estimator,
            )
        });
        (matching_ms, moving_ms) = (matching_ms + matched - begin, moving_ms + cpu_ms() - matched);
        if let Some(estimate) = estimate {
            assert_eq!(
                estimate.status,
                MotionStatus::Estimated,
                "{name} {frame}: {report:?} {estimate:?}"
            );
        }
        let rows = camera.t_world_camera().matrix_3x4();
        trajectory.push(Matrix4::from_fn(|r, c| {
            rows.get(r).map_or(f64::from(u8::from(c == 3)), |row| row[c])
        }));
    }
    let mean = |total: f64| total / trajectory.len() as f64;
    println!(
        "{name}: scene flow {:.1} ms, egomotion {:.1} ms a frame",
        mean(matching_ms),
        mean(moving_ms)
    );
    assert!(trajectory.len() > 1, "{name} has images");
    trajectory
}

fn print_errors(what: &str, errors: &Errors) {
    let Errors { translation_percent, rotation_deg_per_m, frame_rms_m, frame_rms_deg } = errors;
    println!(
        "{what}: t {translation_percent:.3} %, r {rotation_deg_per_m:.4} deg/m, per frame {:.2} cm \
         {frame_rms_deg:.4} deg",
        frame_rms_m * 100.0
    );
}

/// This thread's processor time where Linux tells it, to its tick; else 0.
fn cpu_ms() -> f64 {
    let times = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    times.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).map_or(0.0, |ns| ns * 1e-6)
}

fn truth(name: &str) -> Vec<Matrix4<f64>> {
    poses(&root().join("poses").join(name))
}

#[dynvox_needs::clips("kitti-odometry/sequences/06", "kitti-odometry/poses/06.txt")]
#[test]
fn tracks_sequence_06_as_well_as_the_best_stereo_odometry_measured() {
    let trajectory = run("06");
    let errors = relative_errors(&truth("06.txt"), &trajectory);
    print_errors("06", &errors);
    // The rig as it is: what self-calibration takes out of it is a scale of 0.2 % here.
    assert!(errors.translation_percent <= 0.83);
    assert!(errors.rotation_deg_per_m <= 0.025);
    assert!(errors.frame_rms_m <= 0.010);
}

#[dynvox_needs::clips(
    "kitti-odometry/sequences/r1405",
    "kitti-odometry/poses/r1405.txt",
    "kitti-odometry/poses/r1405.vo.txt"
)]
#[test]
fn tracks_a_residential_street() {
    let trajectory = run("r1405");
    let errors = relative_errors(&truth("r1405.txt"), &trajectory);
    print_errors("r1405 against GPS and inertial unit", &errors);
    // That truth is good over the clip and noisy from frame to frame.
    assert!(errors.translation_percent <= 1.5 && errors.rotation_deg_per_m <= 0.025);
    let errors = relative_errors(&truth("r1405.vo.txt"), &trajectory);
    print_errors("r1405 against another stereo odometry", &errors);
    assert!(
        errors.translation_percent <= 0.5
            && errors.rotation_deg_per_m <= 0.01
            && errors.frame_rms_m <= 0.0075
    );
}

/// Maps the clip with its own unit or without; prints what is known of the unit at the end.
fn mapped(name: &str, with_unit: bool) -> Vec<Matrix4<f64>> {
    let folder = root().join("sequences").join(name);
    let rig = rig(&folder.join("calib.txt"));
    // The heading holds a number of its own.
    let unit: Vec<f64> = fs::read_to_string(root().join("inertial/imu_to_camera0.txt"))
        .unwrap()
        .lines()
        .filter(|line| !line.starts_with('#'))
        .flat_map(|line| line.split_whitespace().map(|word| word.parse().unwrap()))
        .collect();
    let rows = [0, 4, 8].map(|at| [unit[at], unit[at + 1], unit[at + 2]]);
    let t_camera_unit =
        Transform::from_rotation_matrix(&rows, [unit[3], unit[7], unit[11]]).normalized();
    let config = Config {
        inertial: with_unit.then(|| InertialUnit::new(t_camera_unit)),
        ..Config::for_rig(rig)
    };
    // Times of frames and samples, from a moment that leaves space before the first frame.
    let stamp_ns = |time_s: f64| ((10.0 + time_s) * 1e9).round() as u64;
    let table = fs::read_to_string(root().join("inertial").join(format!("{name}.csv"))).unwrap();
    let lines = table.lines().filter(|line| !line.starts_with(['#', 't']));
    let samples: Vec<InertialSample> = lines
        .map(|line| {
            let values: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
            InertialSample {
                time_ns: stamp_ns(values[0]),
                turn_rate: [values[1], values[2], values[3]],
                force: [values[4], values[5], values[6]],
            }
        })
        .collect();
    // Depth costs time and tells nothing of the motion.
    let times = numbers(&folder.join("times.txt"));
    let capacity = Capacity::ONBOARD;
    let mut slab = vec![0u8; capacity.bytes() + SLAB_ALIGN];
    let start = slab.as_ptr().align_offset(SLAB_ALIGN);
    let mut mapper = Mapper::new(&capacity, &config, &mut slab[start..]).unwrap();
    let (mut trajectory, mut before_ns, mut refused) = (Vec::new(), 0, 0);
    for (frame, time_s) in times.iter().enumerate() {
        let (Some(left), Some(right)) =
            (grey(&folder.join("image_0"), frame), grey(&folder.join("image_1"), frame))
        else {
            break;
        };
        let (width, height) = (left.1, left.2);
        let no_depth = vec![0u16; width * height];
        let time_ns = stamp_ns(*time_s);
        let since: Vec<InertialSample> = samples
            .iter()
            .filter(|sample| sample.time_ns > before_ns && sample.time_ns <= time_ns)
            .copied()
            .collect();
        before_ns = time_ns;
        let frame = StereoFrame {
            disparity_q8: View::new(&no_depth, width, height),
            inertial: &since,
            time_ns: Some(time_ns),
            ..StereoFrame::pair(
                View::new(&left.0, width, height).unwrap(),
                View::new(&right.0, width, height).unwrap(),
            )
        };
        let report = mapper.step(&frame, &Serial).unwrap();
        refused += u32::from(report.inertial.is_some_and(|inertial| inertial.refused));
        let rows = report.t_world_camera.matrix_3x4();
        trajectory.push(Matrix4::from_fn(|r, c| {
            rows.get(r).map_or(f64::from(u8::from(c == 3)), |row| row[c])
        }));
        if with_unit && trajectory.len() % 16 == 0 {
            println!("{name} {}: {:?}", trajectory.len(), report.inertial);
        }
    }
    assert!(trajectory.len() > 1, "{name} has images");
    println!("{name}: {refused} turns of the images were refused");
    trajectory
}

// Long, and needs the clip with its unit: two attributes that ignore a test do not stand together.
#[dynvox_needs::long]
#[test]
fn a_car_s_own_unit_with_gaps_makes_no_pose_worse() {
    let truth = truth("r1405.txt");
    let [without, with] = [false, true].map(|unit| relative_errors(&truth, &mapped("r1405", unit)));
    print_errors("r1405 without its unit", &without);
    print_errors("r1405 with its unit", &with);
    assert!(with.translation_percent <= 1.001 * without.translation_percent);
    assert!(with.frame_rms_deg <= 1.001 * without.frame_rms_deg);
}
