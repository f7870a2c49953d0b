//! The synthetic street as a data set.

use super::{Dataset, DatasetError, ExactFrame, Image, LidarScan, Masks, ObjectsTruth, StereoImages};
use crate::segmentation::Sightings;
use crate::synth::{Street, StreetConfig};
use dynvox_core::geometry::{StereoRig, Transform};
use nalgebra::Point3;

/// Frames of a street.
pub struct StreetFrames {
    street: Street,
    frames: usize,
    truth: Vec<Transform>,
}

impl StreetFrames {
    /// The street of a configuration, `frames` of it.
    pub fn new(config: StreetConfig) -> Result<Self, DatasetError> {
        let frames = config.frames;
        let street = Street::new(config).map_err(|error| DatasetError::Street { reason: error.to_string() })?;
        Ok(Self {
            truth: (0..frames).map(|index| street.t_world_camera(index)).collect(),
            frames: frames as usize,
            street,
        })
    }
}

impl Dataset for StreetFrames {
    fn name(&self) -> &str {
        "street"
    }

    fn len(&self) -> usize {
        self.frames
    }

    fn size(&self) -> (usize, usize) {
        (self.street.config().width as usize, self.street.config().height as usize)
    }

    fn rig(&self) -> StereoRig {
        self.street.rig()
    }

    fn time_s(&self, index: usize) -> f64 {
        self.street.time_s(index as u32)
    }

    fn frame(&self, index: usize) -> Result<StereoImages, DatasetError> {
        let frame = self.street.frame(index as u32);
        let (width, height) = (frame.width, frame.height);
        let failed = || DatasetError::Street { reason: format!("frame {index} has no pixels") };
        let moving = (0..frame.depth_m.len()).map(|pixel| frame.is_moving(pixel)).collect();
        let objects = ObjectsTruth::of_street(&frame);
        let exact = || {
            Some(ExactFrame {
                depth_m: Image::new(width, height, frame.depth_m)?,
                moving: Image::new(width, height, moving)?,
                instances: Image::new(width, height, frame.instances)?,
                classes: frame.objects.iter().map(|object| object.class).collect(),
            })
        };
        Ok(StereoImages {
            left: Image::new(width, height, frame.left_grey).ok_or_else(failed)?,
            right: Image::new(width, height, frame.right_grey).ok_or_else(failed)?,
            colour: Image::new(width, height, frame.left_rgb),
            depth: None,
            exact: exact(),
            objects: Some(objects),
            sightings: Sightings::default(),
        })
    }

    fn masks(&self) -> Masks {
        Masks::Exact
    }

    fn has_lidar(&self, index: usize) -> bool {
        index < self.frames
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, DatasetError> {
        let t_camera_lidar = self.street.t_camera_lidar();
        let point = |&[x, y, z, _]: &[f32; 4]| (t_camera_lidar * Point3::new(x, y, z).cast::<f64>()).coords.into();
        let points_m = self.street.lidar(index as u32).iter().map(point).collect();
        Ok((index < self.frames).then(|| LidarScan::of_rig(points_m, &self.street.rig())))
    }

    fn truth(&self) -> Option<&[Transform]> {
        Some(&self.truth)
    }
}
