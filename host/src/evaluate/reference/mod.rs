//! Input and map against a reference depth (LiDAR, or a renderer's exact depth), in disparity: the
//! share of points that have an estimate, and the share of these that is right.
//!
//! Follows Section IV of Bârsan et al. (ICRA 2018) and the published code:
//!
//! 1. A point is projected with the true left and right projections and rounded to a pixel
//!    ([`project_scan`]); its true disparity is the difference of the two columns. Points nearer or
//!    farther than what is fused, and points outside the left image, are left out and counted.
//!    Points whose two rows differ by more than [`EPIPOLAR_PX`] are counted and evaluated.
//! 2. The *input*'s disparity is the matcher's where its depth is within the fused range; the
//!    *map*'s is `baseline * focal / depth` of a raycast from the frame's estimated pose.
//! 3. Each point belongs to a [`Region`] by what its pixel shows **in its own frame**: its masks
//!    and its tracks' states, also where the map is evaluated many frames later
//!    ([`PendingFrames`]).
//! 4. [`Counts`] are per frame and region. A point that either source lacks is `missing` and
//!    evaluated for neither; `missing_alone` and `errors_alone` count each source by itself.
//! 5. A disparity is right by the first of the [`ACCEPTANCE_RULES`]: off by at most 3 px or 5 %.
//!    `accuracy = correct / (total - missing)`, `completeness = 1 - missing_alone / total`,
//!    `f1 = 2 a c / (a + c)`, per frame; a run's figure is the mean over the frames that have it.
//!
//! Maps of several runs are compared on the points all of them show ([`on_common_points`]): a map
//! that drops what is hard is not more accurate for it.
//!
//! Exact depth is sampled at no more than [`EXACT_POINTS`] pixels, evenly.
//!
//! Memory: 16 bytes a point for each frame that waits for its evaluation, 500 bytes a region and
//! two bits a point for each evaluated frame.

mod counts;
mod depth_error;
mod figures;
mod outcomes;
mod pending;
mod projection;
mod region;
mod surface_errors;
#[cfg(test)]
mod tests;

pub use counts::{ACCEPTANCE_RULES, Counts, Rule};
pub use depth_error::{DepthErrorFigures, DepthErrors};
pub use figures::{EvaluatedFrame, PairFigures, ReferenceFigures, SourceFigures};
pub use outcomes::{PointOutcomes, on_common_points};
pub use pending::{PendingFrame, PendingFrames, Sample};
pub use projection::{
    EPIPOLAR_PX, EXACT_POINTS, Field, ProjectedPoint, ProjectedScan, ScanCount, project_scan,
    sample_exact_depth,
};
pub use region::Region;
pub use surface_errors::{SurfaceError, SurfaceErrors};
