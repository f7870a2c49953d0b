//! The street itself: what stays from frame to frame, and how a frame is made.

use std::sync::Arc;

use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::Rectification;
use nalgebra::Vector3;

use super::camera;
use super::car;
use super::config::{CarKind, StreetConfig};
use super::error::SynthError;
use super::frame::SynthFrame;
use super::layout;
use super::light::Light;
use super::mesh::Mesh;
use super::paint::Painter;
use super::path::{Centerline, RoadSpan, SEGMENT_M};
use super::present::{self, PresentCar};
use super::random::Rng;
use super::recent::Recent;
use super::scene::Scene;
use super::segment::{Segment, segment};
use super::shadow::SunAxes;
use super::street_scene::{StreetView, street_scene};
use super::studio::{Moment, Studio};
use super::traffic::{self, Road};
use crate::formats::calibration::StereoCalibration;

/// Distances behind and ahead of the camera up to which the street exists, m.
const REACH_M: (f64, f64) = (70.0, 180.0);
/// Segments cached: more than one frame needs.
const CACHED_SEGMENTS: usize = 16;

/// A synthetic street.
pub struct Street {
    config: StreetConfig,
    centerline: Centerline,
    studio: Studio,
    sun: SunAxes,
    bodies: [Arc<Mesh>; 5],
    segments: Recent<i64, Segment>,
    t_camera0_street: Transform,
}

/// The street around the camera at one frame.
pub(super) struct Surroundings {
    /// Objects and shadows.
    pub scene: Scene,
    /// Camera in the street.
    pub t_street_camera: Transform,
    cars: Vec<PresentCar>,
}

impl Street {
    /// A street for a configuration; nothing of it is built yet but its noise pictures and car
    /// bodies.
    ///
    /// # Errors
    /// A figure out of range, with its name.
    pub fn new(config: StreetConfig) -> Result<Self, SynthError> {
        if let Some(problem) = config.problem() {
            return Err(SynthError::Config(problem));
        }
        let centerline = Centerline::new(&config);
        // A generator for the sun: other draws do not move it.
        let mut rng = Rng::new(config.seed, 0x50_1A2, 0);
        // The sun stands behind the camera's left shoulder: houses on the right are lit, those on
        // the left throw shadows on the road.
        let (height, side) = (rng.between(0.70, 0.85), rng.between(-1.25, -0.65));
        let flat = libm::cos(height);
        let to_sun =
            Vector3::new(flat * libm::sin(side), -libm::sin(height), -flat * libm::cos(side));
        let t_street_camera = camera::t_street_camera(&config, &centerline.span(0, 0), 0.0);
        let light = Light::day(to_sun.map(|value| value as f32));
        Ok(Self {
            studio: Studio::new(camera::optics(&config), light)?,
            centerline,
            sun: SunAxes::new(to_sun),
            bodies: CarKind::ALL.map(|kind| Arc::new(car::body(kind))),
            segments: Recent::new(CACHED_SEGMENTS),
            t_camera0_street: t_street_camera.inverse(),
            config,
        })
    }

    /// The configuration.
    pub fn config(&self) -> &StreetConfig {
        &self.config
    }

    /// The stereo rig.
    pub fn rig(&self) -> StereoRig {
        self.studio.optics.rig
    }

    /// The calibration of raw images; `None` where they come rectified.
    pub fn calibration(&self) -> Option<&StereoCalibration> {
        self.studio.calibration()
    }

    /// Returns the rectification of raw images to the ideal rig; `None` if images are rendered
    /// rectified.
    pub fn rectification(&self) -> Option<Rectification> {
        self.studio.rectification()
    }

    /// Time of frame `index` since frame 0, s.
    pub fn time_s(&self, index: u32) -> f64 {
        f64::from(index) / self.config.rate_hz
    }

    /// Camera pose at frame `index`; exactly the identity at frame 0.
    pub fn t_world_camera(&self, index: u32) -> Transform {
        self.to_world(&self.t_street_camera(self.time_s(index)), index)
    }

    /// Direction that points up in the world of the poses, a unit vector.
    pub fn up_in_world(&self) -> [f64; 3] {
        // The street's y axis points down.
        self.t_camera0_street.rotate([0.0, -1.0, 0.0])
    }

    /// Camera pose on the street at a time since frame 0, which may lie before it.
    pub(super) fn t_street_camera(&self, time_s: f64) -> Transform {
        let at = libm::floor(camera::along_m(&self.config, time_s) / SEGMENT_M) as i64;
        camera::t_street_camera(&self.config, &self.centerline.span(at, at), time_s)
    }

    fn to_world(&self, t_street_camera: &Transform, index: u32) -> Transform {
        if index == 0 {
            Transform::IDENTITY
        } else {
            (self.t_camera0_street * t_street_camera).normalized()
        }
    }

    /// Frame `index` with all its truth.
    pub fn frame(&self, index: u32) -> SynthFrame {
        let around = self.surroundings(index);
        let t_world_camera = self.to_world(&around.t_street_camera, index);
        self.frame_of(index, &around, t_world_camera)
    }

    /// Frame `index` in its surroundings.
    pub(super) fn frame_of(
        &self,
        index: u32,
        around: &Surroundings,
        t_world_camera: Transform,
    ) -> SynthFrame {
        let scene = core::slice::from_ref(&around.scene);
        let truth = |car: &PresentCar| car.truth(&self.bodies, &self.t_camera0_street);
        let objects = around.cars.iter().map(truth).collect();
        let time_s = self.time_s(index);
        self.studio.frame(scene, Moment { index, time_s, gain: 1.0, t_world_camera, objects })
    }

    /// Builds the scene of a frame.
    pub(super) fn surroundings(&self, index: u32) -> Surroundings {
        let time_s = self.time_s(index);
        let along_m = camera::along_m(&self.config, time_s);
        self.surroundings_of(time_s, along_m, |span| {
            camera::t_street_camera(&self.config, span, time_s)
        })
    }

    /// Builds the scene around a camera that `pose_camera` poses, `along_m` along the street.
    pub(super) fn surroundings_of(
        &self,
        time_s: f64,
        along_m: f64,
        pose_camera: impl FnOnce(&RoadSpan<'_>) -> Transform,
    ) -> Surroundings {
        // Ahead and behind as far as the camera or a shadow can reach.
        let reach = (along_m - REACH_M.0, along_m + REACH_M.1);
        let (first, last) =
            (libm::floor(reach.0 / SEGMENT_M) as i64, libm::floor(reach.1 / SEGMENT_M) as i64);
        let span = self.centerline.span(first, last);
        let t_street_camera = pose_camera(&span);
        let segments: Vec<Arc<Segment>> =
            (first..=last).map(|number| self.segment(number)).collect();
        let (from_m, to_m) = reach;
        let road = Road { config: &self.config, span: &span, time_s, from_m, to_m };
        let cars = present(&segments, &road);
        let anchor = span.point(libm::floor(along_m / SEGMENT_M) * SEGMENT_M);
        let posed_cars: Vec<_> = cars.iter().map(PresentCar::posed).collect();
        let view = StreetView { t_street_camera: &t_street_camera, anchor, sun: self.sun };
        let scene = street_scene(&self.bodies, &segments, &posed_cars, view);
        Surroundings { scene, t_street_camera, cars }
    }

    /// The frame that stands on the road, as [`RoadSpan::t_street_local`] has it.
    pub(super) fn t_street_local(&self, along_m: f64, lateral_m: f64, yaw_rad: f64) -> Transform {
        let at = libm::floor(along_m / SEGMENT_M) as i64;
        self.centerline.span(at, at).t_street_local(along_m, lateral_m, yaw_rad)
    }

    /// A segment, from the few that are cached or made anew: either way the same.
    fn segment(&self, number: i64) -> Arc<Segment> {
        self.segments.get(number, || segment(&self.config, &self.centerline, &self.sun, number))
    }

    /// Painter, for the LiDAR.
    pub(super) fn painter(&self) -> &Painter {
        &self.studio.painter
    }
}

/// Cars of the traffic and parked ones, by id.
fn present(segments: &[Arc<Segment>], road: &Road<'_>) -> Vec<PresentCar> {
    let mut cars: Vec<PresentCar> = Vec::new();
    for driver in traffic::drivers(road) {
        let traffic::Driver { id, kind, paint, t_street_car, speed_m_s } = driver;
        cars.push(PresentCar { id, kind, paint, t_street_car, speed_m_s });
    }
    cars.extend(segments.iter().flat_map(|segment| &segment.parked).map(PresentCar::from));
    // 8 parking spaces a segment and traffic 30 m apart leave the bound far away; scripts could
    // reach it.
    present::number(&mut cars);
    debug_assert!(cars.iter().all(|car| car.id < layout::PARKED_IDS || car.speed_m_s == 0.0));
    cars
}
