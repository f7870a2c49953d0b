//! The result of a call.

use core::ffi::{CStr, c_char};
use dynvox_core::{FixError, NewError, StepError, view::RaycastError};

/// The result of a call. A call that does not return DYNVOX_STATUS_OK has changed nothing, but for
/// dynvox_restore with DYNVOX_STATUS_SNAPSHOT or DYNVOX_STATUS_CALLBACK, which leaves no mapper in
/// the buffer, and dynvox_save with DYNVOX_STATUS_CALLBACK, which has written a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum DynvoxStatus {
    /// Done.
    Ok = 0,
    /// A pointer that must not be null is.
    Null,
    /// The buffer does not begin at a multiple of dynvox_alignment(), or another pointer not at one
    /// of its type's.
    Misaligned,
    /// The buffer or an output is too small.
    TooSmall,
    /// The handle is not that of a mapper: never created, destroyed, replaced without success, or a
    /// copy of a buffer elsewhere.
    NoMapper,
    /// The call came from within a callback of the same mapper.
    Busy,
    /// A frame's memory lies within the mapper's buffer.
    Overlap,
    /// An unknown profile, class, track or setting.
    Unknown,
    /// The configuration cannot be used: dynvox_config_problem says why. A calibration that is not
    /// finite is one reason.
    Config,
    /// A pose is not finite, its rotation is not of length 1, or it lies beyond the map, whose
    /// blocks have 16-bit coordinates: 13 km from the origin at 5 cm.
    Pose,
    /// An image is larger than the profile allows, too small to match, or its stride is below its
    /// width.
    Size,
    /// A frame's size differs from that of the frames before.
    SizeChanged,
    /// More detections than a frame can have (64).
    TooMany,
    /// No frame yet.
    NoFrame,
    /// A text is not a value of its setting.
    Value,
    /// A bound is not one a mapper can work with.
    Capacity,
    /// A snapshot is damaged, or of another version, capacity or configuration.
    Snapshot,
    /// A callback refused.
    Callback,
    /// A frame's time is not after that of the frame before.
    Time,
    /// A fix leaves a direction without an error, or no keyframe without a fix leads from the map's
    /// beginning to the camera.
    Fix,
}

impl DynvoxStatus {
    const fn text(self) -> &'static CStr {
        match self {
            Self::Ok => c"ok",
            Self::Null => c"a pointer is null: give one",
            Self::Misaligned => {
                c"a pointer is misaligned: buffers begin at a multiple of \
                                  dynvox_alignment()"
            }
            Self::TooSmall => c"a buffer is too small: dynvox_bytes says how much is needed",
            Self::NoMapper => {
                c"the handle is not a mapper's: create one, and do not use a \
                                destroyed one"
            }
            Self::Busy => {
                c"a callback called its own mapper: call it after the callback has \
                            returned"
            }
            Self::Overlap => c"a frame lies within the mapper's buffer: keep it elsewhere",
            Self::Unknown => c"an unknown value: see the enumeration in the header",
            Self::Config => c"the configuration cannot be used: dynvox_config_problem says why",
            Self::Pose => c"a pose is not finite, not a rotation, or beyond the map",
            Self::Size => c"an image's size does not suit the profile",
            Self::SizeChanged => {
                c"a frame's size differs from that of the frames before: create \
                                   another mapper"
            }
            Self::TooMany => c"too many detections: give the best 64",
            Self::NoFrame => c"no frame yet: step first",
            Self::Value => {
                c"the text is not a value of this setting: a run's config.toml shows \
                             one of each"
            }
            Self::Capacity => {
                c"a bound is not one a mapper can work with: begin with dynvox_capacity_of_profile \
                  or dynvox_capacity_for_budget"
            }
            Self::Snapshot => {
                c"the snapshot is damaged, or of another version, capacity or \
                                configuration"
            }
            Self::Callback => c"a callback refused",
            Self::Time => {
                c"a frame's time is not after that of the frame before: leave the frame \
                            out"
            }
            Self::Fix => {
                c"a fix leaves a direction without an error, or no keyframe without a fix leads \
                  from the map's beginning to the camera: give keyframes, and fix another frame"
            }
        }
    }
}

impl From<NewError> for DynvoxStatus {
    fn from(error: NewError) -> Self {
        match error {
            NewError::Slab(_) => Self::TooSmall,
            NewError::Config(_) | NewError::Rectification(_) => Self::Config,
            _ => Self::Unknown,
        }
    }
}

impl From<StepError> for DynvoxStatus {
    fn from(error: StepError) -> Self {
        match error {
            StepError::SizeChanged => Self::SizeChanged,
            StepError::SizesDiffer
            | StepError::RawSizeDiffers { .. }
            | StepError::PackedNotRectified
            | StepError::PackedTooShort { .. }
            | StepError::TooLarge { .. }
            | StepError::TooSmall { .. } => Self::Size,
            StepError::TimeNotLater => Self::Time,
            StepError::PoseNotFinite | StepError::PoseNotRotation | StepError::PoseBeyondMap => {
                Self::Pose
            }
            _ => Self::Unknown,
        }
    }
}

impl From<RaycastError> for DynvoxStatus {
    fn from(error: RaycastError) -> Self {
        match error {
            RaycastError::ImageSize => Self::NoFrame,
            RaycastError::Viewpoint => Self::Pose,
            _ => Self::Unknown,
        }
    }
}

impl From<FixError> for DynvoxStatus {
    fn from(error: FixError) -> Self {
        match error {
            FixError::Pose => Self::Pose,
            _ => Self::Fix,
        }
    }
}

/// A sentence for a status, in static memory; "no such status" for another number.
#[unsafe(no_mangle)]
pub extern "C" fn dynvox_status_text(status: u32) -> *const c_char {
    // In the order of their numbers, which are part of the binary interface.
    const ALL: [DynvoxStatus; 20] = {
        use DynvoxStatus::*;
        [
            Ok,
            Null,
            Misaligned,
            TooSmall,
            NoMapper,
            Busy,
            Overlap,
            Unknown,
            Config,
            Pose,
            Size,
            SizeChanged,
            TooMany,
            NoFrame,
            Value,
            Capacity,
            Snapshot,
            Callback,
            Time,
            Fix,
        ]
    };
    ALL.get(status as usize).map_or(c"no such status", |status| status.text()).as_ptr()
}
