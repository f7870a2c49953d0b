//! Tracks and masks in a snapshot.

use super::Tracker;
use crate::snapshot::Archive;

impl Tracker<'_> {
    /// Writes or reads all that outlives a frame. Of the two mask buffers that is this frame's: the next frame empties the other one.
    pub(crate) fn archive(&mut self, archive: &mut impl Archive) {
        let [a, b] = &mut self.masks;
        if self.now == 0 { a } else { b }.archive(archive);
        self.tracks.archive(archive);
    }
}
