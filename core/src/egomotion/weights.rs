//! Weights of matches in a motion's refinement.

use super::{EgomotionConfig, points::Point};
use crate::geometry::StereoRig;

/// Weight by distance from the middle column ([`EgomotionConfig::side_knee`]).
pub(super) fn side_weight(config: &EgomotionConfig, rig: &StereoRig, point: &Point) -> f64 {
    let knee_px = config.side_knee * libm::fabs(rig.center_u_px);
    if knee_px <= 0.0 {
        // A principal point in the first column has no middle to be far from.
        return 1.0;
    }
    let share = point.left[0] / knee_px;
    let square = share * share;
    let fourth = square * square;
    1.0 / (1.0 + fourth * fourth)
}

/// Weight by the squared error of a match, px² (Geman and McClure's,
/// [`EgomotionConfig::robust_px`]).
pub(super) fn robust_weight(config: &EgomotionConfig, squared_px: f64) -> f64 {
    let share = robust_share(config, squared_px);
    share * share
}

/// Growth of a match's pull with its error, on average over the error's four coordinates: the pull
/// of an error beyond `robust_px` falls while the error grows, so that a match that is far off
/// holds the motion less than its weight says.
pub(super) fn robust_growth(config: &EgomotionConfig, squared_px: f64) -> f64 {
    let share = robust_share(config, squared_px);
    share * share * share
}

fn robust_share(config: &EgomotionConfig, squared_px: f64) -> f64 {
    1.0 / (1.0 + squared_px / (config.robust_px * config.robust_px))
}
