//! OpenCV's files, YAML or XML: both cameras and `R`, `T` under the short names of its stereo
//! sample (`M1 D1 M2 D2`, in one file or with `R T` in a second), the long ones
//! (`cameraMatrix1 distCoeffs1 ...`), or a file a camera (`cameraMatrix distCoeffs`, also
//! `camera_matrix distortion_coefficients`) with `R` and `T` in one of them.

use super::format::CalibrationFormat;
use super::{Placement, StereoCalibration, lens, tree::Node};
use crate::formats::FormatError;
use dynvox_core::rectify::RawCamera;
use nalgebra::{Matrix3, Vector3};

/// OpenCV's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "OpenCV",
    files: "YAML or XML: `M1 D1 M2 D2 R T`, `cameraMatrix1 distCoeffs1 ...`, or one file for each \
            camera",
    matches: |files| is_one(&files.roots()),
    read: |files| read(&files.roots(), files.image_size, files.root()?),
    example: &[(
        "stereo.yml",
        r"%YAML:1.0
---
image_width: 752
image_height: 480
M1: !!opencv-matrix
   data: [ 458.6, 0., 367.2, 0., 457.2, 248.3, 0., 0., 1. ]
D1: !!opencv-matrix
   data: [ -0.28, 0.07, 0.0002, 0.00002, 0. ]
M2: !!opencv-matrix
   data: [ 458.6, 0., 367.2, 0., 457.2, 248.3, 0., 0., 1. ]
D2: !!opencv-matrix
   data: [ -0.28, 0.07, 0.0002, 0.00002, 0. ]
R: !!opencv-matrix
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: !!opencv-matrix
   data: [ -0.11, 0., 0. ]
",
    )],
};

/// Names of camera matrix and distortion in files that hold both cameras.
const PAIRS: [[[&str; 2]; 2]; 6] = [
    [["M1", "D1"], ["M2", "D2"]],
    [["K1", "D1"], ["K2", "D2"]],
    [["cameraMatrix1", "distCoeffs1"], ["cameraMatrix2", "distCoeffs2"]],
    [["cameraMatrixL", "distCoeffsL"], ["cameraMatrixR", "distCoeffsR"]],
    [
        ["camera_matrix_1", "distortion_coefficients_1"],
        ["camera_matrix_2", "distortion_coefficients_2"],
    ],
    [
        ["left_camera_matrix", "left_distortion_coefficients"],
        ["right_camera_matrix", "right_distortion_coefficients"],
    ],
];
/// Keys in files of one camera.
const SINGLE: [[&str; 2]; 3] = [
    ["cameraMatrix", "distCoeffs"],
    ["camera_matrix", "distortion_coefficients"],
    ["Camera_Matrix", "Distortion_Coefficients"],
];

/// Returns true if the files look like this format.
fn is_one(roots: &[Node<'_>]) -> bool {
    let matrices = PAIRS.iter().flatten().chain(&SINGLE).map(|[matrix, _]| *matrix);
    matrices.clone().any(|key| roots.iter().any(|root| root.get(key).is_some()))
}

/// Reads the pair.
fn read(
    roots: &[Node<'_>],
    image_size: Option<[u32; 2]>,
    first: Node<'_>,
) -> Result<StereoCalibration, FormatError> {
    let find = |key: &'static str| roots.iter().find_map(|root| root.get(key));
    let needed = |keys: &[&'static str]| {
        keys.iter().find_map(|key| find(key)).ok_or_else(|| {
            first.refuse(
                &format!("{} is missing", keys.join(" or ")),
                "Give the file that holds it as a second --calibration",
            )
        })
    };
    let r_right_left =
        Matrix3::from_row_slice(&needed(&["R", "rotation", "Rotation"])?.array::<9>()?);
    let t_right_left_m = Vector3::from(needed(&["T", "translation", "Translation"])?.array::<3>()?);
    let size = size(roots, image_size, first)?;
    let cameras = if let Some([[m1, d1], [m2, d2]]) =
        PAIRS.iter().find(|[[matrix, _], _]| find(matrix).is_some())
    {
        [
            camera(needed(&[m1])?, needed(&[d1])?, roots, size)?,
            camera(needed(&[m2])?, needed(&[d2])?, roots, size)?,
        ]
    } else {
        let singles: Vec<_> = roots.iter().filter_map(single).collect();
        let [(m1, Some(d1)), (m2, Some(d2))] = *singles.as_slice() else {
            return Err(super::euroc::two_files(roots, "camera file"));
        };
        [camera(m1, d1, roots, size)?, camera(m2, d2, roots, size)?]
    };
    let [left, right] = cameras;
    Ok(StereoCalibration {
        left,
        right,
        placement: Placement::Motion { r_right_left, t_right_left_m },
        format: FORMAT.name,
    })
}

/// Camera matrix and distortion of a file of one camera.
fn single<'t>(root: &Node<'t>) -> Option<(Node<'t>, Option<Node<'t>>)> {
    let [matrix, distortion] = SINGLE.iter().find(|[matrix, _]| root.get(matrix).is_some())?;
    Some((root.get(matrix)?, root.get(distortion)))
}

fn size(
    roots: &[Node<'_>],
    image_size: Option<[u32; 2]>,
    first: Node<'_>,
) -> Result<[u32; 2], FormatError> {
    let find = |key: &'static str| roots.iter().find_map(|root| root.get(key));
    let sides =
        [["image_width", "image_height"], ["imageWidth", "imageHeight"], ["width", "height"]];
    if let Some((width, height)) =
        sides.iter().find_map(|[width, height]| Some((find(width)?, find(height)?)))
    {
        return Ok([width.pixels()?, height.pixels()?]);
    }
    if let Some(list) =
        ["image_size", "imageSize", "size", "image_Size"].iter().find_map(|key| find(key))
    {
        return list.size();
    }
    let action = "Add image_width and image_height, or give the calibration together with the \
                  images: --calibration FILE PATH";
    image_size.ok_or_else(|| first.refuse("it does not say the size of the images", action))
}

/// A camera; four coefficients under a model that names the fisheye are equidistant.
fn camera(
    matrix: Node<'_>,
    distortion: Node<'_>,
    roots: &[Node<'_>],
    size: [u32; 2],
) -> Result<RawCamera, FormatError> {
    let [fx, _, cx, _, fy, cy, ..] = matrix.array::<9>()?;
    let named = ["fisheye_model", "fisheye"]
        .iter()
        .find_map(|key| roots.iter().find_map(|root| root.get(key)));
    let by_name = roots
        .iter()
        .find_map(|root| root.get("distortion_model"))
        .and_then(|node| node.text().ok());
    let fisheye = named.is_some_and(|node| node.number().is_ok_and(|flag| flag != 0.0))
        || by_name.is_some_and(|name| name == "fisheye");
    let coefficients = distortion.numbers()?;
    let model = if fisheye {
        lens::equidistant(distortion, &coefficients)?
    } else {
        lens::radial_tangential(distortion, &coefficients)?
    };
    lens::camera(matrix, [fx, fy, cx, cy], model, size)
}
