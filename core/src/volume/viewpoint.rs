//! A camera at a place, as the map uses it.

use crate::geometry::{StereoRig, Transform};
use core::num::NonZeroUsize;
use nalgebra::{Point3, Rotation3, Vector3};

/// The left camera of a rig, looking from a pose at an image of a size.
#[derive(Clone, Copy, Debug)]
pub struct Viewpoint {
    /// The rig; only the left camera matters here.
    pub rig: StereoRig,
    /// Image width, px.
    pub width: usize,
    /// Image height, px.
    pub height: usize,
    /// Camera to world (the map's frame).
    pub t_world_camera: Transform,
}

impl Viewpoint {
    /// Returns the camera with only every so many columns and rows of pixels, from the first on;
    /// `None` for 0. Rays through the pixels kept stay unchanged, to the last bit if `every` is a
    /// power of two.
    #[inline(always)]
    pub(crate) fn thinned(mut self, every: usize) -> Option<Self> {
        let kept = NonZeroUsize::new(every)?;
        let scale = every as f64;
        (self.width, self.height) =
            (self.width.div_ceil(kept.get()), self.height.div_ceil(kept.get()));
        // The baseline is a length in metres and stays.
        for length_px in
            [&mut self.rig.focal_px, &mut self.rig.center_u_px, &mut self.rig.center_v_px]
        {
            *length_px /= scale;
        }
        Some(self)
    }

    /// World to camera, as a rotation matrix and the camera's place in the world. Differences to
    /// that place are taken in `f64`, so that a map kilometres from its origin is as exact as one
    /// at it.
    pub(crate) fn camera_from_world(&self) -> (Rotation3<f64>, Point3<f64>) {
        let rotation = self.t_world_camera.quaternion().to_rotation_matrix();
        (rotation.transpose(), Point3::from(self.t_world_camera.translation()))
    }

    /// The ray of pixel (0, 0) at depth 1 and its change per column and row, in world axes.
    pub(crate) fn rays_world(&self) -> [Vector3<f64>; 3] {
        let rotation = self.t_world_camera.quaternion().to_rotation_matrix();
        let corner = Vector3::new(
            -self.rig.center_u_px / self.rig.focal_px,
            -self.rig.center_v_px / self.rig.focal_px,
            1.0,
        );
        // From pixel to pixel at depth 1.
        let step = 1.0 / self.rig.focal_px;
        [
            rotation * corner,
            rotation * Vector3::new(step, 0.0, 0.0),
            rotation * Vector3::new(0.0, step, 0.0),
        ]
    }
}
