//! The camera's pose in a frame: given, or estimated from matches or from depth.

use super::{
    Config, MotionSource, PoseOrigin, StereoFrame,
    accumulated::{AccumulatedError, PosePrecision},
    matched::MatchedFrame,
    search::Search,
    static_map::StaticMap,
};
use crate::{
    Capacity,
    attached::AttachedCells,
    egomotion::{
        Anchor, Egomotion, Estimator, MotionCovariance, MotionEstimate, SlowFrame, TimedMatches,
        icp::{self, IcpReport},
    },
    geometry::{MapSegment, StereoObservation, StereoRig, Transform},
    inertial::{InertialPrior, MeasuredMotion},
    memory::Carver,
    parallel::Executor,
    places::{FramePoints, PlaceCamera, PlaceView, Places, SegmentPose},
    rectify::self_calibration::SelfCalibration,
    scene_flow::{FlowMatcher, FlowStatus, Match},
    state::Visitor,
    tracking::{CameraMotion, EgomotionMask},
};

/// The camera, what its motion says about the rig, and the memory that an estimate needs.
#[derive(Debug)]
pub(super) struct Localization<'s> {
    pub camera: Egomotion,
    pub self_calibration: SelfCalibration,
    pub estimator: Estimator<'s>,
    /// Older frame that a camera which moves slowly is compared with.
    pub anchor: Anchor<'s>,
    /// Keyframes of the places that the camera has been at.
    pub places: Places<'s>,
    /// Search for a camera that was lost.
    pub search: Search,
    /// Inertial unit; `None` without one.
    pub inertial: Option<&'s mut InertialPrior>,
    /// Deviation of the pose from the surfaces in view.
    pub accumulated: AccumulatedError,
    /// True if the right image's rows are moved otherwise in the next frame than in this one: it
    /// then differs from this one's even where the camera stands.
    pub rows_moved: bool,
}

/// The camera's pose in a frame.
pub(super) struct Located {
    pub camera: CameraMotion,
    pub found: Found,
    /// The pose lies in another segment of the map than the one before.
    pub enters_segment: bool,
}

impl Located {
    /// Motion since the last frame, if it was estimated from this one.
    pub fn estimated_motion(&self) -> Option<Transform> {
        self.camera.t_current_previous.filter(|_| self.found.origin == PoseOrigin::Estimated)
    }
}

/// The camera before a frame.
struct LastPose {
    t_world_camera: Transform,
    segment: MapSegment,
    /// True if the pose is a guess: matches are sought with an earlier frame.
    over_several: bool,
}

/// Origin of a pose, and the report of the stage that found it.
pub(super) struct Found {
    pub origin: PoseOrigin,
    pub egomotion: Option<MotionEstimate>,
    pub icp: Option<IcpReport>,
    /// Matches that were excluded because they may move.
    pub matches_excluded: u32,
}

/// Deviation of a motion from which on it is imprecise, as a share of a voxel.
const IMPRECISE_SHARE: f64 = 0.5;

impl Found {
    /// Tells whether the motion may be off by a large share of a voxel.
    fn is_imprecise(&self, voxel_size_m: f32) -> bool {
        let covariance = self.egomotion.and_then(|motion| motion.covariance);
        let limit_m = IMPRECISE_SHARE * f64::from(voxel_size_m);
        covariance.is_some_and(|covariance| covariance.distance_sigma_m() > limit_m)
    }

    /// Covariance that this frame adds to the way of the camera. While an anchor holds the camera,
    /// the motion that began it stands for all of them: their errors do not add up.
    fn covariance_of_way(&self) -> Option<&MotionCovariance> {
        let estimate = self.egomotion.as_ref()?;
        if estimate.anchored { Some(&MotionCovariance::ZERO) } else { estimate.covariance.as_ref() }
    }

    fn new(origin: PoseOrigin) -> Self {
        Self { origin, egomotion: None, icp: None, matches_excluded: 0 }
    }
}

/// Rows by which the left and the right position of a match may differ where it says something
/// about the rig.
const ROW_DIFFERENCE_MAX_PX: f32 = 2.0;

/// Observations of a match by both cameras, before and now; `None` where the rows are too far
/// apart.
fn observations(rig: &StereoRig, m: &Match) -> Option<[StereoObservation; 2]> {
    let pairs = [(m.previous_left, m.previous_right), (m.current_left, m.current_right)];
    let aligned =
        pairs.iter().all(|(left, right)| (left[1] - right[1]).abs() <= ROW_DIFFERENCE_MAX_PX);
    aligned.then(|| pairs.map(|(left, right)| rig.observation(left, right)))
}

/// Parts of the image that say nothing of the camera's motion.
#[derive(Debug)]
pub(super) struct NoWitness<'a, 'i, 's> {
    /// Objects that may move.
    pub mask: &'a EgomotionMask<'a, 'i>,
    /// Cells that may be attached to the camera.
    pub attached: &'a AttachedCells<'s>,
}

/// Selected matches that may be used for the camera's motion. Masks are of the frame before: where
/// matches are with an earlier one, what moves is left to RANSAC.
fn still<'f>(
    seen: &'f MatchedFrame<'_, '_>,
    no_witness: &'f NoWitness<'_, '_, '_>,
    over_several: bool,
) -> impl Iterator<Item = &'f Match> + Clone {
    // One closure of three small values: the iterator lies on the stack many times over.
    seen.scene_flow.selection().iter().filter_map(move |&index| {
        (over_several || no_witness.mask.includes(index))
            .then(|| seen.scene_flow.refined().get(index as usize))
            .flatten()
            .filter(|m| !no_witness.attached.doubts(m))
    })
}

impl<'s> Localization<'s> {
    /// Bytes of the slab.
    pub const fn bytes(capacity: &Capacity) -> usize {
        Estimator::bytes(capacity)
            + Anchor::bytes(capacity)
            + Places::bytes(capacity)
            + InertialPrior::bytes()
    }

    /// Bytes of it that belong in large memory.
    pub const fn cold_bytes(capacity: &Capacity) -> usize {
        Places::bytes(capacity)
    }

    /// Places a camera that has not moved at the world's origin.
    pub fn new_in(capacity: &Capacity, config: &Config, carver: &mut Carver<'s>) -> Self {
        Self {
            camera: Egomotion::default(),
            self_calibration: SelfCalibration::new(&config.rig_settings),
            estimator: Estimator::new_in(capacity, carver),
            anchor: Anchor::new_in(capacity, carver),
            places: Places::new_in(capacity, carver),
            search: Search::Off,
            inertial: None,
            accumulated: AccumulatedError::default(),
            rows_moved: false,
        }
    }

    /// Precision of the pose in the frame.
    pub fn precision(&self, found: &Found, config: &Config) -> PosePrecision {
        if self.accumulated.is_large(config.volume.truncation_m, config.rig.focal_px) {
            PosePrecision::Displaced
        } else if found.is_imprecise(config.volume.voxel_size_m) {
            PosePrecision::Imprecise
        } else {
            PosePrecision::Precise
        }
    }

    /// Visits what lives from frame to frame.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        // Estimates keep nothing.
        let Self {
            camera,
            self_calibration,
            estimator: _,
            anchor,
            places,
            search,
            inertial,
            accumulated,
            rows_moved,
        } = self;
        camera.visit(visitor);
        anchor.visit(visitor);
        self_calibration.visit(visitor);
        search.visit_above(rows_moved, visitor);
        places.visit(visitor);
        accumulated.visit(visitor);
        // Without a unit the state is what it was before there was any.
        if let Some(inertial) = inertial {
            inertial.visit(visitor);
        }
    }

    /// Sets the pose the frame brings, or estimates it.
    pub fn locate<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        no_witness: &NoWitness<'_, '_, '_>,
        static_map: &mut StaticMap<'_>,
        executor: &E,
    ) -> Located {
        let (before, over_several) =
            (*self.camera.t_world_camera(), self.camera.since_reference() > 0);
        let (segment, was_lost) = (self.camera.segment(), self.camera.is_lost());
        let mut found = if let Some(t_world_camera) = &seen.frame.t_world_camera {
            self.camera.set_pose(t_world_camera);
            self.search = Search::Off;
            // There is no motion to the first pose.
            Found::new(if seen.number == 0 { PoseOrigin::First } else { PoseOrigin::Given })
        } else if seen.config.mapper.egomotion == MotionSource::Icp {
            let icp = (seen.number > 0).then(|| self.register_depth(seen, static_map, executor));
            // ICP needs a picture of the map, which the first frame does not have yet.
            Found { icp, ..Found::new(self.origin(icp.is_some())) }
        } else {
            match seen.flow_status {
                // One frozen camera: its matches would show a motion that did not happen.
                FlowStatus::Frozen => self.hold(seen),
                FlowStatus::Repeated
                    if !self.camera.may_stand(&seen.config.egomotion, seen.interval_s) =>
                // Two equal images are one delivered twice, unless the camera can have stopped by
                // now.
                {
                    self.hold(seen)
                }
                FlowStatus::Matched | FlowStatus::Repeated => {
                    self.estimate_from_matches(seen, no_witness, static_map, executor)
                }
                FlowStatus::First | FlowStatus::Refused => Found::new(PoseOrigin::First),
            }
        };
        // An older frame says more of a slow camera, if estimates alone lead from it to this one.
        if over_several || was_lost {
            self.anchor.clear();
        } else {
            self.correct_slow(seen, no_witness, &mut found);
        }
        if self.recognise(seen, still(seen, no_witness, over_several), &found) {
            found.origin = PoseOrigin::Relocalized;
            self.search = Search::Off;
            self.anchor.clear();
        }
        let enters_segment = self.camera.segment() != segment;
        // A guess says nothing of how the camera moved, nor does a pose given in another segment:
        // objects get no motion from them.
        let is_measured = match found.origin {
            PoseOrigin::Estimated | PoseOrigin::Relocalized => true,
            PoseOrigin::Given => !enters_segment,
            PoseOrigin::First | PoseOrigin::Extrapolated => false,
        };
        // After a guess the motion from the guessed pose, so that motions lead from pose to pose.
        let last_motion = || {
            if over_several {
                self.camera.t_world_camera().inverse() * before
            } else {
                *self.camera.t_current_previous()
            }
        };
        let t_current_previous: Option<Transform> = is_measured.then(last_motion);
        let from = LastPose { t_world_camera: before, segment, over_several };
        self.observe_turn(&found, &from);
        match (found.origin, found.covariance_of_way()) {
            (PoseOrigin::Estimated, Some(motion)) => self.accumulated.add(motion),
            // A guess is not fused: the surfaces in view stay what they are.
            (PoseOrigin::Estimated | PoseOrigin::Extrapolated, _) => {}
            _ => self.accumulated = AccumulatedError::default(),
        }
        let camera =
            CameraMotion { t_world_camera: *self.camera.t_world_camera(), t_current_previous };
        Located { camera, found, enters_segment }
    }

    /// Hands the frame's samples to the inertial unit, and its turn to the camera and to the search
    /// for matches.
    #[inline(never)]
    pub fn expect_turn(
        &mut self,
        frame: &StereoFrame<'_>,
        rig: &StereoRig,
        scene_flow: &mut FlowMatcher<'_>,
    ) {
        let since_reference = self.camera.since_reference();
        let t_world_camera = self.camera.t_world_camera();
        let predicted = self.inertial.as_mut().and_then(|inertial| {
            inertial.predict(frame.time_ns, frame.inertial, since_reference, t_world_camera)
        });
        self.camera.expect_turn(predicted);
        scene_flow.expect_turn(rig, self.camera.expected_turn());
    }

    /// Tells the inertial unit how the camera moved, as far as images or the caller know.
    #[inline(never)]
    fn observe_turn(&mut self, found: &Found, from: &LastPose) {
        let Some(inertial) = &mut self.inertial else { return };
        let (seen, estimate) = (self.camera.seen(), found.egomotion.as_ref());
        let estimated = estimate.and_then(|estimate| estimate.t_current_previous);
        // A unit learns from what images show, not from what it had a part in itself.
        let motion = seen.map(|seen| seen.t_current_reference).or(estimated);
        let motion = motion.map(|motion| motion.inverse());
        let sigma_rad = match (seen, estimate) {
            (Some(seen), _) => seen.sigma_rad,
            (None, Some(estimate)) => estimate.turn_sigma_rad(),
            (None, None) => 0.0,
        };
        let covariance = estimate.and_then(|estimate| estimate.covariance.as_ref());
        let way_sigma_m = covariance.map_or(0.0, |covariance| covariance.distance_sigma_m());
        let is_known = |origin| {
            matches!(origin, PoseOrigin::Estimated | PoseOrigin::Given | PoseOrigin::First)
        };
        let follows =
            is_known(found.origin) && !from.over_several && from.segment == self.camera.segment();
        // Given poses tell the turn as well.
        let is_given = follows && found.origin == PoseOrigin::Given;
        let given = is_given.then(|| from.t_world_camera.inverse() * *self.camera.t_world_camera());
        inertial.observe(&MeasuredMotion {
            t_reference_now: motion.or(given),
            sigma_rad,
            way_sigma_m,
            strong: seen
                .map_or_else(|| estimate.is_none_or(MotionEstimate::is_strong), |seen| seen.strong),
            over_several: from.over_several,
            turned: found.origin == PoseOrigin::Extrapolated && self.camera.is_turned(),
            refused: seen.is_some_and(|seen| seen.refused),
            t_world_before: follows.then_some(from.t_world_camera),
            t_world_camera: *self.camera.t_world_camera(),
            segment: self.camera.segment(),
        });
    }

    /// Hands the frame to the places. Returns whether they say that the camera is in another
    /// segment, in which it goes on.
    #[inline(never)]
    fn recognise<'m>(
        &mut self,
        seen: &'m MatchedFrame<'_, '_>,
        still: impl Iterator<Item = &'m Match> + Clone,
        found: &Found,
    ) -> bool {
        let rig = seen.config.scaled_rig();
        let view =
            PlaceView { rig: &rig, egomotion: &seen.config.egomotion, image: seen.frame.left };
        let is_measured = matches!(
            found.origin,
            PoseOrigin::Estimated | PoseOrigin::Relocalized | PoseOrigin::Given
        );
        let camera = PlaceCamera {
            frame: seen.number,
            pose: SegmentPose {
                segment: self.camera.segment(),
                t_world_camera: *self.camera.t_world_camera(),
            },
            t_current_previous: is_measured.then(|| *self.camera.t_current_previous()),
            covariance: found.covariance_of_way(),
            is_given: found.origin == PoseOrigin::Given,
        };
        let points = FramePoints { all: seen.scene_flow.refined().iter(), still };
        let joined = self.places.observe(&view, &camera, points, &mut self.estimator);
        if let Some(SegmentPose { segment, t_world_camera }) = &joined {
            self.camera.join_segment(*segment, t_world_camera);
        }
        joined.is_some()
    }

    /// Moves the camera on as before.
    fn hold(&mut self, seen: &MatchedFrame<'_, '_>) -> Found {
        self.camera.hold(seen.interval_s);
        Found::new(self.origin(true))
    }

    /// The origin of a pose that was estimated, if it was.
    pub(super) fn origin(&self, is_estimated: bool) -> PoseOrigin {
        match (is_estimated, self.camera.extrapolated_frames()) {
            (false, _) => PoseOrigin::First,
            (true, 0) => PoseOrigin::Estimated,
            (true, _) => PoseOrigin::Extrapolated,
        }
    }

    /// Estimates the motion from the matches the mask includes.
    #[inline(never)]
    fn estimate_from_matches<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        no_witness: &NoWitness<'_, '_, '_>,
        static_map: &mut StaticMap<'_>,
        executor: &E,
    ) -> Found {
        let matches = still(seen, no_witness, self.camera.since_reference() > 0);
        let excluded = seen.scene_flow.selection().len() - matches.clone().count();
        // The rig with the baseline that is in use, not the calibrated one.
        let (rig, was_lost) = (seen.config.scaled_rig(), self.camera.is_lost());
        // Without a way and a map before it, the guess is as good as any pose.
        let is_new = !self.camera.has_moved() && static_map.volume.pool().is_empty();
        let estimate = self.camera.step(
            &seen.config.egomotion,
            &rig,
            TimedMatches { interval_s: seen.interval_s, matches: matches.clone() },
            &mut self.estimator,
        );
        // A motion few matches agree with says nothing about the rig.
        if let Some(motion) = estimate.t_current_previous.filter(|_| estimate.is_strong()) {
            self.self_calibration.update(
                &rig,
                matches.filter_map(|m| observations(&rig, m)),
                &motion,
            );
        }
        // After a long loss the map, not the last pose, has to say where the camera is.
        let is_estimated = self.camera.extrapolated_frames() == 0;
        if was_lost && is_estimated && !is_new {
            self.search = Search::Guess;
        }
        let origin = if is_estimated {
            self.search_on(seen, static_map, executor)
        } else {
            PoseOrigin::Extrapolated
        };
        Found {
            egomotion: Some(estimate),
            matches_excluded: excluded as u32,
            ..Found::new(origin)
        }
    }

    /// Corrects the pose that an estimate led to by an older frame where the camera is slow.
    #[inline(never)]
    fn correct_slow(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        no_witness: &NoWitness<'_, '_, '_>,
        found: &mut Found,
    ) {
        // Along a weak direction the last motion went on, and says nothing of an older frame.
        let is_estimated = found.origin == PoseOrigin::Estimated && !self.rows_moved;
        let Some(estimate) =
            found.egomotion.as_mut().filter(|estimate| is_estimated && !estimate.weak.any())
        else {
            self.anchor.clear();
            return;
        };
        let rig = seen.config.scaled_rig();
        let frame = SlowFrame {
            config: &seen.config.egomotion,
            rig: &rig,
            matcher: seen.scene_flow,
            // Not over several frames: there is no anchor then.
            matches: still(seen, no_witness, false),
        };
        self.anchor.step(&frame, &mut self.camera, estimate, &mut self.estimator);
    }

    /// Registers the depth with the map as it appears from the last pose. All of the picture
    /// counts, what moves as well: the baseline knows no objects.
    fn register_depth<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        static_map: &mut StaticMap<'_>,
        executor: &E,
    ) -> IcpReport {
        let config = &seen.config.icp;
        let is_cast = static_map.cast(&seen.view(self.camera.t_world_camera()), executor);
        let mut report =
            if is_cast { static_map.register(seen, config, 1) } else { IcpReport::unpaired() };
        // Matches do not take part; they only tell how much of the image moves as depth says.
        report.matches = self.estimator.count_inliers(
            &seen.config.scaled_rig(),
            seen.selected(),
            &report.t_current_previous,
            icp::EXPLAINED_PX,
        );
        report.check_matches();
        self.camera.advance(report.motion());
        report
    }
}
