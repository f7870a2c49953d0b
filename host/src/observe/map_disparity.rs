//! Saves what the finished map shows at every frame's pose, as disparities, to be compared with a
//! matcher that was never fused.

use super::{
    EndContext, Finished, FrameContext, ObserveError, ObservedRun, Observer, instances::stem,
};
use crate::formats::{Image, write_png_deep};
use crate::input::InputError;
use dynvox_core::geometry::{DisparityCorrection, StereoRig};
use dynvox_core::image::View;
use dynvox_core::view::RaycastView;
use serde::{Deserialize, Serialize};

/// Units of a disparity in a file, per px.
const UNITS_PER_PX: f32 = 256.0;

/// Saves disparities where [`ObservedRun::map_disparity_folder`] says so.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct MapDisparityObserver {
    /// Names of the frames, and what is looked at. No checkpoint has them: such a run has none.
    #[serde(skip)]
    frames: Vec<(String, RaycastView)>,
}

impl Observer for MapDisparityObserver {
    type Section = ();

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        if run.map_disparity_folder.as_deref().is_some() {
            let name = stem(run.plan.dataset.as_ref(), frame.row.frame);
            self.frames.push((name, frame.row.view()));
        }
        Ok(())
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(folder) = run.map_disparity_folder.as_deref() else { return Ok(()) };
        // A correction that was found but not applied is not in the disparities.
        let calibration =
            end.last.map(|last| last.report.self_calibration).filter(|report| report.corrected);
        let correction = calibration.and_then(|report| report.found()).unwrap_or_default();
        // Frames are drawn at the end, when the map knows most.
        for (name, view) in self.frames.drain(..) {
            let seen = end
                .view
                .raycast(view)
                .and_then(|seen| disparities(&run.plan.config.rig, &correction, seen.depth_m()?));
            if let Some(disparity) = seen {
                write_png_deep(&folder.join(format!("{name}.png")), &disparity)
                    .map_err(InputError::from)?;
            }
        }
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}

/// Depths as the disparities that the images themselves have there, without what `correction` adds,
/// in units of 1/256 px; 0 stays none.
fn disparities(
    rig: &StereoRig,
    correction: &DisparityCorrection,
    depth_m: View<'_, f32>,
) -> Option<Image<u16>> {
    let of_1_m = (rig.focal_px * rig.baseline_m) as f32;
    let width = depth_m.width();
    let disparity = |(at, &depth_m): (usize, &f32)| {
        if depth_m <= 0.0 {
            return 0;
        }
        let corrected_px = of_1_m / depth_m;
        let right_px = [(at % width) as f32 - corrected_px, (at / width) as f32];
        // At least one unit: zero would say that there is no surface.
        ((corrected_px - correction.added_px(rig, right_px)) * UNITS_PER_PX).round().max(1.0) as u16
    };
    Image::new(
        width,
        depth_m.height(),
        depth_m.pixels().iter().enumerate().map(disparity).collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_become_the_disparities_of_the_rig() {
        let rig =
            StereoRig { focal_px: 500.0, center_u_px: 1.0, center_v_px: 1.0, baseline_m: 0.5 };
        // None, usual ones, beyond both ends of 16 bits, and exactly one pixel.
        let depth_m = [0.0, 10.0, 100.0, 1e-3, 1e9, 250.0];
        let none = DisparityCorrection::default();
        let image = disparities(&rig, &none, View::new(&depth_m, 3, 2).unwrap()).unwrap();
        assert_eq!((image.width(), image.height()), (3, 2));
        assert_eq!(image.pixels(), [0, 25 * 256, 640, u16::MAX, 1, 256]);
    }

    #[test]
    fn what_self_calibration_added_is_taken_off_again() {
        let rig =
            StereoRig { focal_px: 500.0, center_u_px: 100.0, center_v_px: 1.0, baseline_m: 0.5 };
        let correction = DisparityCorrection {
            offset_px: 0.5,
            row_quadratic_px: -1.0,
            ..DisparityCorrection::default()
        };
        let image = disparities(&rig, &correction, View::new(&[10.0; 3], 1, 3).unwrap()).unwrap();
        assert_eq!(image.pixels(), [6477, 6221, 6477]);
    }
}
