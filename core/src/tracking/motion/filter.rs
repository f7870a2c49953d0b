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

mod normal_equations;
mod observation;

use super::MotionConfig;
use crate::geometry::{StereoRig, Transform};
use crate::state::Visitor;
use bytemuck::{Pod, Zeroable};
use nalgebra::{Cholesky, Matrix3, Matrix6, Point3, Vector3, Vector6};
use normal_equations::{Linearization, symmetric};
pub(crate) use observation::Observation;

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

/// Camera, time and error of a frame's observations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilterView<'a> {
    pub rig: &'a StereoRig,
    /// Camera to world.
    pub t_world_camera: &'a Transform,
    /// Time since the frame before, s.
    pub interval_s: f64,
    /// Error of one coordinate, one sigma, px.
    pub noise_px: f64,
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

    /// Updates by a frame's observations, after [`MotionFilter::predict`]. Afterwards
    /// `center_world` is where the centre was before the frame's motion. `false`, and the rates
    /// unchanged, when the observations cannot be used or contradict the prediction: if the next
    /// frame contradicts it as well, the filter starts anew from that one.
    pub fn update(
        &mut self,
        config: &MotionConfig,
        view: &FilterView<'_>,
        observations: impl Iterator<Item = Observation> + Clone,
    ) -> bool {
        if self.contradictions == 0 || self.frames == 0 {
            return self.correct(view, observations);
        }
        let mut corrected = Self { contradictions: 0, ..*self };
        let mut restarted = Self { contradictions: 0, frames: 0, ..*self };
        restarted.predict(config, view.interval_s);
        let fits = corrected.correct(view, observations.clone());
        let updated = fits || restarted.correct(view, observations);
        if updated {
            *self = if fits { corrected } else { restarted };
        }
        updated
    }

    /// Updates like [`MotionFilter::update`], without a contradiction in the frame before.
    fn correct(
        &mut self,
        view: &FilterView<'_>,
        observations: impl Iterator<Item = Observation> + Clone,
    ) -> bool {
        let &FilterView { rig, t_world_camera, interval_s, noise_px } = view;
        // The centre, about which the object rotates, and the prediction's weight.
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
        let linearization = Linearization { rig, center, world_camera, interval_s };
        let predicted = Vector6::from(self.rate);
        let mut rate = predicted;
        for step in 0..=STEPS {
            let (matrix, vector) = linearization.equations(observations.clone(), &rate);
            let Some(factor) = Cholesky::new(information + matrix * weight) else { return false };
            // At the last one only the covariance is new.
            if step == STEPS {
                let covariance = factor.inverse();
                if !(rate.iter().chain(covariance.iter()).all(|x| x.is_finite())) {
                    return false;
                }
                let change = rate - predicted;
                if self.frames > 0 && change.dot(&(information * change)) > CONTRADICTION {
                    self.contradictions = self.contradictions.saturating_add(1);
                    return false;
                }
                self.covariance = symmetric(&covariance).into();
                break;
            }
            rate -= factor.solve(&(vector * weight + information * (rate - predicted)));
        }
        self.rate = rate.into();
        self.center_world = t_world_camera.transform_point(center.into());
        self.frames = self.frames.saturating_add(1);
        true
    }
}

#[cfg(test)]
mod tests;
