//! A synthetic room, corridor and yard: seeded, at the scale of hands, with exact truth.
//!
//! A [`Room`] is rendered as the street is. Walls with and without texture, furniture, pictures
//! and a door surround a camera in a hand or on a drone, whose rig has a baseline of
//! centimetres; in a [`RoomKind::Yard`] there are houses, a hedge, a fence, trees and the sun.
//! People walk about, as capsules with swinging limbs: they are the objects of its truth.
//!
//! Frame `i` depends on the configuration and `i` alone. Memory: a few megabytes of meshes and one
//! frame's buffers. Time: as the street's, times five with an open shutter.
//!
//! Left out: shadows and reflections under lamps, cloth that moves, sliding or opening doors,
//! a rolling shutter.

mod config;
mod extent;
mod furniture;
mod inside;
mod path;
mod people;
mod settings;
mod sides;
#[cfg(test)]
mod tests;
mod world;
mod yard;

pub use config::{RoomConfig, RoomKind, RoomPath};
pub use world::Room;
