//! Digests of tracks and objects.

use super::Instances;
use crate::{digest::Digest, stage_digests::ObjectDigests};

impl Instances<'_> {
    /// Digest of the tracks by age, their masks, and what of them waits to be fused.
    pub fn tracks_digest(&self) -> u64 {
        let mut digest = Digest::default();
        for track in self.tracks.all() {
            track.enter(&mut digest);
            self.masks_now().enter(&track.place, &mut digest);
        }
        self.crops.enter(&mut digest);
        digest.finish()
    }

    /// Digests of the objects.
    pub fn object_digests(&self) -> ObjectDigests {
        ObjectDigests::of(self.objects.objects.iter().filter_map(|object| object.digest()))
    }
}
