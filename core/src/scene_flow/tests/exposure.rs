//! Matches of images that differ in brightness.

use super::*;

fn darkened(pixels: &[u8], share: f64) -> Vec<u8> {
    pixels.iter().map(|&level| (f64::from(level) * share).round() as u8).collect()
}

/// Matches of a second image at a share of the first one's light, or the other way round.
fn refined(shares: [f64; 2]) -> u32 {
    let pairs = [see(&Transform::IDENTITY), see(&forward(0.4, 0.01))];
    let mut slab = slab();
    let mut matcher = FlowMatcher::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    let mut report = Default::default();
    for (pair, share) in pairs.iter().zip(shares) {
        let [left, right] = [0, 1].map(|side| darkened(&pair[side], share));
        report = matcher.push(&SceneFlowConfig::default(), view(&left), view(&right), &Serial);
    }
    report.refined
}

#[test]
fn light_that_drops_to_a_third_or_comes_back_keeps_most_matches() {
    let even = refined([1.0, 1.0]);
    for shares in [[1.0, 0.35], [0.35, 1.0], [1.0, 0.5]] {
        let found = refined(shares);
        assert!(2 * found > even, "{found} of {even} matches at {shares:?}");
    }
}

#[test]
fn a_frame_after_a_dark_one_is_much_richer() {
    let pair = see(&Transform::IDENTITY);
    let mut slab = slab();
    let mut matcher = FlowMatcher::new_in(&CAPACITY, &mut Carver::new(&mut slab.0, BYTES).unwrap());
    for share in [0.02, 1.0] {
        let [left, right] = [0, 1].map(|side| darkened(&pair[side], share));
        matcher.push(&SceneFlowConfig::default(), view(&left), view(&right), &Serial);
    }
    assert!(matcher.is_much_richer());
    matcher.push(&SceneFlowConfig::default(), view(&pair[0]), view(&pair[1]), &Serial);
    assert!(!matcher.is_much_richer());
}
