//! Pictures of scenes by a world's cameras: what every world shares.

use dynvox_core::geometry::Transform;
use dynvox_core::rectify::Rectification;

use super::error::SynthError;
use super::frame::{ObjectTruth, SynthFrame};
use super::light::Light;
use super::optics::Optics;
use super::paint::Painter;
use super::raster::Pinhole;
use super::raw::{self, CameraView};
use super::render::{Picture, Renderer};
use super::scene::Scene;
use super::sensor::{Sensor, luma};
use crate::formats::calibration::StereoCalibration;

/// Cameras, painter and light.
pub struct Studio {
    /// Cameras.
    pub optics: Optics,
    /// Painter.
    pub painter: Painter,
    light: Light,
    calibration: Option<StereoCalibration>,
    /// Sampling of both images, if the rig is not ideal.
    views: Option<[CameraView; 2]>,
}

/// A frame before its pictures are taken: what the world knows of it.
pub struct Moment {
    /// Number of the frame, which chooses the noise.
    pub index: u32,
    /// Time since frame 0, s.
    pub time_s: f64,
    /// Light let in, 1 is that of the street.
    pub gain: f64,
    /// Camera to world.
    pub t_world_camera: Transform,
    /// Every object near the camera, seen or not.
    pub objects: Vec<ObjectTruth>,
}

impl Studio {
    /// A studio for cameras and a light.
    ///
    /// # Errors
    /// The lens cannot be used.
    pub fn new(optics: Optics, light: Light) -> Result<Self, SynthError> {
        let calibration = raw::calibration(&optics)?;
        Ok(Self {
            views: raw::views(&optics, calibration.as_ref()),
            calibration,
            painter: Painter::new(),
            light,
            optics,
        })
    }

    /// The calibration of raw images; `None` where they come rectified.
    pub fn calibration(&self) -> Option<&StereoCalibration> {
        self.calibration.as_ref()
    }

    /// Returns the rectification of raw images to the ideal rig; `None` if images are rendered
    /// rectified.
    pub fn rectification(&self) -> Option<Rectification> {
        self.calibration.as_ref().and_then(raw::rectification)
    }

    /// Takes both images of the scenes seen while the shutter is open, in equal shares; depth and
    /// instances are those of the scene in the middle.
    pub fn frame(&self, scenes: &[Scene], moment: Moment) -> SynthFrame {
        let (left, right) =
            rayon::join(|| self.view(scenes, &moment, 0), || self.view(scenes, &moment, 1));
        let ideal = self.optics.pinhole();
        // What an ideal rig sees holds depth and masks as well; through a lens they are rendered
        // for themselves.
        let middle = &scenes[scenes.len() / 2];
        let truth = self.views.as_ref().map(|_| self.render(middle, ideal, 0, 1.0));
        let ((left_rgb, seen), (right_rgb, _)) = (left, right);
        let Picture { depth_m, instances, .. } = truth.unwrap_or(seen);
        let Moment { index, time_s, t_world_camera, objects, .. } = moment;
        SynthFrame {
            index,
            time_s,
            width: ideal.width,
            height: ideal.height,
            image_size: self
                .views
                .as_ref()
                .map_or([ideal.width, ideal.height], |[left, _]| left.size),
            left_grey: left_rgb.iter().map(|&pixel| luma(pixel)).collect(),
            right_grey: right_rgb.iter().map(|&pixel| luma(pixel)).collect(),
            left_rgb,
            right_rgb,
            depth_m,
            instances,
            t_world_camera,
            objects,
        }
    }

    /// One camera's image, 0 left or 1 right; with depth and masks where the rig is ideal.
    fn view(&self, scenes: &[Scene], moment: &Moment, camera: u32) -> (Vec<[u8; 3]>, Picture) {
        let &Moment { index, gain, .. } = moment;
        let sensor = Sensor::new(self.optics.seed, index, camera, self.optics.noise_sigma);
        let view = self.views.as_ref().and_then(|views| views.get(camera as usize));
        // The ideal rig renders what its camera sees.
        let pinhole = view.map_or_else(|| self.optics.pinhole(), |view| view.pinhole);
        let middle = scenes.len() / 2;
        let mut picture = self.render(&scenes[middle], pinhole, camera, gain);
        // While the shutter is open light adds up, before it becomes grey levels.
        for (number, scene) in scenes.iter().enumerate() {
            if number != middle {
                picture.add(&self.render(scene, pinhole, camera, gain));
            }
        }
        picture.scale(1.0 / scenes.len() as f32);
        let rgb = match view {
            None => picture.develop(&sensor),
            // Without noise: the sensor comes after the lens.
            Some(view) => view.image(&picture.develop(&Sensor::new(0, 0, 0, 0.0)), &sensor),
        };
        (rgb, picture)
    }

    fn render(&self, scene: &Scene, pinhole: Pinhole, camera: u32, gain: f64) -> Picture {
        let renderer = Renderer { painter: &self.painter, light: &self.light, pinhole };
        let (offset_m, gain) = if camera == 0 {
            (0.0, gain)
        } else {
            (self.optics.rig.baseline_m, gain * (1.0 + self.optics.gain_difference))
        };
        renderer.picture(scene, offset_m, gain as f32)
    }
}
