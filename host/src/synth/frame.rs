//! One frame and its truth.

use dynvox_core::geometry::Transform;

/// A stereo pair and everything true about it. Images are row by row: depth and masks `width` x
/// `height`, colour and grey `image_size`, which is the same unless images are raw.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthFrame {
    /// Number of the frame.
    pub index: u32,
    /// Time since frame 0, s.
    pub time_s: f64,
    /// Width of depth and masks, px.
    pub width: usize,
    /// Height of depth and masks, px.
    pub height: usize,
    /// Width and height of colour and grey images, px.
    pub image_size: [usize; 2],
    /// Left colour image.
    pub left_rgb: Vec<[u8; 3]>,
    /// Right colour image.
    pub right_rgb: Vec<[u8; 3]>,
    /// Left grey image: integer luma of the colour.
    pub left_grey: Vec<u8>,
    /// Right grey image.
    pub right_grey: Vec<u8>,
    /// Exact depth along z of the ray through each left pixel's centre, m; 0 where the sky is seen.
    pub depth_m: Vec<f32>,
    /// Instance at the centre of each left pixel: k is `objects[k - 1]`, 0 is no car.
    pub instances: Vec<u8>,
    /// Camera to world; the world is the left camera of frame 0.
    pub t_world_camera: Transform,
    /// Every car near the camera, seen or not, by rising number.
    pub objects: Vec<ObjectTruth>,
}

impl SynthFrame {
    /// Returns true if a left pixel shows a car that moves.
    pub fn is_moving(&self, pixel: usize) -> bool {
        let instance = self.instances.get(pixel).copied().unwrap_or(0);
        instance > 0
            && self.objects.get(usize::from(instance) - 1).is_some_and(|object| object.moving)
    }
}

/// A car's truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectTruth {
    /// The car's number for ever, over all frames.
    pub id: u32,
    /// Class of the object: `car` or `van`.
    pub class: &'static str,
    /// Car to world: x right, y down, z forward, origin in the middle of its footprint on the road.
    pub t_world_object: Transform,
    /// Width, height, length of the box around it: x within ±width/2, y within -height..0, z within
    /// ±length/2.
    pub dimensions_m: [f64; 3],
    /// True if the object moves in this frame.
    pub moving: bool,
    /// Speed, m/s.
    pub speed_m_s: f64,
}
