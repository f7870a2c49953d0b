//! The mapper for C.
//!
//! Every function checks what it is given and answers with a [`DynvoxStatus`]; what it cannot check
//! (that a pointer is to as many bytes as it says) stands in the comments, which become the
//! header's (`include/dynvox.h`, written by cbindgen and compared in the tests).
//!
//! Memory: none but the caller's buffer. It holds a small head (what a handle points to: the
//! mapper's own fields) and, behind it, the slab.
#![no_std]

// A library by itself must name a panic handler and an allocator, though neither is ever reached.
#[cfg(feature = "std")]
extern crate std;

mod callback;
mod capacity;
mod config;
mod disparity;
mod given;
mod handle;
mod inertial;
mod loops;
mod map;
mod plan;
mod raw;
mod retired;
mod snapshot;
mod status;
mod step;
mod tracks;
mod two_buffers;
mod types;
mod work;

pub use callback::{
    DynvoxBlock, DynvoxLoadedBlock, DynvoxStore, DynvoxTriangle, DynvoxTriangleSink, DynvoxVertex,
};
pub use capacity::{
    DYNVOX_PROFILE_DESKTOP, DYNVOX_PROFILE_ONBOARD, DYNVOX_PROFILE_SMALL, DYNVOX_PROFILE_TINY,
    DynvoxBudget, DynvoxCapacity, DynvoxProfile, dynvox_capacity_for_budget,
    dynvox_capacity_of_profile,
};
pub use config::{
    DYNVOX_SETTINGS_BYTES, DynvoxConfig, DynvoxRig, dynvox_config_default, dynvox_config_problem,
    dynvox_config_set,
};
pub use disparity::{DynvoxDisparity, dynvox_disparity};
pub use handle::{DynvoxMapper, dynvox_alignment, dynvox_bytes, dynvox_create, dynvox_destroy};
pub use inertial::{
    DynvoxInertialDoubt, DynvoxInertialReport, DynvoxInertialSample, DynvoxInertialUnit,
    dynvox_config_inertial,
};
pub use loops::{dynvox_add_fix, dynvox_add_position, dynvox_add_vertical, dynvox_closed_world};
pub use map::{
    DynvoxPicture, dynvox_finish, dynvox_finish_with, dynvox_pose_matrix, dynvox_raycast,
    dynvox_stream_out, dynvox_triangles,
};
pub use plan::{
    DynvoxFreePath, DynvoxMovingBox, DynvoxPathEnd, DynvoxRobotCylinder, DynvoxWindow,
    dynvox_moving_boxes, dynvox_ray, dynvox_sweep, dynvox_update_planning_maps,
};
pub use raw::{
    DYNVOX_LENS_DOUBLE_SPHERE, DYNVOX_LENS_EQUIDISTANT, DYNVOX_LENS_EXTENDED_UNIFIED,
    DYNVOX_LENS_GENERAL, DYNVOX_LENS_RADIAL_TANGENTIAL, DynvoxLensModel, DynvoxRawCamera,
    DynvoxRawRig, dynvox_config_raw,
};
pub use retired::{DynvoxObjectSink, DynvoxRetired, dynvox_retired_triangles};
pub use snapshot::{DynvoxRead, DynvoxWrite, dynvox_restore, dynvox_save};
pub use status::{DynvoxStatus, dynvox_status_text};
pub use step::{dynvox_pose, dynvox_step, dynvox_step_with};
pub use tracks::{DynvoxMotionState, DynvoxTrack, dynvox_object_triangles, dynvox_tracks};
pub use two_buffers::{
    DynvoxTwoBuffers, dynvox_bytes_in_two, dynvox_create_in_two, dynvox_restore_in_two,
};
pub use types::{
    DYNVOX_SAMPLES_BYTES, DYNVOX_SAMPLES_PACKED_10, DYNVOX_SAMPLES_PACKED_12, DynvoxDetection,
    DynvoxFrame, DynvoxImage, DynvoxPose, DynvoxPoseOrigin, DynvoxReport, DynvoxSampleLayout,
    DynvoxSeverity,
};
pub use work::{DynvoxWork, dynvox_work_bound};
