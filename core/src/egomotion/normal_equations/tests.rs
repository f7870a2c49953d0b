//! The sums against finite differences, and their solution against what it must fulfil.

use super::*;
use crate::random::Random;

const RIG: StereoRig =
    StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 };

fn motion() -> Transform {
    Transform::new([0.02, -0.05, 0.03], [0.2, -0.1, 0.7])
}

fn points() -> [Point; 3] {
    let point =
        |xyz: [f64; 3], right_v: f64| Point { xyz, left: [30.0, -12.0], right: [-25.0, right_v] };
    [point([1.0, -0.7, 6.0], -11.0), point([-3.0, 1.2, 9.0], -15.5), point([0.4, 0.9, 4.0], 3.0)]
}

/// Errors of a point after the motion is shifted by a step.
fn residual_after(point: &Point, step: [f64; N]) -> [f64; 4] {
    let carried = motion().retract(step).transform_point(point.xyz);
    let StereoObservation { u_left_px, v_px, u_right_px } = RIG.project(carried).unwrap();
    let [[left_u, left_v], [right_u, right_v]] = [point.left, point.right];
    [u_left_px - left_u, u_right_px - right_u, v_px - left_v, v_px - right_v]
}

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-4 * (1.0 + expected.abs())
}

#[test]
fn the_sums_of_points_are_those_of_their_errors_derivatives() {
    const STEP: f64 = 1e-5;
    let (mut sums, mut expected) = (NormalEquations::ZERO, NormalEquations::ZERO);
    for point in points() {
        sums.add(&point, &RotationMatrix::new(&motion()), &RIG, |squared| 1.0 / (1.0 + squared));
        let errors = residual_after(&point, [0.0; N]);
        // Central differences in each of the motion's six parameters.
        let derivative: [[f64; 4]; N] = core::array::from_fn(|by| {
            let shifted = |sign: f64| {
                residual_after(
                    &point,
                    core::array::from_fn(|at| if at == by { sign * STEP } else { 0.0 }),
                )
            };
            let (high, low) = (shifted(1.0), shifted(-1.0));
            core::array::from_fn(|row| (high[row] - low[row]) / (2.0 * STEP))
        });
        let squared: f64 = errors.iter().map(|error| error * error).sum();
        // Cauchy's weight, as the closure above gives it.
        let weight = 1.0 / (1.0 + squared);
        for i in 0..N {
            let product = |other: &[f64; 4]| -> f64 {
                (0..4).map(|row| derivative[i][row] * other[row]).sum()
            };
            expected.vector[i] += weight * product(&errors);
            // The lower triangle alone, as the sums have it.
            (0..=i).for_each(|j| expected.matrix[i][j] += weight * product(&derivative[j]));
        }
        expected.error += weight * squared;
        expected.weight += weight;
    }
    for i in 0..N {
        assert!(
            close(sums.vector[i], expected.vector[i]),
            "{i}: {} {}",
            sums.vector[i],
            expected.vector[i]
        );
        for j in 0..N {
            let (found, expected) = (sums.matrix[i][j], expected.matrix[i][j]);
            assert!(close(found, expected), "{i} {j}: {found} {expected}");
        }
    }
    assert!(close(sums.error, expected.error) && close(sums.weight, expected.weight));
}

#[test]
fn a_point_behind_the_camera_adds_nothing() {
    let mut sums = NormalEquations::ZERO;
    sums.add(
        &Point { xyz: [0.0, 0.0, -5.0], ..points()[0] },
        &RotationMatrix::new(&motion()),
        &RIG,
        |_| 1.0,
    );
    assert_eq!(
        (sums.matrix, sums.vector, sums.error, sums.weight),
        ([[0.0; N]; N], [0.0; N], 0.0, 0.0)
    );
}

#[test]
fn the_sums_of_a_row_are_its_products() {
    let mut sums = NormalEquations::ZERO;
    // Products of two of these are all different.
    let row = [1.0, 2.0, 3.0, 5.0, 7.0, 11.0];
    sums.add_row([0.5; N], 4.0, 2.0);
    sums.add_row(row, -3.0, 0.5);
    // -3 times 0.5 is -1.5.
    for i in 0..N {
        assert_eq!(sums.vector[i], 4.0 - 1.5 * row[i]);
        for j in 0..N {
            assert_eq!(
                sums.matrix[i][j],
                if j <= i { 0.5 + 0.5 * row[i] * row[j] } else { 0.0 },
                "{i} {j}"
            );
        }
    }
    assert_eq!((sums.error, sums.weight), (2.0 * 16.0 + 0.5 * 9.0, 2.5));
}

/// Sums of random rows, as many as asked for.
fn random_rows(count: usize, random: &mut Random) -> NormalEquations {
    let mut sums = NormalEquations::ZERO;
    let mut any = || f64::from(random.next_u32()) / f64::from(1u32 << 31) - 1.0;
    for _ in 0..count {
        sums.add_row(core::array::from_fn(|_| any()), any(), 1.5 + any());
    }
    sums
}

#[test]
fn a_solution_times_the_matrix_is_the_right_side() {
    let mut random = Random::new(8);
    for _ in 0..200 {
        let sums = random_rows(12, &mut random);
        let step = sums.solve().unwrap();
        for i in 0..N {
            let entry = |j: usize| if j <= i { sums.matrix[i][j] } else { sums.matrix[j][i] };
            let product: f64 = (0..N).map(|j| entry(j) * step[j]).sum();
            assert!((product + sums.vector[i]).abs() < 1e-9, "{i}: {product} {}", sums.vector[i]);
        }
    }
}

#[test]
fn too_few_rows_and_what_is_not_finite_have_no_solution() {
    let mut random = Random::new(9);
    for count in 0..N {
        assert_eq!(random_rows(count, &mut random).solve(), None, "{count} rows");
        assert_eq!(random_rows(count, &mut random).min_eigen_share(), 0.0);
    }
    assert!(random_rows(N, &mut random).solve().is_some());
    for value in [f64::NAN, f64::INFINITY, f64::MAX] {
        let mut sums = random_rows(12, &mut random);
        sums.add_row([value; N], 1.0, 1.0);
        assert_eq!(sums.solve(), None, "{value}");
    }
    // A right side that overflows.
    let mut sums = NormalEquations::ZERO;
    (0..N).for_each(|at| sums.matrix[at][at] = 1e-200);
    sums.vector = [1e200; N];
    assert_eq!(sums.solve(), None);
}

#[test]
fn a_pivot_decides_by_its_share_of_the_diagonal() {
    // Two rows that differ by a little in the last unknown: the last pivot is the square of that,
    // times the diagonal over two.
    let sums = |little: f64| {
        let mut sums = NormalEquations::ZERO;
        (0..N).for_each(|at| {
            sums.add_row(core::array::from_fn(|other| f64::from(u8::from(at == other))), 1.0, 1.0)
        });
        (sums.matrix[N - 1][N - 2], sums.matrix[N - 1][N - 1]) = (1.0, 1.0 + little);
        sums
    };
    assert!(sums(4e-12).solve().is_some());
    assert_eq!(sums(0.25e-12).solve(), None);
}

#[test]
fn how_well_a_translation_is_held_is_told_by_its_covariance() {
    let unit = |axis: usize| core::array::from_fn(|at| if at == axis { 1.0 } else { 0.0 });
    let with = |weights: [f64; 3]| {
        let mut sums = NormalEquations::ZERO;
        (0..3).for_each(|axis| sums.add_row(unit(axis), 0.0, 1.0));
        (3..N).zip(weights).for_each(|(axis, weight)| sums.add_row(unit(axis), 0.0, weight));
        sums.min_eigen_share()
    };
    // Variances 1, 1/2 and 1/4 beside rows of weight 3 + 7.
    assert!((with([1.0, 2.0, 4.0]) - 1.0 / (1.75 * 10.0)).abs() < 1e-12);
    assert!((with([4.0, 1.0, 2.0]) - 1.0 / (1.75 * 10.0)).abs() < 1e-12);
    assert_eq!(with([1.0, 0.0, 4.0]), 0.0, "a direction that nothing holds");
    let mut sums = NormalEquations::ZERO;
    (0..N).for_each(|axis| sums.matrix[axis][axis] = 1.0);
    assert_eq!(sums.min_eigen_share(), 0.0, "no row weighs anything");
}

#[test]
fn a_rotation_matrix_carries_points_as_the_motion_does() {
    let matrix = RotationMatrix::new(&motion());
    for point in points() {
        let (found, expected) = (matrix.transform(point.xyz), motion().transform_point(point.xyz));
        assert!(
            (0..3).all(|axis| (found[axis] - expected[axis]).abs() < 1e-12),
            "{found:?} {expected:?}"
        );
    }
}
