//! A synthetic street: seeded, endless, with exact truth about everything in it.
//!
//! A [`Street`] gives rectified stereo pairs in colour and grey with sensor noise, exact depth,
//! instance masks, poses of the camera and of every car, simulated LiDAR, and the samples of an
//! inertial unit. Frame `i` depends on the configuration and `i` alone: frames may be asked for in
//! any order, on any number of threads. Only plain arithmetic, the root and `libm` are used, so
//! that the pictures are the same bits on every machine.
//!
//! Memory: about a dozen [`SEGMENT_M`]-metre segments of street near the camera and one frame's
//! buffers, however far the camera drives. Time: about 40,000 triangles a view are set up at any
//! size, the rest is linear in pixels. What can go wrong: a configuration out of range is refused
//! by [`Street::new`].
//!
//! Through a lens of [`StreetLens`] images come raw, with a calibration; a [`RigError`] is what
//! that calibration does not know.
//!
//! Left out: motion blur, rolling shutter, pedestrians, rain; glass shows no rooms; the
//! LiDAR's revolution takes no time.
//!
//! ```
//! use dynvox::synth::{Street, StreetConfig};
//! let street = Street::new(StreetConfig { width: 160, height: 48, ..StreetConfig::static_street() }).unwrap();
//! let frame = street.frame(12);
//! assert_eq!(frame.depth_m.len(), 160 * 48);
//! ```

mod camera;
mod car;
mod car_paint;
#[cfg(test)]
mod carried_tests;
mod config;
mod error;
mod facade;
mod filter;
#[cfg(test)]
mod flow_tests;
mod flown;
mod frame;
mod furniture;
mod inertial;
mod inertial_unit;
mod layout;
mod lens;
mod lidar;
mod light;
mod matrix_pose;
mod mesh;
mod optics;
mod paint;
mod path;
mod pattern;
mod present;
mod random;
mod raster;
mod raw;
#[cfg(test)]
mod raw_tests;
mod recent;
mod render;
mod room;
mod room_paint;
mod scene;
mod segment;
mod sensor;
mod settings;
mod shadow;
mod street;
mod street_scene;
mod studio;
mod surface;
#[cfg(test)]
mod tests;
mod texture;
mod town;
mod traffic;
#[cfg(test)]
mod upright_tests;
mod window_paint;
mod world;
mod writer;

pub use camera::CAMERA_HEIGHT_M;
pub use config::{CarKind, Lane, MovingTraffic, ScriptedCar, SpeedProfile, StreetConfig, Traffic};
pub use error::SynthError;
pub use flown::{FlownView, StreetPose};
pub use frame::{ObjectTruth, SynthFrame};
pub use inertial::t_camera_unit;
pub use inertial_unit::{StreetUnit, UnitFault};
pub use lens::{RigError, StreetLens};
pub use path::SEGMENT_M;
pub use room::{Room, RoomConfig, RoomKind, RoomPath};
pub use street::Street;
pub use town::{Town, TownConfig, TownTwins};
pub use world::World;
pub use writer::write_kitti;
