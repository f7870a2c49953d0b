use super::*;
use crate::input;
use std::fs;
use tempfile::TempDir;

const HEADING: &str = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad \
                       s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]";
const BEGIN_NS: u64 = 1_403_636_579_763_555_584;

/// `T_BS` of a sensor that is turned by a quarter about z and stands `x` to the side.
fn pose(x: f64) -> String {
    format!(
        "T_BS:\n  cols: 4\n  rows: 4\n  data: [0, -1, 0, {x}, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    )
}

/// EuRoC's layout with four pairs at 10 Hz and samples at 200 Hz.
fn euroc() -> TempDir {
    let root = TempDir::new().unwrap();
    let file = |name: &str, text: String| {
        let path = root.path().join("mav0").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    for (camera, x) in [("cam0", 0.0), ("cam1", 0.11)] {
        let mut names = "#timestamp [ns],filename\n".to_owned();
        for at in 0..4u64 {
            let stamp = BEGIN_NS + at * 100_000_000;
            names += &format!("{stamp},{stamp}.png\n");
            file(&format!("{camera}/data/{stamp}.png"), String::new());
            let image = image::GrayImage::from_fn(96, 64, |u, v| {
                image::Luma([((u * 7 + v * 13) % 251) as u8])
            });
            image.save(root.path().join(format!("mav0/{camera}/data/{stamp}.png"))).unwrap();
        }
        file(&format!("{camera}/data.csv"), names);
        let lens = "sensor_type: camera\nresolution: [96, 64]\ncamera_model: pinhole\n\
                    intrinsics: [80, 80, 48, 32]\n\
                    distortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n";
        // The right camera stands to the right in the left one's axes, which are turned.
        let text = pose(0.0).replace("1, 0, 0, 0, 0, 0, 1", &format!("1, 0, 0, {x}, 0, 0, 1"));
        file(&format!("{camera}/sensor.yaml"), format!("{lens}{text}"));
    }
    let rows: String = (0..80u64)
        .map(|at| {
            format!("{},0.1,0.2,0.{at},0.0,0.0,9.8\n", BEGIN_NS + at * 5_000_000 - 20_000_000)
        })
        .collect();
    file("imu0/data.csv", format!("{HEADING}\n{rows}"));
    let identity = "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
    file(
        "imu0/sensor.yaml",
        format!("sensor_type: imu\n{identity}rate_hz: 200\ngyroscope_noise_density: 1.7e-04\n"),
    );
    root
}

fn open(root: &Path, options: &OpenOptions) -> Result<Box<dyn FrameSource>, String> {
    input::open(root, options).map_err(|error| error.to_string())
}

#[test]
fn a_recording_s_own_unit_is_found_with_its_mounting_and_noise() {
    let root = euroc();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    let unit = dataset.info().inertial.clone().unwrap();
    assert_eq!((unit.readings.len(), unit.within_frames), (80, 61));
    assert!((unit.rate_hz - 200.0).abs() < 1e-6);
    assert_eq!(unit.noise.turn_density, Some(1.7e-4));
    // The unit's x axis is the camera's -y: the camera is turned on the body.
    let x = unit.t_camera_unit.rotate([1.0, 0.0, 0.0]);
    assert!((x[0]).abs() < 1e-9 && (x[1] + 1.0).abs() < 1e-9, "{x:?}");
    let note = dataset.notes().iter().find(|note| note.contains("inertial unit")).unwrap();
    assert!(note.contains("61 samples at 200 Hz"), "{note}");
    // The frame at 0.1 s has the samples since the one before.
    assert_eq!(unit.between(Some(BEGIN_NS), BEGIN_NS + 100_000_000).len(), 20);
    let none = OpenOptions { inertial: InertialChoice::None, ..OpenOptions::default() };
    assert!(open(root.path(), &none).unwrap().info().inertial.is_none());
}

#[test]
fn a_unit_that_cannot_be_used_is_said_and_an_asked_for_one_refused() {
    let root = euroc();
    let samples = root.path().join("mav0/imu0/data.csv");
    let asked =
        OpenOptions { inertial: InertialChoice::File(samples.clone()), ..OpenOptions::default() };
    assert!(open(root.path(), &asked).unwrap().info().inertial.is_some());
    let text = fs::read_to_string(&samples).unwrap();
    let early = text.replace("\n14036365", "\n14036355").replace("\n14036364", "\n14036354");
    for (broken, expected) in [
        (text.replace(",9.8\n", ",1.0\n"), "they are in g"),
        (early, "and the frames of 1403636579.764 s to 1403636580.064 s"),
        (text.replace("w_RS_S_z", "temperature"), "no column wz"),
        (String::new(), "it has no rows"),
    ] {
        fs::write(&samples, &broken).unwrap();
        let dataset = open(root.path(), &OpenOptions::default()).unwrap();
        assert!(dataset.info().inertial.is_none());
        let notes = dataset.notes().join("; ");
        assert!(
            notes.contains("its inertial unit is not used") && notes.contains(expected),
            "{notes}"
        );
        let error = open(root.path(), &asked).err().unwrap();
        assert!(error.contains(expected), "{error}");
    }
    fs::write(&samples, &text).unwrap();
    fs::remove_file(root.path().join("mav0/imu0/sensor.yaml")).unwrap();
    let notes = open(root.path(), &OpenOptions::default()).unwrap().notes().join("; ");
    assert!(notes.contains("nothing says how the inertial unit is mounted"), "{notes}");
    let error = open(root.path(), &asked).err().unwrap();
    assert!(error.contains("--inertial-calibration"), "{error}");
}

#[test]
fn a_mounting_that_is_given_counts_and_needs_samples() {
    let root = euroc();
    let file = root.path().join("mount.txt");
    fs::write(&file, "1 0 0 0.3\n0 1 0 0\n0 0 1 0\n").unwrap();
    let given = OpenOptions { inertial_calibration: vec![file.clone()], ..OpenOptions::default() };
    let dataset = open(root.path(), &given).unwrap();
    let unit = dataset.info().inertial.clone().unwrap();
    assert_eq!(unit.t_camera_unit.translation_m, [0.3, 0.0, 0.0]);
    fs::write(&file, "1 0 0 0.3\n0 1 0 0\n0 0 -1 0\n").unwrap();
    let error = open(root.path(), &given).err().unwrap();
    assert!(error.contains("no rotation and translation"), "{error}");
    fs::write(&file, "1 0 0 300\n0 1 0 0\n0 0 1 0\n").unwrap();
    assert!(open(root.path(), &given).err().unwrap().contains("300.0 m from the camera"));
    fs::write(&file, "a rainy day: 1\n").unwrap();
    assert!(open(root.path(), &given).err().unwrap().contains("does not say how"));
    fs::remove_dir_all(root.path().join("mav0/imu0")).unwrap();
    assert!(open(root.path(), &given).err().unwrap().contains("no samples of one"));
}
