//! Frame of all charts: the area, the scale of the y axis with its grid, the legend.

use maud::{Markup, html};

pub(super) const WIDTH: f64 = 640.0;
pub(super) const HEIGHT: f64 = 240.0;
pub(super) const LEFT: f64 = 54.0;
pub(super) const RIGHT: f64 = 10.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 26.0;

/// The area of a chart and the scale of its y axis.
pub(super) struct Plot {
    low: f64,
    high: f64,
    step: f64,
}

impl Plot {
    /// A scale from 0 to a round value that is at least `highest`.
    pub fn from_zero(highest: f64) -> Self {
        let highest = highest.max(1e-9);
        let step = nice_step(highest / 4.0);
        Self { low: 0.0, high: (highest / step).ceil() * step, step }
    }

    /// A scale between round values on either side of `lowest` and `highest`.
    pub fn around(lowest: f64, highest: f64) -> Self {
        let step = nice_step(((highest - lowest) / 4.0).max(1e-3));
        Self {
            low: (lowest / step - 0.05).floor() * step,
            high: (highest / step + 0.05).ceil() * step,
            step,
        }
    }

    /// The height of a value in the drawing; values beyond the scale stay at its end.
    pub fn y(&self, value: f64) -> f64 {
        TOP + (HEIGHT - TOP - BOTTOM)
            * (1.0 - ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0))
    }

    /// The drawing: title, grid, and what is on it.
    pub fn svg(&self, title: &str, content: &Markup) -> Markup {
        // Rounded: the quotient is whole but for its last bits.
        let ticks = (0..=((self.high - self.low) / self.step).round() as usize)
            .map(|tick| self.low + tick as f64 * self.step);
        html! {
            svg viewBox={ "0 0 " (WIDTH) " " (HEIGHT) } role="img" aria-label=(title) {
                text x=(LEFT) y="14" { (title) }
                @for value in ticks {
                    path.grid d={ "M" (LEFT) " " (px(self.y(value))) "H" (WIDTH - RIGHT) } {}
                    text x=(LEFT - 6.0) y=(px(self.y(value) + 4.0)) text-anchor="end" { (number(value)) }
                }
                (content)
            }
        }
    }
}

/// A label below the x axis.
pub(super) fn x_label(x: f64, anchor: &str, label: &str) -> Markup {
    html! { text x=(px(x)) y=(HEIGHT - 8.0) text-anchor=(anchor) { (label) } }
}

/// Names of series and their colours.
pub(super) fn legend<'a>(entries: impl Iterator<Item = (&'a str, &'a str)>) -> Markup {
    html! {
        div.legend {
            @for (name, colour) in entries {
                span { i style={ "background:" (colour) } {} (name) }
            }
        }
    }
}

/// A path through points.
pub(super) fn polyline(points: impl Iterator<Item = (f64, f64)>) -> String {
    let point = |(at, (x, y)): (usize, (f64, f64))| {
        format!("{}{x:.1} {y:.1}", if at == 0 { 'M' } else { 'L' })
    };
    points.enumerate().map(point).collect()
}

/// A coordinate, to a tenth of a pixel.
pub(super) fn px(value: f64) -> String {
    format!("{value:.1}")
}

/// 1, 2 or 5 times a power of ten, at least `least`.
pub(super) fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.max(1e-12).log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= least * 0.999)
        .unwrap_or(10.0 * power)
}

fn number(value: f64) -> String {
    if value >= 10_000.0 {
        format!("{} k", (value / 1_000.0 * 10.0).round() / 10.0)
    } else {
        format!("{}", (value * 1e4).round() / 1e4)
    }
}
