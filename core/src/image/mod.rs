//! Borrowed images: pixels stay where the caller or the slab keeps them.

mod view;

pub use view::{View, ViewMut};

/// One pixel of disparity in the core's unit: 1/256 px in `u16`, as in KITTI's 16-bit PNGs. 0 means none.
pub const DISPARITY_ONE_PX: u16 = 256;

/// One stereo frame as the core takes it: rectified, equal sizes, 8 bit.
#[derive(Clone, Copy, Debug)]
pub struct StereoFrame<'a> {
    /// Left grey image.
    pub left: View<'a, u8>,
    /// Right grey image.
    pub right: View<'a, u8>,
    /// Left image in colour, for fusion; grey is fused where it is absent.
    pub colour: Option<View<'a, [u8; 3]>>,
    /// Semantic class of each left pixel, an index into `VolumeConfig::class_weight`; all weights are 1 where it is absent.
    pub class: Option<View<'a, u8>>,
}
