//! The slab and its regions.
//!
//! A caller owns all memory: one byte slab, divided once into named, typed regions ([`Carver`]),
//! counted to the byte ([`Footprint`]) and sized by one table of bounds ([`Capacity`]). Nothing
//! here grows; full is a value.

mod capacity;
mod footprint;
mod in_place;
#[cfg(feature = "hashbrown")]
mod one_shot;
mod placement;
mod slab;

pub use capacity::Capacity;
pub use footprint::{Footprint, Region};
#[cfg(feature = "hashbrown")]
pub(crate) use one_shot::OneShot;
pub use placement::Placement;
pub use slab::{Carver, SLAB_ALIGN, Slab, SlabError, Slabs, TwoSlabs, region_bytes};
