//! The synthetic street as a source of frames.

use crate::formats::Image;
use crate::input::source::{
    AvailableMasks, ExactFrame, FrameMasks, FrameSource, InputError, LidarScan, ObjectsTruth,
    StereoImages, StreamState, TrueObject,
};
use crate::synth::{Street, StreetConfig, SynthFrame};
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::masks::PixelBox;
use dynvox_core::rectify::Rectification;

/// Frames of a street.
pub struct StreetFrames {
    street: Street,
    frames: usize,
    truth: Vec<Transform>,
    rectification: Option<Rectification>,
}

impl StreetFrames {
    /// The street of a configuration, `frames` of it.
    pub fn new(config: StreetConfig) -> Result<Self, InputError> {
        let frames = config.frames;
        let street = Street::new(config)
            .map_err(|error| InputError::Street { reason: error.to_string() })?;
        Ok(Self {
            truth: (0..frames).map(|index| street.t_world_camera(index)).collect(),
            frames: frames as usize,
            rectification: street.rectification(),
            street,
        })
    }
}

impl FrameSource for StreetFrames {
    fn name(&self) -> &str {
        "street"
    }

    fn len(&self) -> usize {
        self.frames
    }

    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn size(&self) -> (usize, usize) {
        (self.street.config().width as usize, self.street.config().height as usize)
    }

    fn rig(&self) -> StereoRig {
        self.street.rig()
    }

    fn stamp_ns(&self, index: usize) -> Option<u64> {
        Some((self.time_s(index) * 1e9).round() as u64)
    }

    fn rectification(&self) -> Option<&Rectification> {
        self.rectification.as_ref()
    }

    fn time_s(&self, index: usize) -> f64 {
        self.street.time_s(index as u32)
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let frame = self.street.frame(index as u32);
        let ((width, height), [image_width, image_height]) =
            ((frame.width, frame.height), frame.image_size);
        let failed = || InputError::Street { reason: format!("frame {index} has no pixels") };
        let moving = (0..frame.depth_m.len()).map(|pixel| frame.is_moving(pixel)).collect();
        let objects = objects_truth(&frame);
        let exact = || {
            Some(ExactFrame {
                depth_m: Image::new(width, height, frame.depth_m)?,
                moving: Image::new(width, height, moving)?,
                instances: Image::new(width, height, frame.instances)?,
                classes: frame.objects.iter().map(|object| object.class).collect(),
            })
        };
        Ok(StereoImages {
            left: Image::new(image_width, image_height, frame.left_grey).ok_or_else(failed)?,
            right: Image::new(image_width, image_height, frame.right_grey).ok_or_else(failed)?,
            colour: Image::new(image_width, image_height, frame.left_rgb),
            depth: None,
            exact: exact(),
            objects: Some(objects),
            masks: FrameMasks::default(),
        })
    }

    fn masks(&self) -> AvailableMasks {
        AvailableMasks::Exact
    }

    fn has_lidar(&self, index: usize) -> bool {
        index < self.frames
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        let t_camera_lidar = self.street.t_camera_lidar();
        let point =
            |&[x, y, z, _]: &[f32; 4]| t_camera_lidar.transform_point([x, y, z].map(f64::from));
        let points_m = self.street.lidar(index as u32).iter().map(point).collect();
        Ok((index < self.frames).then(|| LidarScan::of_rig(points_m, &self.street.rig())))
    }

    fn truth(&self) -> Option<&[Transform]> {
        Some(&self.truth)
    }
}

/// The truth of a frame: the cars with a pixel in the left image.
fn objects_truth(frame: &SynthFrame) -> ObjectsTruth {
    let mut boxes = vec![None::<[i32; 4]>; frame.objects.len()];
    for (pixel, &instance) in
        frame.instances.iter().enumerate().filter(|(_, instance)| **instance > 0)
    {
        let (u, v) = ((pixel % frame.width) as i32, (pixel / frame.width) as i32);
        if let Some(found) = boxes.get_mut(usize::from(instance) - 1) {
            let [l, t, r, b] = found.unwrap_or([u, v, u, v]);
            *found = Some([l.min(u), t.min(v), r.max(u), b.max(v)]);
        }
    }
    let seen =
        frame.objects.iter().zip(boxes).zip(1..).filter_map(|((object, found), instance)| {
            let [left, top, right, bottom] = found?;
            Some(TrueObject {
                id: object.id,
                instance,
                pixels: PixelBox { left, top, width: right - left + 1, height: bottom - top + 1 },
                t_world_object: object.t_world_object,
                dimensions_m: object.dimensions_m,
                moving: object.moving,
                speed_m_s: object.speed_m_s,
            })
        });
    ObjectsTruth {
        t_world_camera: frame.t_world_camera,
        objects: seen.collect(),
        unlabelled: Vec::new(),
    }
}
