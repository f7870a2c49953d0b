//! Flights in a closed loop: a simulated vehicle goes through the synthetic street on what the
//! mapper tells of it, by the rule of an autopilot's collision prevention.

mod rule;
mod trial;
mod vehicle;

pub use rule::Limits;
pub use trial::{Conditions, Flight, FlightFrame, fly};
