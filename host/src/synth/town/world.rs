//! A town as a world: blocks near the camera, cars, and the recording.

use std::sync::Arc;

use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::Rectification;
use nalgebra::Vector3;

use super::block::{BlockNumber, PITCH_M, Plan};
use super::config::TownConfig;
use super::route::Route;
use crate::formats::TimedReading;
use crate::formats::calibration::StereoCalibration;
use crate::synth::camera;
use crate::synth::car;
use crate::synth::config::{CarKind, StreetConfig, Traffic};
use crate::synth::error::SynthError;
use crate::synth::frame::{ObjectTruth, SynthFrame};
use crate::synth::inertial::Carried;
use crate::synth::inertial_unit::StreetUnit;
use crate::synth::layout;
use crate::synth::lidar::Scanner;
use crate::synth::light::Light;
use crate::synth::mesh::{Mesh, Parallelogram, Point};
use crate::synth::present::{self, PresentCar};
use crate::synth::random::{Rng, hash};
use crate::synth::recent::Recent;
use crate::synth::scene::{Scene, SceneObject};
use crate::synth::segment::{ParkedCar, Segment, choose_car};
use crate::synth::shadow::SunAxes;
use crate::synth::street_scene::{StreetView, street_scene};
use crate::synth::studio::{Moment, Studio};
use crate::synth::surface::{Kind, Surface, tone};
use crate::synth::world::World;

/// Distance from the camera up to which all blocks exist, m.
const NEAR_M: f64 = 100.0;
/// Distance up to which the blocks along the camera's street exist, m.
const ALONG_M: f64 = 180.0;
/// Distance up to which cars exist, m.
const CARS_M: f64 = 90.0;
/// Blocks cached: more than one frame needs.
const CACHED_BLOCKS: usize = 48;
/// Speed of the traffic, m/s.
const TRAFFIC_M_S: f64 = 8.0;
/// Side of the grid on which shadows keep their texels, m.
const ANCHOR_M: f64 = 16.0;
/// Half of the side of the land around the town, m.
const LAND_M: f64 = 2000.0;

/// A synthetic town.
pub struct Town {
    /// The street's settings; their seed chooses houses, and noise and motions with the recording's
    /// number.
    street: StreetConfig,
    town: TownConfig,
    frames: u32,
    route: Route,
    /// Settings of the camera in this recording.
    camera: StreetConfig,
    studio: Studio,
    sun: SunAxes,
    bodies: [Arc<Mesh>; 5],
    land: Arc<Mesh>,
    blocks: Recent<BlockNumber, Segment>,
    t_camera0_town: Transform,
}

impl Town {
    /// Builds a town with the street's cameras and houses; its blocks are built as the camera comes
    /// near. The recording has the frames of its laps.
    ///
    /// # Errors
    /// A figure out of range, with its name.
    ///
    /// ```
    /// use dynvox::synth::{StreetConfig, Town, TownConfig, World};
    ///
    /// let street = StreetConfig { width: 96, height: 32, ..StreetConfig::static_street() };
    /// let town = Town::new(street, TownConfig { laps: 1.0, ..TownConfig::default() })?;
    /// // One lap later the camera is where it began, but for a frame and the springs of its car.
    /// let end = town.t_world_camera(town.frames() - 1);
    /// assert!(end.translation_m.iter().all(|metres| metres.abs() < 1.0));
    /// # Ok::<(), dynvox::synth::SynthError>(())
    /// ```
    pub fn new(street: StreetConfig, town: TownConfig) -> Result<Self, SynthError> {
        if let Some(problem) = street.problem().or_else(|| town.problem()) {
            return Err(SynthError::Config(problem));
        }
        let route = Route::new(town.blocks, !town.reverse, town.lane_shift_m);
        // A recording has noise and small motions of its own; the first one has the street's.
        let recording = i64::from(town.recording);
        let own = if recording == 0 { street.seed } else { hash(street.seed, 0x70_40, recording) };
        let camera = StreetConfig { seed: own, ..street.clone() };
        // The sun has a generator of its own, so that other draws do not move it.
        let mut rng = Rng::new(street.seed, 0x50_1A2, 7);
        let height = rng.between(0.70, 0.85);
        let side = rng.between(-3.1, 3.1) + town.sun_turn_deg.to_radians();
        let flat = libm::cos(height);
        let to_sun =
            Vector3::new(flat * libm::sin(side), -libm::sin(height), -flat * libm::cos(side));
        let light = Light::day(to_sun.map(|value| value as f32));
        // A camera that stands never ends its lap.
        let lap_s = route.length_m() / street.speed_m_s.max(f64::MIN_POSITIVE);
        let frames = libm::ceil(town.laps * lap_s * street.rate_hz).min(f64::from(u32::MAX - 1));
        let mut town = Self {
            studio: Studio::new(camera::optics(&camera), light)?,
            frames: frames as u32 + 1,
            route,
            sun: SunAxes::new(to_sun),
            bodies: CarKind::ALL.map(|kind| Arc::new(car::body(kind))),
            land: Arc::new(land()),
            blocks: Recent::new(CACHED_BLOCKS),
            t_camera0_town: Transform::IDENTITY,
            street,
            town,
            camera,
        };
        town.t_camera0_town = town.t_town_camera(0.0).inverse();
        Ok(town)
    }

    /// Changes the number of frames.
    #[must_use]
    pub fn with_frames(self, frames: u32) -> Self {
        Self { frames, ..self }
    }

    /// The settings of the town.
    pub fn config(&self) -> &TownConfig {
        &self.town
    }

    /// Length of a lap, m.
    pub fn lap_m(&self) -> f64 {
        self.route.length_m()
    }

    /// World of the recording, which is the camera of its frame 0, in the town. Recordings of one
    /// town share the town.
    pub fn t_town_world(&self) -> Transform {
        self.t_camera0_town.inverse()
    }

    /// Camera pose in the town at a time since frame 0, which may lie before it.
    pub(super) fn t_town_camera(&self, time_s: f64) -> Transform {
        let along_m = camera::along_m(&self.camera, time_s);
        camera::carried(&self.camera, time_s, |right_m, yaw_rad| {
            self.route.t_town_local(along_m, right_m, yaw_rad)
        })
    }

    /// Cars near a point, by id: the traffic in the other lane, and those that are parked.
    fn cars<'c>(
        &self,
        time_s: f64,
        parked: impl Iterator<Item = &'c ParkedCar>,
        eye: Point,
    ) -> Vec<PresentCar> {
        let mut cars = self.traffic(time_s);
        cars.extend(parked.map(PresentCar::from));
        cars.retain(|car| (Point::from(car.t_street_car.translation_m) - eye).norm() < CARS_M);
        // Some 150 spaces are so near: the bound is never met.
        present::number(&mut cars);
        cars
    }

    /// Cars that go round the loop against the camera, all at one speed.
    fn traffic(&self, time_s: f64) -> Vec<PresentCar> {
        let Traffic::Moving(moving) = &self.street.traffic else { return Vec::new() };
        if moving.oncoming_gap_m <= 0.0 {
            return Vec::new();
        }
        let lane = Route::new(self.town.blocks, self.town.reverse, 0.0);
        let count = libm::floor(lane.length_m() / moving.oncoming_gap_m).clamp(1.0, 999.0) as u32;
        let gap_m = lane.length_m() / f64::from(count);
        let car = |number: u32| {
            let mut rng = Rng::new(self.camera.seed, 0x70_41, i64::from(number));
            let (kind, paint) = choose_car(&mut rng);
            let from_m = (f64::from(number) + rng.between(0.2, 0.8)) * gap_m;
            let t_street_car = lane.t_town_local(from_m + TRAFFIC_M_S * time_s, 0.0, 0.0);
            let id = layout::ONCOMING_IDS + number;
            PresentCar { id, kind, paint, t_street_car, speed_m_s: TRAFFIC_M_S }
        };
        (0..count).map(car).collect()
    }

    /// Blocks around a point: all that are near, and far ones along its street.
    fn near(&self, eye: Point) -> impl Iterator<Item = BlockNumber> {
        let last = self.town.blocks as i32;
        let grid = (-1..=last).flat_map(move |row| (-1..=last).map(move |column| (column, row)));
        // Far blocks of other streets are hidden behind near ones.
        grid.map(|(column, row)| BlockNumber { column, row }).filter(move |number| {
            let away = number.middle() - eye;
            let along = away.x.abs().min(away.z.abs()) < 0.75 * PITCH_M;
            away.norm() < NEAR_M || along && away.norm() < ALONG_M
        })
    }

    fn plan(&self) -> Plan<'_> {
        Plan { street: &self.street, town: &self.town, sun: &self.sun }
    }

    /// Everything near a pose of the camera at a time.
    fn scene(&self, time_s: f64, t_town_camera: &Transform) -> (Scene, Vec<PresentCar>) {
        let eye = Point::from(t_town_camera.translation_m);
        let built = |number| self.blocks.get(number, || self.plan().block(number));
        let blocks: Vec<Arc<Segment>> = self.near(eye).map(built).collect();
        let cars = self.cars(time_s, blocks.iter().flat_map(|block| &block.parked), eye);
        let posed: Vec<_> = cars.iter().map(PresentCar::posed).collect();
        // Texels of shadows stay where they are while the camera moves.
        let anchor = eye.map(|metres| libm::floor(metres / ANCHOR_M) * ANCHOR_M);
        let anchor = Point::new(anchor.x, 0.0, anchor.z);
        let view = StreetView { t_street_camera: t_town_camera, anchor, sun: self.sun };
        let mut scene = street_scene(&self.bodies, &blocks, &posed, view);
        let land = Arc::clone(&self.land);
        let t_camera_town = t_town_camera.inverse();
        scene.objects.push(SceneObject::new(land, &Transform::IDENTITY, &t_camera_town));
        (scene, cars)
    }

    /// Every car near the camera at frame `index`, as the frame has them.
    #[cfg(test)]
    pub(super) fn objects(&self, index: u32) -> Vec<ObjectTruth> {
        let time_s = self.time_s(index);
        let eye = Point::from(self.t_town_camera(time_s).translation_m);
        // Without the meshes of blocks, which take long.
        let numbers = self.near(eye).map(|number| self.plan().parked(number));
        let parked: Vec<ParkedCar> = numbers.flatten().collect();
        let cars = self.cars(time_s, parked.iter(), eye);
        cars.iter().map(|car| self.truth(car)).collect()
    }

    fn truth(&self, car: &PresentCar) -> ObjectTruth {
        car.truth(&self.bodies, &self.t_camera0_town)
    }
}

/// Meadow around the town and below it.
fn land() -> Mesh {
    let mut mesh = Mesh::default();
    let grass = Surface::new(Kind::Yard, tone(104, 112, 70), 3).with(tone(130, 122, 106));
    let grass = mesh.surface(grass);
    let (u, v) = (Point::x() * (2.0 * LAND_M), Point::z() * (2.0 * LAND_M));
    let origin = Point::new(-LAND_M, 0.1, -LAND_M);
    mesh.sheet(grass, -Point::y(), Parallelogram::new(origin, u, v), [0.0; 3]);
    mesh.finish()
}

impl World for Town {
    fn name(&self) -> &'static str {
        "town"
    }

    fn frames(&self) -> u32 {
        self.frames
    }

    fn size(&self) -> [usize; 2] {
        [self.street.width as usize, self.street.height as usize]
    }

    fn rig(&self) -> StereoRig {
        self.studio.optics.rig
    }

    fn calibration(&self) -> Option<&StereoCalibration> {
        self.studio.calibration()
    }

    fn rectification(&self) -> Option<Rectification> {
        self.studio.rectification()
    }

    fn time_s(&self, index: u32) -> f64 {
        f64::from(index) / self.street.rate_hz
    }

    fn t_world_camera(&self, index: u32) -> Transform {
        if index == 0 {
            return Transform::IDENTITY;
        }
        (self.t_camera0_town * self.t_town_camera(self.time_s(index))).normalized()
    }

    fn up_in_world(&self) -> [f64; 3] {
        // The town's y axis points down.
        self.t_camera0_town.rotate([0.0, -1.0, 0.0])
    }

    fn frame(&self, index: u32) -> SynthFrame {
        let time_s = self.time_s(index);
        let (scene, cars) = self.scene(time_s, &self.t_town_camera(time_s));
        let moment = Moment {
            index,
            time_s,
            gain: 1.0,
            t_world_camera: self.t_world_camera(index),
            objects: cars.iter().map(|car| self.truth(car)).collect(),
        };
        self.studio.frame(core::slice::from_ref(&scene), moment)
    }

    fn lidar(&self, index: u32) -> Vec<[f32; 4]> {
        let time_s = self.time_s(index);
        let (scene, _) = self.scene(time_s, &self.t_town_camera(time_s));
        Scanner { scene: &scene, painter: &self.studio.painter }.scan()
    }

    fn unit(&self) -> Option<StreetUnit> {
        self.street.inertial
    }

    fn inertial(&self) -> Vec<TimedReading> {
        let Some(unit) = &self.street.inertial else { return Vec::new() };
        Carried {
            unit,
            seed: self.camera.seed,
            last_s: self.time_s(self.frames.saturating_sub(1)),
            pose: &|time_s| self.t_town_camera(time_s),
        }
        .readings()
    }
}
