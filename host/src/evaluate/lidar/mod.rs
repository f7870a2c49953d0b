//! Input and map against LiDAR, in disparity: what share of the points is shown at all, and what share of these is right.
//!
//! Follows Section IV of Bârsan et al. (ICRA 2018) and the published code:
//!
//! 1. A point is projected with the true left and right projections and rounded to a pixel ([`aim`]); its true disparity is the difference of the
//!    two columns. Points nearer or farther than what is fused, and points beside the left image, are left out and counted. Points whose two
//!    rows differ by more than [`EPIPOLAR_PX`] are counted and evaluated.
//! 2. The *input*'s disparity is the matcher's where its depth is one that is fused; the *map*'s is `baseline * focal / depth` of a raycast from the
//!    frame's estimated pose.
//! 3. Each point belongs to a [`Layer`] by what its pixel shows **in its own frame**: its masks and its tracks' states, also where the map
//!    is looked at many frames later ([`Delay`]).
//! 4. A [`Tally`] counts per frame and layer. A point that either source lacks is `missing` and judged for neither; `missing_alone` and
//!    `errors_alone` count each source by itself.
//! 5. `accuracy = correct / (total - missing)`, `completeness = 1 - missing_alone / total`, `f1 = 2 a c / (a + c)`, per frame; a run's figure is the
//!    mean over the frames that have it.
//!
//! The same is done with a renderer's exact depth in place of a scan: as many points as pixels, thinned to [`EXACT_POINTS`].
//!
//! Memory: 16 bytes a point for each frame that waits for its evaluation, 500 bytes a layer for each evaluated frame.

mod aim;
mod delay;
mod figures;
mod layer;
mod tally;
#[cfg(test)]
mod tests;

pub use aim::{Aim, EPIPOLAR_PX, EXACT_POINTS, Field, ScanCount, Target, aim, aim_at_exact};
pub use delay::{Awaited, Delay, Sample};
pub use figures::{EvaluatedFrame, LidarFigures, PairFigures, SourceFigures};
pub use layer::Layer;
pub use tally::{RULES, Rule, Tally};
