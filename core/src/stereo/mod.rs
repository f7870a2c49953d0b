//! Disparity from a rectified stereo pair: ELAS (Geiger, Roser, Urtasun, *Efficient Large-Scale
//! Stereo Matching*, ACCV 2010).
//!
//! Points that are easy to match are found first and triangulated; their planes say where to look
//! for the rest. In the paper's order: gradients ([`StereoStep::Gradients`]); support points over
//! the full disparity range, with texture, ratio and left-right tests (3.1); the implausible and
//! the redundant among them removed; their Delaunay triangulations in both images, and the grid
//! prior (3.2); the disparity of least energy for each pixel of both images (3.3), and the check
//! that both agree. Small segments are then removed, gaps filled, and the result is smoothed
//! without blurring edges. Parameters: [`StereoConfig`].
//!
//! Own choices, where the paper leaves one: which 16 gradient samples make a descriptor
//! (`descriptor.rs`); support points are filtered implausible all at once; disparities are refined
//! to fractions of a pixel ([`StereoConfig::subpixel`], measured there); the mean is centred;
//! images of many rows are matched on every second one ([`StereoConfig::second_rows_from`]);
//! surfaces are continued up to the image's rim ([`StereoConfig::rim_reach`]). Pixels outside the
//! hull of the support points get no disparity. Each disparity can have a confidence
//! ([`StereoMatcher::confidence`]).
//!
//! **Memory.** 8 bytes a pixel: the four gradients (1 each; the runs of the speckle filter lie in
//! the same place later, and the confidences in the end), the left disparities (2) and the right
//! ones (2). Descriptors, 16 bytes each, are kept for 16 rows only, disparities of the right image
//! only to be compared with. With P = width x height / 25 candidates for support points, 4 P + 2 x
//! 66 P bytes for them and their triangulations, and 2 x 32 bytes per 10 x 10 px for the grid
//! prior; in all about 14 bytes a pixel and 260 a column (14.8 at KITTI size).
//! [`StereoMatcher::bytes`] is exact. No array on the stack exceeds 600 bytes.
//!
//! **Bounds.** Support points: one per candidate, at least 5 px apart ([`CANDIDATE_STEP`]), so
//! they always fit, as do their triangles, at most two a point. Two that meet at one pixel of the
//! right image become one, counted. Larger images than the capacity's are refused.
//!
//! **Time.** Pixels x (5 + disparities in the grid cell, typically 15) descriptor distances for
//! each image, and candidates x disparities x 4 for the support points. At KITTI size on one thread
//! about 0.6 times OpenCV's StereoSGBM in its fast mode
//! (`cargo bench -p dynvox-core --bench stereo`). With two threads the image is worked on in four
//! bands of rows; the bands are the same with one.
//!
//! **What can go wrong.** A pair without texture has no support points:
//! [`StereoStatus::TooFewSupportPoints`]. Sky between trees is given the trees' disparity;
//! textureless surfaces larger than a grid cell stay empty; repetitive fences may match one picket
//! off. Pairs that fit nothing are refused, see [`StereoStatus`]; nothing here panics.
//!
//! ```
//! use dynvox_core::{Capacity, Serial, image::View, memory::{Carver, Slab}, stereo::{StereoConfig, StereoMatcher, StereoStatus}};
//!
//! const CAPACITY: Capacity = Capacity { image_width: 64, image_height: 48, ..Capacity::TINY };
//! static SLAB: std::sync::Mutex<Slab<{ StereoMatcher::bytes(&CAPACITY) }>> = std::sync::Mutex::new(Slab::ZERO);
//!
//! let mut slab = SLAB.lock().unwrap();
//! let mut carver = Carver::new(&mut slab.0, StereoMatcher::bytes(&CAPACITY)).unwrap();
//! let mut matcher = StereoMatcher::new_in(&CAPACITY, &mut carver);
//!
//! // A noisy wall, 6 px apart in the two images.
//! let grey = |u: usize, v: usize| ((u * 7919 + v * 104_729) * (u + 31 * v) % 251) as u8;
//! let image = |shift: usize| -> Vec<u8> { (0..64 * 48).map(|i| grey(i % 64 + shift, i / 64)).collect() };
//! let (left, right) = (image(0), image(6));
//! let (left, right) = (View::new(&left, 64, 48).unwrap(), View::new(&right, 64, 48).unwrap());
//!
//! let report = matcher.compute(&StereoConfig::default(), left, right, &Serial);
//! assert_eq!(report.status, StereoStatus::Matched);
//! assert_eq!(matcher.disparity_q8().get(40, 20), Some(6 * 256));
//! ```

mod confidence;
mod config;
mod delaunay;
mod dense;
mod descriptor;
mod filter_support;
mod gaps;
mod gradient;
mod invalid;
mod matcher;
mod median;
mod prior;
mod report;
mod rims;
mod rows;
mod smooth;
mod speckle;
mod spread;
mod support;
#[cfg(test)]
mod tests;

pub use config::{
    CANDIDATE_STEP, DISPARITY_LIMIT, GapEnds, MAX_PLANE_RADIUS, MIN_GRID_SIZE, StereoConfig,
};
pub use matcher::StereoMatcher;
pub(crate) use matcher::{StereoBudget, max_points};
pub use report::{StereoReport, StereoStatus, StereoStep};
pub(crate) use rows::most_pixels;

/// Least width and height of an image, px.
pub const MIN_IMAGE_SIZE: usize = 16;
/// Greatest width and height of an image, px, for every capacity: the triangulation is exact up to
/// here.
pub const MAX_IMAGE_SIZE: usize = 8_192;
