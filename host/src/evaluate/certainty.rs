//! Certainty of poses along a path, and how honest it is where true poses are known.

use dynvox_core::egomotion::MotionCovariance;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::{PoseOrigin, Report};
use serde::{Deserialize, Serialize};

/// Names of the six directions: rotation about the camera's axes, then translation along them.
pub const DIRECTIONS: [&str; 6] = ["pitch", "yaw", "roll", "right", "down", "ahead"];
/// Translation of one guessed frame, m, one sigma; it grows with the square of their number.
const GUESSED_M: f64 = 0.1;
/// Rotation of one guessed frame, rad, one sigma.
const GUESSED_RAD: f64 = 0.01;

/// Certainty of the camera's pose in its segment of the map, kept up from frame to frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PathCertainty {
    segment: MapSegment,
    /// Covariance and pose of the last frame whose pose is not a guess.
    reference: MotionCovariance,
    t_world_reference: Transform,
    /// Covariance and pose of the frame that an anchored motion counts from: the one before the
    /// last estimate that is not anchored.
    anchor: MotionCovariance,
    t_world_anchor: Transform,
    /// Frames guessed since.
    guessed: u32,
}

impl Default for PathCertainty {
    /// A camera at the origin of the first segment.
    fn default() -> Self {
        Self {
            segment: MapSegment::FIRST,
            reference: MotionCovariance::ZERO,
            t_world_reference: Transform::IDENTITY,
            anchor: MotionCovariance::ZERO,
            t_world_anchor: Transform::IDENTITY,
            guessed: 0,
        }
    }
}

impl PathCertainty {
    /// Begins with a frame whose pose counts as known.
    fn from_first(report: &Report) -> Self {
        let pose = report.t_world_camera;
        Self {
            segment: report.segment,
            t_world_reference: pose,
            t_world_anchor: pose,
            ..Self::default()
        }
    }

    /// Takes a frame, and returns the covariance of its pose against the segment's first frame, in
    /// the camera's axes.
    pub fn add(&mut self, report: &Report) -> MotionCovariance {
        let begins = report.segment != self.segment || report.pose == PoseOrigin::First;
        if begins || report.pose == PoseOrigin::Given {
            *self = Self::from_first(report);
            return self.reference;
        }
        let motion = (report.t_world_camera.inverse() * self.t_world_reference).normalized();
        let covariance = report.egomotion.and_then(|motion| motion.covariance);
        match covariance.filter(|_| report.pose == PoseOrigin::Estimated) {
            Some(covariance) => {
                // An anchored motion replaces those since its anchor; others begin where the last
                // one ended.
                if !report.egomotion.is_some_and(|motion| motion.anchored) {
                    (self.anchor, self.t_world_anchor) = (self.reference, self.t_world_reference);
                }
                let motion = (report.t_world_camera.inverse() * self.t_world_anchor).normalized();
                self.reference = covariance.after(&self.anchor, &motion);
                (self.t_world_reference, self.guessed) = (report.t_world_camera, 0);
                self.reference
            }
            None => {
                self.guessed += 1;
                let pose = guess(self.guessed).after(&self.reference, &motion);
                // Depth registration and the map's own word have no covariance, but hold the
                // camera: the next frame counts from there.
                if report.pose != PoseOrigin::Extrapolated {
                    self.reference = guess(1).after(&self.reference, &motion);
                    (self.t_world_reference, self.guessed) = (report.t_world_camera, 0);
                }
                pose
            }
        }
    }
}

/// Covariance of a motion that was guessed over some frames.
fn guess(frames: u32) -> MotionCovariance {
    let frames = f64::from(frames);
    let mut matrix = [[0.0; 6]; 6];
    for axis in 0..3 {
        matrix[axis][axis] = (GUESSED_RAD * frames).powi(2);
        matrix[axis + 3][axis + 3] = (GUESSED_M * frames * frames).powi(2);
    }
    MotionCovariance::from_matrix(&matrix)
}

/// Errors against sigmas, of six directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Honesty {
    /// Errors compared.
    pub count: u32,
    /// Errors within two sigma, by direction.
    pub within: [u32; 6],
    /// Sum of squared errors, rad² and m², by direction.
    pub squared: [f64; 6],
    /// Sum of variances, by direction.
    pub variance: [f64; 6],
}

impl Honesty {
    /// Compares a motion with the true one.
    pub fn add(&mut self, found: &Transform, truth: &Transform, covariance: &MotionCovariance) {
        let error = *found * truth.inverse();
        // The sign of a quaternion says nothing.
        let sign = if error.rotation[3] < 0.0 { -2.0 } else { 2.0 };
        let [a, b, c, _] = error.rotation.map(|part| sign * part);
        let [x, y, z] = error.translation_m;
        self.count += 1;
        let ([d, e, f], [g, h, i]) =
            (covariance.rotation_sigma_rad(), covariance.translation_sigma_m());
        for ((direction, error), sigma) in
            [a, b, c, x, y, z].into_iter().enumerate().zip([d, e, f, g, h, i])
        {
            self.within[direction] += u32::from(error.abs() <= 2.0 * sigma);
            self.squared[direction] += error * error;
            self.variance[direction] += sigma * sigma;
        }
    }

    /// Share of the errors within two sigma, by direction.
    pub fn shares(&self) -> [f64; 6] {
        self.within.map(|within| f64::from(within) / f64::from(self.count.max(1)))
    }

    /// Root mean square of the distances by which positions were off, and of their sigmas, m.
    pub fn distances_m(&self) -> [f64; 2] {
        self.sizes().map(|[.., x, y, z]| (x * x + y * y + z * z).sqrt())
    }

    /// Root mean square of the errors, and of the sigmas, by direction.
    pub fn sizes(&self) -> [[f64; 6]; 2] {
        let count = f64::from(self.count.max(1));
        [self.squared, self.variance].map(|sums| sums.map(|sum| (sum / count).sqrt()))
    }
}

/// Honesty of single motions and of poses along a path.
#[derive(Clone, Debug, Default)]
pub struct PathHonesty {
    /// Motions from one frame to the next, or since the anchor.
    pub motions: Honesty,
    /// Poses against the first frame of their segment.
    pub poses: Honesty,
    certainty: PathCertainty,
    /// Estimated and true pose of the segment's first frame, and of the last frame.
    first: Option<[Transform; 2]>,
    last: Option<[Transform; 2]>,
    /// Estimated and true pose of the frame that an anchored motion counts from.
    anchor: Option<[Transform; 2]>,
    segment: MapSegment,
}

impl PathHonesty {
    /// Takes a frame with its true pose.
    pub fn add(&mut self, report: &Report, truth: &Transform) {
        let now = [report.t_world_camera, *truth];
        let begins = self.first.is_none() || report.segment != self.segment;
        let covariance = if self.first.is_none() {
            self.certainty = PathCertainty::from_first(report);
            MotionCovariance::ZERO
        } else {
            self.certainty.add(report)
        };
        if begins {
            (self.first, self.segment, self.anchor) = (Some(now), report.segment, None);
        } else if report.pose == PoseOrigin::Estimated {
            let since = |then: [Transform; 2]| [0, 1].map(|k| now[k].inverse() * then[k]);
            if let Some([found, truth]) = self.first.map(since) {
                self.poses.add(&found, &truth, &covariance);
            }
            if !report.egomotion.is_some_and(|motion| motion.anchored) {
                self.anchor = self.last;
            }
            let motion = report.egomotion.and_then(|motion| motion.covariance);
            if let (Some([found, truth]), Some(covariance)) = (self.anchor.map(since), motion) {
                self.motions.add(&found, &truth, &covariance);
            }
        }
        // After a guess the motion is one from the frame before it.
        self.last = (report.pose != PoseOrigin::Extrapolated).then_some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_count_against_the_sigma_of_their_direction() {
        let mut matrix = [[0.0; 6]; 6];
        (matrix[3][3], matrix[5][5]) = (0.01, 0.04);
        let covariance = MotionCovariance::from_matrix(&matrix);
        let mut honesty = Honesty::default();
        let at = |x, z| Transform::from_translation([x, 0.0, z]);
        honesty.add(&at(0.19, 0.0), &Transform::IDENTITY, &covariance);
        honesty.add(&at(0.21, 0.39), &Transform::IDENTITY, &covariance);
        assert_eq!(honesty.within, [2, 2, 2, 1, 2, 2]);
        let [errors, sigmas] = honesty.sizes();
        assert!((sigmas[3] - 0.1).abs() < 1e-12 && (errors[3] - 0.2).abs() < 0.001, "{errors:?}");
    }

    #[test]
    fn guesses_grow_with_the_square_of_their_number() {
        let sigma = |frames| guess(frames).translation_sigma_m();
        assert!((sigma(1)[0] - GUESSED_M).abs() < 1e-12);
        assert!((sigma(5)[2] - 25.0 * GUESSED_M).abs() < 1e-12);
    }
}
