//! Charts as inline SVG. Text and grid take their colours from the page's style.

mod boxes;
mod lanes;
mod lines;
mod path;
mod plot;
#[cfg(test)]
mod tests;

pub use boxes::{Boxes, Curve, boxes_and_curves};
pub use lanes::{Bar, Lane, lanes};
pub use lines::{Series, lines, stacked};
pub use path::{Path, from_above};

/// Colours of series, in order: distinct in print and for people with colour vision deficiencies.
pub const COLOURS: [&str; 6] = ["#4269d0", "#efb118", "#ff725c", "#3aa99f", "#9b6bd6", "#8a8f98"];
