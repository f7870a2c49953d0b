//! ROS `CameraInfo` as `camera_calibration` writes it: one YAML file a camera, with the
//! rectification and its projection.

use super::check::VERTICAL;
use super::files::Files;
use super::format::{CalibrationFormat, Cameras};
use super::{Placement, RectifiedCameras, StereoCalibration, euroc, lens, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{LensModel, RawCamera};
use nalgebra::{Matrix3, Vector3};

/// ROS's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "ROS CameraInfo",
    files: "`CameraInfo` of `camera_calibration` and RTAB-Map, one YAML file for each camera",
    unit: LengthUnit::METRE,
    matches: |files| files.has("projection_matrix") || files.has("rectification_matrix"),
    read: |files| read(files).map(Into::into),
    example: &[
        (
            "left.yaml",
            r"image_width: 752
image_height: 480
camera_matrix:
  data: [458.6, 0, 367.2, 0, 457.2, 248.3, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  data: [-0.28, 0.07, 0.0002, 0.00002, 0]
rectification_matrix:
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  data: [400, 0, 370, 0, 0, 400, 250, 0, 0, 0, 1, 0]
",
        ),
        (
            "right.yaml",
            r"image_width: 752
image_height: 480
camera_matrix:
  data: [458.6, 0, 367.2, 0, 457.2, 248.3, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  data: [-0.28, 0.07, 0.0002, 0.00002, 0]
rectification_matrix:
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  data: [400, 0, 370, -44, 0, 400, 250, 0, 0, 0, 1, 0]
",
        ),
    ],
};

/// Reads the left and the right camera's file.
fn read(files: &Files<'_>) -> Result<StereoCalibration, FormatError> {
    let [left, right] = sides(files)?;
    let rotation = |node: Node<'_>| {
        Ok::<_, FormatError>(Matrix3::from_row_slice(
            &node.need("rectification_matrix")?.array::<9>()?,
        ))
    };
    let (r_rectified_left, r_rectified_right) = (rotation(left)?, rotation(right)?);
    let placement = match below_m(files, left, right)? {
        Some(below_m) => {
            let back = r_rectified_right.transpose();
            Placement::Vertical {
                r_right_left: back * r_rectified_left,
                t_right_left_m: back * Vector3::new(0.0, -below_m, 0.0),
            }
        }
        None => Placement::Rectified {
            r_rectified_left,
            r_rectified_right,
            rig: rig_of(left, right)?.rig,
            size: size(left)?,
        },
    };
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement,
        format: FORMAT.name,
    })
}

/// Distance by which the second camera stands below the first, m, if a person says that they stand
/// so; `None` if they stand side by side.
fn below_m(files: &Files<'_>, left: Node<'_>, right: Node<'_>) -> Result<Option<f64>, FormatError> {
    let p_left = left.need("projection_matrix")?.array::<12>()?;
    let at = right.need("projection_matrix")?;
    let p_right = at.array::<12>()?;
    let [along, below] = apart(&p_left, &p_right);
    if below.abs() <= along.abs() {
        return Ok(None);
    }
    if files.are_vertical() {
        return Ok(Some(below / p_left[5]));
    }
    let position = if below > 0.0 { "below" } else { "above" };
    Err(at.refuse(&format!("the second camera stands {position} the first"), VERTICAL))
}

/// Rectified cameras one above the other: their images are turned as raw ones are.
fn vertical(
    left: Node<'_>,
    right: Node<'_>,
    below_m: f64,
) -> Result<StereoCalibration, FormatError> {
    let camera = |node: Node<'_>| {
        let at = node.need("projection_matrix")?;
        let [fx, _, cx, _, _, fy, cy, ..] = at.array::<12>()?;
        lens::camera(at, [fx, fy, cx, cy], LensModel::IDEAL, size(node)?)
    };
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: Placement::Vertical {
            r_right_left: Matrix3::identity(),
            t_right_left_m: Vector3::new(0.0, -below_m, 0.0),
        },
        format: FORMAT.name,
    })
}

/// Reads two files of rectified images: the projection matrices say all. Principal points that
/// differ are a question: recorders rectify with zero disparity at infinity.
pub fn read_rectified(files: &Files<'_>) -> Result<Cameras, FormatError> {
    let [left, right] = sides(files)?;
    if let Some(below_m) = below_m(files, left, right)? {
        return vertical(left, right, below_m).map(Cameras::Raw);
    }
    let cameras = rig_of(left, right)?;
    if cameras.offset_px != 0.0 {
        let line = |node: Node<'_>| -> Result<String, FormatError> {
            let numbers = node.need("projection_matrix")?.array::<12>()?;
            Ok(numbers.map(|number| number.to_string()).join(" "))
        };
        return Err(right.refuse(
            &format!(
                "the principal points of the two projection matrices are {:.3} px apart, where \
                 rectified images have one",
                cameras.offset_px
            ),
            &format!(
                "Correct the CameraInfo; if the images are rectified so, give --calibration with a \
                 calib.txt of the two lines `P0: {}` and `P1: {}`, which takes the difference out",
                line(left)?,
                line(right)?
            ),
        ));
    }
    Ok(Cameras::Rectified(RectifiedCameras { size: Some(size(left)?), ..cameras }))
}

fn size(node: Node<'_>) -> Result<[u32; 2], FormatError> {
    Ok([node.need("image_width")?.pixels()?, node.need("image_height")?.pixels()?])
}

/// The left and the right camera's file, in any order: the right one's projection has the baseline.
fn sides<'f>(files: &'f Files<'_>) -> Result<[Node<'f>; 2], FormatError> {
    let roots: Vec<Node<'f>> =
        files.roots().into_iter().filter(|root| root.has("projection_matrix")).collect();
    let [first, second] = *roots.as_slice() else {
        return Err(euroc::two_files(&files.roots(), "CameraInfo file"));
    };
    let along = |node: Node<'_>| -> Result<f64, FormatError> {
        Ok(node.need("projection_matrix")?.array::<12>()?[3])
    };
    if along(first)? < 0.0 && along(second)? == 0.0 {
        files.guess("the right camera's file comes first: exchanged".to_owned());
        return Ok([second, first]);
    }
    Ok([first, second])
}

/// The rectified cameras of two projection matrices.
fn rig_of(left: Node<'_>, right: Node<'_>) -> Result<RectifiedCameras, FormatError> {
    let p_left = left.need("projection_matrix")?.array()?;
    let p_right = right.need("projection_matrix")?;
    rectified_rig(p_right, &p_left, &p_right.array()?)
}

/// Distances of the second of two projections' cameras from the first to the right and down, times
/// the focal length.
fn apart(p_left: &[f64; 12], p_right: &[f64; 12]) -> [f64; 2] {
    let down = |p: &[f64; 12]| p[7] - p[6] * p[11];
    [p_left[3] - p_right[3], down(p_left) - down(p_right)]
}

/// The cameras of two projection matrices with one focal length and height of the centre.
pub fn rectified_rig(
    at: Node<'_>,
    p_left: &[f64; 12],
    p_right: &[f64; 12],
) -> Result<RectifiedCameras, FormatError> {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-3 * (1.0 + a.abs());
    let [along, below] = apart(p_left, p_right);
    if below.abs() > along.abs() {
        let reason = format!(
            "the second camera stands {} the first",
            if below > 0.0 { "below" } else { "above" }
        );
        return Err(at.refuse(
            &reason,
            "Give lenses, rotation and translation in another of the formats, and --vertical",
        ));
    }
    let square = near(p_left[0], p_left[5]);
    if !square || ![0, 5, 6].iter().all(|&entry| near(p_left[entry], p_right[entry])) {
        let reason = "the two projection matrices differ in focal length or in the height of the \
                      principal point";
        return Err(at.refuse(
            reason,
            "Rectify both images alike, or give rotation and translation instead",
        ));
    }
    let rig = StereoRig {
        focal_px: p_left[0],
        center_u_px: p_left[2],
        center_v_px: p_left[6],
        baseline_m: along / p_left[0],
    };
    let offset_px = p_right[2] - p_left[2];
    let offset_px = if near(p_left[2], p_right[2]) { 0.0 } else { offset_px };
    Ok(RectifiedCameras { rig, offset_px, size: None })
}

fn camera(node: Node<'_>) -> Result<RawCamera, FormatError> {
    let [fx, _, cx, _, fy, cy, ..] = node.need("camera_matrix")?.array::<9>()?;
    let name = node.get("distortion_model").map_or(Ok("plumb_bob"), |node| node.text())?;
    let coefficients = node.need("distortion_coefficients")?.numbers()?;
    let model = lens::distortion(node, name, &coefficients)?;
    lens::camera(node.need("camera_matrix")?, [fx, fy, cx, cy], model, size(node)?)
}
