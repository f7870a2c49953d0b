//! Routes through the synthetic worlds, drawn from seeds.

use super::vehicle::Multirotor;
use super::{IMAGE, RATE_HZ};
use crate::synth::{
    FlownView, MovingTraffic, Room, RoomConfig, RoomKind, Street, StreetConfig, SynthError,
    Traffic, World,
};
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::random::Random;
use nalgebra::Vector3;

/// Height of the vehicle above the ground, m.
pub const HEIGHT_M: f64 = 1.6;
/// Distance between the cameras in a yard, m.
const YARD_BASELINE_M: f64 = 0.2;
/// People in a yard.
const PEOPLE: u32 = 3;
/// Start in a yard, as a share of the way from its middle to where plants begin.
const YARD_START: f64 = 0.8;

/// World that is flown through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum FlightWorld {
    /// A street with and without cars that cross.
    #[default]
    Street,
    /// A yard with people who walk about.
    Yard,
}

/// A route drawn from a seed.
pub struct Route {
    ground: Ground,
    yaw_rad: f64,
    random: Random,
}

/// The world, and the point where the vehicle starts.
enum Ground {
    Street { street: Box<Street>, along_m: f64, lateral_m: f64 },
    Yard { yard: Box<Room>, at_m: [f64; 2] },
}

/// Position and direction of the camera on a route.
#[derive(Clone, Copy, Debug)]
pub struct RoutePose {
    /// Camera to the start, m.
    t_start_camera: Transform,
    ahead_m: f64,
}

impl Route {
    /// Draws a world, a start in it and a direction.
    ///
    /// # Errors
    /// The world cannot be made.
    pub fn draw(world: FlightWorld, seed: u64) -> Result<Self, SynthError> {
        let mut random = Random::new(seed ^ 0xF117);
        let mut between = |low: f64, high: f64| low + (high - low) * random.fraction();
        let [width, height] = IMAGE;
        let (ground, yaw_rad) = match world {
            FlightWorld::Street => {
                let (along_m, lateral_m) = (between(30.0, 300.0), between(-1.0, 1.0));
                // Half of the flights keep to the street, half leave it for what stands beside it.
                let side = if seed.is_multiple_of(2) { 0.1 } else { 1.2 };
                let yaw_rad = between(-side, side);
                let traffic = if (seed / 2).is_multiple_of(2) {
                    Traffic::None
                } else {
                    Traffic::Moving(MovingTraffic { cars: Vec::new(), ..Default::default() })
                };
                let config = StreetConfig {
                    seed,
                    width,
                    height,
                    rate_hz: RATE_HZ,
                    traffic,
                    ..Default::default()
                };
                let street = Box::new(Street::new(config)?);
                (Ground::Street { street, along_m, lateral_m }, yaw_rad)
            }
            FlightWorld::Yard => {
                let config = RoomConfig {
                    seed,
                    width,
                    height,
                    rate_hz: RATE_HZ,
                    baseline_m: YARD_BASELINE_M,
                    people: PEOPLE,
                    ..Default::default()
                };
                // Hedges stand around the open ground, and people walk about on it.
                let yard = Box::new(Room::new(RoomKind::Yard, config)?);
                // From one end of the open ground towards the other.
                let [half_x, half_z] = yard.open_half_m();
                let at_m = [between(-0.5, 0.5) * half_x, -YARD_START * half_z];
                (Ground::Yard { yard, at_m }, between(-0.5, 0.5))
            }
        };
        Ok(Self { ground, yaw_rad, random })
    }

    /// The cameras.
    pub fn rig(&self) -> StereoRig {
        match &self.ground {
            Ground::Street { street, .. } => street.rig(),
            Ground::Yard { yard, .. } => yard.rig(),
        }
    }

    /// Pose of the camera where the vehicle is, at a time.
    pub fn pose(&self, vehicle: &Multirotor, time_s: f64) -> RoutePose {
        let [right, ahead] = vehicle.position_m;
        // A gimbal holds the camera level, but for a little.
        let turn = Vector3::new(
            0.004 * libm::sin(9.0 * time_s),
            0.006 * libm::sin(4.0 * time_s + 1.0),
            0.004 * libm::sin(7.0 * time_s + 2.0),
        );
        let t_start_camera = Transform::new(turn, Vector3::new(right, 0.0, ahead));
        RoutePose { t_start_camera, ahead_m: ahead }
    }

    /// The world around a pose at the time of a picture.
    pub fn view(&self, index: u32, pose: &RoutePose) -> FlownView<'_> {
        match &self.ground {
            Ground::Street { street, along_m, lateral_m } => {
                let start = street.pose_above_road(*along_m, *lateral_m, HEIGHT_M, self.yaw_rad);
                let mut moved = start;
                moved.along_m += pose.ahead_m * libm::cos(self.yaw_rad);
                moved.t_street_camera = (start.t_street_camera * pose.t_start_camera).normalized();
                street.seen_from(index, &moved)
            }
            Ground::Yard { yard, at_m } => {
                let start = yard.pose_above_floor(*at_m, HEIGHT_M, self.yaw_rad);
                yard.seen_from(index, &(start * pose.t_start_camera).normalized())
            }
        }
    }

    /// Returns true for a share of the times it is asked.
    pub fn chance(&mut self, share: f64) -> bool {
        self.random.fraction() < share
    }
}
