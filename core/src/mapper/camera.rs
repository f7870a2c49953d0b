//! The camera's way from one frame to the next, wherever it comes from.

use super::{Mapper, MotionSource, PoseOrigin, StereoFrame};
use crate::{
    egomotion::{
        MotionEstimate,
        icp::{self, IcpReport, IcpStatus, MapPicture},
    },
    parallel::Executor,
    volume::Viewpoint,
};

impl Mapper<'_> {
    /// Moves the camera: to where it is said to be, or as its matches or its depth say. `matched` tells whether there was a frame before.
    pub(super) fn move_camera<E: Executor>(
        &mut self,
        frame: &StereoFrame<'_>,
        matched: bool,
        size: [usize; 2],
        executor: &E,
    ) -> (PoseOrigin, Option<MotionEstimate>, Option<IcpReport>) {
        if let Some(t_world_camera) = &frame.t_world_camera {
            self.camera.place(t_world_camera);
            // There is no way to the first place.
            return (if self.frame == 0 { PoseOrigin::First } else { PoseOrigin::Given }, None, None);
        }
        let (estimate, icp) = match self.config.mapper.egomotion {
            MotionSource::Stereo => (matched.then(|| self.follow_matches(size)), None),
            MotionSource::Icp => (None, (self.frame > 0).then(|| self.follow_depth(size, executor))),
        };
        let pose = match (estimate.is_some() || icp.is_some(), self.camera.held_frames()) {
            (false, _) => PoseOrigin::First,
            (true, 0) => PoseOrigin::Estimated,
            (true, _) => PoseOrigin::Held,
        };
        (pose, estimate, icp)
    }

    /// Moves the camera by the matches that lie on nothing that moves.
    fn follow_matches(&mut self, size: [usize; 2]) -> MotionEstimate {
        let (selection, refined) = (self.scene_flow.selection(), self.scene_flow.refined());
        let (estimate, withheld) = {
            let guides = self.tracker.guides_camera(size);
            let guiding = selection.iter().filter(|&&index| guides(index));
            let withheld = selection.len() - guiding.clone().count();
            let matches = guiding.filter_map(|&index| refined.get(index as usize));
            (self.camera.step(&self.config.egomotion, &self.config.rig, matches, &mut self.estimator), withheld)
        };
        self.tracker.note_withheld(withheld as u32);
        estimate
    }

    /// Moves the camera by its depth against the map, as seen from where it was. Everything in the picture counts, what moves as well: the
    /// baseline knows of no objects.
    fn follow_depth<E: Executor>(&mut self, [width, height]: [usize; 2], executor: &E) -> IcpReport {
        let (rig, limits_m) = (self.config.rig, [self.config.volume.near_m, self.config.volume.far_m]);
        let view = Viewpoint { rig, width, height, t_world_camera: *self.camera.t_world_camera() };
        let seen = self.raycaster.cast(&self.background, &view, executor);
        let picture = match (seen, self.raycaster.depth_m(), self.raycaster.normal()) {
            (Ok(_), Some(depth_m), Some(normal)) => Some(MapPicture { depth_m, normal }),
            _ => None,
        };
        // The depth image is made anew when the frame is fused: until then it is room for the pyramid.
        let mut report = picture.map_or(IcpReport { status: IcpStatus::TooFewPairs, ..IcpReport::default() }, |picture| {
            icp::track(&self.config.icp, &rig, limits_m, self.stereo.disparity_q8(), &picture, self.depth_m)
        });
        let refined = self.scene_flow.refined();
        let matches = self.scene_flow.selection().iter().filter_map(|&index| refined.get(index as usize));
        report.matches = self.estimator.explained(&rig, matches, &report.t_current_previous, self.config.icp.explained_px);
        report.ask_matches(&self.config.icp);
        self.camera.advance(report.motion());
        report
    }
}
