//! OpenCV's files, YAML, XML or JSON: both cameras under the names of its samples and its users
//! (`M1 D1 M2 D2`, `cameraMatrix1 distCoeffs1 ...`, `KL DL KR DR`, `left: {K, D}`), or a file for
//! each camera (`cameraMatrix distCoeffs`, `K D`), and `R` and `T` in any of the files.

use super::files::Files;
use super::format::CalibrationFormat;
use super::keys::{self, DISTORTIONS, MATRICES};
use super::{StereoCalibration, family, lens, pose::Pose, tree::Node};
use crate::formats::FormatError;
use crate::formats::calibration::hints::{LengthUnit, LensFamily};
use dynvox_core::rectify::RawCamera;

/// OpenCV's files.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "OpenCV",
    files: "YAML, XML or JSON: `M1 D1 M2 D2 R T`, `cameraMatrix1 distCoeffs1 ...`, or one file for \
            each camera",
    unit: LengthUnit::METRE,
    matches: |files| {
        let roots = files.roots();
        keys::pair(&roots, MATRICES).is_some()
            || keys::find(&roots, MATRICES).is_some()
            || keys::sections(&roots).is_some()
            || keys::pair(&roots, &["p"]).is_some()
    },
    read: |files| read(files).map(Into::into),
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

/// Names of the rotation of left camera coordinates to right ones.
const ROTATIONS: &[&str] = &[
    "r",
    "rotation",
    "rotationmatrix",
    "rotationlefttoright",
    "rmat",
    "rvec",
    "om",
    "rotationvector",
];
/// Names of the translation.
const TRANSLATIONS: &[&str] =
    &["t", "translation", "translationvector", "translationlefttoright", "tvec", "transvec"];
/// Action where a part is in another file.
const SECOND_FILE: &str = "Give the file that holds it as a second --calibration";

/// Camera matrix, distortion and, for `cv2.omnidir`, the sphere's `xi` of one camera.
#[derive(Clone, Copy)]
struct Parts<'t> {
    matrix: Node<'t>,
    distortion: Option<Node<'t>>,
    xi: Option<Node<'t>>,
}

/// Reads the pair.
fn read(files: &Files<'_>) -> Result<StereoCalibration, FormatError> {
    let roots = files.roots();
    let first = files.root()?;
    let parts = cameras(files, &roots, first)?;
    let needed = |names: &[&str], name: &str| {
        keys::find(&roots, names)
            .ok_or_else(|| first.refuse(&format!("{name} is missing"), SECOND_FILE))
    };
    let motion = Pose::from_parts(
        needed(ROTATIONS, "R or rotation")?,
        needed(TRANSLATIONS, "T or translation")?,
    )?;
    let size = size(files, &roots, first)?;
    let family = family_of(files, &roots, &parts, size[0])?;
    let [left, right] = parts;
    Ok(StereoCalibration {
        left: camera(left, family, size)?,
        right: camera(right, family, size)?,
        placement: motion.placement(),
        format: FORMAT.name,
    })
}

/// The parts of both cameras, left first.
fn cameras<'t>(
    files: &Files<'_>,
    roots: &[Node<'t>],
    first: Node<'t>,
) -> Result<[Parts<'t>; 2], FormatError> {
    if let Some([left, right]) = keys::pair(roots, MATRICES) {
        let (distortions, xis) = (keys::pair(roots, DISTORTIONS), keys::pair(roots, &["xi"]));
        let parts = |matrix, side: usize| Parts {
            matrix,
            distortion: distortions.map(|of| of[side]),
            xi: xis.map(|of| of[side]),
        };
        if distortions.is_none() {
            return Err(first.refuse(
                "the distortion coefficients of the two cameras are missing",
                SECOND_FILE,
            ));
        }
        return Ok([parts(left, 0), parts(right, 1)]);
    }
    let sections = keys::sections(roots);
    let singles = sections.as_ref().map_or(roots, |sections| sections.as_slice());
    let single = |root: &Node<'t>| {
        let root = std::slice::from_ref(root);
        let matrix = keys::find(root, MATRICES)?;
        Some(Parts {
            matrix,
            distortion: keys::find(root, DISTORTIONS),
            xi: keys::find(root, &["xi"]),
        })
    };
    let found: Vec<Parts<'t>> = singles.iter().filter_map(single).collect();
    match *found.as_slice() {
        [right, left] if files.right_comes_first() => {
            files.guess("the right camera's file comes first: exchanged".to_owned());
            Ok([left, right])
        }
        [left, right] => Ok([left, right]),
        [] => Err(rectification_only(roots, first)),
        _ => Err(super::euroc::two_files(roots, "camera file")),
    }
}

/// Refuses the output of `stereoRectify` without the lenses.
fn rectification_only(roots: &[Node<'_>], first: Node<'_>) -> FormatError {
    let line = |node: Node<'_>| {
        let numbers: Vec<String> = node.numbers().ok()?.iter().map(f64::to_string).collect();
        Some(numbers.join(" "))
    };
    let lines = keys::pair(roots, &["p"]).and_then(|[p1, p2]| Some([line(p1)?, line(p2)?]));
    let rectified = lines.map_or(String::new(), |[p1, p2]| {
        format!(
            ". If the images are rectified already, give a calib.txt with the two lines `P0: {p1}` \
             and `P1: {p2}`"
        )
    });
    first.refuse(
        "it holds a rectification (R1 R2 P1 P2) and not the lenses",
        &format!("Give the files with camera matrices, distortion, R and T{rectified}"),
    )
}

/// Size of the images: that of the files, else of the images themselves.
fn size(files: &Files<'_>, roots: &[Node<'_>], first: Node<'_>) -> Result<[u32; 2], FormatError> {
    for [width, height] in [["imagewidth", "imageheight"], ["width", "height"], ["w", "h"]] {
        let both = keys::find(roots, &[width]).zip(keys::find(roots, &[height]));
        if let Some((width, height)) = both {
            return Ok([width.pixels()?, height.pixels()?]);
        }
    }
    let list = ["imagesize", "size", "imgsize", "resolution", "framesize", "imageshape"];
    match keys::find(roots, &list) {
        Some(list) => list.size(),
        None => files.image_size(first),
    }
}

/// Family of both lenses: named by the files, said by a person, told by the number of coefficients,
/// or guessed.
fn family_of(
    files: &Files<'_>,
    roots: &[Node<'_>],
    parts: &[Parts<'_>; 2],
    width: u32,
) -> Result<LensFamily, FormatError> {
    let named = keys::find(roots, &["fisheyemodel", "fisheye", "isfisheye"]);
    if let Some(flag) = named {
        let fisheye = flag.number().map(|flag| flag != 0.0).unwrap_or(flag.is_true());
        return Ok(if fisheye { LensFamily::Fisheye } else { LensFamily::Pinhole });
    }
    let names = ["distortionmodel", "cameramodel", "model", "lensmodel", "projection"];
    if let Some(name) = keys::find(roots, &names).and_then(|node| node.text().ok()) {
        let name = name.to_lowercase();
        let is = |words: &[&str]| words.iter().any(|word| name.contains(word));
        if is(&["fish", "equi", "kannala", "kb"]) {
            return Ok(LensFamily::Fisheye);
        }
        if is(&["plumb", "radtan", "rational", "pinhole", "brown", "radial", "opencv"]) {
            return Ok(LensFamily::Pinhole);
        }
    }
    if let Some(family) = files.lens_family() {
        return Ok(family);
    }
    let mut coefficients = Vec::new();
    for distortion in parts.iter().filter(|parts| parts.xi.is_none()).filter_map(|of| of.distortion)
    {
        coefficients.push(distortion.numbers()?);
    }
    let column = parts.iter().filter_map(|of| of.distortion).any(|node| {
        let side = |key| node.get(key).and_then(|side| side.number().ok());
        (side("rows"), side("cols")) == (Some(4.0), Some(1.0))
    });
    let focal_px = parts[0].matrix.array::<9>()?[0];
    let Some((family, reason)) =
        family::guess(&coefficients, column, focal_px / f64::from(width.max(1)))
    else {
        return Ok(LensFamily::Pinhole);
    };
    files.guess_lens(family, reason);
    Ok(family)
}

/// A camera of its parts.
fn camera(
    Parts { matrix, distortion, xi }: Parts<'_>,
    family: LensFamily,
    size: [u32; 2],
) -> Result<RawCamera, FormatError> {
    let [fx, skew, cx, _, fy, cy, below_x, below_y, _] = matrix.array::<9>()?;
    if cx == 0.0 && cy == 0.0 && (below_x != 0.0 || below_y != 0.0) {
        return Err(matrix.refuse(
            &format!("{} is transposed, as MATLAB writes matrices", matrix.key()),
            "Transpose the camera matrices and the rotation",
        ));
    }
    if skew.abs() > 1e-3 * fx.abs() {
        return Err(matrix.refuse(
            &format!("{} has a skew of {skew}, which no lens model here has", matrix.key()),
            "Calibrate without skew",
        ));
    }
    let at = distortion.unwrap_or(matrix);
    let coefficients = distortion.map_or(Ok(Vec::new()), |node| node.numbers())?;
    let pinhole = [fx, fy, cx, cy];
    let (pinhole, model) = match (xi, family) {
        (Some(xi), _) => lens::unified(at, xi.number()?, pinhole, &coefficients)?,
        (None, LensFamily::Fisheye) => (pinhole, lens::equidistant(at, &coefficients)?),
        (None, LensFamily::Pinhole) => (pinhole, lens::radial_tangential(at, &coefficients)?),
    };
    lens::camera(matrix, pinhole, model, size)
}
