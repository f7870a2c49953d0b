//! What tests of other modules need to see.

use super::*;
use crate::{egomotion::Estimator, geometry::StereoRig, image::ViewMut};

pub(crate) use guided_matching::{MAX_GUIDED_MATCHES, step_px};
pub(crate) use match_assignment::MatchOwner;
pub(crate) use motion_filter::{MotionFilter, Observation};

/// The stages one by one, so that what lies between two of them can be looked at.
impl<'s> Tracker<'s> {
    pub(crate) fn test_ingest(
        &mut self,
        frame: u32,
        detections: &[Detection<'_>],
        size: [usize; 2],
        matches: FrameMatches<'_>,
    ) {
        self.ingest(frame, detections, size, &matches);
    }

    pub(crate) fn test_assign_matches(&mut self, matches: FrameMatches<'_>) {
        self.assign_matches(&matches);
    }

    pub(crate) fn test_estimate_motions(
        &mut self,
        rig: &StereoRig,
        camera: &CameraMotion,
        matches: FrameMatches<'_>,
        search: Option<GuidedMatching<'_, '_>>,
        estimator: &mut Estimator<'_>,
    ) {
        self.estimate_motions(&MotionInput { rig, camera: *camera, matches, search }, estimator);
    }

    pub(crate) fn test_mask_dynamic_depth(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        self.report.pixels_masked = self.mask_dynamic_depth(depth_m);
    }

    pub(crate) fn test_tracked(&mut self) -> Tracked<'_, 's> {
        Tracked { tracker: self }
    }

    pub(crate) fn test_report(&self) -> TrackingReport {
        self.report
    }

    /// Returns true if egomotion may use the refined match at that position.
    pub(crate) fn test_egomotion_includes(&self, index: u32) -> bool {
        self.egomotion_mask(&[]).includes(index)
    }

    pub(crate) fn test_instances(&self) -> &[Instance] {
        self.instances.all()
    }

    pub(crate) fn test_track_of(&self, instance: &Instance) -> Option<&Track> {
        self.track_of(instance)
    }

    pub(crate) fn test_tracks(&mut self) -> &mut [Track] {
        self.tracks.all_mut()
    }

    /// Returns the owner of the refined match at that position.
    pub(crate) fn test_match_owner(&self, index: usize) -> MatchOwner {
        self.refined_owner[index].get()
    }

    /// Flips the lowest bit of a track's pose.
    pub(crate) fn flip_track(&mut self, at: usize) {
        let number = &mut self.tracks.all_mut()[at].t_world_object.translation_m[0];
        *number = f64::from_bits(number.to_bits() ^ 1);
    }
}
