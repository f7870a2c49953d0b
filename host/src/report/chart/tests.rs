use super::lines::{POINTS, thinned};
use super::plot::nice_step;
use super::*;

#[test]
fn steps_are_round_and_thinning_keeps_the_peak() {
    assert_eq!([0.03, 1.0, 1.2, 7.0, 230.0].map(nice_step), [0.05, 1.0, 2.0, 10.0, 500.0]);
    let mut values = vec![1.0; 20_000];
    values[12_345] = 9.0;
    let thin = thinned(&values);
    assert!(thin.len() <= POINTS && thin.iter().any(|point| point.1 == 9.0));
    assert!(thinned(&[f64::NAN]).is_empty());
}

#[test]
fn charts_of_nothing_and_of_one_point_are_drawn() {
    let series = |values: Vec<f64>| [Series { name: "a", colour: "red", values }];
    for values in [vec![], vec![0.0], vec![f64::NAN, 3.0]] {
        let frames: Vec<usize> = (0..values.len()).collect();
        assert!(
            lines(&frames, &series(values.clone()), "ms", 0.0).into_string().ends_with("</div>")
        );
        assert!(!stacked(&frames, &series(values), "ms").into_string().contains("NaN"));
    }
    let path = Path { name: "a", colour: "red", dashed: false, points: vec![(0.0, 0.0)] };
    assert!(!from_above(&[path]).into_string().contains("NaN"));
    assert!(from_above(&[]).into_string().is_empty());
}

#[test]
fn boxes_and_curves_leave_gaps_where_a_number_is_unknown() {
    let labels = ["a".to_owned(), "b".to_owned()];
    let boxes = [Boxes { name: "n", colour: "red", boxes: vec![None, Some([1.0; 5])] }];
    let drawn = boxes_and_curves("t", &labels, &boxes, &[]).into_string();
    assert!(drawn.matches("<rect").count() == 1 && !drawn.contains("NaN"));
    let gap = Curve { name: "n", colour: "red", dashed: true, numbers: vec![None, Some(0.5)] };
    let drawn = boxes_and_curves("t", &labels, &[], &[gap]).into_string();
    assert!(drawn.contains("stroke-dasharray") && drawn.matches("<circle").count() == 1);
    assert!(boxes_and_curves("t", &labels, &[], &[]).into_string().is_empty());
}

#[test]
fn names_are_escaped() {
    let series = [Series { name: "a<b>&\"", colour: "red", values: vec![1.0] }];
    let drawn = lines(&[0], &series, "<ms>", 0.0).into_string();
    assert!(
        drawn.contains("a&lt;b&gt;&amp;") && drawn.contains("&lt;ms&gt;") && !drawn.contains("<b>")
    );
}

#[test]
fn lanes_have_a_bar_for_each_stretch_and_text_only_where_it_fits() {
    let bar =
        |from, to| Bar { from, to, style: "dynamic", pale: false, text: Some("3 m/s".to_owned()) };
    let lane = Lane { name: "car 1".to_owned(), bars: vec![bar(0, 1), bar(10, 90)], truth: vec![] };
    let frames: Vec<usize> = (0..100).collect();
    let drawn = lanes(&frames, 100, &[lane], "tracks over frames", &["dynamic"]).into_string();
    assert_eq!((drawn.matches("<rect").count(), drawn.matches("3 m/s").count()), (2, 1));
}
