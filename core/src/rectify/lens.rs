//! A camera's lens: from a ray to a raw pixel and back.

use super::models::{LensModel, LensProblem};

/// A lens: focal lengths, principal point and distortion of a raw camera.
///
/// Camera axes are x right, y down, z forward; pixels are measured from the centre of the first.
///
/// ```
/// use dynvox_core::rectify::{Lens, LensModel};
///
/// let lens = Lens::new([450.0, 450.0], [320.0, 240.0], LensModel::Equidistant { radial: [-0.01, 0.02, 0.0, 0.0] })?;
/// let pixel = lens.project([0.4, -0.2, 1.0]).expect("in front of the camera");
/// let [x, y, z] = lens.unproject(pixel).expect("within the field of view");
/// assert!((x / z - 0.4).abs() < 1e-9 && (y / z + 0.2).abs() < 1e-9);
/// # Ok::<(), dynvox_core::rectify::LensProblem>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    model: LensModel,
    /// The largest ray radius (radial-tangential: x over z; equidistant: angle, rad) up to which
    /// the distortion grows with the ray. Beyond it the polynomial folds back, and far rays would
    /// land among near ones.
    limit: f64,
}

impl Lens {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first parameter that cannot be.
    pub fn new(
        focal_px: [f64; 2],
        center_px: [f64; 2],
        model: LensModel,
    ) -> Result<Self, LensProblem> {
        if !focal_px.iter().all(|focal| focal.is_finite() && *focal > 0.0) {
            return Err(LensProblem::Focal);
        }
        if !center_px.iter().all(|center| center.is_finite()) {
            return Err(LensProblem::Center);
        }
        model.validate()?;
        let limit = model.limit();
        Ok(Self { focal_px, center_px, model, limit })
    }

    /// Focal lengths along u and v, px.
    ///
    /// ```
    /// use dynvox_core::rectify::{Lens, LensModel};
    ///
    /// let lens = Lens::new([450.0, 455.0], [320.0, 240.0], LensModel::IDEAL)?;
    /// assert_eq!((lens.focal_px(), lens.center_px()), ([450.0, 455.0], [320.0, 240.0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn focal_px(&self) -> [f64; 2] {
        self.focal_px
    }

    /// Principal point, px.
    pub fn center_px(&self) -> [f64; 2] {
        self.center_px
    }

    /// The distortion.
    pub fn model(&self) -> &LensModel {
        &self.model
    }

    /// The raw pixel a ray (any length but 0) meets, px, whether or not it lies in the image.
    /// `None` outside the lens's field of view.
    ///
    /// ```
    /// use dynvox_core::rectify::{Lens, LensModel};
    ///
    /// let lens = Lens::new([450.0; 2], [320.0, 240.0], LensModel::IDEAL)?;
    /// assert_eq!(lens.project([0.0, 0.0, 5.0]), Some([320.0, 240.0]));
    /// assert_eq!(lens.project([0.0, 0.0, -5.0]), None, "behind the camera");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn project(&self, ray: [f64; 3]) -> Option<[f64; 2]> {
        let [x, y] = self.model.distort(self.limit, ray)?;
        let pixel =
            [self.focal_px[0] * x + self.center_px[0], self.focal_px[1] * y + self.center_px[1]];
        pixel.iter().all(|value| value.is_finite()).then_some(pixel)
    }

    /// The ray a raw pixel sees, of length 1. `None` where no ray leads to that pixel.
    pub fn unproject(&self, pixel: [f64; 2]) -> Option<[f64; 3]> {
        let at = [
            (pixel[0] - self.center_px[0]) / self.focal_px[0],
            (pixel[1] - self.center_px[1]) / self.focal_px[1],
        ];
        let [x, y, z] = self.model.undistort(self.limit, at)?;
        let length = libm::sqrt(x * x + y * y + z * z);
        (length.is_finite() && length > 0.0).then(|| [x / length, y / length, z / length])
    }

    /// Pixels per radian on the optical axis: the focal length of the ideal pinhole that shows the
    /// middle at the same scale.
    pub(crate) fn middle_focal_px(&self) -> f64 {
        const STEP: f64 = 1e-4;
        // Distortion may move the middle.
        let middle = self.project([0.0, 0.0, 1.0]).unwrap_or(self.center_px);
        let along = |ray: [f64; 3], axis: fn([f64; 2]) -> f64, otherwise: f64| {
            self.project(ray).map_or(otherwise, |pixel| (axis(pixel) - axis(middle)) / STEP)
        };
        let focal_u = along([STEP, 0.0, 1.0], |pixel| pixel[0], self.focal_px[0]);
        let focal_v = along([0.0, STEP, 1.0], |pixel| pixel[1], self.focal_px[1]);
        0.5 * (focal_u + focal_v)
    }
}
