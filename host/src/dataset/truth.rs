//! What is true of the things that move or could, in one frame.

use crate::synth::SynthFrame;
use dynvox_core::geometry::Transform;
use dynvox_core::masks::PixelBox;

/// A thing's truth.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueObject {
    /// Its number, over all frames.
    pub id: u32,
    /// What of it is seen in the left image.
    pub pixels: PixelBox,
    /// Its frame to the world.
    pub t_world_object: Transform,
    /// Width, height, length: x within ±width/2, y within -height..0, z within ±length/2, m.
    pub dimensions_m: [f64; 3],
    /// Whether it moves.
    pub moving: bool,
    /// How fast, m/s.
    pub speed_m_s: f64,
}

/// All things seen in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectsTruth {
    /// Camera to the world the objects' poses are in.
    pub t_world_camera: Transform,
    /// One by one.
    pub objects: Vec<TrueObject>,
    /// Regions of which nothing is said: things there are neither known nor unknown.
    pub unlabelled: Vec<PixelBox>,
}

impl ObjectsTruth {
    /// Of a frame of the synthetic street: the cars with a pixel in the left image.
    pub(super) fn of_street(frame: &SynthFrame) -> Self {
        let mut boxes = vec![None::<[i32; 4]>; frame.objects.len()];
        for (pixel, &instance) in frame.instances.iter().enumerate().filter(|(_, instance)| **instance > 0) {
            let (u, v) = ((pixel % frame.width) as i32, (pixel / frame.width) as i32);
            if let Some(found) = boxes.get_mut(usize::from(instance) - 1) {
                let [l, t, r, b] = found.unwrap_or([u, v, u, v]);
                *found = Some([l.min(u), t.min(v), r.max(u), b.max(v)]);
            }
        }
        let seen = frame.objects.iter().zip(boxes).filter_map(|(object, found)| {
            let [left, top, right, bottom] = found?;
            Some(TrueObject {
                id: object.id,
                pixels: PixelBox { left, top, width: right - left + 1, height: bottom - top + 1 },
                t_world_object: object.t_world_object,
                dimensions_m: object.dimensions_m,
                moving: object.moving,
                speed_m_s: object.speed_m_s,
            })
        });
        Self {
            t_world_camera: frame.t_world_camera,
            objects: seen.collect(),
            unlabelled: Vec::new(),
        }
    }

    /// The same in an image scaled by `scale`.
    pub(super) fn scaled(mut self, scale: f64) -> Self {
        let of = |px: i32| (f64::from(px) * scale) as i32;
        for pixels in self.objects.iter_mut().map(|object| &mut object.pixels).chain(&mut self.unlabelled) {
            let PixelBox { left, top, width, height } = *pixels;
            *pixels = PixelBox { left: of(left), top: of(top), width: of(width).max(1), height: of(height).max(1) };
        }
        self
    }
}
