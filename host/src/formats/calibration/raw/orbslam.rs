//! ORB-SLAM2 and ORB-SLAM3: `LEFT.K ... RIGHT.P` of raw images with their rectification,
//! `Camera.fx` and `Camera.bf` of rectified ones, `Camera1.fx`, `Camera2.fx` and `Stereo.T_c1_c2`
//! of raw ones.

use super::files::Files;
use super::format::{CalibrationFormat, Cameras};
use super::{Placement, RectifiedCameras, StereoCalibration, lens, pose::Pose, ros, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::RawCamera;
use nalgebra::Matrix3;

/// ORB-SLAM's settings.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "ORB-SLAM",
    files: "settings of ORB-SLAM2 and 3: `LEFT.K ... RIGHT.P`, `Camera.bf`, or `Camera1.fx` and \
            `Stereo.T_c1_c2`",
    unit: LengthUnit::METRE,
    matches: |files| {
        ["Camera.fx", "Camera1.fx", "LEFT.K", "Camera.bf"].iter().any(|key| files.has(key))
    },
    read,
    example: &[(
        "EuRoC.yaml",
        r"%YAML:1.0
Camera.type: PinHole
Camera1.fx: 458.6
Camera1.fy: 457.2
Camera1.cx: 367.2
Camera1.cy: 248.3
Camera1.k1: -0.28
Camera1.k2: 0.07
Camera1.p1: 0.0002
Camera1.p2: 0.00002
Camera2.fx: 458.6
Camera2.fy: 457.2
Camera2.cx: 367.2
Camera2.cy: 248.3
Camera2.k1: -0.28
Camera2.k2: 0.07
Camera2.p1: 0.0002
Camera2.p2: 0.00002
Camera.width: 752
Camera.height: 480
Stereo.T_c1_c2: !!opencv-matrix
  rows: 4
  cols: 4
  dt: f
  data:[1.0, 0.0, 0.0, 0.11, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
",
    )],
};

/// Reads whichever cameras the settings have.
fn read(files: &Files<'_>) -> Result<Cameras, FormatError> {
    let root = files.root()?;
    if root.has("LEFT.K") {
        return with_rectification(root).map(Into::into);
    }
    let motion = root.any(&["Stereo.T_c1_c2", "Tlr"]);
    if let Some(motion) = motion.filter(|_| root.has("Camera2.fx")) {
        let first = if root.has("Camera1.fx") { "Camera1" } else { "Camera" };
        return Ok(Cameras::Raw(StereoCalibration {
            left: camera(files, root, first)?,
            right: camera(files, root, "Camera2")?,
            placement: Pose::from_matrix(motion)?.inverse().placement(),
            format: FORMAT.name,
        }));
    }
    rectified(root).map(Cameras::Rectified)
}

/// `LEFT.K`, `LEFT.D`, `LEFT.R`, `LEFT.P` and the right camera's.
fn with_rectification(root: Node<'_>) -> Result<StereoCalibration, FormatError> {
    let side = |side: &str| -> Result<(RawCamera, Matrix3<f64>, [f64; 12]), FormatError> {
        let need = |key: &str| root.need(&format!("{side}.{key}"));
        let (matrix, distortion) = (need("K")?, need("D")?);
        let [fx, _, cx, _, fy, cy, ..] = matrix.array::<9>()?;
        let size = [need("width")?.pixels()?, need("height")?.pixels()?];
        let model = lens::radial_tangential(distortion, &distortion.numbers()?)?;
        let camera = lens::camera(matrix, [fx, fy, cx, cy], model, size)?;
        let rotation = Matrix3::from_row_slice(&need("R")?.array::<9>()?);
        Ok((camera, rotation, need("P")?.array()?))
    };
    let ((left, r_left, p_left), (right, r_right, p_right)) = (side("LEFT")?, side("RIGHT")?);
    Ok(StereoCalibration {
        left,
        right,
        placement: Placement::Rectified {
            r_rectified_left: r_left,
            r_rectified_right: r_right,
            rig: ros::rectified_rig(root.need("RIGHT.P")?, &p_left, &p_right)?.rig,
            size: [left.width, left.height],
        },
        format: FORMAT.name,
    })
}

/// `Camera.fx` and `Camera.bf` (baseline times focal length) or `Stereo.b`: rectified images.
fn rectified(root: Node<'_>) -> Result<RectifiedCameras, FormatError> {
    let camera = if root.has("Camera1.fx") { "Camera1" } else { "Camera" };
    let number = |key: &str| root.need(&format!("{camera}.{key}"))?.number();
    for key in ["k1", "k2", "p1", "p2", "k3"] {
        let bent =
            root.get(&format!("{camera}.{key}")).filter(|k| k.number().is_ok_and(|k| k != 0.0));
        if let Some(bent) = bent {
            return Err(bent.refuse(
                &format!(
                    "{} is not 0, so images are raw, but the right camera is missing",
                    bent.key()
                ),
                "Give Camera2.fx ... and Stereo.T_c1_c2, or LEFT.K ... RIGHT.P",
            ));
        }
    }
    let focal_px = number("fx")?;
    let baseline_m = match (root.get("Stereo.b"), root.any(&["Camera.bf", "Stereo.bf"])) {
        (Some(baseline), _) => baseline.number()?,
        (None, Some(product)) => product.number()? / focal_px,
        (None, None) => {
            return Err(root.refuse(
                "it is of one camera: Camera.bf and Stereo.b are missing",
                "Give Camera.bf, the baseline in metres times Camera.fx",
            ));
        }
    };
    let size = root.get("Camera.width").zip(root.get("Camera.height"));
    let size =
        size.map(|(width, height)| Ok::<_, FormatError>([width.pixels()?, height.pixels()?]));
    Ok(RectifiedCameras {
        rig: StereoRig {
            focal_px,
            center_u_px: number("cx")?,
            center_v_px: number("cy")?,
            baseline_m,
        },
        offset_px: 0.0,
        size: size.transpose()?,
    })
}

/// A raw camera; `KannalaBrandt8` has k1 to k4, `PinHole` k1 k2 p1 p2 k3.
fn camera(files: &Files<'_>, root: Node<'_>, name: &str) -> Result<RawCamera, FormatError> {
    let number = |key: &str| root.need(&format!("{name}.{key}"))?.number();
    let or_zero = |key: &str| root.get(&format!("{name}.{key}")).map_or(Ok(0.0), |k| k.number());
    let at = root.need(&format!("{name}.fx"))?;
    let kind = root.get("Camera.type").map_or(Ok("PinHole"), |kind| kind.text())?;
    let model = match kind {
        "KannalaBrandt8" => {
            lens::equidistant(at, &[number("k1")?, number("k2")?, number("k3")?, number("k4")?])?
        }
        _ => {
            let [k1, k2, p1, p2] = [or_zero("k1")?, or_zero("k2")?, or_zero("p1")?, or_zero("p2")?];
            lens::radial_tangential(at, &[k1, k2, p1, p2, or_zero("k3")?])?
        }
    };
    let size = match root.get("Camera.width").zip(root.get("Camera.height")) {
        Some((width, height)) => [width.pixels()?, height.pixels()?],
        None => files.image_size(root)?,
    };
    lens::camera(at, [number("fx")?, number("fy")?, number("cx")?, number("cy")?], model, size)
}
