//! Saves every frame's disparity, and its confidence where the mapper keeps one.

use super::{FrameContext, ObserveError, ObservedRun, Observer, instances::stem};
use crate::formats::{Image, write_png_bytes, write_png_deep};
use crate::input::InputError;
use crate::owned::create_folder;
use dynvox_core::image::View;
use serde::{Deserialize, Serialize};

/// Folder of the confidences, below that of the disparities.
pub const CONFIDENCE_FOLDER: &str = "confidence";

/// Saves disparities where [`ObservedRun::disparity_folder`] says so.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct DisparityObserver {}

impl Observer for DisparityObserver {
    type Section = ();

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(folder) = run.disparity_folder.as_deref() else { return Ok(()) };
        let name = format!("{}.png", stem(run.plan.dataset.as_ref(), frame.row.frame));
        let mapper = frame.view.mapper();
        if let Some(disparity) = copied(mapper.disparity_q8()) {
            write_png_deep(&folder.join(&name), &disparity).map_err(InputError::from)?;
        }
        if let Some(confidence) = mapper.confidence().and_then(copied) {
            let folder = folder.join(CONFIDENCE_FOLDER);
            create_folder(&folder)
                .map_err(|source| ObserveError::Write { path: folder.clone(), source })?;
            write_png_bytes(&folder.join(&name), &confidence).map_err(InputError::from)?;
        }
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &super::Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}

fn copied<T: Copy>(image: View<'_, T>) -> Option<Image<T>> {
    Image::new(image.width(), image.height(), image.rows().flatten().copied().collect())
}
