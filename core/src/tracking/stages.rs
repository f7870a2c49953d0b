//! The stages of tracking in a frame, each a value that the next one takes.

use super::{
    CameraMotion, Detection, EgomotionMask, FrameMatches, GuidedMatching, MotionInput, Tracker,
    TrackingReport, Trail,
};
use crate::{
    egomotion::Estimator,
    geometry::{StereoRig, Transform},
    image::{View, ViewMut},
};

impl<'s> Tracker<'s> {
    /// Begins frame `frame` of images of that size: validates its detections and associates them
    /// with tracks, which move in the image as the matches of the scene flow say.
    pub(crate) fn detect<'m>(
        &mut self,
        frame: u32,
        detections: &[Detection<'_>],
        size: [usize; 2],
        matches: FrameMatches<'m>,
    ) -> Detected<'_, 'm, 's> {
        self.ingest(frame, detections, size, &matches);
        Detected { tracker: self, matches }
    }
}

/// A frame's detections are associated with tracks.
#[derive(Debug)]
#[must_use]
pub(crate) struct Detected<'t, 'm, 's> {
    tracker: &'t mut Tracker<'s>,
    matches: FrameMatches<'m>,
}

impl<'t, 'm, 's> Detected<'t, 'm, 's> {
    /// Assigns the matches to instances.
    pub(crate) fn assign_matches(self) -> Assigned<'t, 'm, 's> {
        let Self { tracker, matches } = self;
        tracker.assign_matches(&matches);
        Assigned { tracker, matches }
    }
}

/// Its matches are assigned to instances as well.
#[derive(Debug)]
#[must_use]
pub(crate) struct Assigned<'t, 'm, 's> {
    tracker: &'t mut Tracker<'s>,
    matches: FrameMatches<'m>,
}

impl<'t, 's> Assigned<'t, '_, 's> {
    /// Which matches the camera's own motion may be estimated from.
    pub(crate) fn egomotion_mask(&self) -> EgomotionMask<'_, 's> {
        self.tracker.egomotion_mask(self.matches.refined)
    }

    /// Adds instances of what moves and no detector found, if that is asked for
    /// ([`super::SegmentationConfig`]). `search` is where more matches are searched for on objects
    /// that have few.
    pub(crate) fn segment_motion(
        self,
        rig: &StereoRig,
        camera: &CameraMotion,
        disparity_q8: View<'_, u16>,
        search: Option<GuidedMatching<'_, '_>>,
    ) -> Self {
        self.tracker.segment_motion(rig, camera, &self.matches, disparity_q8, search);
        self
    }

    /// Estimates each track's motion, state and pose. `search` is where more matches are searched
    /// for on objects that have few.
    pub(crate) fn estimate_motions(
        self,
        rig: &StereoRig,
        camera: &CameraMotion,
        search: Option<GuidedMatching<'_, '_>>,
        estimator: &mut Estimator<'_>,
    ) -> Tracked<'t, 's> {
        let input = MotionInput { rig, camera: *camera, matches: self.matches, search };
        self.tracker.estimate_motions(&input, estimator);
        Tracked { tracker: self.tracker }
    }
}

/// Its tracks have their motions, states and poses.
#[derive(Debug)]
#[must_use]
pub struct Tracked<'t, 's> {
    pub(super) tracker: &'t mut Tracker<'s>,
}

impl<'s> Tracked<'_, 's> {
    /// Sets the depth of what moves or may move to 0, so that the static map does not get it.
    pub(crate) fn mask_dynamic_depth(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        self.tracker.report.pixels_masked = self.tracker.mask_dynamic_depth(depth_m);
    }

    /// Visits where objects were before they were known to move.
    pub(crate) fn take_trails(&mut self, t_world_camera: &Transform, visit: impl FnMut(&Trail)) {
        self.tracker.segmenter.take_trails(t_world_camera, visit);
    }

    /// The tracks with their instances and masks.
    pub(crate) fn tracker(&self) -> &Tracker<'s> {
        self.tracker
    }

    /// Ends the frame: masks are kept for the next one.
    pub(crate) fn commit(self) -> TrackingReport {
        self.tracker.commit();
        self.tracker.report.mask_words = self.tracker.masks.current().peak() as u32;
        self.tracker.report
    }
}
