//! What the camera did, and which matches its own motion listens to.

use super::{State, Tracker, claim::AMBIGUOUS, detection::Taken, track::Track};
use crate::geometry::Transform;

/// What the camera did in a frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraMotion {
    /// Camera to world, now.
    pub t_world_camera: Transform,
    /// Previous camera to current camera; `None` in the first frame and where it is only guessed.
    pub t_current_previous: Option<Transform>,
}

impl<'s> Tracker<'s> {
    /// Decides which matches the camera's egomotion listens to; the answer is a test by the match's position. Call after
    /// [`Tracker::claim`].
    pub fn guides_camera(&self, size: [usize; 2]) -> impl Fn(u32) -> bool + Clone + '_ {
        let large = f64::from(self.config.large_share) * size[0] as f64 * size[1] as f64;
        let mut withheld = 0u64;
        for (bit, detection) in self.detections.all().iter().enumerate() {
            let state = self.track_of(detection).map_or(State::Uncertain, |track| track.judgement.state());
            let out = match state {
                State::Dynamic => true,
                State::Static => false,
                State::Uncertain => self.masks_now().area(&detection.place) as f64 > large,
            };
            withheld |= u64::from(out) << bit;
        }
        move |index| match self.owner.get(index as usize) {
            Some(&AMBIGUOUS) => withheld == 0,
            Some(&owner) => owner == 0 || withheld >> (owner - 1) & 1 == 0,
            None => true,
        }
    }

    /// Notes how many matches were kept from the camera.
    pub fn note_withheld(&mut self, matches: u32) {
        self.report.matches_withheld = matches;
    }

    pub(crate) fn track_of(&self, detection: &Taken) -> Option<&Track> {
        self.tracks.all().get(detection.track.checked_sub(1)? as usize)
    }
}
