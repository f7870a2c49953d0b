//! Rendering the map and reading it out.

use crate::{
    DynvoxMapper, DynvoxObjectSink, DynvoxPose, DynvoxStatus, DynvoxStore, DynvoxTriangle,
    DynvoxTriangleSink,
    given::{Owned, items_mut, output, read},
    handle::with,
    retired::Retiring,
};
use core::ffi::c_void;
use dynvox_core::{Serial, image::View, view::Triangle};

/// A rendered view of the map: buffers of the caller, any may be null. The view has the size of the
/// frames; its rows follow each other without padding.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxPicture {
    /// Pixels that each buffer holds, unless it is null.
    pub capacity: usize,
    /// Depth, m; 0 where there is no surface.
    pub depth_m: *mut f32,
    /// Three bytes a pixel: the surface's normal in camera axes, towards the camera, 1/127.
    pub normal: *mut i8,
    /// Three bytes a pixel: red, green, blue.
    pub colour: *mut u8,
    /// Number of observations of the surface.
    pub weight: *mut u8,
    /// Written: columns.
    pub width: usize,
    /// Written: rows.
    pub height: usize,
}

/// Renders the static map in the camera's segment from a pose in it.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `pose` is null or points to a pose; `picture` is null or points to a picture whose
/// buffers are as large as it says and overlap nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_raycast(
    mapper: *mut DynvoxMapper,
    pose: *const DynvoxPose,
    picture: *mut DynvoxPicture,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let pose = read(pose)?.transform()?;
            // The caller's picture says which buffers it has and how long they are.
            let mut to = read(picture.cast_const())?;
            let seen = mapper.raycast(&pose, &Serial)?;
            let depth_m = seen.depth_m().ok_or(DynvoxStatus::NoFrame)?;
            (to.width, to.height) = (depth_m.width(), depth_m.height());
            if to.capacity < to.width * to.height {
                return Err(DynvoxStatus::TooSmall);
            }
            fill(Some(depth_m), to.depth_m, buffer)?;
            fill(seen.normal(), to.normal.cast(), buffer)?;
            fill(seen.colour(), to.colour.cast(), buffer)?;
            fill(seen.weight(), to.weight, buffer)?;
            picture.write(to);
            Ok(())
        })
    }
}

/// Copies an image into a buffer, unless the buffer is null.
///
/// # Safety
/// `output` is null or points to as many pixels as the image has, which nothing else uses.
pub(crate) unsafe fn fill<T: Copy>(
    image: Option<View<'_, T>>,
    output: *mut T,
    mapper: &Owned,
) -> Result<(), DynvoxStatus> {
    let Some(image) = image.filter(|_| !output.is_null()) else { return Ok(()) };
    // SAFETY: the caller's promise.
    let output = unsafe { items_mut(output, image.width() * image.height(), mapper)? };
    output.iter_mut().zip(image.rows().flatten()).for_each(|(to, from)| *to = *from);
    Ok(())
}

/// Hands every triangle of the static map in the camera's segment to `sink`, and writes how many
/// there were to `count`, which may be null.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `count` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_triangles(
    mapper: *mut DynvoxMapper,
    sink: DynvoxTriangleSink,
    context: *mut c_void,
    count: *mut u64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            hand_over((sink, context, count), |mut sink| Ok(mapper.triangles(&mut sink)))
        })
    }
}

/// Hands every triangle of `mesh` to a caller's sink, with its context, and writes how many there
/// were to the count, which may be null.
///
/// # Safety
/// The count is null or points to a number.
pub(crate) unsafe fn hand_over(
    (sink, context, count): (DynvoxTriangleSink, *mut c_void, *mut u64),
    mesh: impl FnOnce(&mut dyn FnMut(Triangle)) -> Result<u64, DynvoxStatus>,
) -> Result<(), DynvoxStatus> {
    let sink = sink.ok_or(DynvoxStatus::Null)?;
    // SAFETY: only looked at.
    let count = if count.is_null() { None } else { Some(unsafe { output(count)? }) };
    let triangles = mesh(&mut |triangle| {
        let triangle = DynvoxTriangle::from(triangle);
        sink(context, &raw const triangle);
    })?;
    if let Some(count) = count {
        // SAFETY: not null and aligned, as checked; of the right type, as promised.
        unsafe { count.write(triangles) };
    }
    Ok(())
}

/// Evicts every block of the static map into `store`, which holds the entire map then. Writes the
/// number of stored blocks to `stored` and of those the store refused to `lost`; either may be
/// null.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `store` is null or points to a store; `stored` and `lost` are null or point to a
/// number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_stream_out(
    mapper: *mut DynvoxMapper,
    store: *const DynvoxStore,
    stored: *mut u32,
    lost: *mut u32,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let mut store = read(store)?;
            // Outputs are checked before blocks leave: an error evicts nothing.
            let stored = if stored.is_null() { None } else { Some(output(stored)?) };
            let lost = if lost.is_null() { None } else { Some(output(lost)?) };
            let report = mapper.stream_out(&mut store);
            if let Some(stored) = stored {
                stored.write(report.stored);
            }
            if let Some(lost) = lost {
                lost.write(report.lost);
            }
            Ok(())
        })
    }
}

/// Ends a sequence: prunes what is still in the window. Objects are lost; see dynvox_finish_with.
/// The map can be rendered and read out as before.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_finish(mapper: *mut DynvoxMapper) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            mapper.finish();
            Ok(())
        })
    }
}

/// Finishes like dynvox_finish; the objects that are still in the mapper leave to `objects`, which
/// may be null.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `objects` is null or points to a sink.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_finish_with(
    mapper: *mut DynvoxMapper,
    objects: *const DynvoxObjectSink,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            let mut retiring =
                Retiring { sink: DynvoxObjectSink::given(objects)?, mesh: mapper.config().mesh };
            mapper.finish_with(&mut retiring);
            Ok(())
        })
    }
}

/// Writes a pose as the upper three rows of its matrix, row by row: twelve numbers.
///
/// # Safety
/// `pose` is null or points to a pose, `matrix` is null or points to twelve numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_pose_matrix(
    pose: *const DynvoxPose,
    matrix: *mut f64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let (pose, matrix) =
        match unsafe { (read(pose).and_then(|pose| pose.transform()), output(matrix)) } {
            (Ok(pose), Ok(matrix)) => (pose, matrix),
            (Err(status), _) | (_, Err(status)) => return status,
        };
    for (at, &number) in pose.matrix_3x4().as_flattened().iter().enumerate() {
        // SAFETY: three rows of four.
        unsafe { matrix.add(at).write(number) };
    }
    DynvoxStatus::Ok
}
