//! EuRoC's layout, which TUM VI shares: `mav0/cam0/data`, `mav0/cam1/data`, and `data.csv` with the
//! time stamp of each image.

use super::camera_folders::camera_in;
use super::sequence::{ImageFiles, Parts, Sequence, present};
use super::units;
use crate::formats::calibration::beside;
use crate::formats::read_poses;
use crate::input::data_set::{DataSet, Layout, OpenOptions, no_sequences};
use crate::input::source::InputError;
use std::path::{Path, PathBuf};

/// Folder of all sensors.
const SENSORS: &str = "mav0";
/// Ground truth of EuRoC, of the body.
const TRUTH: &str = "state_groundtruth_estimate0/data.csv";

/// EuRoC and TUM VI.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "euroc",
    summary: "EuRoC and TUM VI: `mav0/{cam0,cam1}/data`, `data.csv`",
    describe: |_| "EuRoC or TUM VI: mav0/cam0 and mav0/cam1, times of data.csv".to_owned(),
    matches: |path| sensors_of(path).is_some(),
    sequences: no_sequences,
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

/// Opens the recording. `path` is its root or `mav0` in it.
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let sensors = sensors_of(path)
        .ok_or_else(|| InputError::Layout { path: path.to_path_buf(), below: Vec::new() })?;
    let action = "A recording of EuRoC or TUM VI has mav0/cam0 and mav0/cam1: fetch the other half";
    let cameras = [
        camera_in(&present(sensors.join("cam0"), action)?)?,
        camera_in(&present(sensors.join("cam1"), action)?)?,
    ];
    // The recordings are raw, with a calibration of each camera; a calib.txt says that they were
    // rectified since.
    let rectified =
        [sensors.join("calib.txt"), path.join("calib.txt")].into_iter().find(|file| file.is_file());
    let cameras_from = match (options.calibration.is_empty(), rectified) {
        (false, _) => options.calibration.clone(),
        (true, Some(file)) => vec![file],
        (true, None) => {
            beside(&sensors).ok_or_else(|| InputError::Unrectified { path: path.to_path_buf() })?
        }
    };
    let truth = sensors.join(TRUTH);
    let poses =
        truth.is_file().then(|| read_poses(&truth).map(|read| (truth, read))).transpose()?;
    let root = sensors.parent().filter(|root| *root != Path::new("")).unwrap_or(&sensors);
    let images = ImageFiles::Cameras(cameras);
    let cameras = options.cameras_of(&cameras_from)?;
    Sequence::from_parts(Parts {
        poses,
        instances: path.join("instances"),
        unit: units::of_folder(&sensors.join("imu0"), &sensors.join("cam0")),
        ..Parts::new(options, super::folder::name_of(root), images, cameras)
    })
}

/// The folder of the sensors, if there is one with a camera.
fn sensors_of(path: &Path) -> Option<PathBuf> {
    let is_mav = path.file_name().is_some_and(|name| name == SENSORS);
    let sensors = if is_mav { path.to_path_buf() } else { path.join(SENSORS) };
    sensors.join("cam0").is_dir().then_some(sensors)
}
