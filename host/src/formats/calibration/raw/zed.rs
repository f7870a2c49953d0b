//! ZED's factory calibration `SN00000000.conf`: a section for each camera and resolution, lengths
//! in millimetres, the rotation as a vector `RX CV RZ`.

use super::files::Files;
use super::format::CalibrationFormat;
use super::{StereoCalibration, lens, pose, pose::Pose, sections, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use dynvox_core::rectify::RawCamera;
use nalgebra::Vector3;

/// ZED's file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "ZED",
    files: "factory calibration `SN....conf`: `[LEFT_CAM_HD]` ... `[STEREO]`, lengths in mm; the \
            images' size chooses the section",
    unit: LengthUnit::MILLIMETRE,
    matches: |files| files.text().contains("[STEREO]") && files.text().contains("[LEFT_CAM_"),
    read: |files| read(files).map(Into::into),
    example: &[(
        "SN10000000.conf",
        r"[LEFT_CAM_HD]
fx=534.3
fy=534.1
cx=639.6
cy=368.0
k1=-0.059
k2=0.036
p1=-0.0003
p2=-0.0001
k3=-0.014
[RIGHT_CAM_HD]
fx=533.5
fy=533.3
cx=631.0
cy=371.9
k1=-0.064
k2=0.044
p1=-0.0004
p2=-0.0006
k3=-0.018
[STEREO]
Baseline=110.0
TY=0
TZ=0
CV_HD=0
RX_HD=0
RZ_HD=0
",
    )],
};

/// Names of the resolutions, and their widths and heights, px.
const RESOLUTIONS: [(&str, [u32; 2]); 6] = [
    ("HD", [1280, 720]),
    ("FHD", [1920, 1080]),
    ("2K", [2208, 1242]),
    ("VGA", [672, 376]),
    ("FHD1200", [1920, 1200]),
    ("SVGA", [960, 600]),
];

/// Reads the sections of the images' resolution.
fn read(files: &Files<'_>) -> Result<StereoCalibration, FormatError> {
    let tree = sections::tree_of(files.text(), files.path());
    let root = tree.root();
    let (name, size) = resolution(files, root)?;
    let stereo = root.need("STEREO")?;
    let number = |key: &str| -> Result<f64, FormatError> {
        let with_size = format!("{key}_{name}");
        stereo.get(&with_size).or_else(|| stereo.get(key)).map_or(Ok(0.0), |value| value.number())
    };
    // Stereolabs' own code hands the vector to Rodrigues' formula and the lengths to OpenCV's
    // rectification, which takes them for the line between the cameras, to the right.
    let r = pose::about(Vector3::new(number("RX")?, number("CV")?, number("RZ")?));
    let baseline = stereo.need("Baseline")?.number()?;
    let t_m = Vector3::new(-baseline, -number("TY")?, -number("TZ")?);
    Ok(StereoCalibration {
        left: camera(root.need(&format!("LEFT_CAM_{name}"))?, size)?,
        right: camera(root.need(&format!("RIGHT_CAM_{name}"))?, size)?,
        placement: Pose { r, t_m }.placement(),
        format: FORMAT.name,
    })
}

/// Name and size of the resolution of the images; without images the first that the file has.
fn resolution(files: &Files<'_>, root: Node<'_>) -> Result<(&'static str, [u32; 2]), FormatError> {
    let has = |name: &str| root.has(&format!("LEFT_CAM_{name}"));
    let there: Vec<_> = RESOLUTIONS.into_iter().filter(|(name, _)| has(name)).collect();
    let list = there.iter().map(|(name, [w, h])| format!("{name} {w} x {h}"));
    let list = list.collect::<Vec<_>>().join(", ");
    let Some(wanted) = files.known_size() else {
        files.lack_size();
        return Err(root.refuse(
            &format!(
                "it has several resolutions ({list}), and which one the images have is not known"
            ),
            "Give --image WxH",
        ));
    };
    there.into_iter().find(|(_, size)| *size == wanted).ok_or_else(|| {
        let [w, h] = wanted;
        root.refuse(
            &format!("it has no section for images of {w} x {h} px, but {list}"),
            "Give the images as the camera delivers them; rectified ones have a calib.txt with \
             focal_px, center_u_px, center_v_px, baseline_m",
        )
    })
}

fn camera(section: Node<'_>, size: [u32; 2]) -> Result<RawCamera, FormatError> {
    let number = |key: &str| section.value_of(key);
    let or_zero = |key: &str| section.get(key).map_or(Ok(0.0), |value| value.number());
    let mut k = [0.0; 8];
    for (k, key) in k.iter_mut().zip(["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]) {
        *k = or_zero(key)?;
    }
    let model = lens::radial_tangential(section, &k)?;
    lens::camera(section, [number("fx")?, number("fy")?, number("cx")?, number("cy")?], model, size)
}
