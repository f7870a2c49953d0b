//! A plain stereo folder: `left/*.png`, `right/*.png` (same names), `calib.txt`, and if known `times.txt` and `poses.txt`.

use super::kitti::present;
use super::sequence::{Parts, Sequence};
use crate::formats::{calibration, read_poses, read_times};
use crate::input::source::InputError;
use std::path::Path;

/// Opens the folder. `calib.txt` holds KITTI's `P0:` and `P1:` or `key value` lines (see [`calibration::read_rig`]).
pub fn open(path: &Path) -> Result<Sequence, InputError> {
    let action =
        "A stereo folder has left/, right/ with the same file names, and calib.txt with focal_px, center_u_px, center_v_px, baseline_m";
    let optional = |name: &str| Some(path.join(name)).filter(|file| file.is_file());
    Sequence::from_parts(Parts {
        name: path.canonicalize().ok().and_then(|full| Some(full.file_name()?.to_string_lossy().into_owned())).unwrap_or("folder".into()),
        left: present(path.join("left"), action)?,
        right: present(path.join("right"), action)?,
        rig: calibration::read_rig(&present(path.join("calib.txt"), action)?)?,
        times: optional("times.txt").map(|file| read_times(&file).map(|times| (file, times))).transpose()?,
        poses: optional("poses.txt").map(|file| read_poses(&file).map(|read| (file, read.poses))).transpose()?,
        numbered: false,
        notes: Vec::new(),
        instances: path.join("instances"),
        objects: Vec::new(),
        lidar: None,
    })
}

/// Whether the folder has this layout.
pub fn is_stereo_folder(path: &Path) -> bool {
    path.join("left").is_dir() || path.join("right").is_dir()
}
