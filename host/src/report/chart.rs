//! Charts as inline SVG: lines, stacked areas, a path seen from above. Text and grid take their colours from the page's style.

use std::fmt::Write;

/// Colours of series, in order: told apart by people who see few colours, and in print.
pub const COLOURS: [&str; 6] = ["#4269d0", "#efb118", "#ff725c", "#3aa99f", "#9b6bd6", "#8a8f98"];

/// Points a line is drawn with at most: longer ones are thinned to the largest value of each piece.
const POINTS: usize = 560;
const WIDTH: f64 = 640.0;
/// Width of a drawing that takes the whole page.
const WHOLE: f64 = 1180.0;
const HEIGHT: f64 = 230.0;
/// Highest drawing of a path.
const HIGHEST: f64 = 620.0;
const LEFT: f64 = 54.0;
const BOTTOM: f64 = 26.0;
const TOP: f64 = 8.0;
const RIGHT: f64 = 10.0;

/// One line of a chart.
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// One value per frame; not finite where there is none.
    pub values: Vec<f64>,
}

/// Lines over frames; the y axis begins at 0 and has room for `least_top`.
pub fn lines(frames: &[usize], series: &[Series<'_>], unit: &str, least_top: f64) -> String {
    let highest = series.iter().flat_map(|one| &one.values).copied().filter(|value| value.is_finite()).fold(least_top, f64::max);
    let axes = Axes::new(frames, highest);
    let mut svg = axes.begin(unit);
    for one in series {
        let points = thinned(&one.values);
        let path = polyline(points.iter().map(|&(at, value)| (axes.x(at), axes.y(value))));
        let _ = write!(svg, r#"<path d="{path}" fill="none" stroke="{}" stroke-width="1.8" stroke-linejoin="round"/>"#, one.colour);
    }
    svg + "</svg>" + &legend(series)
}

/// Areas on top of one another, over frames.
pub fn stacked(frames: &[usize], series: &[Series<'_>], unit: &str) -> String {
    let mut sums = vec![0.0; frames.len()];
    let mut areas = Vec::new();
    for one in series {
        let below = sums.clone();
        sums.iter_mut().zip(&one.values).for_each(|(sum, value)| *sum += if value.is_finite() { *value } else { 0.0 });
        areas.push((one.colour, below, sums.clone()));
    }
    // One slow frame should not flatten all others: the axis ends a little above the 99th percentile.
    let mut sorted = sums.clone();
    sorted.sort_by(f64::total_cmp);
    let high = sorted.get(sorted.len().saturating_sub(1 + sorted.len() / 100)).copied().unwrap_or(1.0);
    let axes = Axes::new(frames, 1.15 * high);
    let mut svg = axes.begin(unit);
    for (colour, below, above) in areas {
        let (upper, lower) = (thinned(&above), thinned(&below));
        let outline = upper.iter().chain(lower.iter().rev()).map(|&(at, value)| (axes.x(at), axes.y(value)));
        let _ = write!(svg, r#"<path d="{}Z" fill="{colour}" fill-opacity="0.9"/>"#, polyline(outline));
    }
    svg + "</svg>" + &legend(series)
}

/// A path seen from above.
pub struct Path<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour.
    pub colour: &'a str,
    /// Whether its line is broken.
    pub dashed: bool,
    /// Places, m: x (right) and z (forward).
    pub points: Vec<(f64, f64)>,
}

/// Paths at one scale. A path that leads forward lies on its side.
pub fn from_above(paths: &[Path<'_>]) -> String {
    let all = || paths.iter().flat_map(|path| &path.points);
    let range =
        |of: fn(&(f64, f64)) -> f64| all().map(of).fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    let ((x0, x1), (z0, z1)) = (range(|point| point.0), range(|point| point.1));
    if x0 > x1 {
        return String::new();
    }
    // Long paths lie on their side: the longer extent goes along the page.
    let side = x1 - x0 < z1 - z0;
    let (along, across) = if side { (z1 - z0, x1 - x0) } else { (x1 - x0, z1 - z0) };
    let margin = 0.06 * along.max(1.0);
    let scale = ((WHOLE - 28.0) / (along + 2.0 * margin)).min(HIGHEST / (across + 2.0 * margin));
    let height = ((across + 2.0 * margin) * scale).max(90.0) + 34.0;
    let middle = ((x0 + x1) / 2.0, (z0 + z1) / 2.0);
    let place = |&(x, z): &(f64, f64)| {
        let (right, up) = if side { (z - middle.1, x - middle.0) } else { (x - middle.0, middle.1 - z) };
        (WHOLE / 2.0 + right * scale, (height - 34.0) / 2.0 + up * scale)
    };
    let mut svg = format!(r#"<svg viewBox="0 0 {WHOLE} {height:.0}" role="img" aria-label="trajectory from above">"#);
    let step = nice_step((along + 2.0 * margin) / 10.0);
    let bar = step * scale;
    let base = height - 18.0;
    let _ = write!(
        svg,
        r#"<path d="M14 {base}h{bar:.1}m0 -4v8m-{bar:.1} -8v8" stroke="currentColor" fill="none"/><text x="{:.1}" y="{:.1}">{step} m{}</text>"#,
        22.0 + bar,
        base + 4.0,
        if side { ", forward to the right" } else { ", forward up" }
    );
    for Path { colour, dashed, points, .. } in paths {
        let every = points.len().div_ceil(4 * POINTS).max(1);
        let path = polyline(points.iter().step_by(every).chain(points.last()).map(place));
        let dash = if *dashed { r#" stroke-dasharray="6 5""# } else { "" };
        let _ = write!(svg, r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="2.2" stroke-linejoin="round"{dash}/>"#);
    }
    if let Some((x, y)) = all().next().map(place) {
        let _ = write!(svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="4.5" fill="{}"/>"#, paths.first().map_or("", |path| path.colour));
    }
    svg += "</svg>";
    let names: Vec<Series<'_>> = paths.iter().map(|path| Series { name: path.name, colour: path.colour, values: Vec::new() }).collect();
    svg + &legend(&names)
}

struct Axes<'f> {
    frames: &'f [usize],
    top: f64,
    step: f64,
}

impl<'f> Axes<'f> {
    fn new(frames: &'f [usize], highest: f64) -> Self {
        let step = nice_step(highest.max(1e-9) / 4.0);
        Self { frames, step, top: (highest.max(1e-9) / step).ceil() * step }
    }

    fn x(&self, at: usize) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * at as f64 / (self.frames.len().saturating_sub(1)).max(1) as f64
    }

    fn y(&self, value: f64) -> f64 {
        TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - (value / self.top).clamp(0.0, 1.0))
    }

    /// The drawing with its grid and the names on its axes.
    fn begin(&self, unit: &str) -> String {
        let mut svg = format!(r#"<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{unit} by frame">"#);
        for tick in 0..=(self.top / self.step).round() as usize {
            let value = tick as f64 * self.step;
            let y = self.y(value);
            let _ = write!(
                svg,
                r#"<path class="grid" d="M{LEFT} {y:.1}H{}"/><text x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                WIDTH - RIGHT,
                LEFT - 8.0,
                y + 4.0,
                number(value)
            );
        }
        let _ = write!(svg, r#"<text x="{LEFT}" y="{:.1}" dx="4" dy="-2">{unit}</text>"#, TOP + 14.0);
        let last = self.frames.len().saturating_sub(1);
        let mut at = 0;
        let step = nice_step(last.max(1) as f64 / 6.0).max(1.0) as usize;
        while at <= last {
            let label = self.frames.get(at).copied().unwrap_or_default();
            let label = if at == 0 { format!("frame {label}") } else { label.to_string() };
            let anchor = if at == 0 { "start" } else { "middle" };
            let _ = write!(svg, r#"<text x="{:.1}" y="{}" text-anchor="{anchor}">{label}</text>"#, self.x(at), HEIGHT - 8.0);
            at += step;
        }
        svg
    }
}

/// 1, 2 or 5 times a power of ten, at least `least`.
pub fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.max(1e-12).log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|step| *step >= least * 0.999).unwrap_or(10.0 * power)
}

fn number(value: f64) -> String {
    if value >= 10_000.0 { format!("{} k", (value / 1_000.0 * 10.0).round() / 10.0) } else { format!("{}", (value * 1e4).round() / 1e4) }
}

/// Pairs of position and value, at most [`POINTS`]: of each piece the largest value.
fn thinned(values: &[f64]) -> Vec<(usize, f64)> {
    let piece = values.len().div_ceil(POINTS).max(1);
    let largest = |(at, values): (usize, &[f64])| {
        let value = values.iter().copied().filter(|value| value.is_finite()).reduce(f64::max)?;
        Some((at * piece, value))
    };
    values.chunks(piece).enumerate().filter_map(largest).collect()
}

fn polyline(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    for (at, (x, y)) in points.enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if at == 0 { 'M' } else { 'L' });
    }
    path
}

fn legend(series: &[Series<'_>]) -> String {
    let mut html = r#"<div class="legend">"#.to_owned();
    for one in series {
        let _ = write!(html, r#"<span><i style="background:{}"></i>{}</span>"#, one.colour, one.name);
    }
    html + "</div>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_thinning_keeps_the_peak() {
        assert_eq!([0.03, 1.0, 1.2, 7.0, 230.0].map(nice_step), [0.05, 1.0, 2.0, 10.0, 500.0]);
        let mut values = vec![1.0; 20_000];
        values[12_345] = 9.0;
        let thin = thinned(&values);
        assert!(thin.len() <= POINTS && thin.iter().any(|point| point.1 == 9.0));
        assert!(thinned(&[f64::NAN]).is_empty());
    }

    #[test]
    fn charts_of_nothing_and_of_one_point_are_drawn() {
        let series = |values: Vec<f64>| [Series { name: "a", colour: "red", values }];
        for values in [vec![], vec![0.0], vec![f64::NAN, 3.0]] {
            let frames: Vec<usize> = (0..values.len()).collect();
            assert!(lines(&frames, &series(values.clone()), "ms", 0.0).ends_with("</div>"));
            assert!(!stacked(&frames, &series(values), "ms").contains("NaN"));
        }
        let path = Path { name: "a", colour: "red", dashed: false, points: vec![(0.0, 0.0)] };
        assert!(!from_above(&[path]).contains("NaN"));
        assert!(from_above(&[]).is_empty());
    }
}
