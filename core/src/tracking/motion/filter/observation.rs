//! Observation of one point.

use nalgebra::Point3;

/// A point of an object: where it would be in the current camera if the object were static, and
/// where it is observed, px from the principal point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    pub static_prediction: Point3<f64>,
    pub left: [f64; 2],
    pub right: [f64; 2],
}
