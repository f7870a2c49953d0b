//! Ground truth of the objects in one frame.

use dynvox_core::geometry::Transform;
use dynvox_core::masks::PixelBox;

/// An object's truth.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueObject {
    /// Number of the object, the same over all frames.
    pub id: u32,
    /// Value in the exact masks ([`crate::input::ExactFrame`]); 0 without them.
    pub instance: u8,
    /// The box of its visible pixels in the left image.
    pub pixels: PixelBox,
    /// Pose of the object in the world.
    pub t_world_object: Transform,
    /// Width, height, length: x within ±width/2, y within -height..0, z within ±length/2, m.
    pub dimensions_m: [f64; 3],
    /// True if the object moves.
    pub moving: bool,
    /// Speed, m/s.
    pub speed_m_s: f64,
}

/// All objects seen in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectsTruth {
    /// Camera to the world the objects' poses are in.
    pub t_world_camera: Transform,
    /// One by one.
    pub objects: Vec<TrueObject>,
    /// Regions without labels: whether objects are there is unknown.
    pub unlabelled: Vec<PixelBox>,
}

impl ObjectsTruth {
    /// Scales the boxes to an image scaled by `scale`.
    pub fn scaled(mut self, scale: f64) -> Self {
        let of = |px: i32| (f64::from(px) * scale) as i32;
        for pixels in
            self.objects.iter_mut().map(|object| &mut object.pixels).chain(&mut self.unlabelled)
        {
            let PixelBox { left, top, width, height } = *pixels;
            *pixels = PixelBox {
                left: of(left),
                top: of(top),
                width: of(width).max(1),
                height: of(height).max(1),
            };
        }
        self
    }
}
