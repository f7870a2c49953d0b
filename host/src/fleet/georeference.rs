//! Pose of a recording in the world, from fixes of a receiver of satellites along its path: a rigid
//! motion by least squares.
//!
//! Umeyama's closed form without scale (*Least-squares estimation of transformation parameters
//! between two point patterns*, PAMI 1991), repeated with Cauchy's weights, whose scale is that of
//! the median residual, so that fixes reflected by houses do not count. Where roll, pitch and yaw
//! come with the fixes, their mean rotation is one more observation in the same form: a straight
//! path says nothing about the turn about itself.
//!
//! The world is the plane through the origin of the fixes: x east, y down, z north.

mod heading;
mod timed;

use super::FleetError;
use super::manifest::{Given, Job, transform};
use super::register::Uncertainty;
use super::submap::Submap;
use crate::formats::{Fix, Fixes, LocalPlane, read_gnss};
use dynvox_core::geometry::Transform;
use heading::HeadingError;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::path::Path;

/// Weight of a fix whose receiver is surer of it than of most, at most.
const WEIGHT_MAX: f64 = 100.0;
/// Frames with a fix.
const FIXES_MIN: usize = 10;
/// Largest standard deviation of the turn about any axis, rad: a registration does not find more.
const TURN_MAX_RAD: f64 = 0.052;
/// Standard deviation of the angles between the inertial system's axes and the camera's, including
/// measurement noise, rad.
const ANGLES_SIGMA_RAD: f64 = 0.0175;
/// Angles may contradict positions by no more, rad.
const CONTRADICTION_MAX_RAD: f64 = 0.175;
/// Standard deviations up to which a difference of headings is explained.
const DOUBT: f64 = 3.0;
/// A path that fits its fixes at a scale off by more has other fixes; stereo errs less.
const SCALE_ERROR_MAX: f64 = 0.08;
/// Fixes in a row err alike: so many count as one.
const CORRELATED_FIXES: f64 = 10.0;
/// Largest standard deviation of a fix from the path, m.
const SIGMA_MAX_M: f64 = 10.0;
/// Residuals are never believed to be smaller, m.
const SIGMA_MIN_M: f64 = 0.01;
/// The median length of a vector of three normally distributed numbers.
const MEDIAN_LENGTH: f64 = 1.538;
/// Cauchy's limit, in standard deviations.
const LIMIT: f64 = 2.385;
const MAX_ROUNDS: usize = 50;
/// A round that changes no number of the motion by more ends them, m and rad.
const STEP_MIN: f64 = 1e-9;

/// Given pose of a recording's map, with its uncertainty where that is known.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// The map in the world.
    pub t_world_map: Transform,
    /// One standard deviation, where the fixes tell it.
    pub uncertainty: Option<Uncertainty>,
    /// Way from where the pose was given to the beginning of the map, m: not 0 for later parts of a
    /// recording.
    pub way_m: f64,
}

/// The antenna in the map and in the world, m.
type PointPair = (Vector3<f64>, Vector3<f64>);

/// A frame with a fix.
#[derive(Clone, Copy, Debug)]
struct Observation {
    /// Pose of the camera in the map.
    t_map_camera: Transform,
    /// The antenna in the world, m.
    at_m: Vector3<f64>,
    /// Axes of the camera in the world, if angles were measured.
    axes: Option<Matrix3<f64>>,
    /// Standard deviation that the receiver tells, of the three axes' mean, m.
    sigma_m: Option<f64>,
}

/// Angles of an inertial system, as a rotation from the map to the world.
#[derive(Clone, Copy, Debug)]
struct GivenAxes {
    rotation: Matrix3<f64>,
    /// Standard deviation about any axis, rad.
    sigma_rad: f64,
}

/// Returns the given pose of a job's map. A job with fixes needs its map.
///
/// # Errors
/// The map or the fixes cannot be read, or the fixes do not say where the map lies.
pub fn prior(job: &Job, folder: &Path) -> Result<Prior, FleetError> {
    let (gnss, antenna_m, origin) = match &job.given {
        Given::TWorldCamera(rows) => {
            let t_world_map = transform(rows).ok_or_else(|| {
                FleetError::content(folder, format!("has no rigid motion for {}", job.name))
            })?;
            return Ok(Prior { t_world_map, uncertainty: None, way_m: 0.0 });
        }
        Given::Gnss { file, antenna_m, origin, .. } => (file, antenna_m, origin),
        Given::Follows(_) => {
            return Err(FleetError::content(
                folder,
                format!("has no pose of its own for {}, a part of a recording", job.name),
            ));
        }
        Given::Figures(_) => {
            return Err(FleetError::content(
                folder,
                "has the jobs of a sweep, which keep no maps. Draw them with `dynvox sweep \
                 --merge`",
            ));
        }
    };
    let fixes = read_gnss(gnss)?;
    let cameras = Submap::cameras(&job.submap(folder))?;
    let plane = LocalPlane::at(*origin);
    let seen = match fixes {
        Fixes::ByTime(fixes) => timed::observations(&cameras, &fixes, &plane),
        // Frames without a fix are left out.
        Fixes::ByFrame(fixes) => {
            let seen = cameras.iter().filter_map(|camera| {
                let fix = fixes.get(camera.frame).copied().flatten()?;
                Some(Observation::of(&camera.t_map_camera, &fix, &plane))
            });
            Ok(seen.collect())
        }
    };
    let found = seen.and_then(|seen| georeference(&seen, *antenna_m));
    found.map_err(|reason| {
        FleetError::content(gnss, format!("does not say where {} lies: {reason}", job.name))
    })
}

impl Observation {
    fn of(t_map_camera: &Transform, fix: &Fix, plane: &LocalPlane) -> Self {
        let [east, north, up] = plane.east_north_up_m(fix.geodetic);
        Self {
            t_map_camera: *t_map_camera,
            at_m: Vector3::new(east, -up, north),
            axes: fix.angles_rad.map(camera_axes),
            sigma_m: fix
                .sigma_m
                .map(|[east, north, up]| ((east * east + north * north + up * up) / 3.0).sqrt()),
        }
    }
}

/// The camera's axes (x right, y down, z ahead) in the world, of a vehicle with x ahead, y left, z
/// up.
fn camera_axes([roll, pitch, yaw]: [f64; 3]) -> Matrix3<f64> {
    let about = |axis: [f64; 3], angle: f64| {
        Matrix3::from(Transform::new(axis.map(|side| side * angle), [0.0; 3]).rotation_matrix())
            .transpose()
    };
    // Yaw about up, pitch about left, roll about ahead, in this order.
    let enu_vehicle =
        about([0.0, 0.0, 1.0], yaw) * about([0.0, 1.0, 0.0], pitch) * about([1.0, 0.0, 0.0], roll);
    let world_enu = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let vehicle_camera = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    world_enu * enu_vehicle * vehicle_camera
}

/// The rotation nearest to a matrix.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let svd = matrix.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = if (u * v_t).determinant() < 0.0 { -1.0 } else { 1.0 };
    Some(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t)
}

/// A motion, the fixes' weights and their standard deviation.
struct Estimate {
    rotation: Matrix3<f64>,
    shift_m: Vector3<f64>,
    sigma_m: f64,
    weights: Vec<f64>,
}

/// Fixes as the estimates take them.
struct Fitted {
    points: Vec<PointPair>,
    /// Weight of each by what its receiver tells of it; 1 where it tells nothing.
    weights: Vec<f64>,
}

impl Fitted {
    fn new(frames: &[Observation], antenna_m: [f64; 3]) -> Self {
        // The antenna is not where the camera is.
        let points = frames
            .iter()
            .map(|of| (Vector3::from(of.t_map_camera.transform_point(antenna_m)), of.at_m))
            .collect();
        let usual_m = told_sigma_m(frames);
        let weight = |of: &Observation| match (of.sigma_m, usual_m) {
            (Some(sigma_m), Some(usual_m)) => (usual_m / sigma_m).powi(2).min(WEIGHT_MAX),
            _ => 1.0,
        };
        Self { points, weights: frames.iter().map(weight).collect() }
    }
}

/// Median of the standard deviations that the receiver tells, m.
fn told_sigma_m(frames: &[Observation]) -> Option<f64> {
    let known: Vec<f64> = frames.iter().filter_map(|of| of.sigma_m).collect();
    (!known.is_empty()).then(|| median(known))
}

/// The upper median; 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

impl Estimate {
    /// By fixes, and angles where there are any.
    fn of(fitted: &Fitted, axes: Option<&GivenAxes>) -> Option<Self> {
        let start = Self {
            rotation: Matrix3::identity(),
            shift_m: Vector3::zeros(),
            sigma_m: 1.0,
            weights: fitted.weights.clone(),
        };
        let mut estimate = start.next(fitted, axes)?;
        // Weights and pose depend on each other: iterate until the pose rests.
        for _ in 1..MAX_ROUNDS {
            let next = estimate.next(fitted, axes)?;
            let change = (next.rotation - estimate.rotation)
                .amax()
                .max((next.shift_m - estimate.shift_m).amax());
            estimate = next;
            if change < STEP_MIN {
                break;
            }
        }
        Some(estimate)
    }

    /// The motion that fits best with some weights, and the weights that follow from it.
    fn next(&self, fitted: &Fitted, axes: Option<&GivenAxes>) -> Option<Self> {
        let points = &fitted.points;
        let centres = centres(points, &self.weights);
        // Angles, where known, weigh as their standard deviation says.
        let mut sum =
            axes.map_or_else(Matrix3::zeros, |axes| axes.rotation / (2.0 * axes.sigma_rad.powi(2)));
        for ((from, to), weight) in points.iter().zip(&self.weights) {
            sum += (weight / information_of(self.sigma_m))
                * (to - centres.1)
                * (from - centres.0).transpose();
        }
        // Kabsch: the rotation nearest to the correlation of both sets.
        let rotation = nearest_rotation(&sum)?;
        let shift_m = centres.1 - rotation * centres.0;
        // Those of surer fixes count as if they were larger.
        let residual = |((from, to), weight): (&PointPair, &f64)| {
            weight.sqrt() * (to - rotation * from - shift_m).norm()
        };
        let residuals_m: Vec<f64> = points.iter().zip(&fitted.weights).map(residual).collect();
        // The median residual gives sigma: outliers do not raise it.
        let sigma_m = (median(residuals_m.clone()) / MEDIAN_LENGTH).max(SIGMA_MIN_M);
        let weights = residuals_m
            .iter()
            .zip(&fitted.weights)
            .map(|(residual_m, weight)| weight / (1.0 + (residual_m / (LIMIT * sigma_m)).powi(2)))
            .collect();
        Some(Self { rotation, shift_m, sigma_m, weights })
    }

    /// Standard deviation of the turn about the axis that is known least, rad.
    fn turn_sigma_rad(&self, points: &[PointPair], axes: Option<&GivenAxes>) -> f64 {
        let (centre, _) = centres(points, &self.weights);
        let mut information =
            axes.map_or_else(Matrix3::zeros, |axes| Matrix3::identity() / axes.sigma_rad.powi(2));
        for ((from, _), weight) in points.iter().zip(&self.weights) {
            let arm = from - centre;
            information += (weight / information_of(self.sigma_m))
                * (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose());
        }
        // The least known axis has the smallest eigenvalue.
        let least = SymmetricEigen::new(information).eigenvalues.min();
        if least > 0.0 {
            least.sqrt().recip().min(std::f64::consts::PI)
        } else {
            std::f64::consts::PI
        }
    }
}

/// Scale at which the path fits its fixes best.
struct PathScale {
    factor: f64,
    /// One standard deviation.
    sigma: f64,
}

impl PathScale {
    fn new(points: &[PointPair], estimate: &Estimate) -> Self {
        let (from_centre, to_centre) = centres(points, &estimate.weights);
        let (mut along, mut arm) = (0.0, 0.0);
        for ((from, to), weight) in points.iter().zip(&estimate.weights) {
            let turned = estimate.rotation * (from - from_centre);
            along += weight * turned.dot(&(to - to_centre));
            arm += weight * turned.norm_squared();
        }
        let factor = along / arm;
        // A wrong scale must not excuse itself: residuals are those that it would leave.
        let residual = |(from, to): &PointPair| {
            (to - to_centre - factor * (estimate.rotation * (from - from_centre))).norm()
        };
        let sigma_m = median(points.iter().map(residual).collect()) / MEDIAN_LENGTH;
        let sigma_m = sigma_m.clamp(SIGMA_MIN_M, estimate.sigma_m.max(SIGMA_MIN_M));
        Self { factor, sigma: (information_of(sigma_m) / arm).sqrt() }
    }
}

/// Returns the divisor of a fix's squared error.
fn information_of(sigma_m: f64) -> f64 {
    sigma_m * sigma_m * CORRELATED_FIXES
}

fn transform_of(rotation: &Matrix3<f64>, shift_m: &Vector3<f64>) -> Transform {
    Transform::from_rotation_matrix(&rotation.transpose().into(), (*shift_m).into()).normalized()
}

fn centres(points: &[PointPair], weights: &[f64]) -> PointPair {
    let total: f64 = weights.iter().sum();
    let sum = |of: fn(&PointPair) -> Vector3<f64>| {
        points
            .iter()
            .zip(weights)
            .fold(Vector3::zeros(), |sum, (point, weight)| sum + of(point) * *weight)
            / total
    };
    (sum(|point| point.0), sum(|point| point.1))
}

/// The mean rotation from the map to the world that measured angles give, if there are any.
fn given_rotation(frames: &[Observation]) -> Option<Matrix3<f64>> {
    let turned = frames
        .iter()
        .filter_map(|of| Some(of.axes? * Matrix3::from(of.t_map_camera.rotation_matrix())));
    turned.clone().next().and_then(|_| nearest_rotation(&turned.sum()))
}

/// Measured angles with the standard deviation that the fixes leave them, or how they contradict
/// these.
fn believed(
    rotation: &Matrix3<f64>,
    fitted: &Fitted,
    by_positions: &Estimate,
) -> Result<GivenAxes, String> {
    let points = &fitted.points;
    let apart = transform_of(&(rotation.transpose() * by_positions.rotation), &Vector3::zeros());
    if apart.angle_rad() > CONTRADICTION_MAX_RAD
        && by_positions.turn_sigma_rad(points, None) < TURN_MAX_RAD
    {
        return Err(format!(
            "its angles contradict its positions by {:.0} degrees. The camera must look along the \
             vehicle",
            apart.angle_rad().to_degrees()
        ));
    }
    // A straight path tells its heading, if not how far the camera leans.
    let HeadingError { off_rad, sigma_rad } =
        HeadingError::new(points, &by_positions.weights, by_positions.sigma_m, rotation);
    let explained_rad = DOUBT * sigma_rad.hypot(ANGLES_SIGMA_RAD);
    if off_rad.abs() > CONTRADICTION_MAX_RAD.max(explained_rad) {
        return Err(format!(
            "its angles contradict the heading of its path by {:.0} degrees. Yaw is 0 to the east \
             and rises counterclockwise, in rad: it may count from north (compass) or be in \
             degrees, or latitude and longitude may be exchanged",
            off_rad.abs().to_degrees()
        ));
    }
    // Angles that are off by less may be a compass' near the north-east: they count for little.
    let sigma_rad = if off_rad.abs() > explained_rad { off_rad.abs() } else { ANGLES_SIGMA_RAD };
    Ok(GivenAxes { rotation: *rotation, sigma_rad })
}

/// Estimates the map's pose from fixes, or says why they do not determine it.
fn georeference(frames: &[Observation], antenna_m: [f64; 3]) -> Result<Prior, String> {
    if frames.len() < FIXES_MIN {
        return Err(format!("{} frames with a fix are less than {FIXES_MIN}", frames.len()));
    }
    let fitted = Fitted::new(frames, antenna_m);
    let points = &fitted.points;
    let unclear = || "its positions are not finite".to_owned();
    // Once without angles, to see whether they contradict the positions.
    let by_positions = Estimate::of(&fitted, None).ok_or_else(unclear)?;
    let axes = match given_rotation(frames) {
        Some(rotation) => Some(believed(&rotation, &fitted, &by_positions)?),
        None => None,
    };
    let estimate = Estimate::of(&fitted, axes.as_ref()).ok_or_else(unclear)?;
    let scale = PathScale::new(points, &estimate);
    if (scale.factor - 1.0).abs() > SCALE_ERROR_MAX + 3.0 * scale.sigma {
        return Err(format!(
            "its fixes lie along {:.2} x the length of its path. Latitude and longitude may be \
             exchanged, or the fixes those of another recording",
            scale.factor
        ));
    }
    // A receiver whose errors are alike along a path knows of more than the residuals show.
    let position_m = estimate.sigma_m.max(told_sigma_m(frames).unwrap_or(0.0));
    let rotation_rad = estimate.turn_sigma_rad(points, axes.as_ref());
    // Fixes of another recording do not fit the path.
    if position_m > SIGMA_MAX_M {
        return Err(format!(
            "its fixes are {position_m:.0} m off its path (one standard deviation; at most \
             {SIGMA_MAX_M}). Give those of this recording"
        ));
    }
    if rotation_rad > TURN_MAX_RAD {
        let [found, most] = [rotation_rad, TURN_MAX_RAD].map(f64::to_degrees);
        return Err(format!(
            "its turn is known to {found:.1} degrees only (one standard deviation; at most \
             {most:.1}), because the path is short, nearly straight, or its \
             fixes are noisy. Give roll, pitch and yaw with the fixes, or t_world_camera"
        ));
    }
    Ok(Prior {
        way_m: 0.0,
        t_world_map: transform_of(&estimate.rotation, &estimate.shift_m),
        // The error of a receiver lasts longer than a recording: its mean over the path is no surer
        // than one fix.
        uncertainty: Some(Uncertainty { position_m, rotation_rad }),
    })
}

#[cfg(test)]
mod tests;
