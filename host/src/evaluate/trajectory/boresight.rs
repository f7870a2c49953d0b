//! The boresight angle: a constant rotation between the camera's axes and those the truth is given
//! in, as calibration leaves it. It grows with no path, and no images of one camera tell it: of a
//! translation error it is the part that is not drift.

use super::Segment;
use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Errors without a constant rotation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WithoutBoresight {
    /// The rotation, degrees. That about the direction of travel is not counted: a straight path
    /// does not tell it.
    pub angle_deg: f64,
    /// Mean translation error of the segments, percent of their length.
    pub t_err_percent: f64,
    /// Root mean square translation error from frame to frame, m.
    pub rpe_t_m: f64,
}

/// Steps of Gauss and Newton: angles are small.
const STEPS: usize = 3;

/// The rotation that takes the segments' estimated translations nearest to the true ones, all of
/// the same length. `None` where they have no direction.
pub(super) fn boresight(segments: &[Segment]) -> Option<Transform> {
    // The turn about the direction of travel cannot be told from translations: it stays zero.
    let travelled: Vector3<f64> = segments
        .iter()
        .map(|segment| Vector3::from(segment.actual.translation_m) / segment.length_m)
        .sum();
    let ahead = travelled.try_normalize(f64::EPSILON)?;
    let across = Matrix3::identity() - ahead * ahead.transpose();
    // Gauss-Newton on the rotation; the problem is nearly linear.
    (0..STEPS).try_fold(Transform::IDENTITY, |turn, _| {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for Segment { length_m, estimated, actual } in segments {
            let [e, a] = [turn.rotate(estimated.translation_m), actual.translation_m]
                .map(|moved| Vector3::from(moved) / *length_m);
            normal += Matrix3::from_diagonal_element(e.norm_squared()) - e * e.transpose();
            right += e.cross(&a);
        }
        // The direction of travel gets a unit entry, so that the matrix can be factored.
        let step = (across * normal * across + ahead * ahead.transpose())
            .cholesky()?
            .solve(&(across * right));
        Some(Transform::new(step, [0.0; 3]) * turn)
    })
}
