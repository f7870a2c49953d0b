//! Calibration files in a recording's folder, by their names and by what they hold.

use super::{CalibrationFiles, CalibrationHints};
use std::path::{Path, PathBuf};

/// Endings of files that may be a calibration.
const ENDINGS: [&str; 7] = ["yaml", "yml", "json", "xml", "txt", "conf", "toml"];
/// Most files of a folder that are looked at.
const MAX_FILES: usize = 12;
/// Largest file that is looked at, bytes.
const MAX_BYTES: u64 = 1 << 17;

/// The calibration that lies in a recording's folder: our own `calibration.toml`, Kalibr's
/// `camchain.yaml`, EuRoC's `sensor.yaml` of each camera, or KITTI raw's `calib_cam_to_cam.txt`,
/// there or a folder up; else the files there that are one by what they hold. Several that are one
/// each are none.
pub fn beside(folder: &Path) -> Option<Vec<PathBuf>> {
    let one = |path: PathBuf| path.is_file().then(|| vec![path]);
    let euroc = || {
        let pair = ["cam0", "cam1"].map(|camera| folder.join(camera).join("sensor.yaml"));
        pair.iter().all(|path| path.is_file()).then(|| pair.to_vec())
    };
    one(folder.join("calibration.toml"))
        .or_else(|| one(folder.join("camchain.yaml")))
        .or_else(euroc)
        .or_else(|| one(folder.join("calib_cam_to_cam.txt")))
        .or_else(|| one(folder.canonicalize().ok()?.parent()?.join("calib_cam_to_cam.txt")))
        .or_else(|| by_content(&[folder.to_path_buf()]))
        .or_else(|| by_content(&["calib", "calibration"].map(|name| folder.join(name))))
        .or_else(|| {
            let sides = [["left", "right"], ["cam0", "cam1"], ["image_0", "image_1"]];
            sides.iter().find_map(|sides| by_content(&sides.map(|side| folder.join(side))))
        })
}

/// The fewest files of some folders that are a calibration together; where none can be used, those
/// of a known format, so that reading them says what is wrong.
fn by_content(folders: &[PathBuf]) -> Option<Vec<PathBuf>> {
    let files: Vec<PathBuf> = folders.iter().flat_map(|folder| candidates(folder)).collect();
    if files.is_empty() || files.len() > MAX_FILES {
        return None;
    }
    let usable = |paths: &[PathBuf]| {
        CalibrationFiles::read(paths, CalibrationHints::default())
            .is_ok_and(|files| files.cameras(None).is_ok() || files.lacks_size())
    };
    for count in 1..=3 {
        let found: Vec<_> = choices(&files, count).into_iter().filter(|of| usable(of)).collect();
        match found.as_slice() {
            [] => {}
            [one] => return Some(one.clone()),
            _ => return None,
        }
    }
    let known = |path: &PathBuf| {
        CalibrationFiles::read(std::slice::from_ref(path), CalibrationHints::default())
            .is_ok_and(|files| files.is_known())
    };
    let known: Vec<PathBuf> = files.into_iter().filter(known).collect();
    (1..=3).contains(&known.len()).then_some(known)
}

/// Files of a folder that may be a calibration, by name.
fn candidates(folder: &Path) -> Vec<PathBuf> {
    let listed = ["times.txt", "poses.txt", "timestamps.txt"];
    let may_be = |path: &PathBuf| {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
            && !name.starts_with('.')
            && !listed.contains(&&*name)
            && path.metadata().is_ok_and(|file| file.is_file() && file.len() <= MAX_BYTES)
    };
    let Ok(entries) = folder.read_dir() else { return Vec::new() };
    let mut files: Vec<PathBuf> =
        entries.flatten().map(|entry| entry.path()).filter(may_be).collect();
    files.sort();
    files
}

/// All choices of so many files, in order.
fn choices(files: &[PathBuf], count: usize) -> Vec<Vec<PathBuf>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let mut all = Vec::new();
    for (at, first) in files.iter().enumerate() {
        for mut chosen in choices(files.get(at + 1..).unwrap_or_default(), count - 1) {
            chosen.insert(0, first.clone());
            all.push(chosen);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::calibration::CALIBRATION_FORMATS;
    use std::fs;

    fn names(found: Option<Vec<PathBuf>>) -> Vec<String> {
        let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
        found.unwrap_or_default().iter().map(name).collect()
    }

    #[test]
    fn every_format_is_found_by_what_it_holds() {
        for row in CALIBRATION_FORMATS.iter().filter(|row| !row.example.is_empty()) {
            let folder = tempfile::tempdir().unwrap();
            fs::write(folder.path().join("notes.txt"), "a rainy day\n").unwrap();
            let mut expected = Vec::new();
            for (name, text) in row.example {
                fs::write(folder.path().join(format!("my_{name}")), text).unwrap();
                expected.push(format!("my_{name}"));
            }
            // Names of files stand in VINS-Fusion's own.
            if matches!(row.name, "VINS-Fusion" | "camodocal") {
                continue;
            }
            expected.sort();
            assert_eq!(names(beside(folder.path())), expected, "{}", row.name);
        }
    }

    #[test]
    fn two_calibrations_are_none_and_a_doubtful_one_is_taken_to_be_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [(_, text)] = CALIBRATION_FORMATS
            .iter()
            .find(|row| row.name == "OpenCV")
            .map(|row| row.example)
            .unwrap()
        else {
            panic!("one file")
        };
        fs::write(folder.path().join("a.yml"), text).unwrap();
        assert_eq!(names(beside(folder.path())), ["a.yml"]);
        fs::write(folder.path().join("b.yml"), text).unwrap();
        assert_eq!(names(beside(folder.path())), Vec::<String>::new());
        fs::remove_file(folder.path().join("b.yml")).unwrap();
        fs::write(folder.path().join("a.yml"), text.replace("-0.11,", "-4.4,")).unwrap();
        assert_eq!(names(beside(folder.path())), ["a.yml"], "its unit is asked for");
    }
}
