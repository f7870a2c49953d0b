//! What tests of other modules need to see.

use super::*;

pub(crate) use claim::AMBIGUOUS;
pub(crate) use filter::{Filter, Sighting};
pub(crate) use look::{LOOKS, step_px};

impl<'s> Tracker<'s> {
    /// Flips the lowest bit of where a track's object lies.
    pub(crate) fn flip_track(&mut self, at: usize) {
        let number = &mut self.all_mut()[at].t_world_object[4];
        *number = f64::from_bits(number.to_bits() ^ 1);
    }

    pub(crate) fn all_mut(&mut self) -> &mut [Track] {
        self.tracks.all_mut()
    }

    /// For each refined match the position of the detection it lies on, plus 1.
    pub(crate) fn owner(&self) -> &[u8] {
        self.owner
    }
}
