//! Bars over frames, a lane for each track.

use super::path::WHOLE;
use super::plot::px;
use maud::{Markup, html};

const LEFT: f64 = 96.0;
const RIGHT: f64 = 8.0;
const ROW: f64 = 20.0;
/// Height of the row of frame numbers.
const LABELS: f64 = 24.0;
/// Narrowest bar that has space for its text.
const TEXT: f64 = 58.0;

/// A bar: frames `from` to `to`, the latter excluded, by position in the run.
pub struct Bar {
    /// First frame.
    pub from: usize,
    /// Frame behind the last one.
    pub to: usize,
    /// Class of its style: what it stands for.
    pub style: &'static str,
    /// True if the bar is drawn paler.
    pub pale: bool,
    /// Text on it, where it is wide enough.
    pub text: Option<String>,
}

/// The bars of one track.
pub struct Lane {
    /// Name in tables and charts.
    pub name: String,
    /// Estimated intervals, drawn as thick bars.
    pub bars: Vec<Bar>,
    /// True intervals, drawn as thin bars below.
    pub truth: Vec<Bar>,
}

/// Lanes over so many frames; `frames` are the numbers of some of them, evenly spread; `styles` are
/// explained in the legend.
pub fn lanes(
    frames: &[usize],
    count: usize,
    lanes: &[Lane],
    label: &str,
    styles: &[&'static str],
) -> Markup {
    // An empty run must not divide by zero.
    let count = count.max(1) as f64;
    // The list of frames may be thinned: each of its numbers stands for several frames.
    let per_number = (count / frames.len().max(1) as f64).ceil() as usize;
    let x = |at: usize| LEFT + (WHOLE - LEFT - RIGHT) * at as f64 / count;
    let width = |bar: &Bar| (x(bar.to) - x(bar.from)).max(1.0);
    let base = ROW * lanes.len() as f64;
    html! {
        svg viewBox={ "0 0 " (WHOLE) " " (base + LABELS) } role="img" aria-label=(label) {
            @for (y, lane) in lanes.iter().enumerate().map(|(at, lane)| (ROW * at as f64, lane)) {
                text x=(LEFT - 8.0) y=(px(y + 14.0)) text-anchor="end" { (lane.name) }
                path.grid d={ "M" (LEFT) " " (px(y + ROW - 1.0)) "H" (WHOLE) } {}
                @for bar in &lane.bars {
                    rect class=(bar.style) x=(px(x(bar.from))) y=(px(y + 2.0)) width=(px(width(bar))) height=(ROW - 5.0)
                        fill-opacity=[bar.pale.then_some("0.55")] {}
                    @if let Some(text) = bar.text.as_ref().filter(|_| width(bar) > TEXT) {
                        text.on x=(px(x(bar.from) + 4.0)) y=(px(y + 13.5)) { (text) }
                    }
                }
                @for bar in &lane.truth {
                    rect class=(bar.style) x=(px(x(bar.from))) y=(px(y + ROW - 3.0)) width=(px(width(bar))) height="2" {}
                }
            }
            @for tick in 0..=6 {
                @let at = tick * frames.len().saturating_sub(1) / 6;
                @let frame = frames.get(at).copied().unwrap_or_default();
                text x=(px(x(at * per_number))) y=(px(base + 16.0)) text-anchor=(if tick == 6 { "end" } else { "start" }) {
                    @if tick == 0 { "frame " } (frame)
                }
            }
        }
        div.legend { @for style in styles { span { i class=(style) {} (style) } } }
    }
}
