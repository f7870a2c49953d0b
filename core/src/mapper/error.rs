//! Errors: the reasons why a mapper cannot be made, or refuses a frame.

use crate::{memory::SlabError, rectify::RectifierError, settings::Problem};
use core::fmt;

/// Least image width the matchers can use, px.
pub const MIN_WIDTH: usize = 64;
/// Least image height the matchers can use, px.
pub const MIN_HEIGHT: usize = 32;

/// Reason why a mapper cannot be made.
///
/// ```
/// use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig};
///
/// let rig = StereoRig { focal_px: -1.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let error = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut []).unwrap_err();
/// assert_eq!(error.to_string(), "the configuration cannot be used: rig.focal_px must be a positive number");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NewError {
    /// The slab cannot hold the capacity.
    Slab(SlabError),
    /// The configuration is not usable: the first problem; [`super::Config::validate`] lists them
    /// all.
    Config(Problem),
    /// The rectification does not fit the capacity.
    Rectification(RectifierError),
}

impl From<SlabError> for NewError {
    fn from(error: SlabError) -> Self {
        Self::Slab(error)
    }
}

impl fmt::Display for NewError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slab(error) => error.fmt(f),
            Self::Config(problem) => write!(f, "the configuration cannot be used: {problem}"),
            Self::Rectification(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for NewError {}

/// Reason why a frame is refused. The mapper is unchanged.
///
/// ```
/// use dynvox_core::{
///     Capacity, Config, Mapper, Serial, StepError, StereoFrame, geometry::StereoRig, image::View,
///     memory::SLAB_ALIGN,
/// };
///
/// let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
/// let mut mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
/// let (pixels, width) = (vec![0; 640 * 192], Capacity::TINY.image_width);
/// let image = View::new(&pixels, 640, 192).unwrap();
/// let refusal = mapper.step(&StereoFrame::pair(image, image), &Serial).unwrap_err();
/// assert!(matches!(refusal, StepError::TooLarge { width: most, .. } if most == width));
/// # Ok::<(), dynvox_core::NewError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StepError {
    /// The images of the frame differ in size.
    SizesDiffer,
    /// The frame is larger than the capacity allows.
    TooLarge {
        /// Widest image, px.
        width: usize,
        /// Highest image, px.
        height: usize,
    },
    /// The frame is smaller than the matchers can use.
    TooSmall {
        /// Least width, px.
        width: usize,
        /// Least height, px.
        height: usize,
    },
    /// The frame's size differs from that of the frames before.
    SizeChanged,
    /// The images of a frame that is to be rectified are not of the size the calibration is for.
    RawSizeDiffers {
        /// Width of the left raw image, px.
        width: usize,
        /// Height of the left raw image, px.
        height: usize,
    },
    /// The samples of the frame are packed, and the mapper does not rectify.
    PackedNotRectified,
    /// The rows of a frame whose samples are packed are too short.
    PackedTooShort {
        /// Bytes of a row of the left image.
        row_bytes: usize,
    },
    /// The frame's pose is not made of finite numbers.
    PoseNotFinite,
    /// The quaternion of the frame's pose does not have length 1.
    PoseNotRotation,
    /// The frame's pose lies where the map has no blocks: their coordinates have 16 bits, which end
    /// 13 km from the origin at 5 cm.
    PoseBeyondMap,
    /// The frame's time is not after that of the frame before.
    TimeNotLater,
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SizesDiffer => f.write_str("the images of the frame differ in size"),
            Self::TooLarge { width, height } => {
                write!(
                    f,
                    "the frame is larger than the capacity allows: at most {width} x {height} px"
                )
            }
            Self::TooSmall { width, height } => {
                write!(
                    f,
                    "the frame is smaller than the matchers can use: at least {width} x {height} px"
                )
            }
            Self::SizeChanged => f.write_str("the frame is not of the size of those before"),
            Self::RawSizeDiffers { width, height } => {
                write!(
                    f,
                    "the frame is not of {width} x {height} px, the size the calibration is for"
                )
            }
            Self::PackedNotRectified => f.write_str(
                "the samples of the frame are packed, which only a mapper that rectifies can read",
            ),
            Self::PackedTooShort { row_bytes } => {
                write!(f, "the frame has fewer than {row_bytes} bytes a row of packed samples")
            }
            Self::PoseNotFinite => {
                f.write_str("the pose of the frame is not made of finite numbers")
            }
            Self::TimeNotLater => {
                f.write_str("the time of the frame is not after that of the frame before")
            }
            Self::PoseNotRotation => {
                f.write_str("the quaternion of the frame's pose does not have length 1")
            }
            Self::PoseBeyondMap => f.write_str(
                "the frame's pose lies beyond the map: give poses relative to the first one",
            ),
        }
    }
}

impl core::error::Error for StepError {}
