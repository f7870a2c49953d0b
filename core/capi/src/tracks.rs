//! Tracks and reconstructed objects.

use crate::{
    DynvoxMapper, DynvoxPose, DynvoxStatus, DynvoxTriangleSink,
    given::{items_mut, output},
    handle::with,
    map::hand_over,
};
use core::ffi::c_void;
use dynvox_core::tracking::{MotionState, TrackReport};

/// Motion state of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum DynvoxMotionState {
    /// Not known yet.
    Uncertain = 0,
    /// The object stands.
    Static,
    /// The object moves.
    Dynamic,
}

/// A track as it stands after a frame.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxTrack {
    /// Id of the track, from 1, never used again.
    pub id: u32,
    /// Class of the object, as in DynvoxDetection.
    pub class_code: u8,
    /// 1 if the track was detected in this frame, else 0.
    pub detected: u8,
    /// 1 if the motion was measured in this frame, 0 if it is extrapolated.
    pub measured: u8,
    /// 1 if `t_world_object` is known, else 0.
    pub has_pose: u8,
    /// Motion state of the object.
    pub state: DynvoxMotionState,
    /// Score of its last detection.
    pub score: f32,
    /// First frame it was detected in.
    pub first_frame: u32,
    /// Last frame it was detected in.
    pub last_frame: u32,
    /// First column of its box, px.
    pub left: i32,
    /// First row of its box, px.
    pub top: i32,
    /// Columns of its box, px.
    pub width: i32,
    /// Rows of its box, px.
    pub height: i32,
    /// Speed over ground, m/s; negative while no motion was ever measured.
    pub speed_m_s: f32,
    /// Standard deviation of the speed, m/s.
    pub speed_sigma_m_s: f32,
    /// Centre of its matches in the world, m.
    pub center_world_m: [f64; 3],
    /// Pose of the object in the world.
    pub t_world_object: DynvoxPose,
    /// Matches assigned to it in this frame.
    pub matches: u32,
    /// Inliers of its motion among them.
    pub inliers: u32,
    /// Blocks of its volume; 0 where it is not reconstructed.
    pub blocks: u32,
}

impl From<MotionState> for DynvoxMotionState {
    fn from(state: MotionState) -> Self {
        match state {
            MotionState::Uncertain => Self::Uncertain,
            MotionState::Static => Self::Static,
            MotionState::Dynamic => Self::Dynamic,
        }
    }
}

impl From<&TrackReport> for DynvoxTrack {
    fn from(track: &TrackReport) -> Self {
        // C has no optional numbers: a negative speed stands for none.
        let [speed_m_s, speed_sigma_m_s] = track.speed_m_s.unwrap_or([-1.0, 0.0]);
        Self {
            id: track.id,
            class_code: track.class.code() as u8,
            detected: u8::from(track.detected),
            measured: u8::from(track.measured),
            has_pose: u8::from(track.t_world_object.is_some()),
            state: track.state.into(),
            score: track.score,
            first_frame: track.first_frame,
            last_frame: track.last_frame,
            left: track.pixels.left,
            top: track.pixels.top,
            width: track.pixels.width,
            height: track.pixels.height,
            speed_m_s,
            speed_sigma_m_s,
            center_world_m: track.center_world_m,
            t_world_object: (&track.t_world_object.unwrap_or_default()).into(),
            matches: track.matches,
            inliers: track.inliers,
            blocks: track.blocks,
        }
    }
}

/// Writes the tracks of the last frame, at most `capacity` of them, and to `count` how many there
/// are.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `tracks` is null or points to `capacity` tracks; `count` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_tracks(
    mapper: *mut DynvoxMapper,
    tracks: *mut DynvoxTrack,
    capacity: usize,
    count: *mut usize,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, buffer| {
            let count = output(count)?;
            let to = items_mut(tracks, capacity, buffer)?;
            to.iter_mut().zip(mapper.tracks()).for_each(|(to, track)| *to = (&track).into());
            count.write(mapper.tracks().count());
            Ok(())
        })
    }
}

/// Hands every triangle of a reconstructed object to `sink`, in the object's own frame
/// (`t_world_object` of its track brings it to the world), and writes how many there were to
/// `count`, which may be null. DYNVOX_STATUS_UNKNOWN where the track is not reconstructed now.
///
/// # Safety
/// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
/// uses it; `count` is null or points to a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_object_triangles(
    mapper: *mut DynvoxMapper,
    track_id: u32,
    sink: DynvoxTriangleSink,
    context: *mut c_void,
    count: *mut u64,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    unsafe {
        with(mapper, |mapper, _| {
            hand_over((sink, context, count), |mut sink| {
                // A track may have several volumes, one for each segment of its trajectory: the
                // latest counts.
                let of_track = mapper.objects().filter(|(summary, _)| summary.id == track_id);
                let (_, object) = of_track
                    .max_by_key(|(summary, _)| summary.segment_id)
                    .ok_or(DynvoxStatus::Unknown)?;
                Ok(object.volume().triangles(&mapper.config().mesh, &mut sink))
            })
        })
    }
}
