//! Saves what the finished map shows at every frame's pose, as disparities, to be compared with a matcher that was never fused.

use super::{EndContext, Finished, FrameContext, ObserveError, Observer, Setup, instances::stem};
use crate::formats::{Image, write_png_deep};
use crate::input::InputError;
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::image::View;
use serde::{Deserialize, Serialize};

/// Units of a disparity in a file, per px.
const UNITS_PER_PX: f32 = 256.0;

/// Saves disparities where [`Setup::save_map_disparity`] says so.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct MapDisparityObserver {
    /// Names of the frames, and their poses. No checkpoint has them: such a run has none.
    #[serde(skip)]
    frames: Vec<(String, Transform)>,
}

impl Observer for MapDisparityObserver {
    type Section = ();

    fn frame(&mut self, setup: &Setup<'_>, frame: &mut FrameContext<'_, '_>) -> Result<(), ObserveError> {
        if setup.save_map_disparity.is_some() {
            self.frames.push((stem(setup.dataset, frame.row.frame), frame.row.report.t_world_camera));
        }
        Ok(())
    }

    fn end(&mut self, setup: &Setup<'_>, end: &mut EndContext<'_, '_>) -> Result<(), ObserveError> {
        let Some(folder) = setup.save_map_disparity else { return Ok(()) };
        for (name, t_world_camera) in self.frames.drain(..) {
            let seen = end.view.raycast((&t_world_camera).into()).and_then(|seen| disparities(&setup.config.rig, seen.depth_m()?));
            if let Some(disparity) = seen {
                write_png_deep(&folder.join(format!("{name}.png")), &disparity).map_err(InputError::from)?;
            }
        }
        Ok(())
    }

    fn finish(self, _: &Setup<'_>, _: &Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}

/// Depths as disparities, in units of 1/256 px; 0 stays none.
fn disparities(rig: &StereoRig, depth_m: View<'_, f32>) -> Option<Image<u16>> {
    let of_1_m = (rig.focal_px * rig.baseline_m) as f32 * UNITS_PER_PX;
    let disparity = |&depth_m: &f32| if depth_m > 0.0 { (of_1_m / depth_m).round().max(1.0) as u16 } else { 0 };
    Image::new(depth_m.width(), depth_m.height(), depth_m.pixels().iter().map(disparity).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_become_the_disparities_of_the_rig() {
        let rig = StereoRig { focal_px: 500.0, center_u_px: 1.0, center_v_px: 1.0, baseline_m: 0.5 };
        let depth_m = [0.0, 10.0, 100.0, 1e-3, 1e9, 250.0];
        let image = disparities(&rig, View::new(&depth_m, 3, 2).unwrap()).unwrap();
        assert_eq!((image.width(), image.height()), (3, 2));
        assert_eq!(image.pixels(), [0, 25 * 256, 640, u16::MAX, 1, 256]);
    }
}
