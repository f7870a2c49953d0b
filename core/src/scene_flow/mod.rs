//! Sparse scene flow: features of a stereo camera matched over two frames and two cameras (Geiger,
//! Ziegler, Stiller: *StereoScan: Dense 3d Reconstruction in Real-time*, IV 2011, section III-A).
//!
//! Data flows through the files in this order: `filter` (blob, corner, Sobel) -> `suppression`
//! (peaks, four classes) -> `strongest` -> `features` (descriptors, sorted for search) -> `circle`
//! (left-previous, right-previous, right-current, left-current and back), once with the sparse
//! features over the whole search radius, once with all of them where `prior` says the sparse ones
//! went -> `support` (outliers) -> `refine` (below the pixel) -> `bucket` (a selection for
//! egomotion). `camera` keeps two frames of each camera, swapped by index.
//!
//! **Memory.** 16.5 bytes per pixel (per camera two images, one gradient, two filter responses and
//! a quarter byte of search tables), 216 bytes per feature (per camera two frames of 1.25 x 36
//! bytes and a candidate of 12; its partners 12) and 69 bytes per match.
//!
//! **Time.** Linear in pixels and in features times the features in their windows.
//!
//! **What can go wrong.** Features and matches beyond the capacity are dropped and counted: the
//! weakest features, matches in scan order. A first frame, or one of another size than the last,
//! has no matches and says so. Images without texture have none either; the motion estimate then
//! says so.
//!
//! ```
//! use dynvox_core::{Capacity, Serial, image::View, memory::Carver, scene_flow::{FlowMatcher, FlowStatus, SceneFlowConfig}};
//!
//! let capacity = Capacity { image_width: 64, image_height: 48, features: 100, matches: 50, ..Capacity::TINY };
//! let mut slab = vec![0; FlowMatcher::bytes(&capacity) + 64];
//! let lead = slab.as_ptr().align_offset(64);
//! let mut carver = Carver::new(&mut slab[lead..], FlowMatcher::bytes(&capacity)).unwrap();
//! let mut matcher = FlowMatcher::new_in(&capacity, &mut carver);
//! let grey = [128; 64 * 48];
//! let image = View::new(&grey, 64, 48).unwrap();
//! let report = matcher.push(&SceneFlowConfig::default(), image, image, &Serial);
//! assert_eq!(report.status, FlowStatus::First);
//! ```

mod bucket;
mod camera;
mod cells;
mod circle;
mod config;
mod exposure;
mod features;
mod filter;
mod matcher;
mod matches;
mod prior;
mod refine;
mod report;
mod strongest;
mod support;
mod suppression;
mod turned;

use crate::parallel::BANDS;
pub use camera::FeatureCount;
pub(crate) use camera::most_features;
use circle::Reach;
pub(crate) use config::MAX_FEATURES;
pub use config::SceneFlowConfig;
pub(crate) use matcher::AnchorPoint;
pub use matcher::FlowMatcher;
pub use matches::Match;
pub(crate) use matches::{NEAR_BASELINES, STILL_PX};
pub use report::{FlowReport, FlowStatus, PassCount};

/// The most descriptors that a frame compares, over both passes.
pub(crate) fn most_compared(capacity: &crate::Capacity, config: &SceneFlowConfig) -> u64 {
    let [dense, sparse] = most_features(capacity);
    let most = |features| Reach::most_compared(config, features) as u64;
    // The sparse pass looks everywhere; the dense one does so for a sample of its features, and for
    // the rest as far as an average allows.
    let sampled = dense.div_ceil(circle::SAMPLED) + 3 * BANDS;
    let thinned = sampled as u64 * most(dense) + 2 * dense as u64 * circle::COMPARED_MAX;
    let whole = dense as u64 * most(dense);
    sparse as u64 * most(sparse) + if thinned < whole { thinned } else { whole }
}

#[cfg(test)]
pub(crate) mod test_scene;
#[cfg(test)]
pub(crate) mod tests;
