//! Paths seen from above.

use super::lines::POINTS;
use super::plot::{legend, nice_step, polyline, px};
use maud::{Markup, html};

/// Width of a drawing that takes the whole page.
pub(super) const WHOLE: f64 = 1180.0;
/// Highest drawing.
const HIGHEST: f64 = 620.0;
/// Height of the scale bar's row.
const BAR: f64 = 34.0;

/// A path seen from above.
pub struct Path<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// True if the line is dashed.
    pub dashed: bool,
    /// Positions, m: x (right) and z (forward).
    pub points: Vec<(f64, f64)>,
}

/// Paths at one scale, with a scale bar. A path that leads forward is turned so that forward is to
/// the right.
pub fn from_above(paths: &[Path<'_>]) -> Markup {
    let all = || paths.iter().flat_map(|path| &path.points);
    let range = |of: fn(&(f64, f64)) -> f64| {
        all()
            .map(of)
            .fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)))
    };
    let ((x0, x1), (z0, z1)) = (range(|point| point.0), range(|point| point.1));
    if x0 > x1 {
        return html! {};
    }
    // The longer extent goes along the page.
    let turned = x1 - x0 < z1 - z0;
    let (along, across) = if turned { (z1 - z0, x1 - x0) } else { (x1 - x0, z1 - z0) };
    let margin = 0.06 * along.max(1.0);
    // One scale for both axes: a path is not distorted.
    let scale = ((WHOLE - 28.0) / (along + 2.0 * margin)).min(HIGHEST / (across + 2.0 * margin));
    let height = ((across + 2.0 * margin) * scale).max(90.0) + BAR;
    let middle = ((x0 + x1) / 2.0, (z0 + z1) / 2.0);
    let to_page = |&(x, z): &(f64, f64)| {
        let (right, up) =
            if turned { (z - middle.1, x - middle.0) } else { (x - middle.0, middle.1 - z) };
        (WHOLE / 2.0 + right * scale, (height - BAR) / 2.0 + up * scale)
    };
    // More points than the page has pixels would only make the file larger.
    let d = |points: &[(f64, f64)]| {
        let every = points.len().div_ceil(4 * POINTS).max(1);
        polyline(points.iter().step_by(every).chain(points.last()).map(to_page))
    };
    // A scale bar of about a tenth of the width, of a round length.
    let step = nice_step((along + 2.0 * margin) / 10.0);
    let (bar, base) = (px(step * scale), height - 18.0);
    html! {
        svg viewBox={ "0 0 " (WHOLE) " " (format!("{height:.0}")) } role="img" aria-label="trajectory from above" {
            path d={ "M14 " (px(base)) "h" (bar) "m0 -4v8m-" (bar) " -8v8" } stroke="currentColor" fill="none" {}
            text x=(px(22.0 + step * scale)) y=(px(base + 4.0)) {
                (step) " m" (if turned { ", forward to the right" } else { ", forward up" })
            }
            @for path in paths {
                path d=(d(&path.points)) fill="none" stroke=(path.colour) stroke-width="2.2" stroke-linejoin="round"
                    stroke-dasharray=[path.dashed.then_some("6 5")] {}
            }
            @if let Some((x, y)) = all().next().map(to_page) {
                circle cx=(px(x)) cy=(px(y)) r="4.5" fill=[paths.first().map(|path| path.colour)] {}
            }
        }
        (legend(paths.iter().map(|path| (path.name, path.colour))))
    }
}
