//! Blocks on disk: where the map goes when it leaves memory, and where it comes back from.

mod file;
pub mod mesh;
mod places;
mod record;
#[cfg(test)]
mod tests;

pub use file::{BlockFile, Opened, Position, StoreError};
pub use places::Tile;
