//! Turns that lead features out of the search, unless a prediction centres it.

use super::*;

/// Camera to world before and after: a turn by 12 degrees to the right, 3 up and 4 about the axis,
/// and a step ahead.
fn poses() -> [Transform; 2] {
    let before = Transform::new(Vector3::new(0.0, -0.1, 0.0), Vector3::zeros());
    let turn = Transform::new(Vector3::new(0.052, 0.21, 0.07), Vector3::new(0.05, 0.0, 0.3));
    [before, before * turn]
}

/// Matches of the turn with a search by 30 px, with the turn expected or not.
fn matches(expected: Option<&Transform>) -> Vec<Match> {
    let config = SceneFlowConfig { search_radius_px: 30, ..SceneFlowConfig::default() };
    let mut slab = slab();
    let mut carver = Carver::new(&mut slab.0, BYTES).unwrap();
    let mut matcher = FlowMatcher::new_in(&CAPACITY, &mut carver);
    for pose in poses() {
        let [left, right] = see(&pose);
        matcher.expect_turn(&RIG, expected);
        matcher.push(&config, view(&left), view(&right), &Serial);
    }
    matcher.refined().to_vec()
}

/// Matches among them that are off by less than a pixel of the scene's own flow.
fn right(matches: &[Match]) -> usize {
    let [before, now] = poses();
    let t_now_before = now.inverse() * before;
    let is_right = |m: &&Match| {
        let seen = RIG.observation(m.previous_left, m.previous_right);
        let point = t_now_before.transform_point(RIG.triangulate(&seen).unwrap());
        let (expected, found) =
            (RIG.project(point).unwrap(), RIG.observation(m.current_left, m.current_right));
        (expected.u_left_px - found.u_left_px).abs() < 1.0
            && (expected.v_px - found.v_px).abs() < 1.0
    };
    matches.iter().filter(is_right).count()
}

#[test]
fn a_turn_beyond_the_search_is_found_where_it_is_expected() {
    let [before, now] = poses();
    let turn = before.inverse() * now;
    let (without, with) = (matches(None), matches(Some(&turn)));
    let (right_without, right_with) = (right(&without), right(&with));
    assert!(right_without < 10, "{right_without} of {}", without.len());
    assert!(right_with > 100 && 10 * right_with > 9 * with.len(), "{right_with} of {}", with.len());
    // A unit that is 2 degrees off still leads near enough.
    let off = turn * Transform::new(Vector3::new(0.0, 0.035, 0.0), Vector3::zeros());
    let off = matches(Some(&off));
    assert!(10 * right(&off) > 8 * right_with, "{} of {right_with}", right(&off));
}

#[test]
fn flow_of_a_turn_is_that_of_points_far_away() {
    let turn = Transform::new(Vector3::new(0.1, -0.3, 0.2), Vector3::new(5.0, 0.0, 0.0));
    let flow = TurnFlow::new(&RIG, &turn);
    for at in [[0.0, 0.0], [198.3, 81.2], [399.0, 10.0], [50.0, 159.0]] {
        let ray = [
            (f64::from(at[0]) - RIG.center_u_px) / RIG.focal_px,
            (f64::from(at[1]) - RIG.center_v_px) / RIG.focal_px,
            1.0,
        ];
        let [x, y, z] = turn.inverse().rotate(ray);
        let expected = [
            x / z * RIG.focal_px + RIG.center_u_px - f64::from(at[0]),
            y / z * RIG.focal_px + RIG.center_v_px - f64::from(at[1]),
        ];
        for (found, expected) in flow.at(at).into_iter().zip(expected) {
            assert!((f64::from(found) - expected).abs() < 1e-2, "{at:?}: {found} {expected}");
        }
    }
    // No turn, no flow, to the bit; nor behind the camera or of broken numbers.
    assert_eq!(TurnFlow::default().at([17.0, 3.0]), [0.0; 2]);
    let round = Transform::new(Vector3::new(0.0, 3.0, 0.0), Vector3::zeros());
    assert_eq!(TurnFlow::new(&RIG, &round).at([200.0, 80.0]), [0.0; 2]);
    assert_eq!(TurnFlow::new(&RIG, &Transform::IDENTITY).at([f32::NAN; 2]), [0.0; 2]);
}
