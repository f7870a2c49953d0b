//! Spring: `NNNN/frame_left` and `frame_right`, `cam_data/intrinsics.txt`. A scene is one
//! recording.

use super::kitti::{chosen, sequences};
use super::sequence::{ImageFiles, Parts, Sequence, present};
use super::trees::first_row;
use crate::formats::FormatError;
use crate::input::data_set::{DataSet, Layout, OpenOptions};
use crate::input::source::InputError;
use dynvox_core::geometry::StereoRig;
use std::path::Path;

/// Distance of the cameras, m, as the data set's page has it.
const BASELINE_M: f64 = 0.065;
const INTRINSICS: &str = "cam_data/intrinsics.txt";

/// Spring.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "spring",
    summary: "Spring: `NNNN/frame_left`, `frame_right`, `cam_data/intrinsics.txt`",
    describe: |_| "Spring: rendered scenes".to_owned(),
    matches: |path| is_scene(path) || !names(path).is_empty(),
    sequences: |path| Ok(if is_scene(path) { Vec::new() } else { names(path) }),
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

fn is_scene(path: &Path) -> bool {
    path.join("frame_left").is_dir() && path.join("cam_data").is_dir()
}

fn names(path: &Path) -> Vec<String> {
    let below = sequences(path).unwrap_or_default();
    below.into_iter().filter(|name| is_scene(&path.join(name))).collect()
}

/// Opens a scene.
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let folder = if is_scene(path) {
        path.to_path_buf()
    } else {
        path.join(chosen(path, options.sequence.as_deref(), &names(path))?)
    };
    let action = "Fetch the right images of the data set: a stereo mapper needs both cameras";
    let right = present(folder.join("frame_right"), action)?;
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let images = ImageFiles::in_folders(&folder.join("frame_left"), &right)?;
    let cameras = options.cameras_or(|| rig(&folder.join(INTRINSICS)))?;
    Sequence::from_parts(Parts {
        notes: vec![format!("baseline {BASELINE_M} m, as the data set's page has it")],
        instances: folder.join("instances"),
        ..Parts::new(options, format!("spring-{name}"), images, cameras)
    })
}

/// The cameras of a row `fx fy cx cy`.
fn rig(path: &Path) -> Result<StereoRig, FormatError> {
    let [focal_px, _, center_u_px, center_v_px] = first_row(path, "Fetch the scene's cam_data")?;
    Ok(StereoRig { focal_px, center_u_px, center_v_px, baseline_m: BASELINE_M })
}
