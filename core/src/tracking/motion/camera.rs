//! Motion of the camera, relative to which objects move.

use crate::geometry::Transform;

/// Motion of the camera in a frame.
#[derive(Clone, Copy, Debug)]
pub struct CameraMotion {
    /// Camera to world, now.
    pub t_world_camera: Transform,
    /// Previous camera to current camera; `None` in the first frame and where it is only
    /// extrapolated.
    pub t_current_previous: Option<Transform>,
}
