//! Registration of two maps: points on the surface of each against the signed distance of the
//! other.
//!
//! Gauss-Newton over rigid motions (point to implicit surface: Canelhas, Stoyanov, Lilienthal, *SDF
//! Tracker*, IROS 2013), with Tukey's weights whose limit shrinks from the truncation to two
//! voxels. Sums run over the points in their order, so the result is the same every time.
//!
//! A registration is believed when enough points take part, most of them lie near, they constrain
//! all six degrees of freedom, and the motion is not larger than the given poses allow; otherwise
//! it is refused by name.

use super::distance_field::{DistanceField, SurfacePoint};
use dynvox_core::geometry::Transform;
use nalgebra::{Matrix6, SymmetricEigen, UnitQuaternion, Vector3, Vector6};
use serde::{Deserialize, Serialize};

/// Points of one map in a registration at most.
const MAX_POINTS: usize = 20_000;
/// Points that must lie where the other map was seen.
const POINTS_MIN: usize = 1_000;
/// Share of these that must lie within the last limit.
const INLIERS_MIN: f64 = 0.7;
/// Largest root mean square of their distances, voxels.
const RMS_MAX_VOXELS: f64 = 1.0;
/// Least share of the weakest degree of freedom in the strongest.
const EIGEN_SHARE_MIN: f64 = 1e-3;
/// Limits of distance, as shares of the truncation; the last one is [`NEAR_VOXELS`].
const LIMITS: [f64; 3] = [0.9, 0.5, 0.25];
/// The last limit, voxels.
const NEAR_VOXELS: f64 = 2.0;
/// Steps at one limit.
const MAX_STEPS: usize = 12;
/// A step that moves no point by more ends them, m.
const STEP_MIN_M: f64 = 1e-5;
/// Neighbouring points err alike: so many count as one.
const CORRELATED_POINTS: f64 = 100.0;

/// A map to be registered: its distances, and points on its surface.
pub struct RegisteredMap {
    /// Distances.
    pub field: DistanceField,
    /// Points.
    pub points: Vec<SurfacePoint>,
}

/// Uncertainty of a given pose, one standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct Uncertainty {
    /// Position, m.
    pub position_m: f64,
    /// Rotation, rad.
    pub rotation_rad: f64,
}

impl Uncertainty {
    /// A multiple of it.
    pub fn times(&self, factor: f64) -> Self {
        Self { position_m: factor * self.position_m, rotation_rad: factor * self.rotation_rad }
    }

    /// Combines the uncertainties of two poses into that of their relative pose.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            position_m: self.position_m.hypot(other.position_m),
            rotation_rad: self.rotation_rad.hypot(other.rotation_rad),
        }
    }
}

/// Quality of the fit of two maps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Points that lie where the other map was seen.
    pub points: usize,
    /// Share of them within the last limit.
    pub inlier_share: f64,
    /// Root mean square of their distances as given, m.
    pub rms_before_m: f64,
    /// And of those within the last limit after, m.
    pub rms_m: f64,
    /// Share of the weakest degree of freedom in the strongest.
    pub min_eigen_share: f64,
    /// Reason why the registration is not believed.
    pub refused: Option<String>,
}

/// Relative pose of two maps, found by registration.
#[derive(Clone, Debug)]
pub struct Registration {
    /// The first map in the second.
    pub t_b_a: Transform,
    /// Information on rotation vector and translation about the centre, in the second map's axes.
    pub information: Matrix6<f64>,
    /// Mean of the points, in the second map.
    pub centre_m: [f64; 3],
    /// Quality of the fit.
    pub fit: Fit,
}

/// Normal equations of one step.
struct Equations {
    matrix: Matrix6<f64>,
    vector: Vector6<f64>,
    points: usize,
    inliers: usize,
    sum_of_squares: f64,
}

impl Equations {
    fn rms_m(&self) -> f64 {
        (self.sum_of_squares / self.inliers.max(1) as f64).sqrt()
    }
}

/// Points of two maps that may meet, and the centre about which they turn.
struct Pair<'p> {
    a: &'p RegisteredMap,
    b: &'p RegisteredMap,
    of_a: Vec<&'p SurfacePoint>,
    of_b: Vec<&'p SurfacePoint>,
    centre_m: Vector3<f64>,
}

/// A rotation vector and a translation about a centre, as a motion.
pub fn motion_about(centre_m: &Vector3<f64>, step: &Vector6<f64>) -> Transform {
    let turn = Transform::new([step[0], step[1], step[2]], [0.0; 3]);
    let turned = Vector3::from(turn.rotate([centre_m.x, centre_m.y, centre_m.z]));
    let moved = centre_m - turned + step.fixed_rows::<3>(3);
    Transform::new([step[0], step[1], step[2]], [moved.x, moved.y, moved.z])
}

/// A motion as a rotation vector and a translation about a centre.
pub fn step_about(centre_m: &Vector3<f64>, motion: &Transform) -> Vector6<f64> {
    let [x, y, z, w] = motion.rotation;
    let turn = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z)).scaled_axis();
    let moved =
        Vector3::from(motion.transform_point([centre_m.x, centre_m.y, centre_m.z])) - centre_m;
    Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z)
}

/// Registers a map with another: `given` is the first map in the second by the poses that were
/// given, which may be off by `uncertainty`, `guess` by what is known now. `None` where too few
/// points could meet.
pub fn register(
    (a, b): (&RegisteredMap, &RegisteredMap),
    (given, guess): (&Transform, &Transform),
    uncertainty: &Uncertainty,
) -> Option<Registration> {
    let pair = Pair::new(a, b, guess)?;
    let field = &b.field;
    let near_m = NEAR_VOXELS * field.voxel_size_m;
    let limits_m: Vec<f64> = LIMITS
        .iter()
        .map(|share| share * field.truncation_m)
        .filter(|limit_m| *limit_m > near_m)
        .chain([near_m])
        .collect();
    // How far off the maps were, at the widest limit.
    let rms_before_m = pair.equations(guess, limits_m[0]).rms_m();
    let mut t_b_a = *guess;
    // Coarse to fine: outliers are cut at ever smaller distances.
    for &limit_m in &limits_m {
        for _ in 0..MAX_STEPS {
            let equations = pair.equations(&t_b_a, limit_m);
            let Some(solver) = equations.matrix.cholesky() else { break };
            let step = solver.solve(&-equations.vector);
            // Steps turn about the centre of the common points, which keeps turn and shift apart.
            t_b_a = (motion_about(&pair.centre_m, &step) * t_b_a).normalized();
            if step.fixed_rows::<3>(3).norm() + step.fixed_rows::<3>(0).norm() * pair.radius_m()
                < STEP_MIN_M
            {
                break;
            }
        }
    }
    // The fit is measured at the finest limit.
    let last = pair.equations(&t_b_a, near_m);
    let variance = last.rms_m().max(1e-6).powi(2);
    let mut fit = Fit {
        points: last.points,
        inlier_share: last.inliers as f64 / last.points.max(1) as f64,
        rms_before_m,
        rms_m: last.rms_m(),
        min_eigen_share: min_eigen_share(&last.matrix, pair.radius_m()),
        refused: None,
    };
    let moved = step_about(&pair.centre_m, &(t_b_a * given.inverse()));
    fit.refused = refusal(&fit, &moved, (field.voxel_size_m, &pair, uncertainty));
    // Neighbouring points share their errors: they count as fewer than they are.
    let information = last.matrix / (variance * CORRELATED_POINTS);
    Some(Registration { t_b_a, information, centre_m: pair.centre_m.into(), fit })
}

fn refusal(
    of: &Fit,
    moved: &Vector6<f64>,
    (voxel_size_m, pair, uncertainty): (f64, &Pair<'_>, &Uncertainty),
) -> Option<String> {
    // Two standard deviations; a turn also moves what is far from the map's origin.
    let turn_rad = 2.0 * uncertainty.rotation_rad;
    let move_m = 2.0 * uncertainty.position_m + turn_rad * pair.centre_m.norm();
    let (moved_m, turned_rad) = (moved.fixed_rows::<3>(3).norm(), moved.fixed_rows::<3>(0).norm());
    if of.points < POINTS_MIN {
        Some(format!("{} points are less than {POINTS_MIN}", of.points))
    } else if of.inlier_share < INLIERS_MIN {
        Some(format!(
            "{:.0} % of the points are near, less than {:.0}",
            100.0 * of.inlier_share,
            100.0 * INLIERS_MIN
        ))
    } else if of.rms_m > RMS_MAX_VOXELS * voxel_size_m {
        Some(format!("the points are {:.3} m off, more than {RMS_MAX_VOXELS} voxel", of.rms_m))
    } else if of.min_eigen_share < EIGEN_SHARE_MIN {
        Some(format!(
            "the surfaces slide along one another: {:.5} is less than {EIGEN_SHARE_MIN}",
            of.min_eigen_share
        ))
    } else if moved_m > move_m || turned_rad > turn_rad {
        Some(format!(
            "{moved_m:.2} m and {:.2} degrees are more than the given poses may be off",
            turned_rad.to_degrees()
        ))
    } else {
        None
    }
}

/// The least eigenvalue over the greatest, with rotations counted by how far they move the points.
fn min_eigen_share(matrix: &Matrix6<f64>, radius_m: f64) -> f64 {
    // A radian at the radius moves a point by the radius: metres on both sides.
    let scale = Matrix6::from_diagonal(&Vector6::new(
        1.0 / radius_m,
        1.0 / radius_m,
        1.0 / radius_m,
        1.0,
        1.0,
        1.0,
    ));
    let values = SymmetricEigen::new(scale * matrix * scale).eigenvalues;
    let (least, most) = values
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(least, most), &value| (least.min(value), most.max(value)));
    // Rounding may make the least one negative.
    if most > 0.0 { least.max(0.0) / most } else { 0.0 }
}

impl<'p> Pair<'p> {
    /// The points of each map that lie where the other was seen, evenly chosen.
    fn new(a: &'p RegisteredMap, b: &'p RegisteredMap, t_b_a: &Transform) -> Option<Self> {
        let back = t_b_a.inverse();
        // Points of each map where the other was seen: elsewhere there is nothing to fit.
        let of_a =
            chosen(&a.points, |point| b.field.at(t_b_a.transform_point(point.at_m)).is_some());
        let of_b =
            chosen(&b.points, |point| a.field.at(back.transform_point(point.at_m)).is_some());
        if of_a.len() + of_b.len() < POINTS_MIN {
            return None;
        }
        // The centre of all, in the second map.
        let in_b = of_a
            .iter()
            .map(|point| t_b_a.transform_point(point.at_m))
            .chain(of_b.iter().map(|point| point.at_m));
        let (sum, count) = in_b.fold((Vector3::zeros(), 0.0), |(sum, count), at| {
            (sum + Vector3::from(at), count + 1.0)
        });
        Some(Self { a, b, of_a, of_b, centre_m: sum / count })
    }

    /// Root mean square of the points' distances from their centre, m.
    fn radius_m(&self) -> f64 {
        let squares = self
            .of_b
            .iter()
            .map(|point| (Vector3::from(point.at_m) - self.centre_m).norm_squared());
        (squares.sum::<f64>() / self.of_b.len().max(1) as f64).sqrt().max(1.0)
    }

    fn equations(&self, t_b_a: &Transform, limit_m: f64) -> Equations {
        let mut equations = Equations {
            matrix: Matrix6::zeros(),
            vector: Vector6::zeros(),
            points: 0,
            inliers: 0,
            sum_of_squares: 0.0,
        };
        let back = t_b_a.inverse();
        // Points of the first map in the field of the second, and the other way round.
        for point in &self.of_a {
            let (at_m, normal) = (t_b_a.transform_point(point.at_m), t_b_a.rotate(point.normal));
            if let Some((distance_m, gradient)) = self.b.field.at(at_m) {
                equations.add(
                    (distance_m, gradient, normal),
                    &(Vector3::from(at_m) - self.centre_m),
                    1.0,
                    limit_m,
                );
            }
        }
        for point in &self.of_b {
            if let Some((distance_m, gradient)) = self.a.field.at(back.transform_point(point.at_m))
            {
                let gradient = t_b_a.rotate(gradient);
                equations.add(
                    (distance_m, gradient, point.normal),
                    &(Vector3::from(point.at_m) - self.centre_m),
                    -1.0,
                    limit_m,
                );
            }
        }
        equations
    }
}

impl Equations {
    /// Adds a point's distance; `sign` says which of the maps a step moves towards it.
    fn add(
        &mut self,
        (distance_m, gradient, normal): (f64, [f64; 3], [f64; 3]),
        arm_m: &Vector3<f64>,
        sign: f64,
        limit_m: f64,
    ) {
        let (gradient, normal) = (Vector3::from(gradient), Vector3::from(normal));
        // A surface seen from its other side is another surface.
        if gradient.dot(&normal) < 0.5 * gradient.norm() {
            return;
        }
        self.points += 1;
        // An outlier counts as a point, not as an inlier.
        if distance_m.abs() >= limit_m {
            return;
        }
        self.inliers += 1;
        self.sum_of_squares += distance_m * distance_m;
        // Tukey's weight, which is zero at the limit.
        let weight = (1.0 - (distance_m / limit_m).powi(2)).powi(2);
        let turn = arm_m.cross(&gradient);
        let row = sign * Vector6::new(turn.x, turn.y, turn.z, gradient.x, gradient.y, gradient.z);
        self.matrix += weight * row * row.transpose();
        self.vector += weight * distance_m * row;
    }
}

/// Points that fulfil a condition, evenly chosen.
fn chosen(points: &[SurfacePoint], fulfils: impl Fn(&SurfacePoint) -> bool) -> Vec<&SurfacePoint> {
    let all: Vec<&SurfacePoint> = points.iter().filter(|point| fulfils(point)).collect();
    let stride = all.len().div_ceil(MAX_POINTS).max(1);
    all.into_iter().step_by(stride).collect()
}
