//! Masks as bits, and boxes of pixels: how a detection's pixels are kept, compared, scaled and
//! carried to the next frame.
//!
//! Memory: 8 bytes for each 64 columns a row of a box touches, out of one bounded buffer a frame.
//! Time: linear in the words of a mask. What can go wrong: a full buffer, which is a value
//! (`MaskStore::alloc`).

mod pixel_box;
mod scaled;
mod store;
#[cfg(test)]
mod tests;
mod two_frames;

pub(crate) use pixel_box::MAX_SIDE;
pub use pixel_box::PixelBox;
pub(crate) use scaled::ScaledMask;
pub(crate) use store::{MaskHandle, MaskStore};
pub(crate) use two_frames::TwoFrames;
