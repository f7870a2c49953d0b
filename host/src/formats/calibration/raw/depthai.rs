//! DepthAI (OAK cameras), lengths in centimetres: the device's own calibration with `cameraData`,
//! and the table of `left_intrinsics`, `rotation_left_to_right`, ... that its scripts write.

use super::files::Files;
use super::format::CalibrationFormat;
use super::{StereoCalibration, lens, pose::Pose, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::RawCamera;
use nalgebra::{Matrix3, Vector3};

/// DepthAI's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "DepthAI",
    files: "calibration of an OAK camera as JSON, lengths in cm: `cameraData`, or \
            `left_intrinsics` and `translation_left_to_right`",
    unit: LengthUnit::CENTIMETRE,
    matches: |files| files.has("cameraData") || files.has("translation_left_to_right"),
    read: |files| read(files).map(Into::into),
    example: &[(
        "calib.json",
        r#"{
  "width": 752, "height": 480,
  "left_intrinsics": [[458.6, 0, 367.2], [0, 457.2, 248.3], [0, 0, 1]],
  "right_intrinsics": [[458.6, 0, 367.2], [0, 457.2, 248.3], [0, 0, 1]],
  "rotation_left_to_right": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  "translation_left_to_right": [[-11], [0], [0]],
  "distortion_left": [-0.28, 0.07, 0.0002, 0.00002, 0],
  "distortion_right": [-0.28, 0.07, 0.0002, 0.00002, 0]
}
"#,
    )],
};

/// Sockets of the left and the right camera.
const SOCKETS: [f64; 2] = [1.0, 2.0];

fn read(files: &Files<'_>) -> Result<StereoCalibration, FormatError> {
    let root = files.root()?;
    match root.get("cameraData") {
        Some(cameras) => of_device(root, cameras),
        None => of_script(files, root),
    }
}

/// The table that DepthAI's scripts write.
fn of_script(files: &Files<'_>, root: Node<'_>) -> Result<StereoCalibration, FormatError> {
    let size = match root.get("width").zip(root.get("height")) {
        Some((width, height)) => [width.pixels()?, height.pixels()?],
        None => files.image_size(root)?,
    };
    let camera = |matrix: &str, distortion: &str| {
        let (matrix, distortion) = (root.need(matrix)?, root.need(distortion)?);
        perspective(matrix, &distortion.numbers()?, size)
    };
    let motion = Pose::from_parts(
        root.need("rotation_left_to_right")?,
        root.need("translation_left_to_right")?,
    )?;
    Ok(StereoCalibration {
        left: camera("left_intrinsics", "distortion_left")?,
        right: camera("right_intrinsics", "distortion_right")?,
        placement: motion.placement(),
        format: FORMAT.name,
    })
}

fn perspective(
    matrix: Node<'_>,
    distortion: &[f64],
    size: [u32; 2],
) -> Result<RawCamera, FormatError> {
    let [fx, _, cx, _, fy, cy, ..] = matrix.array::<9>()?;
    let model = lens::radial_tangential(matrix, distortion)?;
    lens::camera(matrix, [fx, fy, cx, cy], model, size)
}

/// The calibration that a device holds: `cameraData` is a list of sockets and cameras.
fn of_device(root: Node<'_>, cameras: Node<'_>) -> Result<StereoCalibration, FormatError> {
    let mut found = [None, None];
    for entry in cameras.elements() {
        let mut parts = entry.elements();
        let (Some(socket), Some(camera)) = (parts.next(), parts.next()) else { continue };
        let socket = socket.number()?;
        for (slot, wanted) in found.iter_mut().zip(SOCKETS) {
            if socket == wanted {
                *slot = Some(camera);
            }
        }
    }
    let [Some(left), Some(right)] = found else {
        return Err(root.refuse(
            "cameraData has no cameras on the sockets 1 (left) and 2 (right)",
            "Give the calibration of a stereo camera",
        ));
    };
    let placement = match (motion_to(left, SOCKETS[1])?, motion_to(right, SOCKETS[0])?) {
        (Some(motion), _) => motion.placement(),
        (None, Some(back)) => back.inverse().placement(),
        (None, None) => {
            return Err(root.refuse(
                "neither camera has extrinsics to the other one",
                "Calibrate the pair again with DepthAI",
            ));
        }
    };
    Ok(StereoCalibration {
        left: of_socket(left)?,
        right: of_socket(right)?,
        placement,
        format: FORMAT.name,
    })
}

/// Motion of a camera's coordinates to those of another socket, if the file has it.
fn motion_to(camera: Node<'_>, socket: f64) -> Result<Option<Pose>, FormatError> {
    let Some(extrinsics) = camera.get("extrinsics") else { return Ok(None) };
    let to = extrinsics.any(&["toCameraSocket", "toCameraId"]);
    if to.map_or(Ok(-1.0), |to| to.number())? != socket {
        return Ok(None);
    }
    let translation = extrinsics.need("translation")?;
    let rotation = extrinsics.need("rotationMatrix")?.array::<9>()?;
    Ok(Some(Pose {
        r: Matrix3::from_row_slice(&rotation),
        t_m: Vector3::new(
            translation.value_of("x")?,
            translation.value_of("y")?,
            translation.value_of("z")?,
        ),
    }))
}

fn of_socket(camera: Node<'_>) -> Result<RawCamera, FormatError> {
    let matrix = camera.need("intrinsicMatrix")?;
    let size = [camera.need("width")?.pixels()?, camera.need("height")?.pixels()?];
    let distortion = camera.need("distortionCoeff")?.numbers()?;
    let fisheye = camera.get("cameraType").is_some_and(|kind| {
        kind.number().is_ok_and(|kind| kind == 1.0)
            || kind.text().is_ok_and(|kind| kind == "Fisheye")
    });
    if fisheye {
        let [fx, _, cx, _, fy, cy, ..] = matrix.array::<9>()?;
        let four = distortion.get(..4).unwrap_or(&distortion);
        return lens::camera(matrix, [fx, fy, cx, cy], lens::equidistant(matrix, four)?, size);
    }
    perspective(matrix, &distortion, size)
}
