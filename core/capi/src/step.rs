//! Taking frames.

use crate::{
    DYNVOX_SAMPLES_BYTES, DYNVOX_SAMPLES_PACKED_10, DYNVOX_SAMPLES_PACKED_12, DynvoxDetection,
    DynvoxFrame, DynvoxImage, DynvoxMapper, DynvoxObjectSink, DynvoxPose, DynvoxReport,
    DynvoxSampleLayout, DynvoxStatus, DynvoxStore,
    given::{Owned, items, output, read},
    handle::with,
    inertial::samples,
    retired::Retiring,
};
use core::ptr;
use dynvox_core::{
    Serial, StereoFrame,
    image::{SampleLayout, View},
    tracking::{Class, Detection, MAX_DETECTIONS},
};

/// Processes one frame, on the calling thread: depth, motion, map. Evicted blocks go to `store`, or
/// are lost and counted where it is null. What was refused is counted in `report`, which may be
/// null.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `frame` is null or points to a frame whose images, detections and masks are as large as
/// it says; `store` is null or points to a store; `report` is null or points to a report.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_step(
    mapper: *mut DynvoxMapper,
    frame: *const DynvoxFrame,
    store: *const DynvoxStore,
    report: *mut DynvoxReport,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe { dynvox_step_with(mapper, frame, store, ptr::null(), report) }
}

/// Steps like dynvox_step; objects that leave the mapper within the step go to `objects`, which may
/// be null.
///
/// # Safety
/// As dynvox_step; `objects` is null or points to a sink.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_step_with(
    mapper: *mut DynvoxMapper,
    frame: *const DynvoxFrame,
    store: *const DynvoxStore,
    objects: *const DynvoxObjectSink,
    report: *mut DynvoxReport,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let frame = read(frame)?;
            // A store, a sink and a report are optional.
            let mut store = if store.is_null() { DynvoxStore::NONE } else { read(store)? };
            let mut retiring =
                Retiring { sink: DynvoxObjectSink::given(objects)?, mesh: mapper.config().mesh };
            let report = if report.is_null() { None } else { Some(output(report)?) };
            // Detections are converted in a buffer on the stack: MAX_DETECTIONS bounds it.
            let mut buffered = [NOTHING; MAX_DETECTIONS];
            let layout = layout(frame.layout)?;
            // A row takes less than twice its width; a width that is nonsense must not overflow.
            frame.width.checked_mul(2).ok_or(DynvoxStatus::Size)?;
            let row = layout.row_bytes(frame.width);
            let size = [frame.width, frame.height];
            // What lies over the left image lies over the rectified one.
            let rectified = mapper.config().rectification.as_ref();
            let rectified =
                rectified.map_or(size, |raw| [raw.width, raw.height].map(|n| n as usize));
            let frame_in_core = StereoFrame {
                left: image(frame.left, size, row, buffer)?.ok_or(DynvoxStatus::Null)?,
                right: image(frame.right, size, row, buffer)?.ok_or(DynvoxStatus::Null)?,
                colour: image(frame.colour, size, size[0], buffer)?,
                layout,
                class: None,
                detections: detections(&frame, &mut buffered, buffer)?,
                disparity_q8: disparity(&frame, rectified, buffer)?,
                ignored: image(frame.ignored, rectified, rectified[0], buffer)?,
                inertial: samples(frame.inertial, frame.inertial_count, buffer)?,
                time_ns: if frame.time_ns.is_null() { None } else { Some(read(frame.time_ns)?) },
                t_world_camera: if frame.t_world_camera.is_null() {
                    None
                } else {
                    Some(read(frame.t_world_camera)?.transform()?)
                },
            };
            let done = mapper.step_with(&frame_in_core, &Serial, &mut store, &mut retiring)?;
            if let Some(report) = report {
                report.write((&done).into());
            }
            Ok(())
        })
    }
}

/// Writes the left camera's pose in the last frame; the identity before the first.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `pose` is null or points to a pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_pose(
    mapper: *mut DynvoxMapper,
    pose: *mut DynvoxPose,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            output(pose)?.write(mapper.t_world_camera().into());
            Ok(())
        })
    }
}

fn layout(layout: DynvoxSampleLayout) -> Result<SampleLayout, DynvoxStatus> {
    match layout {
        DYNVOX_SAMPLES_BYTES => Ok(SampleLayout::Bytes),
        DYNVOX_SAMPLES_PACKED_10 => Ok(SampleLayout::Packed10),
        DYNVOX_SAMPLES_PACKED_12 => Ok(SampleLayout::Packed12),
        _ => Err(DynvoxStatus::Unknown),
    }
}

/// An image of the frame, whose last row has `row` items; none where its pixels are null.
///
/// # Safety
/// The image is as large as `size` says.
unsafe fn image<'a, T>(
    image: DynvoxImage,
    [width, height]: [usize; 2],
    row: usize,
    buffer: &Owned,
) -> Result<Option<View<'a, T>>, DynvoxStatus> {
    if image.pixels.is_null() {
        return Ok(None);
    }
    let before_last = height.checked_sub(1).and_then(|rows| rows.checked_mul(image.stride));
    let len = before_last.and_then(|pixels| pixels.checked_add(row)).ok_or(DynvoxStatus::Size)?;
    // SAFETY: the caller's promise; a pixel is bytes, so that no alignment is asked of it.
    let pixels = unsafe { items(image.pixels.cast::<T>(), len, buffer)? };
    View::with_stride(pixels, width, height, image.stride).map(Some).ok_or(DynvoxStatus::Size)
}

/// The frame's own disparity; none where it is null.
///
/// # Safety
/// It is as large as `size` says.
unsafe fn disparity<'a>(
    frame: &DynvoxFrame,
    [width, height]: [usize; 2],
    buffer: &Owned,
) -> Result<Option<View<'a, u16>>, DynvoxStatus> {
    if frame.disparity_q8.is_null() {
        return Ok(None);
    }
    let len = width.checked_mul(height).ok_or(DynvoxStatus::Size)?;
    // SAFETY: the caller's promise.
    let pixels = unsafe { items(frame.disparity_q8, len, buffer)? };
    View::new(pixels, width, height).map(Some).ok_or(DynvoxStatus::Size)
}

const NOTHING: Detection<'static> =
    Detection { class: Class::Other, score: 0.0, left: 0, top: 0, width: 0, height: 0, mask: &[] };

/// The frame's detections, copied to `buffered`.
///
/// # Safety
/// There are as many as the frame says, and their masks are as large as they say.
unsafe fn detections<'a>(
    frame: &DynvoxFrame,
    buffered: &'a mut [Detection<'a>; MAX_DETECTIONS],
    buffer: &Owned,
) -> Result<&'a [Detection<'a>], DynvoxStatus> {
    // SAFETY: the caller's promise.
    let given: &[DynvoxDetection] =
        unsafe { items(frame.detections, frame.detection_count, buffer)? };
    let buffered = buffered.get_mut(..given.len()).ok_or(DynvoxStatus::TooMany)?;
    for (slot, &DynvoxDetection { class_code, score, left, top, width, height, mask }) in
        buffered.iter_mut().zip(given)
    {
        let class = *Class::ALL.get(usize::from(class_code)).ok_or(DynvoxStatus::Unknown)?;
        let len = (width as usize).checked_mul(height as usize).ok_or(DynvoxStatus::Size)?;
        // SAFETY: the caller's promise.
        let mask = unsafe { items(mask, len, buffer)? };
        *slot = Detection { class, score, left, top, width, height, mask };
    }
    Ok(buffered)
}
