//! What holds the map together beyond the camera's own motion: loops, and fixes of the caller's.

use crate::{
    DynvoxMapper, DynvoxPose, DynvoxStatus,
    given::{output, read},
    handle::with,
};
use dynvox_core::{egomotion::MotionCovariance, places::PoseFix};

/// Writes the change from the world as it is driven to the one after all loops and fixes, at the
/// camera: ROS's transform from `map` to `odom`. Reports, planning maps and objects are in the
/// world as driven, which never jumps.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `change` is null or points to a pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_closed_world(
    mapper: *mut DynvoxMapper,
    change: *mut DynvoxPose,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            output(change)?.write(DynvoxPose::from(&mapper.t_closed_driven()));
            Ok(())
        })
    }
}

/// Takes a pose of the camera in the last frame that something else measured, in the world of the
/// first camera, with its covariance row by row: rotation (rad), then translation (m), in the
/// camera's axes. Like a loop it moves the keyframes, ten frames later; one that all else
/// contradicts is taken out. The camera goes on in the world as driven.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `pose` is null or points to a pose; `covariance` is null or points to 36 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_add_fix(
    mapper: *mut DynvoxMapper,
    pose: *const DynvoxPose,
    covariance: *const f64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let matrix: [[f64; 6]; 6] = read(covariance.cast())?;
            let fix = PoseFix {
                t_world_camera: read(pose)?.transform()?,
                covariance: MotionCovariance::from_matrix(&matrix),
            };
            Ok(mapper.add_fix(&fix)?)
        })
    }
}

/// Takes a position of the camera in the last frame, m, with its standard deviations along the axes
/// of the world, m, as dynvox_add_fix takes a pose.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `position_m` and `sigma_m` are null or point to three numbers each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_add_position(
    mapper: *mut DynvoxMapper,
    position_m: *const f64,
    sigma_m: *const f64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let position_m: [f64; 3] = read(position_m.cast())?;
            let sigma_m: [f64; 3] = read(sigma_m.cast())?;
            Ok(mapper.add_position(position_m, sigma_m)?)
        })
    }
}

/// Takes the direction that is up in the last frame, in the camera's axes and in those of the first
/// camera, with the standard deviation of its angle, rad, as dynvox_add_fix takes a pose. It holds
/// roll and pitch, and with them the height of a long way.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `up_camera` and `up_world` are null or point to three numbers each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_add_vertical(
    mapper: *mut DynvoxMapper,
    up_camera: *const f64,
    up_world: *const f64,
    sigma_rad: f64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let up_camera: [f64; 3] = read(up_camera.cast())?;
            let up_world: [f64; 3] = read(up_world.cast())?;
            Ok(mapper.add_vertical(up_camera, up_world, sigma_rad)?)
        })
    }
}
