//! Heading of a path by its fixes against the heading by measured angles.
//!
//! Positions of a nearly straight path do not tell how far the camera leans, so they cannot be
//! compared with angles about all axes. About the vertical they can: a path has a heading.

use super::{PointPair, centres, information_of};
use nalgebra::{Matrix3, Vector3};

/// Turn about the vertical between angles and path.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeadingError {
    /// By how much the path lies clockwise of where the angles have it, seen from above, rad.
    pub off_rad: f64,
    /// One standard deviation, rad.
    pub sigma_rad: f64,
}

impl HeadingError {
    /// Compares fixes with the path turned by `axes`, the rotation from the map to the world that the
    /// angles give. The world is x east, y down, z north.
    pub fn new(points: &[PointPair], weights: &[f64], sigma_m: f64, axes: &Matrix3<f64>) -> Self {
        let (from_centre, to_centre) = centres(points, weights);
        let (mut across, mut along, mut arm) = (0.0, 0.0, 0.0);
        for ((from, to), weight) in points.iter().zip(weights) {
            let (turned, at): (Vector3<f64>, Vector3<f64>) =
                (axes * (from - from_centre), to - to_centre);
            across += weight * (turned.z * at.x - turned.x * at.z);
            along += weight * (turned.x * at.x + turned.z * at.z);
            arm += weight * (turned.x * turned.x + turned.z * turned.z);
        }
        Self {
            off_rad: across.atan2(along),
            sigma_rad: (information_of(sigma_m) / arm).sqrt().min(std::f64::consts::PI),
        }
    }
}
