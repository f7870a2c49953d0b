//! Blocks on disk: where the map goes when it leaves memory, and where it comes back from.

mod behind;
mod block_index;
mod file;
pub mod mesh;
mod pool;
mod record;
mod segment;
#[cfg(test)]
mod tests;

pub use behind::BehindFile;
pub use block_index::Tile;
pub use file::{BlockFile, Opened, Position, StoreError};
pub use pool::PoolAndFile;
pub use segment::OneSegment;
