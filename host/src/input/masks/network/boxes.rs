//! Boxes of a detector with three grids: YOLOX, YOLOv5, YOLOv8 and their kin.

use super::PicturePart;
use super::layout::{BoxFormat, STRIDES};
use super::model::Output;
use crate::input::masks::boxes::DetectedBox;
use dynvox_core::tracking::Class;

/// One row of boxes.
pub struct BoxRow<'o> {
    values: &'o [f32],
    format: BoxFormat,
    index: usize,
}

impl BoxRow<'_> {
    /// An attribute of the box.
    pub fn value(&self, attribute: usize) -> f32 {
        let attributes = self.values.len() / self.format.count;
        let at = if self.format.transposed {
            attribute * self.format.count + self.index
        } else {
            self.index * attributes + attribute
        };
        self.values.get(at).copied().unwrap_or(0.0)
    }

    /// The best class and its score, of those kept.
    fn best(&self, classes: &[Option<Class>]) -> Option<(Class, f32)> {
        let first = 4 + usize::from(self.format.objectness);
        let objectness = if self.format.objectness { self.value(4) } else { 1.0 };
        let scores = (0..self.format.classes).map(|class| (class, self.value(first + class)));
        let (class, score) = scores.reduce(|best, one| if one.1 > best.1 { one } else { best })?;
        classes.get(class).copied().flatten().map(|class| (class, objectness * score))
    }

    /// Left, top, right and bottom edge in the input, px.
    fn edges(&self, size: (usize, usize)) -> [f64; 4] {
        let [mut x, mut y, mut w, mut h] = [0, 1, 2, 3].map(|at| f64::from(self.value(at)));
        if self.format.in_grid {
            let (column, row, stride) = cell(self.index, size);
            [x, y] = [(x + column as f64) * stride, (y + row as f64) * stride];
            [w, h] = [w.exp() * stride, h.exp() * stride];
        }
        [x - w / 2.0, y - h / 2.0, x + w / 2.0, y + h / 2.0]
    }
}

/// Column, row and stride of a cell, counted through the grids.
fn cell(mut index: usize, (width, height): (usize, usize)) -> (usize, usize, f64) {
    for stride in STRIDES {
        let (columns, rows) = (width / stride, height / stride);
        if index < columns * rows {
            return (index % columns, index / columns, stride as f64);
        }
        index -= columns * rows;
    }
    (0, 0, 0.0)
}

/// The rows above the least score, with their boxes in the picture.
pub fn rows<'o>(
    output: &'o Output,
    format: &'o BoxFormat,
    part: &'o PicturePart<'_>,
) -> impl Iterator<Item = (BoxRow<'o>, DetectedBox)> + 'o {
    let row = move |index| BoxRow { values: &output.values, format: *format, index };
    (0..format.count).map(row).filter_map(move |row| {
        let (class, score) =
            row.best(part.classes).filter(|(_, score)| *score >= part.settings.score_min)?;
        let edges = part.edges(row.edges(part.input));
        // A width that overflows is no box.
        edges.iter().all(|edge| edge.is_finite()).then_some(())?;
        Some((row, DetectedBox { class, score: score.min(1.0), edges }))
    })
}
