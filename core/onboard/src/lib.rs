//! Obstacles around a vehicle, of a mapper's planner window, in the words of autopilots and
//! navigation stacks.
//!
//! | module | gives | for |
//! |---|---|---|
//! | [`sectors`] | the nearest obstacle in each of 72 directions | MAVLink's `OBSTACLE_DISTANCE` |
//! | [`points`] | the nearest obstacles as points | MAVLink's `OBSTACLE_DISTANCE_3D` |
//! | [`costs`] | a cost for each column | costmaps of Nav2 |
//! | [`heights`] | the height of the ground in each column | height maps |
//! | [`mavlink`] | bytes of the messages | a serial line or a socket |
//!
//! A direction is free only where every cell of the vehicle's height, out to the range asked for,
//! was seen free within the frames allowed. What was not seen is unknown. Cells shortly before a
//! surface, where depth's error could have put it, belong to the obstacle.
//!
//! ```
//! use dynvox_core::{
//!     Capacity, Config, Mapper, PoseOrigin, Serial, StereoFrame,
//!     geometry::{StereoRig, Transform}, image::View, memory::SLAB_ALIGN,
//! };
//! use dynvox_onboard::{Band, Direction, Vehicle, sectors};
//!
//! // A camera that looks at a wall 10 m ahead.
//! let rig = StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
//! let capacity = Capacity {
//!     planning_width: 120, planning_length: 120, planning_height: 20, ..Capacity::TINY
//! };
//! let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
//! let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
//! let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
//! let view = View::new(&grey, 320, 96).unwrap();
//! let frame = StereoFrame {
//!     disparity_q8: View::new(&wall, 320, 96),
//!     t_world_camera: Some(Transform::IDENTITY),
//!     ..StereoFrame::pair(view, view)
//! };
//! let mut report = mapper.step(&frame, &Serial)?;
//! for _ in 0..3 {
//!     report = mapper.step(&frame, &Serial)?;
//! }
//! mapper.update_planning_maps(0.0);
//!
//! let vehicle = Vehicle::new(&report.t_world_camera, report.pose != PoseOrigin::Extrapolated);
//! let band = Band {
//!     body_m: 0.3, near_m: 3.0, far_m: 11.0, up_m: 0.2, down_m: 0.2, stale_frames: 30,
//! };
//! let around = sectors(mapper.planning(), &vehicle, &band);
//! match around.directions()[0] {
//!     // Half a pixel of disparity is half a metre there: so far from the wall all is free.
//!     Direction::Obstacle { distance_m } => assert!((9.0..10.0).contains(&distance_m)),
//!     other => panic!("{other:?}"),
//! }
//! // Nothing was ever seen behind the vehicle.
//! assert_eq!(around.directions()[36], Direction::Unknown);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![no_std]
#![cfg_attr(
    test,
    allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)
)]

#[cfg(test)]
extern crate std;

mod columns;
mod costmap;
pub mod mavlink;
mod sector;
mod vehicle;

pub use costmap::{COST_FREE, COST_LETHAL, COST_UNKNOWN, Costmap, costs, heights};
pub use sector::{Band, Direction, SECTOR_DEG, SECTORS, Sectors, points, sectors};
pub use vehicle::Vehicle;
