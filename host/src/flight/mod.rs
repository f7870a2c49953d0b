//! Flights in a closed loop: a simulated vehicle goes through the synthetic street on what the
//! mapper tells of it, by the rule of an autopilot's collision prevention.

mod rule;
mod trial;
mod truth;
mod vehicle;

pub use rule::Limits;
pub use trial::{Conditions, Flight, FlightFrame, fly};

/// Radius of the vehicle, m.
const BODY_M: f64 = 0.3;
/// Farthest surface that is looked for around a point, m.
const REACH_M: f64 = 5.0;
