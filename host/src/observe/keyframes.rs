//! Pictures of some frames, and of the finished map.

use super::{
    EndContext, Finished, FrameContext, ObserveError, ObservedRun, Observer, frame_pictures::Shown,
    spread,
};
use serde::{Deserialize, Serialize};

/// Frames shown in the report.
const KEYFRAMES: usize = 5;

/// Pictures of one frame, as JPEG files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Keyframe {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Left image.
    pub input_jpeg: Vec<u8>,
    /// Disparity in colours.
    pub disparity_jpeg: Vec<u8>,
    /// The static map from the camera's pose.
    pub raycast_jpeg: Vec<u8>,
    /// Raycast with every object at its pose, as JPEG; empty without objects.
    pub composed_jpeg: Vec<u8>,
}

/// Pictures of a run.
#[derive(Clone, Debug)]
pub struct KeyframesSection {
    /// Pictures of some frames.
    pub keyframes: Vec<Keyframe>,
    /// The finished map from behind and above the last camera, as a JPEG file; empty without
    /// frames.
    pub overview_jpeg: Vec<u8>,
}

/// Takes pictures.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct KeyframesObserver {
    keyframes: Vec<Keyframe>,
    #[serde(skip)]
    overview_jpeg: Vec<u8>,
}

impl Observer for KeyframesObserver {
    type Section = KeyframesSection;

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let position = frame.position;
        // Of a stream the first frame, and others ever further apart.
        let chosen = run.plan.frames.count().map_or_else(
            || position == 0 || position.is_power_of_two(),
            |frames| spread(frames, KEYFRAMES)(position),
        );
        if chosen {
            // A stream has no known end: the newest picture replaces the oldest.
            if self.keyframes.len() == KEYFRAMES {
                self.keyframes.remove(0);
            }
            self.keyframes.extend(keyframe(frame));
        }
        Ok(())
    }

    fn end(
        &mut self,
        _: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        self.overview_jpeg = end.overview_jpeg.clone();
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<KeyframesSection, ObserveError> {
        Ok(KeyframesSection { keyframes: self.keyframes, overview_jpeg: self.overview_jpeg })
    }
}

fn keyframe(frame: &mut FrameContext<'_, '_>) -> Option<Keyframe> {
    let (input_jpeg, disparity_jpeg, raycast_jpeg) =
        (frame.jpeg(Shown::Left), frame.jpeg(Shown::Disparity), frame.jpeg(Shown::Map));
    // A picture that cannot be made leaves the key frame out, not the run.
    if input_jpeg.is_empty() || raycast_jpeg.is_empty() {
        return None;
    }
    Some(Keyframe {
        frame: frame.row.frame,
        input_jpeg,
        disparity_jpeg,
        raycast_jpeg,
        composed_jpeg: frame.jpeg(Shown::Composed),
    })
}
