//! Flights in a closed loop: a simulated vehicle goes through the synthetic street or yard on what
//! the mapper tells of it, by the rule of an autopilot's collision prevention.

mod route;
mod rule;
mod trial;
mod truth;
mod vehicle;

pub use route::FlightWorld;
pub use rule::Limits;
pub use trial::{Conditions, Flight, FlightFrame, fly};

/// Radius of the vehicle, m.
const BODY_M: f64 = 0.3;
/// Farthest surface that is looked for around a point, m.
const REACH_M: f64 = 5.0;
/// Width and height of the images, px: what stands beside the vehicle's upper and lower ends must
/// be in view near by, too.
const IMAGE: [u32; 2] = [320, 192];
/// Pictures a second.
const RATE_HZ: f64 = 10.0;
