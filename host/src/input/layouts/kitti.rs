//! KITTI's layouts: odometry and tracking.

use super::labels;
use super::lidar::LidarFiles;
use super::names::{natural_order, pictures_in};
use super::sequence::{ImageFiles, Parts, Sequence, present};
use crate::formats::calibration::KittiCalibration;
use crate::formats::{read_poses, read_times};
use crate::input::data_set::{CameraPair, DataSet, Layout, OpenOptions};
use crate::input::source::{InputError, read_failed};
use dynvox_core::geometry::Transform;
use std::path::{Path, PathBuf};

/// Time between two frames of the tracking benchmark, s.
const LABELS_INTERVAL_S: f64 = 0.1;

/// The odometry benchmark.
pub const ODOMETRY: Layout = Layout::new(&DataSet {
    name: "kitti-odometry",
    summary: "KITTI odometry: `sequences/NN/{image_0,image_1,calib.txt}`",
    describe: |_| "KITTI odometry: image_0 to image_3 of each sequence".to_owned(),
    matches: |path| odometry_root(path).is_some() || is_odometry_sequence(path),
    sequences: |path| odometry_root(path).map_or(Ok(Vec::new()), |root| sequences(&root)),
    open: |path, options| Ok(Box::new(open_odometry(path, options)?)),
});

/// The tracking benchmark.
pub const TRACKING: Layout = Layout::new(&DataSet {
    name: "kitti-tracking",
    summary: "KITTI tracking: `training/{image_02,image_03}/NNNN`, `training/calib/NNNN.txt`",
    describe: |_| "KITTI tracking: image_02 and image_03 of each sequence".to_owned(),
    matches: |path| tracking_split(path).is_some(),
    sequences: |path| {
        tracking_split(path).map_or(Ok(Vec::new()), |split| tracking_sequences(&split))
    },
    open: |path, options| Ok(Box::new(open_tracking(path, options)?)),
});

/// Opens a sequence of the odometry benchmark. `path` is its root (with `sequences/`), the
/// `sequences` folder or one sequence.
fn open_odometry(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let folder = odometry_folder(path, options.sequence.as_deref())?;
    let number =
        folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let calibration = KittiCalibration::read(&present(
        folder.join("calib.txt"),
        "Every sequence needs its calib.txt: copy it from the benchmark",
    )?)?;
    // A street written through a lens brings the calibration of its raw images.
    let own = Some(folder.join("calibration.toml"))
        .filter(|file| file.is_file() && options.calibration.is_empty());
    let options = &OpenOptions {
        calibration: own.map_or_else(|| options.calibration.clone(), |file| vec![file]),
        ..options.clone()
    };
    let mut notes = Vec::new();
    let (left, right) = odometry_pair(&folder, options.cameras, &mut notes);
    let camera = |number: usize| {
        present(
            folder.join(format!("image_{number}")),
            "A pair is image_0 and image_1 (grey) or image_2 and image_3 (colour): fetch the other \
             half",
        )
    };
    let (left_folder, right_folder) = (camera(left)?, camera(right)?);
    let times = folder.join("times.txt");
    let times = if times.is_file() { Some((times.clone(), read_times(&times)?)) } else { None };
    let poses = match odometry_poses(&folder, &number) {
        // The benchmark's poses are those of camera 0; the colour camera sees the same motion from
        // its own place.
        Some(path) => {
            let t_camera_zero = Transform::from_translation(calibration.offset_m(left)?.into());
            let mut read = read_poses(&path)?;
            for pose in &mut read.poses {
                *pose = t_camera_zero * *pose * t_camera_zero.inverse();
            }
            Some((path, read))
        }
        None => None,
    };
    let images = ImageFiles::in_folders(&left_folder, &right_folder)?;
    let cameras = options.cameras_or(|| calibration.rig(left, right))?;
    Sequence::from_parts(Parts {
        times,
        poses,
        numbered: true,
        notes,
        instances: folder.join("instances"),
        lidar: LidarFiles::at(folder.join("velodyne"), &calibration, [left, right])?,
        ..Parts::new(options, format!("kitti-odometry-{number}"), images, cameras)
    })
}

/// Numbers of the left and the right camera of a sequence.
fn odometry_pair(folder: &Path, cameras: CameraPair, notes: &mut Vec<String>) -> (usize, usize) {
    let has = |pair: [&str; 2]| pair.iter().all(|camera| folder.join(camera).is_dir());
    let (grey, colour) = (has(["image_0", "image_1"]), has(["image_2", "image_3"]));
    match cameras {
        CameraPair::Grey => (0, 1),
        CameraPair::Colour => (2, 3),
        CameraPair::Auto if grey => {
            if colour {
                notes.push(
                    "grey and colour images are there: the grey ones are used; --images \
                            colour takes the others"
                        .to_owned(),
                );
            }
            (0, 1)
        }
        CameraPair::Auto if colour => (2, 3),
        CameraPair::Auto => (0, 1),
    }
}

/// Opens a sequence of the tracking benchmark. `path` is its root, its `training` or `testing`
/// folder.
fn open_tracking(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let split = tracking_split(path)
        .ok_or_else(|| InputError::Layout { path: path.to_path_buf(), below: Vec::new() })?;
    let names = tracking_sequences(&split)?;
    let name = chosen(path, options.sequence.as_deref(), &names)?;
    let action = "The tracking benchmark keeps left images in image_02/NNNN, right ones in \
                  image_03/NNNN: fetch what is missing";
    let calibration = KittiCalibration::read(&present(
        split.join("calib").join(format!("{name}.txt")),
        "Fetch the benchmark's calibration files",
    )?)?;
    let poses = split.join("poses").join(format!("{name}.txt"));
    let labels = split.join("label_02").join(format!("{name}.txt"));
    // Labels have a scale of their own: poses on it are preferred.
    let scaled = split.join("poses").join(format!("{name}.scaled.txt"));
    let labels_poses =
        [&scaled, &poses].into_iter().find(|path| path.is_file() && labels.is_file());
    let objects = match labels_poses {
        Some(path) => labels::read_labels(
            &labels,
            &read_poses(path)?.poses,
            calibration.offset_m(2)?,
            LABELS_INTERVAL_S,
        )?,
        None => Vec::new(),
    };
    let images = ImageFiles::in_folders(
        &present(split.join("image_02").join(&name), action)?,
        &present(split.join("image_03").join(&name), action)?,
    )?;
    let cameras = options.cameras_or(|| calibration.rig(2, 3))?;
    Sequence::from_parts(Parts {
        poses: if poses.is_file() { Some((poses.clone(), read_poses(&poses)?)) } else { None },
        numbered: true,
        instances: split.join("instances").join(&name),
        objects,
        lidar: LidarFiles::at(split.join("velodyne").join(&name), &calibration, [2, 3])?,
        ..Parts::new(options, format!("kitti-tracking-{name}"), images, cameras)
    })
}

/// The sequences folder of an odometry root, if it is one.
fn odometry_root(path: &Path) -> Option<PathBuf> {
    let below = path.join("sequences");
    if below.is_dir() {
        return Some(below);
    }
    let named = path.file_name().is_some_and(|name| name == "sequences");
    (named && path.is_dir()).then(|| path.to_path_buf())
}

/// Returns true if the folder is one sequence of the odometry benchmark.
fn is_odometry_sequence(path: &Path) -> bool {
    path.join("calib.txt").is_file()
        && ["image_0", "image_2"].iter().any(|camera| path.join(camera).is_dir())
}

/// The split (`training`, `testing`) of a tracking root, if it is one.
fn tracking_split(path: &Path) -> Option<PathBuf> {
    let is_split = |folder: &Path| {
        // Images directly below image_02 would be another layout: here each sequence has a folder
        // of its own.
        folder.join("image_02").is_dir() && pictures_in(&folder.join("image_02")).is_err()
    };
    [path.to_path_buf(), path.join("training"), path.join("testing")]
        .into_iter()
        .find(|folder| is_split(folder))
}

/// Names of the sequences in a folder of folders.
pub fn sequences(folder: &Path) -> Result<Vec<String>, InputError> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(read_failed(folder))? {
        let entry = entry.map_err(read_failed(folder))?;
        if entry.path().is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort_by(|a, b| natural_order(a, b));
    Ok(names)
}

/// Names of the sequences of a tracking split.
fn tracking_sequences(split: &Path) -> Result<Vec<String>, InputError> {
    sequences(&split.join("image_02"))
}

fn odometry_folder(path: &Path, sequence: Option<&str>) -> Result<PathBuf, InputError> {
    if let Some(root) = odometry_root(path) {
        return Ok(root.join(chosen(path, sequence, &sequences(&root)?)?));
    }
    if let Some(wanted) = sequence
        .filter(|wanted| path.file_name().is_none_or(|name| name.to_string_lossy() != **wanted))
    {
        let known = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        return Err(InputError::Sequence {
            sequence: wanted.to_owned(),
            root: path.to_path_buf(),
            known: format!("only {known}"),
        });
    }
    Ok(path.to_path_buf())
}

/// `poses/NN.txt` beside `sequences`, or `poses.txt` within the sequence.
fn odometry_poses(folder: &Path, number: &str) -> Option<PathBuf> {
    let beside =
        folder.parent()?.parent().map(|root| root.join("poses").join(format!("{number}.txt")));
    beside.into_iter().chain([folder.join("poses.txt")]).find(|path| path.is_file())
}

/// The sequence that is asked for, or the only one.
pub fn chosen(root: &Path, wanted: Option<&str>, names: &[String]) -> Result<String, InputError> {
    let known = names.join(", ");
    match (wanted, names) {
        (Some(wanted), _) if names.iter().any(|name| name == wanted) => Ok(wanted.to_owned()),
        (Some(wanted), _) => {
            let known = if known.is_empty() { "none".to_owned() } else { known };
            Err(InputError::Sequence {
                sequence: wanted.to_owned(),
                root: root.to_path_buf(),
                known,
            })
        }
        (None, [only]) => Ok(only.clone()),
        (None, []) => Err(InputError::Layout { path: root.to_path_buf(), below: Vec::new() }),
        (None, _) => Err(InputError::Choice { root: root.to_path_buf(), known }),
    }
}
