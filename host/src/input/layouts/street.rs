//! The synthetic worlds as sources of frames: the street, a room, a yard.

use crate::formats::calibration::UnitNoise;
use crate::formats::{Image, TimedReading};
use crate::input::source::{
    AvailableMasks, ExactFrame, FrameInfo, FrameMasks, FrameSource, InertialUnitData, InputError,
    LidarScan, ObjectsTruth, SourceInfo, StereoImages, StreamState, TrueObject,
};
use crate::synth::{Street, StreetConfig, StreetUnit, SynthFrame, World, t_camera_unit};
use dynvox_core::masks::PixelBox;
use std::path::PathBuf;
use std::sync::Arc;

/// Frames of a street, or of another synthetic world.
pub struct StreetFrames {
    world: Box<dyn World>,
    info: SourceInfo,
}

impl StreetFrames {
    /// The street of a configuration, `frames` of it.
    pub fn new(config: StreetConfig) -> Result<Self, InputError> {
        let street = Street::new(config)
            .map_err(|error| InputError::Street { reason: error.to_string() })?;
        Ok(Self::from_world(Box::new(street)))
    }

    /// The frames of a world.
    pub fn from_world(world: Box<dyn World>) -> Self {
        let (frames, [width, height]) = (world.frames(), world.size());
        let size = (width, height);
        let info = SourceInfo {
            name: world.name().to_owned(),
            frames: frames as usize,
            size,
            full_size: size,
            rig: world.rig(),
            rectification: world.rectification(),
            masks: AvailableMasks::Exact,
            truth: Some((0..frames).map(|index| world.t_world_camera(index)).collect()),
            own_unit: None,
            inertial: unit(world.as_ref()).map(Arc::new),
            notes: Vec::new(),
            ignored: None,
        };
        Self { world, info }
    }
}

impl FrameSource for StreetFrames {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn frame_info(&self, index: usize) -> FrameInfo {
        let time_s = self.world.time_s(index as u32);
        FrameInfo { stem: None, stamp_ns: Some((time_s * 1e9).round() as u64), time_s }
    }
    fn stream(&self) -> Option<StreamState> {
        None
    }

    fn frame(&self, index: usize) -> Result<StereoImages, InputError> {
        let frame = self.world.frame(index as u32);
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
            ignored: None,
        })
    }

    fn has_lidar(&self, index: usize) -> bool {
        index < self.info.frames
    }

    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError> {
        let t_camera_lidar = self.world.t_camera_lidar();
        let point =
            |&[x, y, z, _]: &[f32; 4]| t_camera_lidar.transform_point([x, y, z].map(f64::from));
        let points_m = self.world.lidar(index as u32).iter().map(point).collect();
        Ok((index < self.info.frames).then(|| LidarScan::of_rig(points_m, &self.world.rig())))
    }
}

/// The inertial unit of a world that has one.
fn unit(world: &dyn World) -> Option<InertialUnitData> {
    let readings = world.inertial();
    let StreetUnit { rate_hz, turn_noise, force_noise, gap_s, .. } = world.unit()?;
    let last_ns = (world.time_s(world.frames().saturating_sub(1)) * 1e9).round() as i64;
    let within = |reading: &&TimedReading| (0..=last_ns).contains(&reading.time_ns);
    (!readings.is_empty()).then(|| InertialUnitData {
        path: PathBuf::from(world.name()),
        within_frames: readings.iter().filter(within).count(),
        samples: InertialUnitData::samples_of(&readings),
        readings,
        t_camera_unit: t_camera_unit(),
        clock_offset_s: 0.0,
        noise: UnitNoise {
            turn_density: (turn_noise > 0.0).then_some(turn_noise),
            force_density: (force_noise > 0.0).then_some(force_noise),
            ..UnitNoise::default()
        },
        rate_hz,
        longest_gap_s: gap_s + 1.0 / rate_hz,
    })
}

/// The truth of a frame: the objects with a pixel in the left image.
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
