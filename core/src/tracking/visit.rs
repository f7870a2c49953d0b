//! Tracks and masks as state.

use super::Tracker;
use crate::state::Visitor;

impl Tracker<'_> {
    /// Visits all that outlives a frame. Of the two mask buffers that is this frame's: the next frame empties the other one.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            masks: [a, b],
            now,
            tracks,
            // Given by the caller, or of one frame alone.
            config: _,
            detections: _,
            owner: _,
            sparse_owner: _,
            looked: _,
            frame: _,
            report: _,
        } = self;
        if *now == 0 { a } else { b }.visit(visitor);
        tracks.visit(visitor);
    }
}
