//! Virtual KITTI 2: `SceneNN/VARIATION/frames/rgb/Camera_0` and `Camera_1`, `intrinsic.txt` and
//! `extrinsic.txt`. A scene in one light and weather is one recording.

use super::kitti::{chosen, sequences};
use super::sequence::{ImageFiles, Parts, Sequence, present};
use super::trees::{first_row, rows};
use crate::formats::{FormatError, Trajectory};
use crate::input::data_set::{DataSet, Layout, OpenOptions};
use crate::input::source::InputError;
use dynvox_core::geometry::{StereoRig, Transform};
use std::path::Path;

/// Folders of the images, below that of a variation.
const IMAGES: [&str; 2] = ["frames/rgb/Camera_0", "frames/rgb/Camera_1"];
/// Distance of the cameras, m, as the data set's page has it.
const BASELINE_M: f64 = 0.532_725;

/// Virtual KITTI 2.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "vkitti",
    summary: "Virtual KITTI 2: `SceneNN/VARIATION/frames/rgb/Camera_0` and `Camera_1`, \
              `intrinsic.txt`",
    describe: |_| "Virtual KITTI 2: rendered drives in several lights and weathers".to_owned(),
    matches: |path| is_recording(path) || !names(path).is_empty(),
    sequences: |path| Ok(if is_recording(path) { Vec::new() } else { names(path) }),
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

fn is_recording(path: &Path) -> bool {
    path.join(IMAGES[0]).is_dir()
}

/// Recordings below a folder: `clone`, or `Scene01/clone`.
fn names(path: &Path) -> Vec<String> {
    let below = |folder: &Path| sequences(folder).unwrap_or_default();
    let mut names = Vec::new();
    for name in below(path) {
        if is_recording(&path.join(&name)) {
            names.push(name);
        } else if name.starts_with("Scene") {
            let inner = below(&path.join(&name)).into_iter();
            let inner = inner.map(|variation| format!("{name}/{variation}"));
            names.extend(inner.filter(|name| is_recording(&path.join(name))));
        }
    }
    names
}

/// Opens a recording, named `Scene01/clone` from the root.
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let folder = if is_recording(path) {
        path.to_path_buf()
    } else {
        path.join(chosen(path, options.sequence.as_deref(), &names(path))?)
    };
    let action = "Fetch the right camera's images of the data set: a stereo mapper needs both";
    let [left, right] = IMAGES.map(|side| folder.join(side));
    let poses = folder.join("extrinsic.txt");
    let poses = match poses.is_file() {
        true => Some((poses.clone(), truth(&poses)?)),
        false => None,
    };
    let mut words: Vec<String> =
        folder.iter().rev().take(2).map(|word| word.to_string_lossy().into_owned()).collect();
    words.reverse();
    let images = ImageFiles::in_folders(&left, &present(right, action)?)?;
    let cameras = options.cameras_or(|| rig(&folder.join("intrinsic.txt")))?;
    Sequence::from_parts(Parts {
        poses,
        notes: vec![format!("baseline {BASELINE_M} m, as the data set's page has it")],
        instances: folder.join("instances"),
        ..Parts::new(options, format!("vkitti-{}", words.join("-")), images, cameras)
    })
}

/// The cameras of a row `frame camera fx fy cx cy`.
fn rig(path: &Path) -> Result<StereoRig, FormatError> {
    let [_, _, focal_px, _, center_u_px, center_v_px] =
        first_row(path, "Fetch vkitti_2.0.3_textgt, which has it")?;
    Ok(StereoRig { focal_px, center_u_px, center_v_px, baseline_m: BASELINE_M })
}

/// Poses of the left camera, by rows of `t_camera_world`.
fn truth(path: &Path) -> Result<Trajectory, FormatError> {
    let refuse = |reason: &str| FormatError::content(path, reason, "Fetch it anew");
    let (mut numbers, mut poses) = (Vec::new(), Vec::new());
    for row in rows(path)? {
        let [frame, camera, matrix @ ..] = row.as_slice() else { continue };
        let &[r00, r01, r02, x, r10, r11, r12, y, r20, r21, r22, z, ..] = matrix else {
            return Err(refuse("a row has fewer numbers than a frame, a camera and a pose"));
        };
        if *camera != 0.0 || *frame < 0.0 {
            continue;
        }
        let rotation = [[r00, r01, r02], [r10, r11, r12], [r20, r21, r22]];
        let t_camera_world = Transform::from_rotation_matrix(&rotation, [x, y, z]);
        if !t_camera_world.is_rotation() {
            return Err(refuse("a pose has a matrix that is no rotation"));
        }
        numbers.push(*frame as usize);
        poses.push(t_camera_world.normalized().inverse());
    }
    if numbers.is_empty() || !numbers.is_sorted_by(|a, b| a < b) {
        return Err(refuse("it has no poses of camera 0 in the order of its frames"));
    }
    Ok(Trajectory { numbers: Some(numbers), poses, ..Trajectory::default() })
}
