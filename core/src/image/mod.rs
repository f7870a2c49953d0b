//! Borrowed images: pixels stay where the caller or the slab keeps them.

mod coverage;
mod disparity;
mod layout;
mod view;

pub(crate) use coverage::{InvalidPair, InvalidPixels, MaskedPair};
pub(crate) use disparity::disparity_px;
pub use disparity::{DISPARITY_ONE_PX, DisparityQ8};
pub use layout::SampleLayout;
pub use view::{View, ViewMut};
