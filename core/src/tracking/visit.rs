//! Tracks and masks as state.

use super::Tracker;
use crate::{invariants::Invariants, state::Visitor};

impl Tracker<'_> {
    /// Says what must hold of the tracks after a frame.
    pub(crate) fn check_invariants(&self, invariants: &mut Invariants) {
        self.tracks.check_invariants(self.frame, self.instances.all().len(), invariants);
    }

    /// Visits all that outlives a frame. Only this frame's mask store does: the next frame empties
    /// the other one.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            masks,
            tracks,
            // Told by the caller.
            config: _,
            // Belong to one frame.
            instances: _,
            refined_owner: _,
            sparse_owner: _,
            guided_matches: _,
            frame: _,
            size: _,
            report: _,
        } = self;
        masks.current_mut().visit(visitor);
        tracks.visit(visitor);
    }
}
