//! KITTI's raw drives and KITTI-360: a folder a drive with `image_00` and `image_01`, their
//! `timestamps.txt`, and one calibration for all.

use super::camera_folders::camera_in;
use super::folder::name_of;
use super::kitti::{chosen, sequences};
use super::sequence::{ImageFiles, Parts, Sequence, present};
use super::units;
use crate::formats::calibration::{CalibrationHints, KittiCalibration};
use crate::formats::read_poses;
use crate::input::data_set::{CameraPair, DataSet, Layout, OpenOptions};
use crate::input::source::InputError;
use std::path::{Path, PathBuf};

/// Folder of all drives of KITTI-360.
const DRIVES_360: &str = "data_2d_raw";
/// Folder of KITTI-360's poses, a folder a drive, and the file of camera 0 in it.
const POSES_360: &str = "data_poses";
const POSES_FILE_360: &str = "cam0_to_world.txt";

/// KITTI's raw drives.
pub const KITTI_RAW: Layout = Layout::new(&DataSet {
    name: "kitti-raw",
    summary: "KITTI raw: `DAY/DRIVE_sync/{image_00,image_01}/data`, `DAY/calib_cam_to_cam.txt`",
    describe: |_| {
        "KITTI raw: image_00 to image_03 of each drive, times of timestamps.txt".to_owned()
    },
    matches: |path| is_drive(path) || drives(path).is_ok_and(|drives| !drives.is_empty()),
    sequences: |path| if is_drive(path) { Ok(Vec::new()) } else { drives(path) },
    open: |path, options| Ok(Box::new(open_raw(path, options)?)),
});

/// KITTI-360.
pub const KITTI_360: Layout = Layout::new(&DataSet {
    name: "kitti-360",
    summary: "KITTI-360: `data_2d_raw/DRIVE/{image_00,image_01}/data_rect`, \
              `calibration/perspective.txt`",
    describe: |_| {
        "KITTI-360: image_00 and image_01 of each drive, times of timestamps.txt".to_owned()
    },
    matches: |path| drives_360(path).is_some() || is_drive_360(path),
    sequences: |path| drives_360(path).map_or(Ok(Vec::new()), |drives| sequences(&drives)),
    open: |path, options| Ok(Box::new(open_360(path, options)?)),
});

/// Opens a drive of KITTI raw. `path` is the drive (`2011_09_26_drive_0001_sync`) or the day with
/// its calibration.
fn open_raw(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let drive = if is_drive(path) {
        path.to_path_buf()
    } else {
        path.join(chosen(path, options.sequence.as_deref(), &drives(path)?)?)
    };
    let calibration = [drive.join("calib_cam_to_cam.txt"), drive.join("../calib_cam_to_cam.txt")];
    let found = calibration.iter().find(|file| file.is_file()).unwrap_or(&calibration[1]);
    // What was only extracted is raw: the same file says how to rectify it.
    let extracted = name_of(&drive).ends_with("_extract") && options.calibration.is_empty();
    let options = if extracted {
        let (_, right) = pair_of(&drive, options.cameras);
        let hints = CalibrationHints { colour: right == 3, ..options.hints };
        &OpenOptions { calibration: vec![found.clone()], hints, ..options.clone() }
    } else {
        options
    };
    let files = DriveFiles { calibration: found.clone(), poses: None };
    open_drive(&drive, &files, "kitti-raw", options)
}

/// Opens a drive of KITTI-360. `path` is the root of the data set or one drive in `data_2d_raw`.
fn open_360(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let (root, drive) = match drives_360(path) {
        Some(drives) => (
            path.to_path_buf(),
            drives.join(chosen(path, options.sequence.as_deref(), &sequences(&drives)?)?),
        ),
        None => (path.join("../.."), path.to_path_buf()),
    };
    let files = DriveFiles {
        calibration: root.join("calibration/perspective.txt"),
        poses: Some(root.join(POSES_360).join(name_of(&drive)).join(POSES_FILE_360)),
    };
    open_drive(&drive, &files, "kitti-360", options)
}

/// Files of a drive apart from its folder.
struct DriveFiles {
    calibration: PathBuf,
    /// Poses of camera 0, there or not.
    poses: Option<PathBuf>,
}

/// Numbers of the cameras to read: those asked for, else the pair that is there.
fn pair_of(drive: &Path, cameras: CameraPair) -> (usize, usize) {
    let has = |cameras: [&str; 2]| cameras.iter().all(|camera| drive.join(camera).is_dir());
    match cameras {
        CameraPair::Grey => (0, 1),
        CameraPair::Colour => (2, 3),
        CameraPair::Auto if !has(["image_00", "image_01"]) && has(["image_02", "image_03"]) => {
            (2, 3)
        }
        CameraPair::Auto => (0, 1),
    }
}

fn open_drive(
    drive: &Path,
    files: &DriveFiles,
    prefix: &str,
    options: &OpenOptions,
) -> Result<Sequence, InputError> {
    let (left, right) = pair_of(drive, options.cameras);
    let action =
        "A drive has image_00 and image_01, or image_02 and image_03: fetch the other half";
    let camera =
        |number: usize| camera_in(&present(drive.join(format!("image_{number:02}")), action)?);
    let cameras = [camera(left)?, camera(right)?];
    let own = || KittiCalibration::read(&files.calibration)?.rig(left, right);
    let poses = files.poses.as_ref().filter(|poses| left == 0 && poses.is_file());
    let images = ImageFiles::Cameras(cameras);
    let cameras = options.cameras_or(own)?;
    Sequence::from_parts(Parts {
        poses: poses.map(|path| read_poses(path).map(|read| (path.clone(), read))).transpose()?,
        numbered: true,
        instances: drive.join("instances"),
        unit: units::of_kitti_raw(drive, &files.calibration),
        ..Parts::new(options, format!("{prefix}-{}", name_of(drive)), images, cameras)
    })
}

/// Returns true if the folder is one drive of KITTI raw.
fn is_drive(path: &Path) -> bool {
    ["image_00", "image_02"].iter().any(|camera| path.join(camera).join("data").is_dir())
}

/// The drives of a day of KITTI raw; empty where the folder is none.
fn drives(path: &Path) -> Result<Vec<String>, InputError> {
    if !path.join("calib_cam_to_cam.txt").is_file() {
        return Ok(Vec::new());
    }
    Ok(sequences(path)?.into_iter().filter(|name| is_drive(&path.join(name))).collect())
}

/// The folder of the drives of KITTI-360.
fn drives_360(path: &Path) -> Option<PathBuf> {
    Some(path.join(DRIVES_360)).filter(|drives| drives.is_dir())
}

/// Returns true if the folder is one drive of KITTI-360.
fn is_drive_360(path: &Path) -> bool {
    path.join("image_00/data_rect").is_dir()
}
