//! An object's velocity and angular velocity over frames: an extended information filter.
//!
//! The state is the velocity and angular velocity over ground at the object's centre, in world
//! axes. Between frames it may change by a random acceleration (constant-velocity model). A frame's
//! matches enter by their reprojection errors, not by a motion computed from them alone:
//! Gauss-Newton minimises `sum |error|^2 / noise^2 + |rate - predicted|^2` (weighted by the inverse
//! of the prediction's covariance), so what a frame does not determine, as the rotation and the
//! depth of a car far away, is taken from the frames before. The inverse of the matrix it solves is
//! the covariance, which tells the motion state how certain a speed is.
//!
//! A point that the camera's motion alone would predict at `q` (in the current camera) is expected
//! at `c + R(angular velocity dt) (q - c) + velocity dt`, where c is the mean of all q. Errors of
//! matches of one object are not independent (one mask, one rectification): no more than
//! `independent_matches` count.

use super::config::MotionConfig;
use crate::geometry::{StereoObservation, StereoRig, Transform};
use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};
use nalgebra::{Cholesky, Matrix3, Matrix6, Point3, Rotation3, Vector3, Vector6};

/// Most of an object's matches that count as independent: their errors are correlated.
const INDEPENDENT_MATCHES: f64 = 30.0;
/// Rotation of an object about the vertical when it is first detected, one sigma, rad/s.
const YAW_RAD_S: f32 = 0.2;
/// Rotation about any other axis, which the road limits, one sigma, rad/s.
const TILT_RAD_S: f32 = 0.03;
/// Change of speed within a second, one sigma, m/s.
const ACCELERATION_M_S2: f32 = 3.0;
/// Change of rotation about the vertical within a second, one sigma, rad/s.
const YAW_ACCELERATION_RAD_S2: f32 = 0.4;
/// Change of rotation about any other axis within a second, one sigma, rad/s.
const TILT_ACCELERATION_RAD_S2: f32 = 0.03;
/// Gauss-Newton steps per frame; what is left after them is far below the noise.
const STEPS: usize = 4;
/// Squared Mahalanobis distance from the prediction beyond which a frame contradicts it:
/// chi-square, 6 degrees of freedom, 1e-5.
const CONTRADICTION: f64 = 34.0;

/// A point of an object: where it would be in the current camera if the object were static, and
/// where it is observed, px from the principal point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    pub static_prediction: Point3<f64>,
    pub left: [f64; 2],
    pub right: [f64; 2],
}

/// The filter. `rate` is angular velocity (rad/s), then velocity (m/s), in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MotionFilter {
    rate: [f64; 6],
    covariance: [[f64; 6]; 6],
    center_world: [f64; 3],
    /// Frames that updated it; 0 before the first.
    frames: u32,
    /// Consecutive frames that contradicted the prediction.
    contradictions: u32,
}

impl MotionFilter {
    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { rate, covariance, center_world, frames, contradictions } = self;
        visitor.f64s(rate);
        visitor.f64s(covariance.as_flattened_mut());
        visitor.f64s(center_world);
        visitor.u32(frames);
        visitor.u32(contradictions);
    }

    /// Returns true if a motion was ever measured.
    pub fn is_known(&self) -> bool {
        self.frames > 0
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        let [x, y, z, ..] = self.rate;
        Vector3::new(x, y, z)
    }

    /// Velocity over ground, m/s.
    pub fn velocity(&self) -> Vector3<f64> {
        let [.., x, y, z] = self.rate;
        Vector3::new(x, y, z)
    }

    /// Centre of the object in the world, m.
    pub fn center_world(&self) -> Point3<f64> {
        Point3::from(self.center_world)
    }

    /// Speed over ground, its error along the direction of motion and its error in all directions
    /// together, m/s.
    pub fn speed(&self) -> [f64; 3] {
        let velocity = self.velocity();
        let speed = libm::sqrt(velocity.dot(&velocity));
        let covariance = Matrix6::from(self.covariance);
        let part: Matrix3<f64> = covariance.fixed_view::<3, 3>(3, 3).into_owned();
        // Without a velocity there is no direction: the mean over all directions counts.
        let variance = if speed > 1e-6 {
            velocity.dot(&(part * velocity)) / (speed * speed)
        } else {
            part.trace() / 3.0
        };
        [speed, libm::sqrt(variance), libm::sqrt(part.trace())]
    }

    /// The motion over ground within a frame: maps points of the object in the world from where
    /// they were to where they are.
    pub fn motion(&self, interval_s: f64) -> Transform {
        let turn = Transform::new(self.angular_velocity() * interval_s, Vector3::zeros());
        let center = self.center_world().coords;
        let shift = center + self.velocity() * interval_s - turn.rotate(center);
        Transform { translation_m: shift.into(), ..turn }
    }

    /// Predicts the next frame: the rates may have changed. The velocity rotates with the object.
    pub fn predict(&mut self, config: &MotionConfig, interval_s: f64) {
        let square = |x: f32| f64::from(x) * f64::from(x);
        if self.frames == 0 {
            let [tilt, yaw, speed] = [TILT_RAD_S, YAW_RAD_S, config.speed_m_s].map(square);
            self.rate = [0.0; 6];
            self.covariance =
                Matrix6::from_diagonal(&Vector6::new(tilt, yaw, tilt, speed, speed, speed)).into();
            return;
        }
        let turned = Transform::new(self.angular_velocity() * interval_s, Vector3::zeros())
            .rotate(self.velocity());
        let [.., x, y, z] = &mut self.rate;
        (*x, *y, *z) = (turned.x, turned.y, turned.z);
        let [tilt, yaw, speed] =
            [TILT_ACCELERATION_RAD_S2, YAW_ACCELERATION_RAD_S2, ACCELERATION_M_S2]
                .map(|change| square(change) * interval_s * interval_s);
        for (i, (row, growth)) in
            self.covariance.iter_mut().zip([tilt, yaw, tilt, speed, speed, speed]).enumerate()
        {
            if let Some(entry) = row.get_mut(i) {
                *entry += growth;
            }
        }
    }

    /// Advances the centre in a frame without a measured motion.
    pub fn coast(&mut self, interval_s: f64) {
        self.center_world = (self.center_world() + self.velocity() * interval_s).coords.into();
    }

    /// Updates by a frame's observations, after [`MotionFilter::predict`]. `noise_px` is the error
    /// of one coordinate. Afterwards `center_world` is where the centre was before the frame's
    /// motion. `false`, and the rates unchanged, when the observations cannot be used or contradict
    /// the prediction: if the next frame contradicts it as well, the filter starts anew from that
    /// one.
    pub fn update(
        &mut self,
        config: &MotionConfig,
        rig: &StereoRig,
        t_world_camera: &Transform,
        interval_s: f64,
        noise_px: f64,
        observations: impl Iterator<Item = Observation> + Clone,
    ) -> bool {
        if self.contradictions == 0 || self.frames == 0 {
            return self.correct(rig, t_world_camera, interval_s, noise_px, observations);
        }
        let mut corrected = Self { contradictions: 0, ..*self };
        let mut restarted = Self { contradictions: 0, frames: 0, ..*self };
        restarted.predict(config, interval_s);
        let fits =
            corrected.correct(rig, t_world_camera, interval_s, noise_px, observations.clone());
        let updated =
            fits || restarted.correct(rig, t_world_camera, interval_s, noise_px, observations);
        if updated {
            *self = if fits { corrected } else { restarted };
        }
        updated
    }

    /// Updates like [`MotionFilter::update`], without a contradiction in the frame before.
    fn correct(
        &mut self,
        rig: &StereoRig,
        t_world_camera: &Transform,
        interval_s: f64,
        noise_px: f64,
        observations: impl Iterator<Item = Observation> + Clone,
    ) -> bool {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for observation in observations.clone() {
            sum += observation.static_prediction.coords;
            count += 1.0;
        }
        let Some(information) =
            Cholesky::new(Matrix6::from(self.covariance)).map(|factor| factor.inverse())
        else {
            return false;
        };
        let center = sum / count;
        // False for NaN as well.
        if !(count >= 3.0 && center.iter().all(|x| x.is_finite())) {
            return false;
        }
        let independent = INDEPENDENT_MATCHES;
        let weight =
            (if count > independent { independent / count } else { 1.0 }) / (noise_px * noise_px);
        let world_camera = t_world_camera.quaternion().to_rotation_matrix();
        let predicted = Vector6::from(self.rate);
        let mut rate = predicted;
        for step in 0..=STEPS {
            let equations = NormalEquations::over(
                observations.clone(),
                rig,
                &center,
                &world_camera,
                interval_s,
                &rate,
            );
            let (matrix, vector) = equations.in_world(&world_camera, interval_s);
            let Some(factor) = Cholesky::new(information + matrix * weight) else { return false };
            if step == STEPS {
                let covariance = factor.inverse();
                if !(rate.iter().chain(covariance.iter()).all(|x| x.is_finite())) {
                    return false;
                }
                let change = rate - predicted;
                if self.frames > 0 && change.dot(&(information * change)) > CONTRADICTION {
                    self.contradictions += 1;
                    return false;
                }
                self.covariance = symmetric(&covariance).into();
                break;
            }
            rate -= factor.solve(&(vector * weight + information * (rate - predicted)));
        }
        self.rate = rate.into();
        self.center_world = t_world_camera.transform_point(center.into());
        self.frames += 1;
        true
    }
}

fn symmetric(matrix: &Matrix6<f64>) -> Matrix6<f64> {
    (matrix + matrix.transpose()) * 0.5
}

/// J'J and J'r of the reprojection errors, by a small rotation and translation in camera axes.
struct NormalEquations {
    matrix: [[f64; 6]; 6],
    vector: [f64; 6],
}

impl NormalEquations {
    fn over(
        observations: impl Iterator<Item = Observation>,
        rig: &StereoRig,
        center: &Vector3<f64>,
        world_camera: &Rotation3<f64>,
        interval_s: f64,
        rate: &Vector6<f64>,
    ) -> Self {
        let turn = world_camera.inverse() * Vector3::new(rate.x, rate.y, rate.z) * interval_s;
        let shift = world_camera.inverse() * Vector3::new(rate.w, rate.a, rate.b) * interval_s;
        let turned = Transform::new(turn, Vector3::zeros()).quaternion().to_rotation_matrix();
        let mut equations = Self { matrix: [[0.0; 6]; 6], vector: [0.0; 6] };
        for observation in observations {
            let arm = turned * (observation.static_prediction.coords - center);
            equations.add(rig, &arm, &(center + arm + shift), &observation);
        }
        equations
    }

    /// Adds a point at `at` in the camera, `arm` from the centre. One behind the camera adds
    /// nothing.
    fn add(
        &mut self,
        rig: &StereoRig,
        arm: &Vector3<f64>,
        at: &Vector3<f64>,
        observed: &Observation,
    ) {
        let at = (*at).into();
        let Some(StereoObservation { u_left_px, v_px, u_right_px }) = rig.project(at) else {
            return;
        };
        // Derivatives of a coordinate by the point (gx, gy, gz), and by the rotation: arm x g.
        let row = |g: [f64; 3]| {
            let turn = arm.cross(&Vector3::from(g));
            [turn.x, turn.y, turn.z, g[0], g[1], g[2]]
        };
        let [left, down, right] = rig.project_jacobian(at).map(row);
        let rows = [
            (left, u_left_px - observed.left[0]),
            (right, u_right_px - observed.right[0]),
            (down, v_px - observed.left[1]),
            (down, v_px - observed.right[1]),
        ];
        for (row, error) in rows {
            for ((line, sum), a) in self.matrix.iter_mut().zip(&mut self.vector).zip(row) {
                *sum += a * error;
                line.iter_mut().zip(row).for_each(|(entry, b)| *entry += a * b);
            }
        }
    }

    /// Returns the motion by rates in world axes.
    fn in_world(
        &self,
        world_camera: &Rotation3<f64>,
        interval_s: f64,
    ) -> (Matrix6<f64>, Vector6<f64>) {
        let mut turn = Matrix6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(world_camera.matrix());
        turn.fixed_view_mut::<3, 3>(3, 3).copy_from(world_camera.matrix());
        let matrix =
            turn * Matrix6::from(self.matrix) * turn.transpose() * (interval_s * interval_s);
        (symmetric(&matrix), turn * Vector6::from(self.vector) * interval_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::vec::Vec;

    const RIG: StereoRig =
        StereoRig { focal_px: 721.5, center_u_px: 609.6, center_v_px: 172.9, baseline_m: 0.54 };
    const INTERVAL_S: f64 = 0.1;

    /// A number about 0 with a standard deviation of 1: the sum of twelve uniform ones.
    fn normal(random: &mut Random) -> f64 {
        (0..12).map(|_| f64::from(random.below(1 << 20)) / f64::from(1 << 20)).sum::<f64>() - 6.0
    }

    /// Points on a car's back, `depth_m` before the camera, that moved by `rate` and are seen with
    /// an error; those before as well.
    fn frame(random: &mut Random, depth_m: f64, rate: [f64; 6], noise_px: f64) -> Vec<Observation> {
        let center = Vector3::new(1.0, 0.5, depth_m);
        let turn =
            Transform::new(Vector3::new(rate[0], rate[1], rate[2]) * INTERVAL_S, Vector3::zeros());
        let project = |p: Vector3<f64>| {
            let per_m = RIG.focal_px / p.z;
            ([p.x * per_m, p.y * per_m], [(p.x - RIG.baseline_m) * per_m, p.y * per_m])
        };
        (0..60)
            .map(|_| {
                let [x, y, z] = [(); 3].map(|()| f64::from(random.below(1000)) / 1000.0 - 0.5);
                let point = center + Vector3::new(1.8 * x, 1.4 * y, 1.0 * z);
                let (before, before_right) = project(point);
                let mut noise = || normal(random) * noise_px;
                let disparity = before[0] + noise() - before_right[0] - noise();
                let per_px = RIG.baseline_m / disparity;
                let static_prediction = Point3::new(
                    (before[0] + noise()) * per_px,
                    (before[1] + noise()) * per_px,
                    RIG.focal_px * per_px,
                );
                let moved = center
                    + turn.rotate(point - center)
                    + Vector3::new(rate[3], rate[4], rate[5]) * INTERVAL_S;
                let (left, right) = project(moved);
                Observation {
                    static_prediction,
                    left: [left[0] + noise(), left[1] + noise()],
                    right: [right[0] + noise(), right[1] + noise()],
                }
            })
            .collect()
    }

    fn track(
        depth_m: f64,
        noise_px: f64,
        frames: usize,
        rate: impl Fn(usize) -> [f64; 6],
    ) -> Vec<MotionFilter> {
        let mut random = Random::new(7);
        let mut filter = MotionFilter::default();
        let config = MotionConfig::default();
        (0..frames)
            .map(|n| {
                filter.predict(&config, INTERVAL_S);
                let seen = frame(&mut random, depth_m, rate(n), noise_px);
                let noise = if noise_px > 0.1 { noise_px * 1.5 } else { 0.1 };
                assert!(filter.update(
                    &config,
                    &RIG,
                    &Transform::IDENTITY,
                    INTERVAL_S,
                    noise,
                    seen.iter().copied()
                ));
                filter
            })
            .collect()
    }

    #[test]
    fn exact_observations_give_the_motion_at_once() {
        let rate = [0.0, 0.3, 0.0, 2.0, 0.0, 9.0];
        let filter = track(12.0, 0.0, 1, |_| rate)[0];
        let error = (filter.velocity() - Vector3::new(2.0, 0.0, 9.0)).norm();
        assert!(error < 0.1, "{error} m/s");
        assert!(
            (filter.angular_velocity() - Vector3::new(0.0, 0.3, 0.0)).norm() < 0.05,
            "{}",
            filter.angular_velocity()
        );
    }

    #[test]
    fn a_far_car_is_known_better_after_ten_frames_than_after_one_and_says_so() {
        let filters = track(30.0, 0.3, 40, |_| [0.0, 0.0, 0.0, 0.0, 0.0, 8.0]);
        let error =
            |filter: &MotionFilter| (filter.velocity() - Vector3::new(0.0, 0.0, 8.0)).norm();
        let late: f64 = filters[10..].iter().map(error).sum::<f64>() / 30.0;
        assert!(late * INTERVAL_S < 0.05, "{late} m/s");
        assert!(
            filters[20].speed()[1] < 0.7 * filters[0].speed()[1],
            "{:?} {:?}",
            filters[20].speed(),
            filters[0].speed()
        );
        let within =
            filters.iter().filter(|filter| error(filter) < 3.0 * filter.speed()[1]).count();
        assert!(within >= 38, "the error is what it says to be: {within} of 40");
    }

    #[test]
    fn a_car_that_brakes_is_followed() {
        let filters = track(15.0, 0.3, 30, |n| {
            [0.0, 0.0, 0.0, 0.0, 0.0, if n < 10 { 8.0 } else { 8.0 - 0.3 * (n - 10) as f64 }]
        });
        let late = filters[29].speed();
        assert!((late[0] - 2.3).abs() < 0.8, "{late:?}");
    }

    #[test]
    fn one_contradicting_frame_is_not_believed_but_two_are() {
        let still = [0.0; 6];
        let fast = [0.0, 0.0, 0.0, 0.0, 0.0, 9.0];
        let mut random = Random::new(3);
        let config = MotionConfig::default();
        let mut filter = MotionFilter::default();
        let mut take = |rate: [f64; 6]| {
            filter.predict(&config, INTERVAL_S);
            let seen = frame(&mut random, 12.0, rate, 0.3);
            (
                filter.update(
                    &config,
                    &RIG,
                    &Transform::IDENTITY,
                    INTERVAL_S,
                    0.4,
                    seen.iter().copied(),
                ),
                filter.speed()[0],
            )
        };
        for _ in 0..5 {
            assert!(take(still).0);
        }
        let (taken, speed) = take(fast);
        assert!(!taken && speed < 0.5, "{speed}");
        assert!(take(still).0, "an outlier is forgotten");
        assert!(!take(fast).0);
        let (taken, speed) = take(fast);
        assert!(taken && (speed - 9.0).abs() < 1.0, "{speed}");
    }

    #[test]
    fn the_motion_turns_about_the_middle() {
        let filter = track(10.0, 0.0, 1, |_| [0.0, 0.5, 0.0, 1.0, 0.0, 3.0])[0];
        let center = filter.center_world();
        let moved = filter.motion(INTERVAL_S).transform_point(center);
        assert!((moved - center - filter.velocity() * INTERVAL_S).norm() < 1e-12);
    }

    #[test]
    fn nonsense_is_refused_and_changes_nothing() {
        let config = MotionConfig::default();
        let mut filter = MotionFilter::default();
        filter.predict(&config, INTERVAL_S);
        let before = filter;
        let bad = [Observation {
            static_prediction: Point3::new(f64::NAN, 0.0, 10.0),
            left: [0.0; 2],
            right: [0.0; 2],
        }; 4];
        assert!(!filter.update(
            &config,
            &RIG,
            &Transform::IDENTITY,
            INTERVAL_S,
            0.3,
            bad.iter().copied()
        ));
        assert_eq!(filter, before);
    }
}
