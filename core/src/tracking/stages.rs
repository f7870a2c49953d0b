//! The stages of tracking in a frame, each a value that the next one takes.

use super::{
    CameraMotion, Class, EgomotionMask, FrameMatches, GuidedMatching, Instance, MotionInput,
    OwnerCode, Track, Tracker, TrackingReport,
};
use crate::{egomotion::Estimator, geometry::StereoRig, image::ViewMut, masks::PixelBox};

/// A frame's detections are associated with tracks.
#[derive(Debug)]
#[must_use]
pub(crate) struct Detected<'t, 'm, 's> {
    tracker: &'t mut Tracker<'s>,
    matches: FrameMatches<'m>,
}

impl<'t, 'm, 's> Detected<'t, 'm, 's> {
    pub(super) fn new(tracker: &'t mut Tracker<'s>, matches: FrameMatches<'m>) -> Self {
        Self { tracker, matches }
    }

    /// Assigns the matches to instances.
    pub(crate) fn assign_matches(self) -> Assigned<'t, 'm, 's> {
        let Self { tracker, matches } = self;
        tracker.assign_matches(&matches);
        Assigned { tracker, matches }
    }
}

/// Tracker whose matches are assigned to instances.
#[derive(Debug)]
#[must_use]
pub(crate) struct Assigned<'t, 'm, 's> {
    tracker: &'t mut Tracker<'s>,
    matches: FrameMatches<'m>,
}

impl<'t, 'm, 's> Assigned<'t, 'm, 's> {
    /// The matches that the camera's own motion may be estimated from.
    pub(crate) fn egomotion_mask(&self) -> EgomotionMask<'_, 's> {
        self.tracker.egomotion_mask(self.matches.refined)
    }

    /// The frame's matches.
    pub(crate) fn matches(&self) -> FrameMatches<'m> {
        self.matches
    }

    /// Returns the owners of the refined and of the sparse matches.
    pub(crate) fn match_owners(&self) -> [&[OwnerCode]; 2] {
        self.tracker.matches.match_owners()
    }

    /// The instances of the frame.
    pub(crate) fn instances(&self) -> &[Instance] {
        self.tracker.instances.all()
    }

    /// Adds an instance of class [`Class::MovingObject`] with the pixels of a box that are its own,
    /// without those of other instances.
    pub(crate) fn add_moving_object(
        &mut self,
        pixels: PixelBox,
        score: f32,
        is_own: impl Fn(i32, i32) -> bool,
    ) -> Added {
        let Tracker { masks, instances, size, .. } = &mut *self.tracker;
        let masks = masks.current_mut();
        let Some(mask) = masks.alloc(pixels) else { return Added::Full };
        masks.fill(&mask, is_own);
        let whole = masks.area(&mask);
        instances.all().iter().for_each(|instance| masks.subtract(&mask, &instance.mask));
        if 3 * masks.area(&mask) <= 2 * whole {
            masks.free_last(mask);
            return Added::Covered;
        }
        if instances.add(mask, Class::MovingObject, score, size[0]) {
            Added::Yes
        } else {
            masks.free_last(mask);
            Added::Full
        }
    }

    /// Associates the instances from position `first` on with tracks, and assigns to them the
    /// matches that no instance has.
    pub(crate) fn associate_from(&mut self, first: usize) {
        self.tracker.associate_from(first, &self.matches);
    }

    /// Forgets the motion and the poses of all tracks, which lie in a frame of reference that the
    /// camera has left. Tracks keep their numbers, masks and classes.
    pub(crate) fn restart_motions(&mut self) {
        self.tracker.tracks.all_mut().iter_mut().for_each(Track::restart_motion);
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

/// The fate of an instance that was not detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Added {
    /// It is an instance of the frame.
    Yes,
    /// Other instances have a third of its pixels or more.
    Covered,
    /// There was no space for it.
    Full,
}

/// Tracker whose tracks have their motions, states and poses.
#[derive(Debug)]
#[must_use]
pub struct Tracked<'t, 's> {
    pub(super) tracker: &'t mut Tracker<'s>,
}

impl<'s> Tracked<'_, 's> {
    /// Sets the depth of what moves or may move to 0, so that the static map does not get it.
    pub(crate) fn mask_dynamic_depth(&mut self, depth_m: &mut ViewMut<'_, f32>) {
        self.tracker.mask_dynamic_depth(depth_m);
    }

    /// Counts pixels of what moves that were removed besides.
    pub(crate) fn add_masked(&mut self, pixels: u32) {
        self.tracker.report.pixels_masked += pixels;
    }

    /// The tracks with their instances and masks.
    pub(crate) fn tracker(&self) -> &Tracker<'s> {
        self.tracker
    }

    /// Ends the frame: masks are kept for the next one.
    pub(crate) fn commit(self) -> TrackingReport {
        self.tracker.commit()
    }
}
