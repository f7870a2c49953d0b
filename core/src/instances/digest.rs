//! Digest of tracks and objects.

use super::Instances;
use crate::digest::Digest;

impl<'s> Instances<'s> {
    /// Digest of all that later frames depend on: tracks by age, objects by position.
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        for track in self.tracks.all() {
            let numbers = [track.id, track.class, track.first_frame, track.last_frame, track.chain, track.chains, track.inliers];
            numbers.iter().for_each(|&number| digest.u64(u64::from(number)));
            digest.u64(track.judgement.state() as u64);
            track.t_world_object.iter().for_each(|&number| digest.f64(number));
            track.filter.rate().iter().for_each(|&number| digest.f64(number));
            digest.u64(self.masks_now().area(&track.place) as u64);
        }
        for object in &self.objects.objects {
            digest.u64(object.summary.map_or(0, |summary| u64::from(summary.id) << 32 | u64::from(summary.frames)));
            digest.u64(object.volume.digest());
        }
        digest.finish()
    }
}
