//! What a pixel of the frame shows.

use super::{Class, State, Tracker};

/// A thing that moves or could, as a pixel shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThingAt {
    /// What the detector calls it.
    pub class: Class,
    /// Number of its track; `None` where the table of tracks had no room.
    pub track: Option<u32>,
    /// What is known of its motion.
    pub state: State,
}

impl Tracker<'_> {
    /// What the pixel shows: the best detection of the last frame whose copy mask holds it, in constant time per detection. `None` for the
    /// street, which is everything no detection was taken for.
    pub fn at(&self, u: i32, v: i32) -> Option<ThingAt> {
        let masks = self.masks_now();
        let detection = self.detections.all().iter().find(|detection| masks.contains(&detection.place, u, v))?;
        let track = self.track_of(detection);
        Some(ThingAt {
            class: detection.class(),
            track: track.map(|track| track.id),
            state: track.map_or(State::Uncertain, |track| track.judgement.state()),
        })
    }
}
