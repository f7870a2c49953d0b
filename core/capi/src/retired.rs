//! Objects that leave the mapper, within a step or at the end.

use crate::{
    DynvoxMotionState, DynvoxPose, DynvoxStatus, DynvoxTriangle, DynvoxTriangleSink,
    given::{output, read},
};
use core::ffi::c_void;
use dynvox_core::objects::{ObjectSink, RetiredObject};
use dynvox_core::view::MeshConfig;
use dynvox_core::volume::Volume;

/// An object that leaves. Valid during the call.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxRetired {
    /// Number of its track.
    pub id: u32,
    /// Number of the trajectory segment within the track.
    pub segment_id: u32,
    /// Class of the object, as in DynvoxDetection.
    pub class_code: u8,
    /// Motion state of the object.
    pub state: DynvoxMotionState,
    /// First frame it was fused in.
    pub first_frame: u32,
    /// Last frame it was fused in.
    pub last_frame: u32,
    /// Frames it was fused in.
    pub frames: u32,
    /// Blocks of its volume.
    pub blocks: u32,
    /// Pose of the object in the world when it was fused last.
    pub t_world_object: DynvoxPose,
    /// For dynvox_retired_triangles.
    pub volume: *const c_void,
}

/// The caller's sink for objects that leave. Called on the thread of the step, which waits for it;
/// must not call the same mapper.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxObjectSink {
    /// Handed to the function.
    pub context: *mut c_void,
    /// Takes an object. Null: none is reported.
    pub retire: Option<extern "C" fn(context: *mut c_void, object: *const DynvoxRetired)>,
}

impl DynvoxObjectSink {
    /// The caller's sink, or one that takes nothing where it is null.
    ///
    /// # Safety
    /// `sink` is null or points to a sink.
    pub(crate) unsafe fn given(sink: *const Self) -> Result<Self, DynvoxStatus> {
        if sink.is_null() {
            return Ok(Self { context: core::ptr::null_mut(), retire: None });
        }
        // SAFETY: the caller's promise.
        unsafe { read(sink) }
    }
}

/// Target of `DynvoxRetired::volume`.
struct RetiredVolume<'v, 's> {
    volume: &'v Volume<'s>,
    mesh: MeshConfig,
}

/// A sink, and how its objects are meshed.
pub(crate) struct Retiring {
    pub sink: DynvoxObjectSink,
    pub mesh: MeshConfig,
}

impl ObjectSink for Retiring {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        let Some(retire) = self.sink.retire else { return };
        let (summary, volume) =
            (&object.summary, RetiredVolume { volume: object.volume, mesh: self.mesh });
        // Valid while `retire` runs, and no longer.
        let object = DynvoxRetired {
            id: summary.id,
            segment_id: summary.segment_id,
            class_code: summary.class.code() as u8,
            state: summary.state.into(),
            first_frame: summary.first_frame,
            last_frame: summary.last_frame,
            frames: summary.frames,
            blocks: object.volume.pool().len() as u32,
            t_world_object: (&summary.t_world_object).into(),
            volume: (&raw const volume).cast(),
        };
        retire(self.sink.context, &raw const object);
    }
}

/// Hands every triangle of an object that leaves to `sink`, in the object's own frame, and writes
/// how many there were to `count`, which may be null. Only within the call that reports the object.
///
/// # Safety
/// `object` is null or what the caller's DynvoxObjectSink was handed, within that call; `count` is
/// null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_retired_triangles(
    object: *const DynvoxRetired,
    sink: DynvoxTriangleSink,
    context: *mut c_void,
    count: *mut u64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let object = match unsafe { read(object) } {
        Ok(object) if !object.volume.is_null() => object,
        Ok(_) => return DynvoxStatus::Null,
        Err(status) => return status,
    };
    let Some(sink) = sink else { return DynvoxStatus::Null };
    // SAFETY: written by `retire`, in whose call this is.
    let RetiredVolume { volume, mesh } = unsafe { &*object.volume.cast::<RetiredVolume<'_, '_>>() };
    let triangles = volume.triangles(mesh, &mut |triangle| {
        let triangle = DynvoxTriangle::from(triangle);
        sink(context, &raw const triangle);
    });
    // The count is optional.
    if !count.is_null() {
        // SAFETY: not null; the rest is the caller's promise.
        match unsafe { output(count) } {
            // SAFETY: checked.
            Ok(count) => unsafe { count.write(triangles) },
            Err(status) => return status,
        }
    }
    DynvoxStatus::Ok
}
