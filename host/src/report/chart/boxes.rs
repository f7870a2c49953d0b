//! Box plots and curves over a few values of a setting.

use super::plot::{LEFT, Plot, RIGHT, WIDTH, legend, polyline, px, x_label};
use maud::{Markup, html};

/// Widest box, px.
const WIDEST: f64 = 26.0;

/// A line over the values.
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// True if the line is dashed.
    pub dashed: bool,
    /// A number for each value; none where it is unknown.
    pub numbers: Vec<Option<f64>>,
}

/// Boxes over the values: ends of the whiskers, quartiles, median.
pub struct Boxes<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// Five ascending numbers for each value; none where they are unknown.
    pub boxes: Vec<Option<[f64; 5]>>,
}

/// Draws boxes side by side and curves over them, a place for each label; nothing where there is no
/// number.
pub fn boxes_and_curves(
    title: &str,
    labels: &[String],
    boxes: &[Boxes<'_>],
    curves: &[Curve<'_>],
) -> Markup {
    let of_boxes = boxes.iter().flat_map(|one| one.boxes.iter().flatten().flatten().copied());
    let all = of_boxes.chain(curves.iter().flat_map(|one| one.numbers.iter().flatten().copied()));
    // One scale for all: boxes and curves are read against each other.
    let (low, high) =
        all.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    if low > high || labels.is_empty() {
        return html! {};
    }
    let plot = Plot::around(low, high);
    // Each label has a slot, in which its boxes stand side by side.
    let slot = (WIDTH - LEFT - RIGHT) / labels.len() as f64;
    let x = |at: usize| LEFT + slot * (at as f64 + 0.5);
    let width = (slot / (boxes.len() as f64 + 1.0)).min(WIDEST);
    let offset = |nth: usize| (nth as f64 - (boxes.len() as f64 - 1.0) / 2.0) * width * 1.15;
    let drawn = html! {
        @for (at, label) in labels.iter().enumerate() { (x_label(x(at), "middle", label)) }
        @for (nth, one) in boxes.iter().enumerate() {
            @for (at, numbers) in one.boxes.iter().enumerate() {
                @if let Some(numbers) = numbers { (draw_box(&plot, x(at) + offset(nth), width, one.colour, numbers)) }
            }
        }
        @for one in curves { (draw_curve(&plot, one, x)) }
    };
    let names = boxes
        .iter()
        .map(|one| (one.name, one.colour))
        .chain(curves.iter().map(|one| (one.name, one.colour)));
    html! { div.figure { (plot.svg(title, &drawn)) (legend(names)) } }
}

fn draw_box(
    plot: &Plot,
    centre: f64,
    width: f64,
    colour: &str,
    &[first, low, middle, high, last]: &[f64; 5],
) -> Markup {
    let y = |value: f64| px(plot.y(value));
    let left = px(centre - width / 2.0);
    let centre = px(centre);
    // From the least to the greatest value a line, a box for the middle half, a thick line for the
    // median.
    html! {
        path d={ "M" (centre) " " (y(first)) "V" (y(low)) "M" (centre) " " (y(high)) "V" (y(last)) } stroke=(colour) fill="none" {}
        rect x=(left) y=(y(high)) width=(px(width)) height=(px((plot.y(low) - plot.y(high)).max(0.5)))
            fill=(colour) fill-opacity="0.25" stroke=(colour) {}
        path d={ "M" (left) " " (y(middle)) "h" (px(width)) } stroke=(colour) stroke-width="2.4" {}
    }
}

/// A curve with a mark at each number, interrupted where one is unknown.
fn draw_curve(plot: &Plot, curve: &Curve<'_>, x: impl Fn(usize) -> f64) -> Markup {
    let marks: Vec<(usize, f64)> = curve
        .numbers
        .iter()
        .enumerate()
        .filter_map(|(at, number)| Some((at, (*number)?)))
        .collect();
    // Neighbouring positions are joined; a gap begins a new line.
    let stretches = marks.chunk_by(|a, b| a.0 + 1 == b.0);
    let path: String = stretches
        .map(|marks| polyline(marks.iter().map(|&(at, number)| (x(at), plot.y(number)))))
        .collect();
    html! {
        path d=(path) fill="none" stroke=(curve.colour) stroke-width="1.8" stroke-dasharray=[curve.dashed.then_some("5 4")] {}
        @for &(at, number) in &marks { circle cx=(px(x(at))) cy=(px(plot.y(number))) r="3.2" fill=(curve.colour) {} }
    }
}
