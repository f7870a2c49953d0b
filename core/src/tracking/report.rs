//! Reports of detections and tracks, as plain values.

use super::{Class, DetectionCount, MotionState, Track, TrackCount};
use crate::{geometry::Transform, masks::PixelBox};

/// A track as it stands after a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackReport {
    /// Id of the track, from 1, never used again.
    pub id: u32,
    /// Class, by majority of the sightings.
    pub class: Class,
    /// Motion state of the track.
    pub state: MotionState,
    /// Score of its last detection.
    pub score: f32,
    /// True if the track was detected in this frame.
    pub detected: bool,
    /// First frame it was detected in.
    pub first_frame: u32,
    /// Last frame it was detected in.
    pub last_frame: u32,
    /// Frames it was detected in.
    pub sightings: u32,
    /// Box in the left image, where it was last detected.
    pub pixels: PixelBox,
    /// Speed over ground and its error, one sigma, m/s; `None` while no motion was ever measured,
    /// and once the last one is too old to tell a state. For a static object it is what was
    /// measured, although its motion is taken to be the identity.
    pub speed_m_s: Option<[f32; 2]>,
    /// True if the motion was measured in this frame, false if it is extrapolated.
    pub measured: bool,
    /// Centre of its matches in the world, before this frame's motion, m.
    pub center_world_m: [f64; 3],
    /// Motion over ground within this frame, see [`crate::tracking`]; identity for a static object.
    pub motion_world: Transform,
    /// Pose of the object in the world; `None` outside a trajectory segment.
    pub t_world_object: Option<Transform>,
    /// Matches assigned to it in this frame.
    pub matches: u32,
    /// Inliers of its motion among them.
    pub inliers: u32,
    /// Blocks of its volume.
    pub blocks: u32,
}

/// One frame's detections and tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct TrackingReport {
    /// Counts of detections.
    pub detections: DetectionCount,
    /// Counts of associations with tracks.
    pub tracks: TrackCount,
    /// Pixels whose depth was kept out of the static map.
    pub pixels_masked: u32,
    /// Most words of masks in use: what `capacity.mask_words` bounds.
    pub mask_words: u32,
    /// Matches excluded from the camera's own motion, because they may move.
    pub matches_excluded: u32,
}

impl TrackingReport {
    /// Returns the number of items that should have been used and were refused: detections, tracks
    /// and masks.
    pub fn refused(&self) -> u32 {
        self.detections.refused() + self.tracks.refused + self.tracks.masks_lost
    }
}

impl TrackReport {
    /// A track as it stands after a frame. Volumes are not known here: `blocks` is 0.
    pub(super) fn new(track: &Track, interval_s: f64) -> Self {
        Self {
            id: track.id,
            class: track.class(),
            state: track.motion_state.state(),
            score: track.score,
            detected: track.instance.is_some(),
            first_frame: track.first_frame,
            last_frame: track.last_frame,
            sightings: track.sightings,
            pixels: track.mask.pixels,
            speed_m_s: track.has_speed().then(|| [track.filter.speed()[0] as f32, track.sigma_m_s]),
            measured: track.measured.get(),
            center_world_m: track.filter.center_world().coords.into(),
            motion_world: track.motion_world(interval_s),
            t_world_object: (track.segment_len > 0).then_some(track.t_world_object),
            matches: track.matches,
            inliers: track.inliers,
            blocks: 0,
        }
    }
}
