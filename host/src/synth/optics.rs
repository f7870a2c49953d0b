//! Cameras of a synthetic world: size, rig, lens and sensor.

use dynvox_core::geometry::StereoRig;

use super::lens::{RigError, StreetLens};
use super::raster::Pinhole;

/// Cameras of a world.
#[derive(Clone, Debug)]
pub struct Optics {
    /// Section of the settings that the figures come from, for messages.
    pub section: &'static str,
    /// Chooses the noise.
    pub seed: u64,
    /// Width and height of the rectified images, px.
    pub size: [u32; 2],
    /// The ideal rig.
    pub rig: StereoRig,
    /// Lens of both cameras.
    pub lens: StreetLens,
    /// Misalignment of the right camera.
    pub rig_error: RigError,
    /// Noise of one colour channel at mid grey, grey levels.
    pub noise_sigma: f64,
    /// Difference in brightness of the right camera, as a share of the light.
    pub gain_difference: f64,
}

impl Optics {
    /// The ideal rig's cameras for the rasteriser.
    pub fn pinhole(&self) -> Pinhole {
        Pinhole {
            width: self.size[0] as usize,
            height: self.size[1] as usize,
            focal_px: self.rig.focal_px,
            center_px: (self.rig.center_u_px, self.rig.center_v_px),
        }
    }
}
