//! Normal equations of a frame's reprojection errors.

use super::Observation;
use crate::geometry::{StereoObservation, StereoRig, Transform};
use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};

/// Mean of a matrix and its transpose.
pub(super) fn symmetric(matrix: &Matrix6<f64>) -> Matrix6<f64> {
    (matrix + matrix.transpose()) * 0.5
}

/// Point of view from which reprojection errors are linearised.
pub(super) struct Linearization<'a> {
    pub rig: &'a StereoRig,
    /// Centre of the object in camera axes, m.
    pub center: Vector3<f64>,
    /// Rotation from camera to world axes.
    pub world_camera: Rotation3<f64>,
    pub interval_s: f64,
}

impl Linearization<'_> {
    /// J'J and J'r of the reprojection errors at a rate, by rates in world axes.
    pub fn equations(
        &self,
        observations: impl Iterator<Item = Observation>,
        rate: &Vector6<f64>,
    ) -> (Matrix6<f64>, Vector6<f64>) {
        let &Self { rig, center, world_camera, interval_s } = self;
        // The motion of a frame at that rate, in camera axes.
        let turn = world_camera.inverse() * Vector3::new(rate.x, rate.y, rate.z) * interval_s;
        let shift = world_camera.inverse() * Vector3::new(rate.w, rate.a, rate.b) * interval_s;
        let turned = Transform::new(turn, Vector3::zeros()).quaternion().to_rotation_matrix();
        let mut equations = NormalEquations { matrix: [[0.0; 6]; 6], vector: [0.0; 6] };
        for observation in observations {
            let arm = turned * (observation.static_prediction.coords - center);
            equations.add(rig, &arm, &(center + arm + shift), &observation);
        }
        self.in_world(&equations)
    }

    /// Equations in camera axes, by rates in world axes.
    fn in_world(&self, equations: &NormalEquations) -> (Matrix6<f64>, Vector6<f64>) {
        let (axes, interval_s) = (self.world_camera.matrix(), self.interval_s);
        let mut turn = Matrix6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(axes);
        turn.fixed_view_mut::<3, 3>(3, 3).copy_from(axes);
        let matrix =
            turn * Matrix6::from(equations.matrix) * turn.transpose() * (interval_s * interval_s);
        (symmetric(&matrix), turn * Vector6::from(equations.vector) * interval_s)
    }
}

/// J'J and J'r of the reprojection errors, by a small rotation and translation in camera axes.
struct NormalEquations {
    matrix: [[f64; 6]; 6],
    vector: [f64; 6],
}

impl NormalEquations {
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
}
