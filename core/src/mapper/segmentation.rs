//! The ground of a frame, and the moving objects in it that no detector found.

use super::matched::MatchedFrame;
use crate::{
    geometry::GroundPlane,
    segmentation::{MotionSegmenter, SegmentationInput, SegmentationReport},
    tracking::{Assigned, CameraMotion},
    volume::Volume,
};

/// The parts of a mapper that segment a frame by motion.
pub(super) struct Segmentation<'m, 's> {
    pub segmenter: &'m mut MotionSegmenter<'s>,
    /// The static map of the frames before.
    pub map: &'m Volume<'s>,
    /// True if the planner needs the ground of this frame.
    pub plans: bool,
}

impl Segmentation<'_, '_> {
    /// Finds the ground plane, if a stage needs it, and adds instances of what moves to `assigned`,
    /// if the configuration asks for that.
    pub fn run(
        self,
        seen: &MatchedFrame<'_, '_>,
        camera: &CameraMotion,
        assigned: &mut Assigned<'_, '_, '_>,
    ) -> (Option<GroundPlane>, SegmentationReport) {
        let Self { segmenter, map, plans } = self;
        let (config, disparity_q8) = (seen.config, seen.disparity_q8);
        let (rig, motion) = (config.scaled_rig(), &config.tracking.motion);
        // Without the camera's motion nothing can be said to move on its own.
        let segments = config.tracking.dynamic
            && config.segmentation.enabled
            && camera.t_current_previous.is_some();
        let ground = (segments || plans).then(|| GroundPlane::find(&rig, disparity_q8)).flatten();
        if !segments {
            return (ground, SegmentationReport::default());
        }
        let input = SegmentationInput {
            rig: &rig,
            camera,
            disparity_q8,
            ground,
            map: Some(map),
            search: seen.search(),
            bias_px: [motion.bias_px, motion.lens_px].map(f64::from),
        };
        (ground, segmenter.segment(&config.segmentation, &input, assigned))
    }
}
