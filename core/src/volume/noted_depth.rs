//! Depths with a note at each pixel on how fusion is to take them.
//!
//! The note lies in the lowest bits of the depth: five of 24, 60 µm at 20 m.

use crate::image::View;
use bytemuck::{Pod, TransparentWrapper, Zeroable};

/// Levels of obliqueness.
pub(super) const LEVELS: u32 = 16;
/// Set where the colour may be another surface's.
const UNRELIABLE_COLOUR: u32 = LEVELS;
/// All bits of a depth that are notes.
const NOTES: u32 = (LEVELS - 1) | UNRELIABLE_COLOUR;

/// A depth in metres, 0 none, and how obliquely its surface is seen and whether its colour can be
/// believed. As large as a float.
///
/// ```
/// use dynvox_core::volume::NotedDepth;
///
/// let wall = NotedDepth::new(10.0, 15, false);
/// assert_eq!((wall.obliqueness(), wall.has_unreliable_colour()), (1.0, false));
/// let road = NotedDepth::new(10.0, 3, true);
/// assert_eq!((road.obliqueness(), road.has_unreliable_colour()), (0.25, true));
/// assert!((road.m() - 10.0).abs() < 1e-4);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Pod, Zeroable, TransparentWrapper)]
#[repr(transparent)]
pub struct NotedDepth(f32);

impl NotedDepth {
    /// No depth.
    pub const NONE: Self = Self(0.0);

    /// A depth, m, and its note: `level` is sixteenths of obliqueness less one, 0 to 15; higher
    /// bits are dropped.
    #[inline(always)]
    pub const fn new(depth_m: f32, level: u16, has_unreliable_colour: bool) -> Self {
        let colour = if has_unreliable_colour { UNRELIABLE_COLOUR } else { 0 };
        let level = level as u32 & (LEVELS - 1);
        Self(f32::from_bits(depth_m.to_bits() & !NOTES | level | colour))
    }

    /// The depth, m, 0 none: to 60 µm at 20 m, which is what the note takes.
    pub const fn m(self) -> f32 {
        self.0
    }

    /// Distance to the surface along its normal over distance along the camera's z axis, 1/16 to 1.
    #[inline(always)]
    pub fn obliqueness(self) -> f32 {
        ((self.0.to_bits() & (LEVELS - 1)) + 1) as i32 as f32 * (1.0 / LEVELS as f32)
    }

    /// Returns true if the colour may be that of a surface behind, or of the sky.
    #[inline(always)]
    pub const fn has_unreliable_colour(self) -> bool {
        self.0.to_bits() & UNRELIABLE_COLOUR != 0
    }
}

/// Depths of an observation, as large as its images and without padding between rows.
#[derive(Clone, Copy, Debug)]
pub enum DepthImage<'a> {
    /// Depths, m, 0 none, that face the camera and whose colours are their own.
    Plain(View<'a, f32>),
    /// Depths with notes, as the mapper makes them from disparity.
    Noted(View<'a, NotedDepth>),
}

impl<'a> DepthImage<'a> {
    /// The depths, m, 0 none. Those with notes are off by what the notes take.
    pub fn depth_m(self) -> View<'a, f32> {
        match self {
            Self::Plain(depth_m) => depth_m,
            Self::Noted(noted) => noted.peeled(),
        }
    }

    /// Returns true if depths have notes.
    pub(super) fn is_noted(self) -> bool {
        matches!(self, Self::Noted(_))
    }
}
