//! Poses of recordings from what was given and how their maps lie to one another: weighted least
//! squares.
//!
//! Each recording's map is rigid. Given poses are weak observations, registrations strong ones. A
//! recording without a registration stays where it was given. A map's drift stays in it, so a
//! registration at its end is as sure about its centre as the way between the two is short: without
//! that ([`with_drift`]) the drift of all maps of a chain adds up, and given poses count for
//! nothing.
//!
//! **Memory.** A matrix of 36 x 36 numbers for each two recordings.

use super::register::{Uncertainty, motion_about, step_about};
use dynvox_core::geometry::Transform;
use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};

const MAX_ITERATIONS: usize = 20;
/// Drift of a map, one standard deviation: of its length, as stereo odometry has it over 5 to 50 m.
const DRIFT_SHARE: f64 = 0.005;
/// And of its rotation, rad/m: 0.01 degrees.
const DRIFT_RAD_PER_M: f64 = 1.75e-4;
/// A step that changes no pose by more ends them, m and rad.
const STEP_MIN: f64 = 1e-10;

/// A recording.
#[derive(Clone, Debug)]
pub struct Node {
    /// Given pose of the map in the world.
    pub given: Transform,
    /// Uncertainty of the given pose.
    pub uncertainty: Uncertainty,
    /// The map's centre, in the map: what is not known about its rotation is about it.
    pub centre_m: [f64; 3],
}

/// Measured relative pose of two maps.
#[derive(Clone, Debug)]
pub struct Edge {
    /// First and second recording.
    pub nodes: [usize; 2],
    /// The first map in the second.
    pub t_b_a: Transform,
    /// Information about the centre, in the second map's axes.
    pub information: Matrix6<f64>,
    /// The centre, in the second map.
    pub centre_m: [f64; 3],
}

/// Adds to a registration's information the drift between maps whose centres are some way apart.
pub fn with_drift(information: &Matrix6<f64>, way_m: f64) -> Matrix6<f64> {
    let (turn, shift) = ((DRIFT_RAD_PER_M * way_m).powi(2), (DRIFT_SHARE * way_m).powi(2));
    let drift = Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift));
    information.try_inverse().and_then(|own| (own + drift).try_inverse()).unwrap_or(*information)
}

/// Drift that a path may have over some way, one standard deviation: systematic errors add up to
/// twice those of a single map.
pub fn drift_over(way_m: f64) -> Uncertainty {
    Uncertainty {
        position_m: 2.0 * DRIFT_SHARE * way_m,
        rotation_rad: 2.0 * DRIFT_RAD_PER_M * way_m,
    }
}

/// Solves for the maps' poses in the world, beginning at `start`.
pub fn solve(nodes: &[Node], edges: &[Edge], start: &[Transform]) -> Vec<Transform> {
    let mut poses = start.to_vec();
    for _ in 0..MAX_ITERATIONS {
        let mut matrix = DMatrix::zeros(6 * nodes.len(), 6 * nodes.len());
        let mut vector = DVector::zeros(6 * nodes.len());
        // Each map is held by its given pose, as surely as that is known.
        for (at, node) in nodes.iter().enumerate() {
            // Errors are taken about the map's centre, where turn and shift are independent.
            let centre_m = Vector3::from(poses[at].transform_point(node.centre_m));
            let to_centre = about(&centre_m);
            let information = to_centre.transpose() * information_of(&node.uncertainty);
            add(&mut matrix, at, at, &(information * to_centre));
            add_vector(
                &mut vector,
                at,
                &(information * step_about(&centre_m, &(node.given * poses[at].inverse()))),
            );
        }
        // An edge pulls both maps towards their registered relative pose.
        for edge in edges {
            let [a, b] = edge.nodes;
            let centre_m = Vector3::from(poses[b].transform_point(edge.centre_m));
            let to_centre = about(&centre_m);
            let wanted = poses[b] * edge.t_b_a;
            let weighted = to_centre.transpose() * turned(&edge.information, &poses[b]);
            let (own, shared) = (
                weighted * to_centre,
                weighted * step_about(&centre_m, &(wanted * poses[a].inverse())),
            );
            // Only the difference of both poses counts.
            [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)]
                .into_iter()
                .for_each(|(i, j, sign)| add(&mut matrix, i, j, &(sign * own)));
            add_vector(&mut vector, a, &shared);
            add_vector(&mut vector, b, &-shared);
        }
        // Without a solution the poses of the last step stay.
        let Some(solver) = matrix.cholesky() else { break };
        let step = solver.solve(&vector);
        for (at, pose) in poses.iter_mut().enumerate() {
            // The step is about the world's origin.
            let own = Vector6::from(step.fixed_rows::<6>(6 * at));
            *pose = (motion_about(&Vector3::zeros(), &own) * *pose).normalized();
        }
        // The largest entry: rotations in rad and shifts in m alike.
        if step.amax() < STEP_MIN {
            break;
        }
    }
    poses
}

fn add(matrix: &mut DMatrix<f64>, row: usize, column: usize, part: &Matrix6<f64>) {
    let mut view = matrix.fixed_view_mut::<6, 6>(6 * row, 6 * column);
    view += part;
}

fn add_vector(vector: &mut DVector<f64>, row: usize, part: &Vector6<f64>) {
    let mut view = vector.fixed_rows_mut::<6>(6 * row);
    view += part;
}

/// Takes a step about the world's origin to one about a centre: the translation is that of the
/// centre.
fn about(centre_m: &Vector3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::identity();
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&-centre_m.cross_matrix());
    matrix
}

/// Information of a pose about its own centre.
pub fn information_of(uncertainty: &Uncertainty) -> Matrix6<f64> {
    let (turn, shift) = (uncertainty.rotation_rad.powi(-2), uncertainty.position_m.powi(-2));
    Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift))
}

/// Information in the world's axes.
fn turned(information: &Matrix6<f64>, t_world_b: &Transform) -> Matrix6<f64> {
    let rotation = nalgebra::Matrix3::from(t_world_b.rotation_matrix()).transpose();
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    both * information * both.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNCERTAINTY: Uncertainty = Uncertainty { position_m: 0.3, rotation_rad: 0.02 };

    fn apart(a: &Transform, b: &Transform, at_m: [f64; 3]) -> f64 {
        (Vector3::from(a.transform_point(at_m)) - Vector3::from(b.transform_point(at_m))).norm()
    }

    #[test]
    fn registered_recordings_are_moved_and_one_without_overlap_stays() {
        // Three that overlap one after the other, and one far away.
        let truth = [
            Transform::new([0.0, 0.3, 0.0], [500.0, 1.0, -300.0]),
            Transform::new([0.0, 0.9, 0.1], [520.0, 1.0, -280.0]),
            Transform::new([0.1, -2.0, 0.0], [540.0, 0.0, -290.0]),
            Transform::from_translation([-900.0, 0.0, 10.0]),
        ];
        let centre_m = [3.0, 0.0, 14.0];
        // Errors about the middle of what a recording saw, as its uncertainty is given.
        let off = |pose: &Transform, at: f64| {
            let centre = Vector3::from(pose.transform_point(centre_m));
            motion_about(&centre, &Vector6::new(0.0, 0.017 * at, 0.0, 0.15, -0.05 * at, 0.1))
                * *pose
        };
        let given = [truth[0], off(&truth[1], 1.0), off(&truth[2], -1.0), off(&truth[3], 1.0)];
        // The first one is nearly certain: it holds the others.
        let uncertainty = |at: usize| UNCERTAINTY.times(if at == 0 { 1e-4 } else { 1.0 });
        let node = |(at, &given): (usize, &Transform)| Node {
            given,
            uncertainty: uncertainty(at),
            centre_m,
        };
        let nodes: Vec<Node> = given.iter().enumerate().map(node).collect();
        let edge = |a: usize, b: usize| Edge {
            nodes: [a, b],
            t_b_a: truth[b].inverse() * truth[a],
            information: Matrix6::identity() * 1e6,
            centre_m: [1.0, 2.0, 30.0],
        };
        let solved = solve(&nodes, &[edge(0, 1), edge(1, 2)], &given);
        for at in 0..3 {
            assert!(
                apart(&solved[at], &truth[at], centre_m) < 1e-3,
                "{at}: {}",
                apart(&solved[at], &truth[at], centre_m)
            );
            assert!((solved[at].inverse() * truth[at]).angle_rad() < 1e-4);
        }
        // Without an edge nothing moves it.
        assert!(apart(&solved[3], &given[3], centre_m) < 1e-9);
        // Bit for bit the same each time.
        assert_eq!(solved, solve(&nodes, &[edge(0, 1), edge(1, 2)], &given));
    }

    #[test]
    fn the_drift_of_a_chain_of_maps_does_not_add_up() {
        // Each map is 30 m long and 0.1 m too short, and every other one was given 0.2 m beside its
        // place.
        let truth: Vec<Transform> = (0..24)
            .map(|nth| Transform::from_translation([0.0, 0.0, 30.0 * f64::from(nth)]))
            .collect();
        let beside = |at: usize| {
            Transform::from_translation([if at.is_multiple_of(2) { 0.0 } else { 0.2 }, 0.0, 0.0])
        };
        let node = |(at, pose): (usize, &Transform)| Node {
            given: beside(at) * *pose,
            uncertainty: UNCERTAINTY,
            centre_m: [0.0, 0.0, 15.0],
        };
        let nodes: Vec<Node> = truth.iter().enumerate().map(node).collect();
        let given: Vec<Transform> = nodes.iter().map(|node| node.given).collect();
        let errors = |way_m: f64| -> Vec<f64> {
            let edge = |a: usize| Edge {
                nodes: [a, a - 1],
                t_b_a: Transform::from_translation([0.0, 0.0, 29.9]),
                information: with_drift(&(Matrix6::identity() * 1e6), way_m),
                centre_m: [0.0, 0.0, 30.0],
            };
            let solved = solve(&nodes, &(1..24).map(edge).collect::<Vec<_>>(), &given);
            solved
                .iter()
                .zip(&truth)
                .map(|(found, truth)| apart(found, truth, [0.0, 0.0, 15.0]))
                .collect()
        };
        let (rigid, drifting) = (errors(0.0), errors(20.0));
        let worst = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        assert!(
            worst(&rigid) > 1.0 && worst(&drifting) < 0.35,
            "{} m, {} m",
            worst(&rigid),
            worst(&drifting)
        );
    }

    #[test]
    fn of_two_registrations_that_contradict_the_surer_one_counts() {
        let node = |share: f64| Node {
            given: Transform::IDENTITY,
            uncertainty: UNCERTAINTY.times(share),
            centre_m: [0.0; 3],
        };
        let nodes = [1e-4, 1.0].map(node);
        let edge = |x: f64, sure: f64| Edge {
            nodes: [1, 0],
            t_b_a: Transform::from_translation([x, 0.0, 0.0]),
            information: Matrix6::identity() * sure,
            centre_m: [0.0; 3],
        };
        let start = nodes.each_ref().map(|node| node.given);
        // Nine parts of the first and one of the second.
        let solved = solve(&nodes, &[edge(0.1, 9e6), edge(0.2, 1e6)], &start);
        assert!((solved[1].translation_m[0] - 0.11).abs() < 1e-4, "{:?}", solved[1]);
    }
}
