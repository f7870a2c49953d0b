//! What a frame's tracks came to, as plain values.

use super::{Class, DetectionCount, State, TrackCount, Tracker, follow::motion_world, pose::transform};
use crate::{geometry::Transform, masks::PixelBox};

/// A track as it stands after a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackReport {
    /// Its number, from 1, never used again.
    pub id: u32,
    /// What it is, by majority of its sightings.
    pub class: Class,
    /// Whether it moves.
    pub state: State,
    /// Score of its last detection.
    pub score: f32,
    /// Whether it was seen in this frame.
    pub seen: bool,
    /// First frame it was seen in.
    pub first_frame: u32,
    /// Last frame it was seen in.
    pub last_frame: u32,
    /// Frames it was seen in.
    pub sightings: u32,
    /// Box in the left image, where it was last seen.
    pub pixels: PixelBox,
    /// Speed over ground and its error, one sigma, m/s; `None` while no motion was ever measured. Of a static object it is what was
    /// measured, although its motion is taken to be none.
    pub speed_m_s: Option<[f32; 2]>,
    /// Whether the motion was measured in this frame; if not it is the last one's.
    pub measured: bool,
    /// Middle of its matches in the world, before this frame's motion, m.
    pub center_world_m: [f64; 3],
    /// Motion over ground within this frame, as [`crate::tracking`] says; identity for a static object.
    pub motion_world: Transform,
    /// Its frame to the world; `None` while its poses do not connect.
    pub t_world_object: Option<Transform>,
    /// Matches on it in this frame.
    pub matches: u32,
    /// Of these, explained by its motion.
    pub inliers: u32,
    /// Blocks of its volume.
    pub blocks: u32,
}

/// One frame's detections and tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TrackingReport {
    /// What became of the detections.
    pub detections: DetectionCount,
    /// What became of the tracks.
    pub tracks: TrackCount,
    /// Matches kept out of the camera's own motion.
    pub matches_withheld: u32,
    /// Pixels whose depth was kept out of the static map.
    pub pixels_cleared: u32,
}

impl Tracker<'_> {
    /// What the last frame came to.
    pub fn report(&self) -> &TrackingReport {
        &self.report
    }

    /// The tracks as they stand, by age; without those too small to be reconstructed of which no motion was ever measured. Of their volumes
    /// nothing is known here: [`TrackReport::blocks`] is 0.
    pub fn tracks(&self) -> impl Iterator<Item = TrackReport> + '_ {
        let interval_s = f64::from(self.config.frame_interval_s);
        self.tracks.all().iter().filter(|track| !track.is_tentative()).map(move |track| TrackReport {
            id: track.id,
            class: track.class(),
            state: track.judgement.state(),
            score: track.score,
            seen: track.detection > 0,
            first_frame: track.first_frame,
            last_frame: track.last_frame,
            sightings: track.sightings,
            pixels: track.place.pixels,
            speed_m_s: track.filter.is_known().then(|| [track.filter.speed()[0] as f32, track.sigma_m_s]),
            measured: track.measured == 1,
            center_world_m: track.filter.center_world().coords.into(),
            motion_world: motion_world(track, interval_s),
            t_world_object: (track.chain > 0).then(|| transform(&track.t_world_object)),
            matches: track.matches,
            inliers: track.inliers,
            blocks: 0,
        })
    }
}
