//! Whole pairs through the matcher: analytic scenes with closed answers, input that must not be
//! believed, and real clips.

mod budget;
mod clips;
mod confidence;
mod scenes;
mod second_rows;
mod trouble;

use super::*;
use crate::{
    Capacity, Executor, Serial,
    image::View,
    memory::{Carver, SLAB_ALIGN},
};
use std::{boxed::Box, vec, vec::Vec};

/// An image as the tests hold it.
pub(super) struct Grey {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<u8>,
}

impl Grey {
    /// An image of what is at each column and row.
    pub(super) fn of(width: usize, height: usize, at: impl Fn(f32, usize) -> f32) -> Self {
        Self {
            width,
            height,
            pixels: (0..width * height).map(|i| at((i % width) as f32, i / width) as u8).collect(),
        }
    }

    pub(super) fn view(&self) -> View<'_, u8> {
        View::new(&self.pixels, self.width, self.height).unwrap()
    }
}

/// A capacity for images of this size.
pub(super) fn capacity(image_width: usize, image_height: usize) -> Capacity {
    Capacity { image_width, image_height, ..Capacity::TINY }
}

/// Runs `work` on a matcher in a slab of exactly its size.
pub(super) fn with_matcher<R>(
    capacity: &Capacity,
    work: impl FnOnce(&mut StereoMatcher<'_>) -> R,
) -> R {
    let bytes = StereoMatcher::bytes(capacity);
    let mut memory: Box<[u8]> = vec![0xA5; bytes + SLAB_ALIGN].into_boxed_slice();
    let skip = memory.as_ptr().align_offset(SLAB_ALIGN);
    let mut carver = Carver::new(&mut memory[skip..skip + bytes], bytes).unwrap();
    let mut matcher = StereoMatcher::new_in(capacity, &mut carver);
    assert_eq!(carver.footprint().bytes(), bytes, "what was cut is what was promised");
    work(&mut matcher)
}

/// The report and the disparities of one pair, 1/256 px.
pub(super) fn disparity<E: Executor>(
    config: &StereoConfig,
    left: &Grey,
    right: &Grey,
    executor: &E,
) -> (StereoReport, Vec<u16>) {
    with_matcher(&capacity(left.width, left.height), |matcher| {
        let report = matcher.compute(config, left.view(), right.view(), executor);
        let view = matcher.disparity_q8();
        assert_eq!((view.width(), view.height()), (left.width, left.height));
        (report, view.rows().flatten().copied().collect())
    })
}

impl StereoMatcher<'_> {
    /// Flips a bit of a pixel's disparity.
    pub(crate) fn flip(&mut self, pixel: usize, bit: u32) {
        self.result_mut()[pixel] ^= 1 << bit;
    }
}
