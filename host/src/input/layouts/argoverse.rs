//! Argoverse 2: `sensors/cameras/stereo_front_left` and `stereo_front_right` of a log, images named
//! by their times in ns. Its calibration is in Feather files, which one command turns into
//! OpenCV's. The images come undistorted: the files' coefficients are those of the lenses before.

use super::camera_folders::camera_in;
use super::kitti::{chosen, sequences};
use super::sequence::{ImageFiles, Parts, Sequence, present};
use crate::formats::calibration::beside;
use crate::input::data_set::{DataSet, Layout, OpenOptions};
use crate::input::source::InputError;
use std::path::{Path, PathBuf};

/// Folders of the images in a log.
const SIDES: [&str; 2] =
    ["sensors/cameras/stereo_front_left", "sensors/cameras/stereo_front_right"];
/// Command that writes `calibration/stereo.json` of a log; it runs in the folder of the log.
const CONVERT: &str = r#"python3 -c "
import json, numpy, pandas
k, e = [pandas.read_feather(f'calibration/{name}.feather').set_index('sensor_name')
        for name in ('intrinsics', 'egovehicle_SE3_sensor')]
def camera(side):
    k1, e1 = k.loc['stereo_front_' + side], e.loc['stereo_front_' + side]
    w, v = e1.qw, numpy.array([e1.qx, e1.qy, e1.qz])
    turn = (w * w - v @ v) * numpy.eye(3) + 2 * numpy.outer(v, v)
    turn += 2 * w * numpy.cross(numpy.eye(3), v)
    matrix = [[k1.fx_px, 0, k1.cx_px], [0, k1.fy_px, k1.cy_px], [0, 0, 1]]
    return k1, matrix, turn, numpy.array([e1.tx_m, e1.ty_m, e1.tz_m])
(k1, m1, r1, t1), (_, m2, r2, t2) = camera('left'), camera('right')
rig = dict(image_width=int(k1.width_px), image_height=int(k1.height_px), M1=m1, D1=[0] * 5,
           M2=m2, D2=[0] * 5, R=(r2.T @ r1).tolist(), T=(r2.T @ (t1 - t2)).tolist())
json.dump(rig, open('calibration/stereo.json', 'w'), default=float)
""#;

/// Argoverse 2.
pub const DATA_SET: Layout = Layout::new(&DataSet {
    name: "argoverse",
    summary: "Argoverse 2: `sensors/cameras/stereo_front_left` and `stereo_front_right` of a log",
    describe: |_| "Argoverse 2: the stereo cameras of each log".to_owned(),
    matches: |path| is_log(path) || !names(path).is_empty(),
    sequences: |path| Ok(if is_log(path) { Vec::new() } else { names(path) }),
    open: |path, options| Ok(Box::new(open(path, options)?)),
});

fn is_log(path: &Path) -> bool {
    path.join(SIDES[0]).is_dir()
}

fn names(path: &Path) -> Vec<String> {
    let below = sequences(path).unwrap_or_default();
    below.into_iter().filter(|name| is_log(&path.join(name))).collect()
}

/// Opens a log.
fn open(path: &Path, options: &OpenOptions) -> Result<Sequence, InputError> {
    let folder = if is_log(path) {
        path.to_path_buf()
    } else {
        path.join(chosen(path, options.sequence.as_deref(), &names(path))?)
    };
    let action = "Fetch the images of the right stereo camera: a stereo mapper needs both cameras";
    let name = folder.canonicalize().unwrap_or_else(|_| folder.clone());
    let name = name.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let images =
        [camera_in(&folder.join(SIDES[0]))?, camera_in(&present(folder.join(SIDES[1]), action)?)?];
    let files: Vec<PathBuf> = if options.calibration.is_empty() {
        beside(&folder).ok_or_else(|| InputError::Part {
            path: folder.join("calibration/stereo.json"),
            action: format!(
                "Write it from the log's Feather files: in {} type (after `pip install pandas \
                 pyarrow`)\n{CONVERT}",
                folder.display()
            ),
        })?
    } else {
        options.calibration.clone()
    };
    let cameras = options.cameras_of(&files)?;
    Sequence::from_parts(Parts {
        instances: folder.join("instances"),
        ..Parts::new(options, format!("argoverse-{name}"), ImageFiles::Cameras(images), cameras)
    })
}
