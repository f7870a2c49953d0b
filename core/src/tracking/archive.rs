//! Tracks and masks as state.

use super::Tracker;
use crate::snapshot::Archive;

impl Tracker<'_> {
    /// Visits all that outlives a frame. Of the two mask buffers that is this frame's: the next frame empties the other one.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
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
        if *now == 0 { a } else { b }.archive(archive);
        tracks.archive(archive);
    }
}
