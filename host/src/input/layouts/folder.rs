//! Any two folders of images, one folder with prefixes or suffixes, or images that hold both
//! cameras; beside them `calib.txt`, and if known `times.txt` and `poses.txt`.

use super::camera_folders::{camera_in, side_folders, split_by_mark};
use super::names::pictures_in;
use super::pairing::CameraFiles;
use super::sequence::{ImageFiles, Parts, Sequence, camera_files, present, stamps_in_names};
use super::units;
use crate::formats::calibration::{CameraGeometry, beside};
use crate::formats::{picture_size, read_poses, read_times};
use crate::input::data_set::{DataSet, Layout, OpenOptions, no_sequences};
use crate::input::source::{InputError, Stacking};
use std::path::{Path, PathBuf};

/// Any folder of stereo pairs.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "folder",
    summary: "Two folders of images, one with prefixes or suffixes, or images that hold both \
              cameras; and `calib.txt`",
    describe,
    matches: is_stereo_folder,
    sequences: no_sequences,
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

/// Opens the folder. `calib.txt` holds KITTI's `P0:` and `P1:` or `key value` lines (see
/// [`CameraGeometry::read`]); without it a calibration of raw images is looked for ([`beside`]).
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let action = "A stereo folder has the images of both cameras (left/ and right/, cam0/ and \
        cam1/, one folder with left_ and right_ before the \
                  names, or both images in one file), and calib.txt with focal_px, center_u_px, \
                  center_v_px, baseline_m";
    let file = |name: &str| Some(path.join(name)).filter(|file| file.is_file());
    let cameras = match (options.calibration.as_slice(), file("calib.txt")) {
        ([], Some(own)) => options.cameras_of(&[own])?,
        ([], None) => match beside(path) {
            Some(own) => options.cameras_of(&own)?,
            None => options.cameras_of(&[present(path.join("calib.txt"), action)?])?,
        },
        (given, _) => options.cameras_of(given)?,
    };
    let images = images(path, action, options.stacking, &cameras)?;
    Sequence::from_parts(Parts {
        times: file("times.txt")
            .map(|file| read_times(&file).map(|times| (file, times)))
            .transpose()?,
        poses: file("poses.txt")
            .map(|file| read_poses(&file).map(|read| (file, read)))
            .transpose()?,
        instances: path.join("instances"),
        unit: units::beside_images(path),
        ..Parts::new(options, name_of(path), images, cameras)
    })
}

/// The name of a folder, also where `path` is relative.
pub fn name_of(path: &Path) -> String {
    path.canonicalize()
        .ok()
        .and_then(|full| Some(full.file_name()?.to_string_lossy().into_owned()))
        .unwrap_or("folder".into())
}

/// Returns true if the folder has this layout.
fn is_stereo_folder(path: &Path) -> bool {
    side_folders(path).is_some() || (path.join("calib.txt").is_file() && pictures_in(path).is_ok())
}

/// Returns true if the folder has pictures.
pub fn holds_pictures(path: &Path) -> bool {
    pictures_in(path).is_ok_and(|files| !files.is_empty())
}

/// Describes the layout of the images, as `inspect` prints it.
pub(super) fn describe(path: &Path) -> String {
    let name =
        |folder: &PathBuf| folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match side_folders(path) {
        Some([left, right]) => format!("two folders, {} and {}", name(&left), name(&right)),
        None if pictures_in(path).is_ok_and(|files| split_by_mark(&files).is_some()) => {
            "one folder, the camera in the files' names".to_owned()
        }
        None => "one folder, both images in one file".to_owned(),
    }
}

fn images(
    path: &Path,
    action: &str,
    stacking: Option<Stacking>,
    cameras: &CameraGeometry,
) -> Result<ImageFiles, InputError> {
    if let Some([left, right]) = side_folders(path) {
        return Ok(ImageFiles::Cameras([
            camera_in(&present(left, action)?)?,
            camera_in(&present(right, action)?)?,
        ]));
    }
    let files = pictures_in(path)?;
    if stacking.is_none()
        && let Some(sides) = split_by_mark(&files)
    {
        return Ok(ImageFiles::Cameras(
            sides.map(|files| CameraFiles { stamps_ns: stamps_in_names(&files), files }),
        ));
    }
    let stacking = match (stacking, files.first()) {
        (Some(stacking), _) => Some(stacking),
        (None, Some(first)) => {
            told_stacking(picture_size(first).map_err(InputError::image)?, cameras)
        }
        (None, None) => None,
    };
    let stacking = stacking.ok_or_else(|| InputError::OneCamera { path: path.to_path_buf() })?;
    Ok(ImageFiles::Stacked(camera_files(path)?, stacking))
}

/// Two images lie in one where the calibration is for a half, and not for the whole.
fn told_stacking(size: (usize, usize), cameras: &CameraGeometry) -> Option<Stacking> {
    let both = [Stacking::SideBySide, Stacking::TopBottom];
    both.into_iter()
        .find(|stacking| cameras.suits(stacking.size_of_one(size)) && !cameras.suits(size))
}
