//! A synthetic town: blocks of houses in a grid of streets, and a recording that closes a loop.
//!
//! A [`Town`] is built of the street's houses, furniture and cars, and rendered as the street is.
//! The camera of [`StreetConfig`](super::StreetConfig) drives round `blocks` by `blocks` of them,
//! lap after lap, so that it comes back to where it was with exact truth about how far it is
//! off. Another recording has other parked cars and other traffic in front of the same houses.
//!
//! Traps: [`TownTwins`] makes houses alike, in a whole row or in the street opposite.
//!
//! Frame `i` depends on the configuration and `i` alone. Memory: some 3 MiB for each of at most
//! 48 blocks near the camera, and one frame's buffers. Time: as the street's.
//!
//! Left out: crossing traffic, pedestrians, hills; streets end behind the next block.

mod block;
mod config;
mod route;
mod settings;
#[cfg(test)]
mod tests;
mod world;

pub use config::{TownConfig, TownTwins};
pub use world::Town;
