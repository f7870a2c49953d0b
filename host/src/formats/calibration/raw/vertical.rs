//! Cameras one above the other: rectified images are turned by a quarter, so that they lie side by
//! side.
//!
//! The turn is part of the rectification's rotations, so raw images stay as they come. Size and
//! focal length are those of cameras whose images were turned before.

use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{
    Lens, LensModel, LensProblem, RawCamera, RawRig, Rectification, RectifyProblem, Sizing,
    TurnedCamera,
};
use nalgebra::{Matrix3, Vector3};

/// Direction in which images are turned: the second camera becomes the right one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quarter {
    /// Counterclockwise: the second camera stands below the first.
    Left,
    /// Clockwise: the second camera stands above the first.
    Right,
}

impl Quarter {
    /// The turn for a motion between cameras; `None` where they do not stand one above the other.
    pub fn new(r_right_left: &Matrix3<f64>, t_right_left_m: &Vector3<f64>) -> Option<Self> {
        let to_second = -(r_right_left.transpose() * t_right_left_m);
        let across = to_second.x.hypot(to_second.z);
        (to_second.y.abs() > across).then_some(if to_second.y > 0.0 {
            Self::Left
        } else {
            Self::Right
        })
    }

    /// Position of the second camera, for a sentence.
    pub fn second_stands(self) -> &'static str {
        match self {
            Self::Left => "below",
            Self::Right => "above",
        }
    }

    /// Rotation of a camera's coordinates to those of its turned image.
    fn rotation(self) -> Matrix3<f64> {
        let sine = if self == Self::Left { 1.0 } else { -1.0 };
        Matrix3::new(0.0, sine, 0.0, -sine, 0.0, 0.0, 0.0, 0.0, 1.0)
    }

    /// Turns a pair of components along x and y.
    fn pair(self, [x, y]: [f64; 2]) -> [f64; 2] {
        if self == Self::Left { [y, -x] } else { [-y, x] }
    }

    /// The camera that takes turned images.
    fn camera(self, raw: &RawCamera) -> Result<RawCamera, LensProblem> {
        let ([fx, fy], [cx, cy]) = (raw.lens.focal_px(), raw.lens.center_px());
        let last = |side: u32| f64::from(side) - 1.0;
        let center_px = match self {
            Self::Left => [cy, last(raw.width) - cx],
            Self::Right => [last(raw.height) - cy, cx],
        };
        let lens = Lens::new([fy, fx], center_px, self.model(*raw.lens.model()))?;
        Ok(RawCamera { lens, width: raw.height, height: raw.width })
    }

    /// A lens' distortion of turned images. A sensor's tilt turns only nearly; sizes are found with
    /// it, and images are rectified by the lens as it is.
    fn model(self, model: LensModel) -> LensModel {
        // The second number shifts points along x, the first along y.
        let turned = |[p1, p2]: [f64; 2]| {
            let [x, y] = self.pair([p2, p1]);
            [y, x]
        };
        match model {
            LensModel::RadialTangential { radial, tangential } => {
                LensModel::RadialTangential { radial, tangential: turned(tangential) }
            }
            LensModel::General { xi, radial, tangential, prism: [s1, s2, s3, s4], tilt } => {
                let ([s1, s3], [s2, s4]) = (self.pair([s1, s3]), self.pair([s2, s4]));
                LensModel::General {
                    xi,
                    radial,
                    tangential: turned(tangential),
                    prism: [s1, s2, s3, s4],
                    tilt: self.pair(tilt),
                }
            }
            round => round,
        }
    }
}

/// Rectifies two cameras one above the other.
///
/// # Errors
/// They do not stand so, or cannot be rectified.
pub(super) fn rectify(
    rig: &RawRig,
    sizing: Sizing,
) -> Result<(Rectification, StereoRig), RectifyProblem> {
    let quarter = Quarter::new(&rig.r_right_left, &rig.t_right_left_m)
        .ok_or(RectifyProblem::NotSideBySide)?;
    let turn = quarter.rotation();
    // A quarter turn changes no parameter that a lens is refused for.
    let camera = |raw: &RawCamera| quarter.camera(raw).map_err(|_| RectifyProblem::RectifiedSize);
    let turned = RawRig {
        left: camera(&rig.left)?,
        right: camera(&rig.right)?,
        r_right_left: turn * rig.r_right_left * turn.transpose(),
        t_right_left_m: turn * rig.t_right_left_m,
    };
    let (rectification, rectified) = Rectification::new(&turned, sizing)?;
    let back = |camera: TurnedCamera, raw: RawCamera| TurnedCamera {
        raw,
        r_rectified_raw: camera.r_rectified_raw * turn,
    };
    let given = Rectification::given(
        back(rectification.left, rig.left),
        back(rectification.right, rig.right),
        [rectification.width, rectification.height],
    )?;
    Ok((given, rectified))
}
