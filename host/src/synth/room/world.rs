//! A room or yard as a world: what stands, who walks, and what the camera sees of it.

use std::sync::Arc;

use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::Rectification;
use nalgebra::Vector3;

use super::config::{RoomConfig, RoomKind, RoomPath};
use super::extent::Extent;
use super::path::CameraPath;
use super::people::{Person, Standing};
use super::{inside, yard};
use crate::formats::TimedReading;
use crate::formats::calibration::StereoCalibration;
use crate::synth::error::SynthError;
use crate::synth::frame::SynthFrame;
use crate::synth::inertial::Carried;
use crate::synth::inertial_unit::StreetUnit;
use crate::synth::lidar::Scanner;
use crate::synth::light::Light;
use crate::synth::matrix_pose::MatrixPose;
use crate::synth::mesh::{Mesh, Point};
use crate::synth::optics::Optics;
use crate::synth::random::Rng;
use crate::synth::scene::{Scene, SceneObject, Sunlight};
use crate::synth::shadow::{GroundLight, ShadowMap, ShadowTile, SunAxes};
use crate::synth::studio::{Moment, Studio};
use crate::synth::world::World;

/// Moments within an open shutter at which the scene is rendered.
const MOMENTS: u32 = 5;
/// Time from bright to bright where the light swings, s.
const SWING_S: f64 = 6.0;

/// A synthetic room or yard.
pub struct Room {
    kind: RoomKind,
    config: RoomConfig,
    studio: Studio,
    path: CameraPath,
    meshes: Vec<Arc<Mesh>>,
    people: Vec<Person>,
    sun: Option<Sun>,
    pub(in crate::synth) t_camera0_room: Transform,
}

/// Sunlight of a yard.
struct Sun {
    axes: SunAxes,
    /// Shadow of what stands.
    standing: ShadowTile,
}

impl Room {
    /// Builds a room or yard for a configuration.
    ///
    /// # Errors
    /// A figure out of range, with its name.
    ///
    /// ```
    /// use dynvox::synth::{RoomKind, Room, RoomConfig, World};
    ///
    /// let config = RoomConfig { width: 96, height: 64, ..RoomConfig::default() };
    /// let room = Room::new(RoomKind::Room, config)?;
    /// let frame = room.frame(3);
    /// // Every ray ends at a wall.
    /// assert!(frame.depth_m.iter().all(|&depth_m| depth_m > 0.0));
    /// # Ok::<(), dynvox::synth::SynthError>(())
    /// ```
    pub fn new(kind: RoomKind, config: RoomConfig) -> Result<Self, SynthError> {
        if let Some(problem) = config.problem() {
            return Err(SynthError::Config(problem));
        }
        if kind == RoomKind::Yard && config.path == RoomPath::Corridor {
            return Err(SynthError::Config(
                "a yard has no corridor. Set room.path to another, or take the room".to_owned(),
            ));
        }
        let extent = Extent::new(kind, &config);
        let path = CameraPath::new(kind, &config, &extent);
        let to_light = to_light(kind, config.seed);
        // Lamps throw no shadows; the sun's shadow of what stands is drawn once.
        let towards = to_light.map(|value| value as f32);
        let (standing, light) = match kind {
            RoomKind::Room => (inside::room(&config, &extent), Light::lamps(towards)),
            RoomKind::Yard => (yard::yard(&config, &extent), Light::day(towards)),
        };
        let meshes = standing.meshes;
        let sun = (kind == RoomKind::Yard).then(|| {
            let axes = SunAxes::new(to_light);
            let still = MatrixPose::new(&Transform::IDENTITY);
            // The ground, first of the meshes, shades nothing.
            let standing = meshes.iter().skip(1).map(|mesh| (&**mesh, still));
            Sun { axes, standing: ShadowTile::new(&axes, standing) }
        });
        // People keep clear of a camera that walks with them, or of one that stands.
        let walks = !matches!(config.path, RoomPath::Stand | RoomPath::Turn);
        let person = |number| Person::new(config.seed, number, &extent, path.round_hz(), walks);
        Ok(Self {
            kind,
            studio: Studio::new(optics(&config), light)?,
            people: (0..config.people).map(person).collect(),
            t_camera0_room: path.t_room_camera(0.0).inverse(),
            path,
            meshes,
            sun,
            config,
        })
    }

    /// The configuration.
    pub fn config(&self) -> &RoomConfig {
        &self.config
    }

    /// Pose of a camera above the floor: `at_m` to the right of and ahead of the middle,
    /// `height_m` above the floor, turned to the right by `yaw_rad`.
    pub fn pose_above_floor(
        &self,
        [right_m, ahead_m]: [f64; 2],
        height_m: f64,
        yaw_rad: f64,
    ) -> Transform {
        Transform::new(Vector3::new(0.0, yaw_rad, 0.0), Vector3::new(right_m, -height_m, ahead_m))
    }

    /// Half the width and half the length of what is free of plants and furniture, m.
    pub fn open_half_m(&self) -> [f64; 2] {
        Extent::new(self.kind, &self.config).round_m
    }

    /// Frame of a scene, in which the world of the poses is the room.
    pub(in crate::synth) fn frame_of(
        &self,
        index: u32,
        scene: &Scene,
        t_room_camera: Transform,
    ) -> SynthFrame {
        let moment = self.moment(index, t_room_camera, &Transform::IDENTITY);
        self.studio.frame(core::slice::from_ref(scene), moment)
    }

    /// Time, light and truth of a frame, in a world that the room has a pose in.
    fn moment(&self, index: u32, t_world_camera: Transform, t_world_room: &Transform) -> Moment {
        let time_s = self.time_s(index);
        let truth = |(number, person): (u32, &Standing)| person.truth(number, t_world_room);
        Moment {
            index,
            time_s,
            gain: self.gain(time_s),
            t_world_camera,
            objects: (0..).zip(&self.people_at(time_s)).map(truth).collect(),
        }
    }

    /// Everything at a time, seen from a pose of the camera.
    pub(in crate::synth) fn scene(&self, time_s: f64, t_room_camera: &Transform) -> Scene {
        let t_camera_room = t_room_camera.inverse();
        let still = |mesh: &Arc<Mesh>| {
            SceneObject::new(Arc::clone(mesh), &Transform::IDENTITY, &t_camera_room)
        };
        // What stands first, then people part by part.
        let mut objects: Vec<SceneObject> = self.meshes.iter().map(still).collect();
        let people = self.people_at(time_s);
        for (number, person) in people.iter().enumerate() {
            objects.extend(person.parts.iter().map(|(mesh, t_room_part)| SceneObject {
                instance: number as u8 + 1,
                ..SceneObject::new(Arc::clone(mesh), t_room_part, &t_camera_room)
            }));
        }
        let sunlight = self.sun.as_ref().map(|sun| {
            let mut shadow = ShadowMap::new(sun.axes, Point::zeros(), Point::zeros());
            shadow.lay(&sun.standing);
            for (mesh, t_room_part) in people.iter().flat_map(|person| &person.parts) {
                let part = (&**mesh, MatrixPose::new(t_room_part));
                shadow.lay(&ShadowTile::new(&sun.axes, core::iter::once(part)));
            }
            Sunlight { shadow, ground: GroundLight::new(Point::zeros(), Point::zeros()) }
        });
        Scene { objects, anchor_camera: Scene::anchored(t_room_camera, Point::zeros()), sunlight }
    }

    fn people_at(&self, time_s: f64) -> Vec<Standing> {
        self.people.iter().map(|person| person.at(time_s)).collect()
    }

    /// Times within the open shutter around a frame's time, s; the middle one is that time.
    fn moments(&self, time_s: f64) -> impl Iterator<Item = f64> {
        let open_s = self.config.shutter_s;
        let count = if open_s > 0.0 { MOMENTS } else { 1 };
        (0..count).map(move |moment| {
            time_s + open_s * ((f64::from(moment) + 0.5) / f64::from(count) - 0.5)
        })
    }

    /// Light let in at a time.
    fn gain(&self, time_s: f64) -> f64 {
        let phase = 2.0 * core::f64::consts::PI * time_s / SWING_S;
        1.0 + self.config.light_swing * libm::sin(phase)
    }
}

impl World for Room {
    fn name(&self) -> &'static str {
        match self.kind {
            RoomKind::Room => "room",
            RoomKind::Yard => "yard",
        }
    }

    fn frames(&self) -> u32 {
        self.config.frames
    }

    fn size(&self) -> [usize; 2] {
        [self.config.width as usize, self.config.height as usize]
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
        f64::from(index) / self.config.rate_hz
    }

    fn t_world_camera(&self, index: u32) -> Transform {
        if index == 0 {
            return Transform::IDENTITY;
        }
        (self.t_camera0_room * self.path.t_room_camera(self.time_s(index))).normalized()
    }

    fn up_in_world(&self) -> [f64; 3] {
        // The room's y axis points down.
        self.t_camera0_room.rotate([0.0, -1.0, 0.0])
    }

    fn frame(&self, index: u32) -> SynthFrame {
        let time_s = self.time_s(index);
        let scene = |time_s: f64| self.scene(time_s, &self.path.t_room_camera(time_s));
        let scenes: Vec<Scene> = self.moments(time_s).map(scene).collect();
        let moment = self.moment(index, self.t_world_camera(index), &self.t_camera0_room);
        self.studio.frame(&scenes, moment)
    }

    fn lidar(&self, index: u32) -> Vec<[f32; 4]> {
        let time_s = self.time_s(index);
        let scene = self.scene(time_s, &self.path.t_room_camera(time_s));
        Scanner { scene: &scene, painter: &self.studio.painter }.scan()
    }

    fn unit(&self) -> Option<StreetUnit> {
        self.config.inertial
    }

    fn inertial(&self) -> Vec<TimedReading> {
        let Some(unit) = &self.config.inertial else { return Vec::new() };
        Carried {
            unit,
            seed: self.config.seed,
            last_s: self.time_s(self.config.frames.saturating_sub(1)),
            pose: &|time_s| self.path.t_room_camera(time_s),
        }
        .readings()
    }
}

/// Cameras of a configured room: the middle of the image is the principal point.
fn optics(config: &RoomConfig) -> Optics {
    let rig = StereoRig {
        focal_px: config.focal_px(),
        center_u_px: 0.5 * (f64::from(config.width) - 1.0),
        center_v_px: 0.5 * (f64::from(config.height) - 1.0),
        baseline_m: config.baseline_m,
    };
    Optics {
        section: "room",
        seed: config.seed,
        size: [config.width, config.height],
        rig,
        lens: config.lens.clone(),
        rig_error: config.rig_error,
        noise_sigma: config.noise_sigma,
        gain_difference: config.gain_difference,
    }
}

/// Direction to the sun of a yard, or to where most light of a room comes from.
fn to_light(kind: RoomKind, seed: u64) -> Point {
    let mut rng = Rng::new(seed, 0x50_1A2, kind as i64 + 1);
    let (height, side) = match kind {
        RoomKind::Room => (rng.between(0.9, 1.2), rng.between(-3.1, 3.1)),
        RoomKind::Yard => (rng.between(0.75, 0.95), rng.between(-3.1, 3.1)),
    };
    let flat = libm::cos(height);
    Vector3::new(flat * libm::sin(side), -libm::sin(height), -flat * libm::cos(side))
}
