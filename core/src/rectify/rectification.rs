//! From a raw rig to a rectified one: rotations, size and focal length.

use super::{Alignment, RawCamera, RawRig, RectifyProblem, align};
use crate::geometry::StereoRig;
use nalgebra::{Matrix3, Vector3};

/// Widest and highest raw image, px: positions of a map have 12 bits before the point.
pub const MAX_RAW_SIDE: u32 = 4_096;
/// Tangent of the widest half field of view a rectified image is given by itself: 60 degrees.
/// Pixels further out show little of the world each, and cost as much.
const WIDEST_TANGENT: f64 = 1.732_050_807_568_877_2;
/// Points along each side of a raw image by which the common view is found.
const SIDE_POINTS: u32 = 256;

/// Size of the rectified images.
///
/// ```
/// use dynvox_core::rectify::{Lens, LensModel, RawCamera, RawRig, Rectification, Sizing};
/// use nalgebra::{Matrix3, Vector3};
///
/// let lens = Lens::new([450.0; 2], [320.0, 240.0], LensModel::IDEAL)?;
/// let camera = RawCamera { lens, width: 640, height: 480 };
/// let rig = RawRig {
///     left: camera,
///     right: camera,
///     r_right_left: Matrix3::identity(),
///     t_right_left_m: Vector3::new(-0.1, 0.0, 0.0),
/// };
/// let sizing = Sizing::Given { width: 320, height: 240, focal_px: Some(225.0) };
/// let (rectification, rectified) = Rectification::new(&rig, sizing)?;
/// assert_eq!((rectification.width, rectified.focal_px), (320, 225.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sizing {
    /// All that both cameras see of one rectangle, up to 120 degrees, at the scale of the raw
    /// images' middle; smaller where that does not fit. No pixel is invalid.
    Automatic {
        /// Widest image, px.
        max_width: u32,
        /// Highest image, px.
        max_height: u32,
    },
    /// Images of this size, centred on what both cameras see.
    Given {
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
        /// Focal length, px; `None` chooses the least without invalid pixels.
        focal_px: Option<f64>,
    },
}

/// One raw camera and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnedCamera {
    /// The raw camera.
    pub raw: RawCamera,
    /// Rotation of raw camera coordinates to rectified ones.
    pub r_rectified_raw: Matrix3<f64>,
}

/// Rectification of raw pairs. Focal length and principal point of both rectified images are those
/// of the mapper's rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectification {
    /// The left camera.
    pub left: TurnedCamera,
    /// The right camera.
    pub right: TurnedCamera,
    /// Width of the rectified images, px.
    pub width: u32,
    /// Height of the rectified images, px.
    pub height: u32,
}

impl Rectification {
    /// Rectifies two cameras by Bouguet's way.
    ///
    /// # Errors
    /// See [`RectifyProblem`].
    pub fn new(rig: &RawRig, sizing: Sizing) -> Result<(Self, StereoRig), RectifyProblem> {
        let Alignment { r_rectified_left, r_rectified_right, baseline_m } = rig.align()?;
        let left = TurnedCamera { raw: rig.left, r_rectified_raw: r_rectified_left };
        let right = TurnedCamera { raw: rig.right, r_rectified_raw: r_rectified_right };
        let common = common_view([&left, &right])?;
        let middle_focal_px =
            0.5 * (rig.left.lens.middle_focal_px() + rig.right.lens.middle_focal_px());
        let (focal_px, [width, height]) = common.sized(sizing, middle_focal_px)?;
        // The common field of view in the middle of the image.
        let rig = StereoRig {
            focal_px,
            center_u_px: 0.5 * f64::from(width - 1) - focal_px * 0.5 * (common.x[0] + common.x[1]),
            center_v_px: 0.5 * f64::from(height - 1) - focal_px * 0.5 * (common.y[0] + common.y[1]),
            baseline_m,
        };
        Ok((Self::given(left, right, [width, height])?, rig))
    }

    /// Takes rotations and a size that a calibration gives.
    ///
    /// # Errors
    /// See [`RectifyProblem`].
    pub fn given(
        left: TurnedCamera,
        right: TurnedCamera,
        [width, height]: [u32; 2],
    ) -> Result<Self, RectifyProblem> {
        for camera in [&left, &right] {
            // The map mixes 2 x 2 raw pixels, and has 12 bits before the point.
            align::rotation(&camera.r_rectified_raw)?;
            let side = 2..=MAX_RAW_SIDE;
            if !(side.contains(&camera.raw.width) && side.contains(&camera.raw.height)) {
                return Err(RectifyProblem::RawSize);
            }
        }
        if width == 0 || height == 0 {
            return Err(RectifyProblem::RectifiedSize);
        }
        Ok(Self { left, right, width, height })
    }
}

/// A rectangle of rays, x and y over z: from and to.
struct CommonView {
    x: [f64; 2],
    y: [f64; 2],
}

impl CommonView {
    /// Focal length and size.
    fn sized(
        &self,
        sizing: Sizing,
        middle_focal_px: f64,
    ) -> Result<(f64, [u32; 2]), RectifyProblem> {
        let [wide, high] = [self.x[1] - self.x[0], self.y[1] - self.y[0]];
        let (focal_px, size) = match sizing {
            Sizing::Automatic { max_width, max_height } => {
                // From the centre of the first pixel to that of the last there is one pixel less
                // than the image has.
                let [fits_u, fits_v] =
                    [(f64::from(max_width) - 1.0) / wide, (f64::from(max_height) - 1.0) / high];
                let fits = if fits_u < fits_v { fits_u } else { fits_v };
                // No finer than the raw image in its middle: enlarging adds no detail.
                let focal_px = if fits < middle_focal_px { fits } else { middle_focal_px };
                let pixels = |tangent: f64, most: u32| {
                    // A hair more, so that rounding does not take a pixel from an exact fit.
                    let pixels = libm::floor(tangent * focal_px + 1e-6) as u32;
                    pixels.saturating_add(1).min(most)
                };
                (focal_px, [pixels(wide, max_width), pixels(high, max_height)])
            }
            Sizing::Given { width, height, focal_px } => {
                let [fits_u, fits_v] =
                    [(f64::from(width) - 1.0) / wide, (f64::from(height) - 1.0) / high];
                (focal_px.unwrap_or(if fits_u > fits_v { fits_u } else { fits_v }), [width, height])
            }
        };
        let usable = focal_px.is_finite() && focal_px > 0.0 && size[0] > 0 && size[1] > 0;
        if usable { Ok((focal_px, size)) } else { Err(RectifyProblem::RectifiedSize) }
    }
}

/// The largest rectangle about the middle that both cameras cover: each side as far out as the raw
/// image's own side comes in.
fn common_view(cameras: [&TurnedCamera; 2]) -> Result<CommonView, RectifyProblem> {
    let mut common =
        CommonView { x: [-WIDEST_TANGENT, WIDEST_TANGENT], y: [-WIDEST_TANGENT, WIDEST_TANGENT] };
    for camera in cameras {
        let last = [f64::from(camera.raw.width) - 1.0, f64::from(camera.raw.height) - 1.0];
        for step in 0..=SIDE_POINTS {
            // Distortion bends the sides: all their points are asked, and the innermost counts.
            let share = f64::from(step) / f64::from(SIDE_POINTS);
            let [u, v] = [last[0] * share, last[1] * share];
            if let Some([x, _]) = camera.tangents([0.0, v]) {
                common.x[0] = if x > common.x[0] { x } else { common.x[0] };
            }
            if let Some([x, _]) = camera.tangents([last[0], v]) {
                common.x[1] = if x < common.x[1] { x } else { common.x[1] };
            }
            if let Some([_, y]) = camera.tangents([u, 0.0]) {
                common.y[0] = if y > common.y[0] { y } else { common.y[0] };
            }
            if let Some([_, y]) = camera.tangents([u, last[1]]) {
                common.y[1] = if y < common.y[1] { y } else { common.y[1] };
            }
        }
    }
    // Less than three degrees of common view is a mistake in the calibration.
    let wide_enough = |[from, to]: [f64; 2]| to - from > 0.05;
    if wide_enough(common.x) && wide_enough(common.y) {
        Ok(common)
    } else {
        Err(RectifyProblem::NoCommonView)
    }
}

impl TurnedCamera {
    /// x and y over z of the ray a raw pixel sees, in rectified coordinates; `None` where it sees
    /// none, or one behind the image plane.
    fn tangents(&self, raw: [f64; 2]) -> Option<[f64; 2]> {
        let ray = self.r_rectified_raw * Vector3::from(self.raw.lens.unproject(raw)?);
        (ray.z > 1e-3).then(|| [ray.x / ray.z, ray.y / ray.z])
    }

    /// The raw pixel a rectified pixel shows, px, whether or not it lies in the raw image. `None`
    /// outside the lens's field of view.
    pub fn raw_pixel(&self, rig: &StereoRig, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let ray = Vector3::new(
            (u - rig.center_u_px) / rig.focal_px,
            (v - rig.center_v_px) / rig.focal_px,
            1.0,
        );
        self.raw.lens.project((self.r_rectified_raw.transpose() * ray).into())
    }
}
