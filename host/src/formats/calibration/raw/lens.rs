//! Lenses from the names and lists of several tools.

use super::tree::Node;
use crate::formats::FormatError;
use dynvox_core::rectify::{Lens, LensModel, LensProblem, RawCamera};

/// A camera from focal lengths and centre (`fx fy cx cy`), model and size.
pub fn camera(
    at: Node<'_>,
    [fx, fy, cx, cy]: [f64; 4],
    model: LensModel,
    [width, height]: [u32; 2],
) -> Result<RawCamera, FormatError> {
    let lens = Lens::new([fx, fy], [cx, cy], model).map_err(|problem| {
        let action = match problem {
            LensProblem::Focal => "Focal lengths are in pixels, above 0: look at the camera matrix",
            _ => "Compare the parameters with the calibration tool's own output",
        };
        at.refuse(&problem.to_string(), action)
    })?;
    let inside =
        |center: f64, side: u32| center > -0.5 * f64::from(side) && center < 1.5 * f64::from(side);
    if !(inside(cx, width) && inside(cy, height)) {
        let reason = format!(
            "the principal point ({cx}, {cy}) px does not fit images of {width} x {height} px"
        );
        return Err(at.refuse(&reason, "Check the image size and the order of the parameters"));
    }
    Ok(RawCamera { lens, width, height })
}

/// Distortion in OpenCV's order: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]].
pub fn radial_tangential(at: Node<'_>, coefficients: &[f64]) -> Result<LensModel, FormatError> {
    let get = |index: usize| coefficients.get(index).copied().unwrap_or(0.0);
    if !matches!(coefficients.len(), 0 | 4 | 5 | 8 | 12 | 14) {
        return Err(at.refuse(
            &format!(
                "{} distortion coefficients are not k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx \
                 ty]]]]",
                coefficients.len()
            ),
            "Give 4, 5, 8, 12 or 14 of them",
        ));
    }
    let radial = [get(0), get(1), get(4), get(5), get(6), get(7)];
    let tangential = [get(2), get(3)];
    if (8..14).all(|index| get(index) == 0.0) {
        return Ok(LensModel::RadialTangential { radial, tangential });
    }
    let prism = [get(8), get(9), get(10), get(11)];
    Ok(LensModel::General { xi: 0.0, radial, tangential, prism, tilt: [get(12), get(13)] })
}

/// The equidistant model's k1 to k4.
pub fn equidistant(at: Node<'_>, coefficients: &[f64]) -> Result<LensModel, FormatError> {
    match *coefficients {
        [k1, k2, k3, k4] => Ok(LensModel::Equidistant { radial: [k1, k2, k3, k4] }),
        _ => Err(at.refuse(
            &format!("the equidistant model has 4 coefficients, not {}", coefficients.len()),
            "Give k1 k2 k3 k4",
        )),
    }
}

/// The distortion model of a pinhole by its name.
pub fn distortion(
    at: Node<'_>,
    name: &str,
    coefficients: &[f64],
) -> Result<LensModel, FormatError> {
    match name.to_ascii_lowercase().replace(['-', ' '], "_").as_str() {
        "radtan"
        | "radial_tangential"
        | "plumb_bob"
        | "rational_polynomial"
        | "rational"
        | "radtan8"
        | "brown_conrady"
        | "brown"
        | "opencv"
        | "pinhole"
        | "perspective" => radial_tangential(at, coefficients),
        "equidistant" | "equi" | "fisheye" | "kannala_brandt" | "kannala_brandt4" | "kb4" => {
            equidistant(at, coefficients)
        }
        "none" | "" if coefficients.iter().all(|k| *k == 0.0) => Ok(LensModel::IDEAL),
        other => Err(at.refuse(
            &format!("the distortion model {other} is not known"),
            "Known are radtan (plumb_bob, rational_polynomial) and equidistant (fisheye): \
             calibrate again with one of them",
        )),
    }
}

/// The unified model of Mei; without distortion an extended unified one with the same rays and
/// other names.
pub fn unified(
    at: Node<'_>,
    xi: f64,
    [fx, fy, cx, cy]: [f64; 4],
    distortion: &[f64],
) -> Result<([f64; 4], LensModel), FormatError> {
    if distortion.iter().all(|k| *k == 0.0) {
        let model = LensModel::ExtendedUnified { alpha: xi / (1.0 + xi), beta: 1.0 };
        return Ok(([fx / (1.0 + xi), fy / (1.0 + xi), cx, cy], model));
    }
    let LensModel::RadialTangential { radial, tangential } = radial_tangential(at, distortion)?
    else {
        return Err(at.refuse("the unified (MEI, omni) model has k1 k2 p1 p2", "Give 4 numbers"));
    };
    let model = LensModel::General { xi, radial, tangential, prism: [0.0; 4], tilt: [0.0; 2] };
    Ok(([fx, fy, cx, cy], model))
}
