//! Certainty of poses along a path, and how honest it is where true poses are known.

use dynvox_core::egomotion::MotionCovariance;
use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::{PoseOrigin, Report};
use serde::{Deserialize, Serialize};
use std::array;

/// Names of the six directions: rotation about the camera's axes, then translation along them.
pub const DIRECTIONS: [&str; 6] = ["pitch", "yaw", "roll", "right", "down", "ahead"];
/// Standard deviation of an error that all motions of a path share, as a share of each motion's
/// own. Residuals do not show it, and along the path it adds up linearly.
const SHARED: f64 = 0.3;
/// Translation of one guessed frame, m, one sigma; it grows with the square of their number.
const GUESSED_M: f64 = 0.1;
/// Rotation of one guessed frame, rad, one sigma.
const GUESSED_RAD: f64 = 0.01;

/// Certainty of the camera's pose in its segment of the map, kept up from frame to frame.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PathCertainty {
    segment: MapSegment,
    /// The last frame whose pose is not a guess.
    reference: CertainPose,
    /// The frame that an anchored motion counts from: the one before the last estimate that is not
    /// anchored.
    anchor: CertainPose,
    /// Frames guessed since.
    guessed: u32,
}

impl Default for PathCertainty {
    /// A camera at the origin of the first segment.
    fn default() -> Self {
        Self {
            segment: MapSegment::FIRST,
            reference: CertainPose::known(Transform::IDENTITY),
            anchor: CertainPose::known(Transform::IDENTITY),
            guessed: 0,
        }
    }
}

impl PathCertainty {
    /// Begins with a frame whose pose counts as known.
    fn from_first(report: &Report) -> Self {
        let pose = CertainPose::known(report.t_world_camera);
        Self { segment: report.segment, reference: pose, anchor: pose, guessed: 0 }
    }

    /// Takes a frame, and returns the covariance of its pose against the segment's first frame, in
    /// the camera's axes.
    pub fn add(&mut self, report: &Report) -> MotionCovariance {
        let begins = report.segment != self.segment || report.pose == PoseOrigin::First;
        if begins || report.pose == PoseOrigin::Given {
            *self = Self::from_first(report);
            return MotionCovariance::ZERO;
        }
        let covariance = report.egomotion.and_then(|motion| motion.covariance);
        match covariance.filter(|_| report.pose == PoseOrigin::Estimated) {
            Some(covariance) => {
                // An anchored motion replaces those since its anchor; others begin where the last
                // one ended.
                if !report.egomotion.is_some_and(|motion| motion.anchored) {
                    self.anchor = self.reference;
                }
                self.reference = self.anchor.moved(report.t_world_camera, &covariance, SHARED);
                self.guessed = 0;
                self.reference.covariance()
            }
            None => {
                self.guessed += 1;
                let guessed =
                    |frames| self.reference.moved(report.t_world_camera, &guess(frames), 0.0);
                let pose = guessed(self.guessed).covariance();
                // Depth registration and the map's own word have no covariance, but hold the
                // camera: the next frame counts from there.
                if report.pose != PoseOrigin::Extrapolated {
                    (self.reference, self.guessed) = (guessed(1), 0);
                }
                pose
            }
        }
    }
}

/// Pose with the errors that it may have against the segment's first frame, in the camera's axes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct CertainPose {
    t_world_camera: Transform,
    /// Errors of single motions.
    own: MotionCovariance,
    /// Errors that all motions share: each column is the effect of one of six independent ones.
    shared: [[f64; 6]; 6],
}

impl CertainPose {
    /// Pose without an error.
    fn known(t_world_camera: Transform) -> Self {
        Self { t_world_camera, own: MotionCovariance::ZERO, shared: [[0.0; 6]; 6] }
    }

    /// Pose after a motion with this covariance. A share of the motion's deviations is common to
    /// all motions.
    fn moved(&self, t_world_camera: Transform, covariance: &MotionCovariance, share: f64) -> Self {
        let motion = (t_world_camera.inverse() * self.t_world_camera).normalized();
        let (change, root) = (motion.adjoint(), root(&covariance.matrix()));
        let shared = array::from_fn(|row| {
            array::from_fn(|column| {
                let carried: f64 = (0..6).map(|k| change[row][k] * self.shared[k][column]).sum();
                carried + share * root[row][column]
            })
        });
        Self { t_world_camera, own: covariance.after(&self.own, &motion), shared }
    }

    /// Covariance of both kinds of errors.
    fn covariance(&self) -> MotionCovariance {
        let mut sum = self.own.matrix();
        for (row, entries) in sum.iter_mut().enumerate() {
            for (column, entry) in entries.iter_mut().enumerate() {
                *entry += (0..6).map(|k| self.shared[row][k] * self.shared[column][k]).sum::<f64>();
            }
        }
        MotionCovariance::from_matrix(&sum)
    }
}

/// Lower triangle whose product with its own transpose is the matrix (Cholesky); a direction
/// without variance stays zero.
fn root(matrix: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    let mut root = [[0.0_f64; 6]; 6];
    for (row, entries) in matrix.iter().enumerate() {
        for (column, entry) in entries.iter().enumerate().take(row + 1) {
            let known: f64 = (0..column).map(|k| root[row][k] * root[column][k]).sum();
            let (rest, pivot) = (entry - known, root[column][column]);
            root[row][column] = match (row == column, pivot > 0.0) {
                (true, _) => rest.max(0.0).sqrt(),
                (false, true) => rest / pivot,
                (false, false) => 0.0,
            };
        }
    }
    root
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
    use dynvox_core::egomotion::MotionEstimate;

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

    /// Certainty after so many frames of a straight way, each a metre long and known within a
    /// centimetre ahead.
    fn straight(frames: u32) -> MotionCovariance {
        let mut matrix = [[0.0; 6]; 6];
        matrix[5][5] = 1e-4;
        let mut motion = MotionEstimate::default();
        motion.covariance = Some(MotionCovariance::from_matrix(&matrix));
        let mut certainty = PathCertainty::default();
        let mut last = MotionCovariance::ZERO;
        for frame in 0..=frames {
            let mut report = Report::default();
            report.t_world_camera = Transform::from_translation([0.0, 0.0, f64::from(frame)]);
            report.pose = if frame == 0 { PoseOrigin::First } else { PoseOrigin::Estimated };
            report.egomotion = Some(motion);
            last = certainty.add(&report);
        }
        last
    }

    #[test]
    fn what_all_motions_share_adds_up_linearly() {
        let [one, many] = [1, 400].map(|frames| straight(frames).translation_sigma_m()[2]);
        // Independent errors of 400 motions are 20 times that of one, shared ones 400 times.
        let expected = 0.01 * (400.0 + (400.0 * SHARED).powi(2)).sqrt();
        assert!((many - expected).abs() < 1e-9, "{many} m instead of {expected}");
        assert!((one - 0.01 * (1.0 + SHARED * SHARED).sqrt()).abs() < 1e-9, "{one}");
        assert!(many > 80.0 * one);
    }

    #[test]
    fn a_root_times_itself_is_the_matrix() {
        let lower: [[f64; 6]; 6] = array::from_fn(|row| {
            array::from_fn(|column| match column.cmp(&row) {
                std::cmp::Ordering::Less => 0.1 * (row as f64 - 2.0 * column as f64),
                std::cmp::Ordering::Equal => 1.0 + row as f64,
                std::cmp::Ordering::Greater => 0.0,
            })
        });
        let squared = array::from_fn(|row| {
            array::from_fn(|column| (0..6).map(|k| lower[row][k] * lower[column][k]).sum())
        });
        let found = root(&squared);
        let off = (0..36).map(|at| (found[at / 6][at % 6] - lower[at / 6][at % 6]).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9, "{found:?}");
        assert_eq!(root(&[[0.0; 6]; 6]), [[0.0; 6]; 6], "a pose that is known");
    }

    #[test]
    fn guesses_grow_with_the_square_of_their_number() {
        let sigma = |frames| guess(frames).translation_sigma_m();
        assert!((sigma(1)[0] - GUESSED_M).abs() < 1e-12);
        assert!((sigma(5)[2] - 25.0 * GUESSED_M).abs() < 1e-12);
    }
}
