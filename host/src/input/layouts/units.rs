//! Inertial units of layouts: where their samples and the files with their mounting lie.

use crate::input::source::{OwnUnit, UnitSamples};
use std::path::{Path, PathBuf};

/// Names of tables of samples in a folder of images.
const TABLES: [&str; 6] =
    ["imu0/data.csv", "imu.csv", "imu_data.csv", "inertial.csv", "imu/data.csv", "imu.txt"];
/// Names of files with a unit's mounting in a folder of images, and with its noise.
const MOUNTINGS: [&str; 6] = [
    "camchain-imucam.yaml",
    "camchain.yaml",
    "kalibr_imucam_chain.yaml",
    "imu_to_camera.txt",
    "imu_to_camera0.txt",
    "calib.json",
];
const NOISES: [&str; 2] = ["imu.yaml", "kalibr_imu_chain.yaml"];

/// The unit of EuRoC's layout: `imu0` with its table and `sensor.yaml`, next to the camera's.
pub fn of_folder(unit: &Path, camera: &Path) -> Option<OwnUnit> {
    let samples = Some(unit.join("data.csv")).filter(|table| table.is_file())?;
    let calibration = [unit, camera].map(|folder| folder.join("sensor.yaml"));
    let whole = calibration.iter().all(|file| file.is_file());
    Some(OwnUnit {
        samples: UnitSamples::Files(samples),
        calibration: if whole { calibration.to_vec() } else { Vec::new() },
    })
}

/// The unit of a recording of KITTI raw: `oxts` in it, and the files of the day next to the
/// cameras'.
pub fn of_kitti_raw(recording: &Path, cameras: &Path) -> Option<OwnUnit> {
    let samples = Some(recording.join("oxts")).filter(|folder| folder.join("data").is_dir())?;
    let mounting = cameras.with_file_name("calib_imu_to_velo.txt");
    let calibration = if mounting.is_file() { vec![mounting] } else { Vec::new() };
    Some(OwnUnit { samples: UnitSamples::Files(samples), calibration })
}

/// The unit of a folder of images, by the names of its files.
pub fn beside_images(folder: &Path) -> Option<OwnUnit> {
    let there = |name: &&str| Some(folder.join(name)).filter(|file| file.is_file());
    let samples = TABLES.iter().find_map(&there)?;
    let mounting = MOUNTINGS.iter().find_map(&there);
    let noise = mounting.as_ref().and_then(|_| NOISES.iter().find_map(there));
    let mut calibration: Vec<PathBuf> = mounting.into_iter().chain(noise).collect();
    let euroc = [folder.join("imu0"), folder.join("cam0")].map(|at| at.join("sensor.yaml"));
    if calibration.is_empty() && euroc.iter().all(|file| file.is_file()) {
        calibration = euroc.to_vec();
    }
    Some(OwnUnit { samples: UnitSamples::Files(samples), calibration })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use tempfile::TempDir;

    /// A folder with empty files of these names.
    fn folder(names: &[&str]) -> TempDir {
        let root = TempDir::new().unwrap();
        for name in names {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        root
    }

    /// Names of the samples and the calibration of a unit, below a folder.
    fn names(root: &TempDir, unit: Option<OwnUnit>) -> Option<Vec<String>> {
        let OwnUnit { samples: UnitSamples::Files(samples), calibration } = unit? else {
            panic!("in files")
        };
        let files = std::iter::once(samples).chain(calibration);
        let below = |file: PathBuf| file.strip_prefix(root.path()).unwrap().display().to_string();
        Some(files.map(below).collect())
    }

    #[test]
    fn a_table_beside_images_brings_its_mounting() {
        for (files, expected) in [
            (&["camchain.yaml"][..], None),
            (&["imu.csv"], Some(&["imu.csv"][..])),
            (&["imu.csv", "imu.yaml"], Some(&["imu.csv"])),
            (
                &["imu.csv", "imu.yaml", "camchain.yaml"],
                Some(&["imu.csv", "camchain.yaml", "imu.yaml"]),
            ),
            (
                &["imu0/data.csv", "imu0/sensor.yaml", "cam0/sensor.yaml"],
                Some(&["imu0/data.csv", "imu0/sensor.yaml", "cam0/sensor.yaml"]),
            ),
        ] {
            let root = folder(files);
            let found = names(&root, beside_images(root.path()));
            let expected = expected.map(|names| names.iter().map(|&name| name.into()).collect());
            assert_eq!(found, expected, "{files:?}");
        }
    }

    #[test]
    fn kitti_raws_unit_lies_in_oxts() {
        let root = folder(&["day/oxts/data/0.txt", "calib_cam_to_cam.txt"]);
        let (recording, cameras) =
            (root.path().join("day"), root.path().join("calib_cam_to_cam.txt"));
        // Samples without a mounting are samples: the settings may have it.
        let found = || names(&root, of_kitti_raw(&recording, &cameras)).unwrap();
        assert_eq!(found(), ["day/oxts"]);
        fs::write(root.path().join("calib_imu_to_velo.txt"), "").unwrap();
        assert_eq!(found(), ["day/oxts", "calib_imu_to_velo.txt"]);
        assert!(of_kitti_raw(root.path(), &cameras).is_none(), "no oxts");
    }
}
