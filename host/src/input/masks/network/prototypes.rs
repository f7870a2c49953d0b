//! Boxes with coefficients of mask prototypes: a mask is where the prototypes' weighted sum is
//! above 0, within its box (YOLACT, YOLO-seg).

use super::boxes::{self, BoxRow};
use super::layout::PrototypeFormat;
use super::model::Output;
use super::semantic::Map;
use super::{PicturePart, without_doubles};
use crate::input::masks::boxes::DetectedBox;
use crate::input::source::{FrameMasks, InstanceMask};

/// Adds the masks of the boxes above the least score, doubles left out.
pub fn decode(
    outputs: &[Output],
    format: &PrototypeFormat,
    part: &PicturePart<'_>,
    masks: &mut FrameMasks,
) {
    let (all, prototypes) = (&outputs[format.boxes.output], &outputs[format.output]);
    let rows: Vec<(BoxRow<'_>, DetectedBox)> = boxes::rows(all, &format.boxes, part).collect();
    let map = Map {
        values: &prototypes.values,
        width: prototypes.shape[3],
        height: prototypes.shape[2],
    };
    for one in without_doubles(rows.iter().map(|(_, one)| *one).collect()) {
        let Some((row, _)) = rows.iter().find(|(_, other)| *other == one) else { continue };
        let first = 4 + format.boxes.classes;
        let weights: Vec<f32> = (0..format.prototypes).map(|at| row.value(first + at)).collect();
        let holds = |u: i32, v: i32| {
            let [x, y] = part.fit.input_point([f64::from(u) + 0.5, f64::from(v) + 0.5]);
            let [x, y] = [
                x * map.width as f64 / part.input.0 as f64,
                y * map.height as f64 / part.input.1 as f64,
            ];
            map.at(weights.len(), x, y)
                .zip(&weights)
                .map(|(value, weight)| value * weight)
                .sum::<f32>()
                > 0.0
        };
        let pixels = one.pixels(0.0, part.picture);
        if masks.reserve(pixels.area() as usize) {
            masks.push(InstanceMask::from_predicate(one.class, one.score, pixels, holds));
        }
    }
}
