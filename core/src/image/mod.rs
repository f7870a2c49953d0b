//! Borrowed images: pixels stay where the caller or the slab keeps them.

mod coverage;
mod view;

pub(crate) use coverage::{InvalidPair, InvalidPixels};
pub use view::{View, ViewMut};

/// One pixel of disparity in the core's unit: 1/256 px in `u16`, as in KITTI's 16-bit PNGs. 0 means
/// none.
pub const DISPARITY_ONE_PX: u16 = 256;
/// Set in disparities of the core's own matcher that were filled in between measured ones, and in
/// none that were measured. Disparities from elsewhere carry no such mark.
pub const DISPARITY_FILLED: u16 = 1;
