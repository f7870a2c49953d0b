//! Whole pairs through the matcher.

mod clips;

use super::*;
use crate::{Serial, memory::Carver};
use std::{boxed::Box, vec, vec::Vec};

/// An image as the tests hold it.
pub(super) struct Grey {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<u8>,
}

impl Grey {
    pub(super) fn view(&self) -> View<'_, u8> {
        View::new(&self.pixels, self.width, self.height).unwrap()
    }
}

/// A capacity for images of this size.
pub(super) fn capacity(image_width: usize, image_height: usize) -> Capacity {
    Capacity { image_width, image_height, ..Capacity::TINY }
}

/// Aligned zeroed bytes.
pub(super) fn slab(bytes: usize) -> Box<[u32]> {
    vec![0u32; bytes.div_ceil(4) + 16].into_boxed_slice()
}

/// Runs the matcher on one pair, in a slab of exactly its size.
pub(super) fn disparity<E: Executor>(config: &StereoConfig, left: &Grey, right: &Grey, executor: &E) -> (StereoReport, Vec<u16>) {
    let capacity = capacity(left.width, left.height);
    let mut memory = slab(StereoMatcher::bytes(&capacity));
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut memory);
    let skip = bytes.as_ptr().align_offset(crate::memory::SLAB_ALIGN);
    let mut carver = Carver::new(&mut bytes[skip..], StereoMatcher::bytes(&capacity)).unwrap();
    let mut matcher = StereoMatcher::carve(&capacity, &mut carver).unwrap();
    let report = matcher.compute(config, left.view(), right.view(), executor);
    (report, matcher.disparity_q8().rows().flatten().copied().collect())
}
