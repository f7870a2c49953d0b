//! Curves and box plots over a few values, as inline SVG.

use crate::report::chart::nice_step;
use std::fmt::Write;

const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 50.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 30.0;

/// A line over the values.
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// Whether it is the original's: its line is broken.
    pub theirs: bool,
    /// A number for each value; none where there is none.
    pub numbers: Vec<Option<f64>>,
}

/// Boxes over the values: ends of the whiskers, quartiles, median.
pub struct Boxes<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// Five ascending numbers for each value; none where there is none.
    pub boxes: Vec<Option<[f64; 5]>>,
}

/// Five numbers of some samples: whiskers end at the last sample within one and a half times the box's height (Tukey).
pub fn five(samples: &[f64]) -> Option<[f64; 5]> {
    let mut sorted: Vec<f64> = samples.iter().copied().filter(|sample| sample.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    // Linear between the samples around it.
    let quantile = |share: f64| {
        let at = share * (sorted.len() as f64 - 1.0);
        let (low, high) = (*sorted.get(at.floor() as usize)?, *sorted.get(at.ceil() as usize)?);
        Some(low + (high - low) * (at - at.floor()))
    };
    let [low, middle, high] = [quantile(0.25)?, quantile(0.5)?, quantile(0.75)?];
    let reach = 1.5 * (high - low);
    let first = sorted.iter().copied().find(|sample| *sample >= low - reach)?;
    let last = sorted.iter().rev().copied().find(|sample| *sample <= high + reach)?;
    Some([first, low, middle, high, last])
}

/// Draws boxes beside one another and curves over them.
pub fn drawing(title: &str, labels: &[String], boxes: &[Boxes<'_>], curves: &[Curve<'_>]) -> String {
    let shown = || {
        boxes
            .iter()
            .flat_map(|one| one.boxes.iter().flatten().flatten().copied())
            .chain(curves.iter().flat_map(|one| one.numbers.iter().flatten().copied()))
    };
    let (low, high) = shown().fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    if low > high || labels.is_empty() {
        return String::new();
    }
    let step = nice_step(((high - low) / 4.0).max(1e-3));
    let (bottom, top) = ((low / step - 0.05).floor() * step, (high / step + 0.05).ceil() * step);
    let y = |value: f64| TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - (value - bottom) / (top - bottom));
    let slot = (WIDTH - LEFT - RIGHT) / labels.len() as f64;
    let x = |at: usize| LEFT + slot * (at as f64 + 0.5);
    let mut svg = format!(r#"<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{title}"><text x="{LEFT}" y="14">{title}</text>"#);
    for tick in 0..=((top - bottom) / step).round() as usize {
        let value = bottom + tick as f64 * step;
        let _ = write!(
            svg,
            r#"<path class="grid" d="M{LEFT} {0:.1}H{1}"/><text x="{2}" y="{3:.1}" text-anchor="end">{4}</text>"#,
            y(value),
            WIDTH - RIGHT,
            LEFT - 6.0,
            y(value) + 4.0,
            (value * 1e4).round() / 1e4
        );
    }
    for (at, label) in labels.iter().enumerate() {
        let _ = write!(svg, r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">{label}</text>"#, x(at), HEIGHT - 10.0);
    }
    let width = (slot / (boxes.len() as f64 + 1.0)).min(26.0);
    for (nth, one) in boxes.iter().enumerate() {
        let aside = (nth as f64 - (boxes.len() as f64 - 1.0) / 2.0) * width * 1.15;
        for (at, five) in one.boxes.iter().enumerate() {
            let Some([first, low, middle, high, last]) = five else { continue };
            let (centre, half) = (x(at) + aside, width / 2.0);
            let _ = write!(
                svg,
                r#"<path d="M{centre:.1} {:.1}V{:.1}M{centre:.1} {:.1}V{:.1}" stroke="{}" fill="none"/>"#,
                y(*first),
                y(*low),
                y(*high),
                y(*last),
                one.colour
            );
            let _ = write!(
                svg,
                r#"<rect x="{:.1}" y="{:.1}" width="{width:.1}" height="{:.1}" fill="{3}" fill-opacity="0.25" stroke="{3}"/>"#,
                centre - half,
                y(*high),
                (y(*low) - y(*high)).max(0.5),
                one.colour
            );
            let _ =
                write!(svg, r#"<path d="M{:.1} {:.1}h{width:.1}" stroke="{}" stroke-width="2.4"/>"#, centre - half, y(*middle), one.colour);
        }
    }
    for one in curves {
        let mut path = String::new();
        let mut marks = String::new();
        let mut joined = false;
        for (at, number) in one.numbers.iter().enumerate() {
            let Some(number) = number else {
                joined = false;
                continue;
            };
            let _ = write!(path, "{}{:.1} {:.1}", if joined { 'L' } else { 'M' }, x(at), y(*number));
            let _ = write!(marks, r#"<circle cx="{:.1}" cy="{:.1}" r="3.2" fill="{}"/>"#, x(at), y(*number), one.colour);
            joined = true;
        }
        let dash = if one.theirs { r#" stroke-dasharray="5 4""# } else { "" };
        let _ = write!(svg, r#"<path d="{path}" fill="none" stroke="{}" stroke-width="1.8"{dash}/>{marks}"#, one.colour);
    }
    svg += r#"</svg><div class="legend">"#;
    let names = boxes.iter().map(|one| (one.name, one.colour, false)).chain(curves.iter().map(|one| (one.name, one.colour, one.theirs)));
    for (name, colour, theirs) in names {
        let _ = write!(svg, r#"<span><i style="background:{colour}"></i>{name}{}</span>"#, if theirs { " (original)" } else { "" });
    }
    format!("<div class=\"figure\">{svg}</div></div>")
}
