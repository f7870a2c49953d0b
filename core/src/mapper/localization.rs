//! The camera's pose in a frame: given, or estimated from matches or from depth.

use super::{Config, MotionSource, PoseOrigin, StereoFrame};
use crate::{
    egomotion::{
        Egomotion, Estimator, MotionEstimate,
        icp::{self, IcpConfig, IcpReport, MapPicture},
    },
    geometry::{StereoObservation, StereoRig, Transform},
    image::View,
    parallel::Executor,
    rectify::self_calibration::SelfCalibration,
    scene_flow::{FlowMatcher, FlowStatus, Match},
    tracking::{CameraMotion, EgomotionMask},
    view::Raycaster,
    volume::{Viewpoint, Volume},
};

/// The parts of a mapper that localize the camera.
pub(super) struct Localization<'m, 's> {
    pub config: &'m Config,
    pub frame: u32,
    /// Time since the frame before, s.
    pub interval_s: f32,
    pub disparity_q8: View<'m, u16>,
    pub scene_flow: &'m FlowMatcher<'s>,
    pub background: &'m Volume<'s>,
    pub camera: &'m mut Egomotion,
    pub self_calibration: &'m mut SelfCalibration,
    pub estimator: &'m mut Estimator<'s>,
    pub raycaster: &'m mut Raycaster<'s>,
    /// The depth image is computed anew when the frame is fused: until then it is scratch for ICP's
    /// pyramid.
    pub depth_m: &'m mut [f32],
}

/// The camera's pose in a frame.
pub(super) struct Located {
    pub camera: CameraMotion,
    pub found: Found,
}

/// Where a pose comes from, and what the stage that found it says.
pub(super) struct Found {
    pub origin: PoseOrigin,
    pub egomotion: Option<MotionEstimate>,
    pub icp: Option<IcpReport>,
    /// Matches that were excluded because they may move.
    pub matches_excluded: u32,
}

impl Found {
    fn new(origin: PoseOrigin) -> Self {
        Self { origin, egomotion: None, icp: None, matches_excluded: 0 }
    }
}

/// Rows by which the left and the right position of a match may differ where it says something
/// about the rig.
const ROW_DIFFERENCE_MAX_PX: f32 = 2.0;

/// What both cameras saw of a match, before and now; `None` where the rows are too far apart.
fn observations(rig: &StereoRig, m: &Match) -> Option<[StereoObservation; 2]> {
    let pairs = [(m.previous_left, m.previous_right), (m.current_left, m.current_right)];
    let aligned =
        pairs.iter().all(|(left, right)| (left[1] - right[1]).abs() <= ROW_DIFFERENCE_MAX_PX);
    aligned.then(|| pairs.map(|(left, right)| rig.observation(left, right)))
}

impl Localization<'_, '_> {
    /// Sets the pose the frame brings, or estimates it.
    pub fn locate<E: Executor>(
        &mut self,
        frame: &StereoFrame<'_>,
        status: FlowStatus,
        mask: &EgomotionMask<'_, '_>,
        executor: &E,
    ) -> Located {
        let (before, over_several) =
            (*self.camera.t_world_camera(), self.camera.since_reference() > 0);
        let found = if let Some(t_world_camera) = &frame.t_world_camera {
            self.camera.set_pose(t_world_camera);
            // There is no motion to the first pose.
            Found::new(if self.frame == 0 { PoseOrigin::First } else { PoseOrigin::Given })
        } else if self.config.mapper.egomotion == MotionSource::Icp {
            let icp = (self.frame > 0)
                .then(|| self.register_depth([frame.left.width(), frame.left.height()], executor));
            Found { icp, ..Found::new(self.origin(icp.is_some())) }
        } else {
            match status {
                FlowStatus::Frozen => self.hold(),
                FlowStatus::Repeated
                    if !self.camera.may_stand(&self.config.egomotion, self.interval_s) =>
                {
                    self.hold()
                }
                FlowStatus::Matched | FlowStatus::Repeated => {
                    self.estimate_from_matches(frame, mask, executor)
                }
                FlowStatus::First | FlowStatus::Refused => Found::new(PoseOrigin::First),
            }
        };
        let is_measured = matches!(
            found.origin,
            PoseOrigin::Estimated | PoseOrigin::Relocalized | PoseOrigin::Given
        );
        // After a guess the motion from the guessed pose, so that motions lead from pose to pose.
        let last_motion = || {
            if over_several {
                self.camera.t_world_camera().inverse() * before
            } else {
                *self.camera.t_current_previous()
            }
        };
        let t_current_previous: Option<Transform> = is_measured.then(last_motion);
        let camera =
            CameraMotion { t_world_camera: *self.camera.t_world_camera(), t_current_previous };
        Located { camera, found }
    }

    /// Moves the camera on as before.
    fn hold(&mut self) -> Found {
        self.camera.hold(self.interval_s);
        Found::new(self.origin(true))
    }

    /// The origin of a pose that was estimated, if it was.
    fn origin(&self, is_estimated: bool) -> PoseOrigin {
        match (is_estimated, self.camera.held_frames()) {
            (false, _) => PoseOrigin::First,
            (true, 0) => PoseOrigin::Estimated,
            (true, _) => PoseOrigin::Held,
        }
    }

    /// Estimates the motion from the matches the mask includes.
    fn estimate_from_matches<E: Executor>(
        &mut self,
        frame: &StereoFrame<'_>,
        mask: &EgomotionMask<'_, '_>,
        executor: &E,
    ) -> Found {
        let (selection, refined) = (self.scene_flow.selection(), self.scene_flow.refined());
        // Masks are of the frame before; matches over several frames are left to RANSAC.
        let over_several = self.camera.since_reference() > 0;
        let included = selection.iter().filter(|&&index| over_several || mask.includes(index));
        let excluded = selection.len() - included.clone().count();
        let matches = included.filter_map(|&index| refined.get(index as usize));
        let (rig, was_lost) = (self.config.scaled_rig(), self.camera.is_lost());
        let estimate = self.camera.step(
            &self.config.egomotion,
            &rig,
            self.interval_s,
            matches.clone(),
            self.estimator,
        );
        // A motion few matches agree with says nothing about the rig.
        if let Some(motion) =
            estimate.t_current_previous.filter(|_| 2 * estimate.inliers >= estimate.matches)
        {
            self.self_calibration.update(
                &rig,
                matches.filter_map(|m| observations(&rig, m)),
                &motion,
            );
        }
        let ends_loss = was_lost && !self.camera.is_lost();
        let is_found = ends_loss && self.end_loss(frame, executor);
        Found {
            egomotion: Some(estimate),
            matches_excluded: excluded as u32,
            ..Found::new(if is_found { PoseOrigin::Relocalized } else { self.origin(true) })
        }
    }

    /// Registers the depth with the map as it appears from the last pose. All of the picture
    /// counts, what moves as well: the baseline knows no objects.
    fn register_depth<E: Executor>(&mut self, size: [usize; 2], executor: &E) -> IcpReport {
        let config = &self.config.icp;
        let t_world_camera = *self.camera.t_world_camera();
        let is_cast = self.cast(&t_world_camera, size, executor);
        let mut report = if is_cast { self.register(config) } else { IcpReport::unpaired() };
        let refined = self.scene_flow.refined();
        let matches =
            self.scene_flow.selection().iter().filter_map(|&index| refined.get(index as usize));
        let rig = self.config.scaled_rig();
        report.matches = self.estimator.count_inliers(
            &rig,
            matches,
            &report.t_current_previous,
            icp::EXPLAINED_PX,
        );
        report.check_matches();
        self.camera.advance(report.motion());
        report
    }

    /// Looks at the map from a pose; whether that could be done.
    pub(super) fn cast<E: Executor>(
        &mut self,
        t_world_camera: &Transform,
        [width, height]: [usize; 2],
        executor: &E,
    ) -> bool {
        let view = Viewpoint {
            rig: self.config.scaled_rig(),
            width,
            height,
            t_world_camera: *t_world_camera,
        };
        self.raycaster.cast(self.background, &view, executor).is_ok()
    }

    /// Registers the depth with the map as it was cast last.
    pub(super) fn register(&mut self, config: &IcpConfig) -> IcpReport {
        let (rig, limits_m) =
            (self.config.scaled_rig(), [self.config.volume.near_m, self.config.volume.far_m]);
        match (self.raycaster.depth_m(), self.raycaster.normal()) {
            (Some(depth_m), Some(normal)) => icp::track(
                config,
                &rig,
                limits_m,
                self.disparity_q8,
                &MapPicture { depth_m, normal },
                self.depth_m,
            ),
            _ => IcpReport::unpaired(),
        }
    }
}
