//! Raw pairs become rectified ones.
//!
//! Real cameras bend rays and do not stand exactly side by side. [`Lens`] says how each bends them
//! (models: [`LENS_MODELS`]), [`RawRig`] how the two stand, [`Rectification`] how both are turned
//! so that their rows agree, how large the result is and at which scale. A [`Rectifier`] makes one
//! map a camera, once, in `f64` with `libm`, and remaps each pair in integers.
//!
//! **Invalid pixels.** A rectified pixel that no raw pixel covers is not black but invalid, and so
//! are those within
//! [`INVALID_MARGIN_PX`] of it, whose surroundings are not all there: `Rectifier::invalid` has one bit a pixel. Stereo finds no disparity
//! there, scene flow no features, and without depth nothing is fused. [`Sizing::Automatic`] leaves
//! none.
//!
//! Memory, from `Capacity`, where it has raw pixels: 4 bytes a rectified pixel and camera for the
//! map, 1 for the image, an eighth for the mask, 3 for colour. Raw images stay with the caller.
//! Time: making the maps takes one projection a rectified pixel and camera; a frame 2 reads of two
//! bytes and four multiplications a pixel. What can go wrong: a rig that cannot be rectified
//! ([`RectifyProblem`]), a lens with absurd parameters ([`LensProblem`]), images that do not fit
//! the capacity ([`RectifierError`]): all before the first frame. A frame of another size is
//! refused by the mapper.
//!
//! ```
//! use dynvox_core::rectify::{Lens, LensModel, RawCamera, RawRig, Rectification, Sizing};
//! use nalgebra::{Matrix3, Vector3};
//!
//! let lens = Lens::new([458.0, 457.0], [367.0, 248.0], LensModel::RadialTangential {
//!     radial: [-0.28, 0.07, 0.0, 0.0, 0.0, 0.0],
//!     tangential: [0.0002, 0.00002],
//! })?;
//! let camera = RawCamera { lens, width: 752, height: 480 };
//! let raw = RawRig { left: camera, right: camera, r_right_left: Matrix3::identity(), t_right_left_m: Vector3::new(-0.11, 0.0, 0.0) };
//! let sizing = Sizing::Automatic { max_width: 640, max_height: 480 };
//! let (rectification, rig) = Rectification::new(&raw, sizing)?;
//! assert_eq!(rectification.width, 640);
//! assert!(rig.focal_px < 458.0 && (rig.baseline_m - 0.11).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod align;
mod align_rows;
mod lens;
mod map;
mod models;
mod monotonic;
mod packed;
mod rectification;
mod rectifier;
pub mod self_calibration;
#[cfg(test)]
mod tests;

pub use align::{Alignment, RawCamera, RawRig, RectifyProblem, WIDEST_ANGLE_RAD};
pub(crate) use align_rows::AlignedImage;
pub use lens::Lens;
pub use map::INVALID_MARGIN_PX;
pub use models::MAX_STEPS as MAX_PLANE_STEPS;
pub use models::{LENS_MODELS, LensKind, LensModel, LensParameter, LensProblem};
pub use monotonic::MAX_STEPS as MAX_RADIAL_STEPS;
pub use rectification::{MAX_RAW_SIDE, Rectification, Sizing, TurnedCamera};
pub use rectifier::{Pair, RectifiedImages, Rectifier, RectifierError};

/// Report of a pair's rectification.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct RectifyReport {
    /// Pixels of the left rectified image that no raw pixel covers.
    pub invalid_left: u32,
    /// Pixels of the right rectified image that no raw pixel covers.
    pub invalid_right: u32,
    /// Digest of the rectified images.
    pub digest: u64,
}
