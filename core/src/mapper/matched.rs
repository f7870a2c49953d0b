//! A frame whose images were matched: what the stages after stereo and scene flow share.

use super::{Config, StereoFrame};
use crate::{
    attached::{AttachedCells, AttachedInput},
    geometry::{StereoRig, Transform},
    image::View,
    objects::{ObjectFrame, Picture},
    scene_flow::{FlowMatcher, FlowStatus, Match},
    tracking::{Assigned, FrameMatches, GuidedMatching, MatchOwner},
    volume::Viewpoint,
};

/// A rectified frame with its disparity and its matches.
pub(super) struct MatchedFrame<'f, 's> {
    pub config: &'f Config,
    /// Frames taken before this one.
    pub number: u32,
    /// Time since the frame before, s.
    pub interval_s: f32,
    pub frame: &'f StereoFrame<'f>,
    pub disparity_q8: View<'f, u16>,
    pub scene_flow: &'f FlowMatcher<'s>,
    pub flow_status: FlowStatus,
    /// The matches are with the last frame, not with an earlier one.
    pub with_last: bool,
}

impl<'f, 's> MatchedFrame<'f, 's> {
    /// View of the frame's left camera from a pose.
    pub fn view(&self, t_world_camera: &Transform) -> Viewpoint {
        Viewpoint {
            rig: self.config.scaled_rig(),
            width: self.frame.left.width(),
            height: self.frame.left.height(),
            t_world_camera: *t_world_camera,
        }
    }

    /// Width and height of the images, px.
    pub fn size(&self) -> [usize; 2] {
        [self.frame.left.width(), self.frame.left.height()]
    }

    /// Matches that objects are followed by, from frame to frame: those with an earlier frame than
    /// the last say nothing of an object's motion.
    pub fn matches(&self) -> FrameMatches<'f> {
        let scene_flow = self.scene_flow;
        if self.with_last {
            FrameMatches { refined: scene_flow.refined(), sparse: scene_flow.sparse() }
        } else {
            FrameMatches::default()
        }
    }

    /// Search for further matches on objects, where [`MatchedFrame::matches`] are with the last
    /// frame.
    pub fn search(&self) -> Option<GuidedMatching<'f, 's>> {
        let Self { scene_flow: matcher, disparity_q8, .. } = *self;
        self.with_last.then_some(GuidedMatching { matcher, disparity_q8 })
    }

    /// Counts the matches for and against what is attached to the camera, given its motion since
    /// the last frame, where that was estimated. Those on detected objects do not count.
    #[inline(never)]
    pub fn observe_attached(
        &self,
        attached: &mut AttachedCells<'_>,
        motion: Option<Transform>,
        assigned: &Assigned<'_, '_, '_>,
    ) {
        let motion = motion.filter(|_| self.with_last);
        let (Some(t_current_previous), Some(left)) = (&motion, self.scene_flow.left_images())
        else {
            return;
        };
        let rig = self.config.scaled_rig();
        let [codes, _] = assigned.match_owners();
        let unowned = self.scene_flow.refined().iter().zip(codes);
        let unowned = unowned.filter(|(_, code)| code.get() == MatchOwner::None);
        let input = AttachedInput { rig: &rig, t_current_previous, left };
        attached.observe(&input, unowned.map(|(m, _)| m));
    }

    /// Frames are fused at an interval, and this one is due.
    pub fn is_due(&self) -> bool {
        self.number.is_multiple_of(self.config.mapper.fuse_every.max(1))
    }

    /// The frame as objects are reconstructed from it.
    pub fn of_objects<'o>(
        &self,
        rig: &'o StereoRig,
        t_world_camera: &'o Transform,
    ) -> ObjectFrame<'o>
    where
        'f: 'o,
    {
        ObjectFrame {
            rig,
            t_world_camera,
            picture: Picture { grey: self.frame.left, colour: self.frame.colour },
            disparity_q8: self.disparity_q8,
        }
    }

    /// Matches that bucketing selected, refined.
    pub fn selected(&self) -> impl Iterator<Item = &Match> + Clone {
        let refined = self.scene_flow.refined();
        self.scene_flow.selection().iter().filter_map(|&index| refined.get(index as usize))
    }
}
