//! Networks that end with objects: boxes with scores, labels and perhaps masks, doubles left out
//! (RTMDet-Ins and its kin).

use super::PicturePart;
use super::layout::EndToEndFormat;
use super::model::Output;
use super::semantic::Map;
use crate::input::masks::boxes::{DetectedBox, Detections};
use crate::input::source::InstanceMask;

/// Adds the objects above the least score. Masks are of the input's size or a part of it, with
/// shares of 0 to 1 or logits.
pub fn decode(
    outputs: &[Output],
    format: &EndToEndFormat,
    part: &PicturePart<'_>,
    found: &mut Detections,
) {
    let (boxes, labels) = (&outputs[format.boxes], &outputs[format.labels]);
    for (index, (row, label)) in
        boxes.values.as_chunks::<5>().0.iter().zip(&labels.values).enumerate()
    {
        let [left, top, right, bottom, score] = *row;
        let Some(class) = part
            .classes
            .get(*label as usize)
            .copied()
            .flatten()
            .filter(|_| score >= part.settings.score_min)
        else {
            continue;
        };
        let edges = part.edges([left, top, right, bottom].map(f64::from));
        if edges.iter().any(|edge| !edge.is_finite()) {
            continue;
        }
        let one = DetectedBox { class, score: score.min(1.0), edges };
        let Some(masks) = format.masks.map(|at| &outputs[at]) else {
            found.boxes.push(one);
            continue;
        };
        let (width, height) = (masks.shape[3], masks.shape[2]);
        let values = masks
            .values
            .get(index * width * height..(index + 1) * width * height)
            .unwrap_or_default();
        // Logits are below 0 outside, shares never are.
        let least = if values.iter().any(|value| *value < 0.0) { 0.0 } else { 0.5 };
        let map = Map { values, width, height };
        let holds = |u: i32, v: i32| {
            let [x, y] = part.fit.input_point([f64::from(u) + 0.5, f64::from(v) + 0.5]);
            let [x, y] =
                [x * width as f64 / part.input.0 as f64, y * height as f64 / part.input.1 as f64];
            map.at(1, x, y).any(|value| value > least)
        };
        let pixels = one.pixels(0.0, part.picture);
        if found.masks.reserve(pixels.area() as usize) {
            found.masks.push(InstanceMask::from_predicate(class, one.score, pixels, holds));
        }
    }
}
