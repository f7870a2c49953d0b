//! Digest of the tracks.

use super::Tracker;
use crate::digest::Digest;

impl Tracker<'_> {
    /// Takes the tracks by age, and their masks, into a digest.
    pub fn enter(&self, digest: &mut Digest) {
        for track in self.tracks.all() {
            track.enter(digest);
            self.masks_now().enter(&track.place, digest);
        }
    }
}
