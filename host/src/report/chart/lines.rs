//! Lines and stacked areas over the frames of a run.

use super::plot::{LEFT, Plot, RIGHT, WIDTH, legend, nice_step, polyline, x_label};
use crate::evaluate::quantile::quantile;
use maud::{Markup, html};

/// Points a line is drawn with at most: longer ones are thinned to the largest value of each
/// interval.
pub(super) const POINTS: usize = 560;

/// One line of a chart.
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// One value per frame; not finite where it is unknown.
    pub values: Vec<f64>,
}

impl Series<'_> {
    /// Converts the line to another unit: values times `factor`.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.values.iter_mut().for_each(|value| *value *= factor);
        self
    }

    /// Sizes of the values, without their signs.
    pub fn sizes(mut self) -> Self {
        self.values.iter_mut().for_each(|value| *value = value.abs());
        self
    }
}

/// Lines over frames; the y axis begins at 0 and reaches at least `least_top`.
pub fn lines(frames: &[usize], series: &[Series<'_>], title: &str, least_top: f64) -> Markup {
    // Values that are not known are NaN, and have no height.
    let finite =
        series.iter().flat_map(|one| &one.values).copied().filter(|value| value.is_finite());
    let plot = Plot::from_zero(finite.fold(least_top, f64::max));
    let path = |one: &Series<'_>| {
        polyline(thinned(&one.values).iter().map(|&(at, value)| (x(frames, at), plot.y(value))))
    };
    let drawn = html! {
        (frame_labels(frames))
        @for one in series {
            path d=(path(one)) fill="none" stroke=(one.colour) stroke-width="1.8" stroke-linejoin="round" {}
        }
    };
    html! { (plot.svg(title, &drawn)) (legend(series.iter().map(|one| (one.name, one.colour)))) }
}

/// Areas on top of one another, over frames.
pub fn stacked(frames: &[usize], series: &[Series<'_>], title: &str) -> Markup {
    // Each area lies on the sum of those before it.
    let mut sums = vec![0.0; frames.len()];
    let mut areas = Vec::new();
    for one in series {
        let below = sums.clone();
        sums.iter_mut()
            .zip(&one.values)
            .for_each(|(sum, value)| *sum += if value.is_finite() { *value } else { 0.0 });
        areas.push((one.colour, below, sums.clone()));
    }
    // One slow frame should not flatten all others: the axis ends a little above the 99th
    // percentile.
    sums.sort_by(f64::total_cmp);
    let plot = Plot::from_zero(1.15 * quantile(&sums, 0.99).unwrap_or(1.0));
    // Along the upper edge and back along the lower one.
    let outline = |below: &[f64], above: &[f64]| {
        let (upper, lower) = (thinned(above), thinned(below));
        polyline(
            upper
                .iter()
                .chain(lower.iter().rev())
                .map(|&(at, value)| (x(frames, at), plot.y(value))),
        )
    };
    let drawn = html! {
        (frame_labels(frames))
        @for (colour, below, above) in &areas {
            path d={ (outline(below, above)) "Z" } fill=(colour) fill-opacity="0.9" {}
        }
    };
    html! { (plot.svg(title, &drawn)) (legend(series.iter().map(|one| (one.name, one.colour)))) }
}

fn x(frames: &[usize], at: usize) -> f64 {
    LEFT + (WIDTH - LEFT - RIGHT) * at as f64 / (frames.len().saturating_sub(1)).max(1) as f64
}

fn frame_labels(frames: &[usize]) -> Markup {
    let last = frames.len().saturating_sub(1);
    // About six labels, at round numbers of frames.
    let step = nice_step(last.max(1) as f64 / 6.0).max(1.0) as usize;
    html! {
        @for (at, frame) in frames.iter().enumerate().step_by(step) {
            @if at == 0 { (x_label(x(frames, at), "start", &format!("frame {frame}"))) }
            @else { (x_label(x(frames, at), "middle", &frame.to_string())) }
        }
    }
}

/// Pairs of position and value, at most [`POINTS`]: the largest value of each interval.
pub(super) fn thinned(values: &[f64]) -> Vec<(usize, f64)> {
    let interval = values.len().div_ceil(POINTS).max(1);
    let largest = |(at, values): (usize, &[f64])| {
        let value = values.iter().copied().filter(|value| value.is_finite()).reduce(f64::max)?;
        Some((at * interval, value))
    };
    values.chunks(interval).enumerate().filter_map(largest).collect()
}
