//! A synthetic world as data sets and writers see it: the street, a room, a yard.

use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::Rectification;

use super::frame::SynthFrame;
use super::inertial_unit::StreetUnit;
use super::lidar;
use super::street::Street;
use crate::formats::TimedReading;
use crate::formats::calibration::StereoCalibration;

/// A seeded world that renders any frame with its truth.
pub trait World: Send + Sync {
    /// Name of the world, as users enter it.
    fn name(&self) -> &'static str;

    /// Frames that a writer or a run takes.
    fn frames(&self) -> u32;

    /// Width and height of rectified images, px.
    fn size(&self) -> [usize; 2];

    /// The ideal stereo rig.
    fn rig(&self) -> StereoRig;

    /// The calibration of raw images; `None` where they come rectified.
    fn calibration(&self) -> Option<&StereoCalibration>;

    /// The rectification of raw images to the ideal rig; `None` where they come rectified.
    fn rectification(&self) -> Option<Rectification>;

    /// Time of frame `index` since frame 0, s.
    fn time_s(&self, index: u32) -> f64;

    /// Camera pose at frame `index`; exactly the identity at frame 0.
    fn t_world_camera(&self, index: u32) -> Transform;

    /// Direction that points up in the world of the poses, a unit vector.
    fn up_in_world(&self) -> [f64; 3];

    /// Frame `index` with all its truth.
    fn frame(&self, index: u32) -> SynthFrame;

    /// One scan of the LiDAR at frame `index`, as [`Street::lidar`] gives it.
    fn lidar(&self, index: u32) -> Vec<[f32; 4]>;

    /// LiDAR to left camera.
    fn t_camera_lidar(&self) -> Transform {
        lidar::t_camera_lidar()
    }

    /// Inertial unit of the camera, if it has one.
    fn unit(&self) -> Option<StreetUnit>;

    /// Samples of the unit from a second before the first frame to the last.
    fn inertial(&self) -> Vec<TimedReading>;
}

impl World for Street {
    fn name(&self) -> &'static str {
        "street"
    }

    fn frames(&self) -> u32 {
        self.config().frames
    }

    fn size(&self) -> [usize; 2] {
        [self.config().width as usize, self.config().height as usize]
    }

    fn rig(&self) -> StereoRig {
        self.rig()
    }

    fn calibration(&self) -> Option<&StereoCalibration> {
        self.calibration()
    }

    fn rectification(&self) -> Option<Rectification> {
        self.rectification()
    }

    fn time_s(&self, index: u32) -> f64 {
        self.time_s(index)
    }

    fn t_world_camera(&self, index: u32) -> Transform {
        self.t_world_camera(index)
    }

    fn up_in_world(&self) -> [f64; 3] {
        self.up_in_world()
    }

    fn frame(&self, index: u32) -> SynthFrame {
        self.frame(index)
    }

    fn lidar(&self, index: u32) -> Vec<[f32; 4]> {
        self.lidar(index)
    }

    fn unit(&self) -> Option<StreetUnit> {
        self.config().inertial
    }

    fn inertial(&self) -> Vec<TimedReading> {
        self.inertial()
    }
}
