//! What a pixel of the frame shows.

use super::{Class, MotionState, Tracker};

/// A detected instance, as a pixel shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstanceAt {
    /// Class that the detector gives.
    pub class: Class,
    /// Number of its track; `None` where the table of tracks was full.
    pub track: Option<u32>,
    /// Motion state of the object.
    pub state: MotionState,
}

impl Tracker<'_> {
    /// The best instance of the last frame whose copy mask has the pixel, in constant time per
    /// instance; `None` for the static map.
    pub(crate) fn instance_at(&self, u: i32, v: i32) -> Option<InstanceAt> {
        let masks = self.masks.current();
        let instance =
            self.instances.all().iter().find(|instance| masks.contains(&instance.mask, u, v))?;
        let track = self.track_of(instance);
        Some(InstanceAt {
            class: instance.class(),
            track: track.map(|track| track.id),
            state: track.map_or(MotionState::Uncertain, |track| track.motion_state.state()),
        })
    }
}
