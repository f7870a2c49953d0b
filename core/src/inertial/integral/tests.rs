//! Turns with a closed answer.

use super::*;
use std::vec::Vec;

fn reading(at_s: f64, turn_rate: [f64; 3]) -> Reading {
    Reading { at_s, turn_rate: turn_rate.into(), force: Vector3::new(0.0, 0.0, 9.81) }
}

fn turned(readings: &[Reading], span_s: f64) -> Option<Vector3<f64>> {
    let integral = integrate(readings.iter().copied(), span_s, &Vector3::zeros())?;
    Some(integral.t_start_end.rotation_vector().into())
}

#[test]
fn a_turn_that_speeds_up_is_exact_at_irregular_times() {
    // 2 t rad/s about one axis: t² rad.
    let times = [-0.02, 0.013, 0.02, 0.071, 0.09, 0.13];
    let readings: Vec<_> = times.map(|t| reading(t, [0.0, 2.0 * t, 0.0])).into();
    let turn = turned(&readings, 0.1).unwrap();
    assert!((turn - Vector3::new(0.0, 0.01, 0.0)).norm() < 1e-12, "{turn}");
}

#[test]
fn turns_about_two_axes_follow_each_other_in_order_of_time() {
    // A quarter turn about x, then one about the new y: the third axis ends where x was.
    let quarter = core::f64::consts::FRAC_PI_2 / 0.1;
    let rates = [[quarter, 0.0, 0.0], [0.0, quarter, 0.0]];
    let readings: Vec<_> = (0..=2_000)
        .map(|at| reading(f64::from(at) * 1e-4 + 5e-5, rates[usize::from(at >= 1_000)]))
        .collect();
    let integral = integrate(readings.into_iter(), 0.2, &Vector3::zeros()).unwrap();
    let [x, y, z]: [f64; 3] = integral.t_start_end.rotate([0.0, 0.0, 1.0]);
    assert!((x - 1.0).abs() < 1e-3 && y.abs() < 2e-3 && z.abs() < 2e-3, "{x} {y} {z}");
}

#[test]
fn the_bias_is_taken_out() {
    let bias = Vector3::new(0.1, -0.05, 0.02);
    let readings = (0..12).map(|at| reading(f64::from(at) * 0.01, [0.1, -0.05, 0.52]));
    let integral = integrate(readings, 0.1, &bias).unwrap();
    let turn = Vector3::from(integral.t_start_end.rotation_vector());
    assert!((turn - Vector3::new(0.0, 0.0, 0.05)).norm() < 1e-12, "{turn}");
}

#[test]
fn a_quarter_of_a_second_is_bridged_and_counted_and_no_more() {
    let integral = |gap_s: f64| {
        let readings = [0.0, 0.01, 0.01 + gap_s, 0.4].map(|at| reading(at, [0.0, 0.0, 0.3]));
        integrate(readings.into_iter(), 0.3, &Vector3::zeros())
    };
    let bridged = integral(0.24).unwrap();
    assert_eq!(bridged.bridged, 2, "and the one to the reading after the interval");
    let [.., turned] = bridged.t_start_end.rotation_vector();
    assert!((turned - 0.09).abs() < 1e-12);
    assert!(bridged.unseen_rad > 0.008, "what happened in it is not known");
    assert!(integral(0.26).is_none());
}

#[test]
fn an_interval_that_is_not_covered_has_no_turn() {
    let some = |times: &[f64]| {
        let readings: Vec<_> = times.iter().map(|&t| reading(t, [0.2, 0.0, 0.0])).collect();
        turned(&readings, 0.3)
    };
    assert!(some(&[]).is_none());
    assert!(some(&[0.0, 0.02]).is_none(), "ends too early");
    assert!(some(&[0.28, 0.3]).is_none(), "begins too late");
    assert!(some(&[-0.2, -0.1]).is_none(), "lies before");
    assert!((some(&[0.1, 0.2]).unwrap().x - 0.06).abs() < 1e-12, "held at both ends");
}

#[test]
fn readings_out_of_order_are_skipped() {
    let mut readings: Vec<_> =
        (0..12).map(|at| reading(f64::from(at) * 0.01, [0.0, 0.5, 0.0])).collect();
    readings.insert(6, reading(0.02, [9.0; 3]));
    assert!((turned(&readings, 0.1).unwrap().y - 0.05).abs() < 1e-12);
}

#[test]
fn forces_are_averaged_in_the_axes_of_the_start() {
    // A unit that turns over while what holds it stays upright.
    let rate = 8.0;
    let readings = (0..=100).map(|at| {
        let at_s = f64::from(at) * 0.001;
        let held = Transform::new([rate * at_s, 0.0, 0.0], [0.0; 3]).inverse();
        Reading {
            at_s,
            turn_rate: Vector3::new(rate, 0.0, 0.0),
            force: held.rotate(Vector3::new(0.0, 0.0, 9.81)),
        }
    });
    let integral = integrate(readings, 0.1, &Vector3::zeros()).unwrap();
    let off = integral.mean_force - Vector3::new(0.0, 0.0, 9.81);
    assert!(off.norm() < 1e-3, "{off}");
}
