//! An inertial unit as a user of the binary meets it: found, text, doubted, turned off.

use super::binary::{dynvox, output_text, rig};
use super::same_run::summary;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Maps the street with a unit and further settings.
fn street(root: &Path, out: &str, settings: &[&str], more: &[&str]) -> String {
    let mut words = vec!["run", "--profile", "tiny", "--instances", "none", "--threads", "1"];
    let common =
        ["street.width=320", "street.height=96", "street.frames=24", "street.sway_deg_s=20"];
    for setting in common.iter().chain(settings) {
        words.extend(["--set", setting]);
    }
    words.extend(["--out", out]);
    words.extend(more);
    let run = dynvox(root, &words);
    assert!(run.status.success(), "{}", output_text(&run));
    output_text(&run) + &String::from_utf8_lossy(&run.stdout)
}

#[dynvox_needs::long]
#[test]
fn a_street_s_unit_is_compared_with_the_images_and_a_fault_is_named() {
    let root = TempDir::new().unwrap();
    let unit = ["street.inertial.rate_hz=200", "street.inertial.clock_offset_s=0.02"];
    let text = street(root.path(), "sound", &unit, &[]);
    assert!(text.contains("inertial unit") && !text.contains("inertial WARNING"), "{text}");
    let found = &summary(&root.path().join("sound"))["inertial"];
    assert_eq!(found["samples"], 461, "{found}");
    let offset_ms = found["clock_offset_ms"].as_f64().unwrap();
    assert!((offset_ms - 20.0).abs() < 6.0, "{found}");
    assert!(found["doubt"].is_null() && found["up"].is_array(), "{found}");
    let faulty = [unit[0], "street.inertial.fault=degrees"];
    let text = street(root.path(), "degrees", &faulty, &[]);
    assert!(text.contains("inertial WARNING") && text.contains("they are in degrees"), "{text}");
    let text = street(root.path(), "none", &unit, &["--inertial", "none"]);
    assert!(!text.contains("inertial"), "{text}");
    assert!(summary(&root.path().join("none"))["inertial"].is_null());
}

#[test]
fn inspect_tells_of_a_unit_and_of_the_command_that_uses_it() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 4);
    let samples: String = (0..40)
        .map(|at| format!("{},0.1,{},0,0,0,9.8\n", f64::from(at) * 0.01, f64::from(at) * 0.01))
        .collect();
    fs::write(root.path().join("imu.csv"), format!("time,wx,wy,wz,ax,ay,az\n{samples}")).unwrap();
    fs::write(root.path().join("mount.txt"), "0 -1 0 0.1 0 0 -1 0 1 0 0 0\n").unwrap();
    let times = "0.0\n0.1\n0.2\n0.3\n";
    fs::write(root.path().join("rig/times.txt"), times).unwrap();
    let options = ["--inertial", "imu.csv", "--inertial-calibration", "mount.txt"];
    let inspect = dynvox(root.path(), &[&["inspect", "rig"][..], &options].concat());
    let text = String::from_utf8_lossy(&inspect.stdout).into_owned();
    assert!(inspect.status.success(), "{}", output_text(&inspect));
    assert!(
        text.contains("inertial unit: 31 samples at 100 Hz, longest gap 0.010 s, 0.10 m"),
        "{text}"
    );
    assert!(text.contains("--inertial imu.csv --inertial-calibration mount.txt"), "{text}");
    // Without its mounting it is refused where it is asked for.
    let refused = dynvox(root.path(), &["run", "rig", "--inertial", "imu.csv"]);
    let text = output_text(&refused);
    assert!(!refused.status.success() && text.contains("--inertial-calibration"), "{text}");
    let street = dynvox(root.path(), &["run", "--inertial", "imu.csv"]);
    let text = output_text(&street);
    assert!(!street.status.success() && text.contains("belong to a recording"), "{text}");
}
