//! Input and map against LiDAR or exact depth: a table, a chart over the frames, pictures of the errors.

use super::grouped;
use crate::evaluate::lidar::{EvaluatedFrame, Layer, PairFigures, RULES, SourceFigures};
use crate::observe::pictures;
use crate::report::chart::{self, COLOURS, Series};
use crate::run::RunRecord;
use base64::{Engine, engine::general_purpose::STANDARD};
use std::fmt::Write as _;

/// The section; empty when nothing was evaluated.
pub fn section(run: &RunRecord) -> String {
    let Some(record) = &run.lidar else { return String::new() };
    let Some(figures) = &record.figures else { return String::new() };
    let what = if figures.source == "exact" { "exact depth" } else { "LiDAR" };
    let when = match figures.delay_frames {
        0 => "right after each frame".to_owned(),
        frames => format!("{frames} frames later"),
    };
    let mut html = format!(
        "<section><h2>Against {what}</h2><p class=\"soft small\">{} frames; the map is looked at {when}. Accuracy: share that is right (off by less than 3 px \
         or 5 %) of the points both input and map have. Completeness: share of the points each has. Means over frames. {} points on what could move \
         and has no volume are in no figure; {} points lie beyond what is fused or beside the image; {} break the epipolar line by more than 1.2 px.</p>\
         <div class=\"scroll\"><table><tr><th><th><th class=n>accuracy<th class=n>completeness<th class=n>F1<th class=n>accuracy alone\
         <th class=n>within 1 px<th class=n>within 2 px<th class=n>points</tr>",
        figures.frames,
        grouped(figures.ignored_points),
        grouped(figures.left_out_points),
        grouped(figures.epipolar_violations)
    );
    for (name, PairFigures { input, fused, .. }) in [("street", &figures.still), ("cars", &figures.dynamic)] {
        html += &row(name, "input", input);
        html += &row("", "map", fused);
    }
    html += "</table></div>";
    html += &charts(&record.frames);
    let _ = write!(html, "<p class=\"soft small\">{}</p>", legend());
    for pictures in &record.pictures {
        let image = |png: &[u8], of: &str| {
            format!("<img style=\"width:100%\" alt=\"{of} against {what}\" src=\"data:image/png;base64,{}\">", STANDARD.encode(png))
        };
        let _ = write!(
            html,
            "<figure>{}<figcaption>frame {}: input against {what}</figcaption>{}<figcaption>frame {1}: map against {what}</figcaption></figure>",
            image(&pictures.input_png, "input"),
            pictures.frame,
            image(&pictures.map_png, "map")
        );
    }
    html + "</section>"
}

fn row(layer: &str, source: &str, of: &SourceFigures) -> String {
    let share = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.4}"));
    let within = |px: f32| share(of.accuracy_by_px.iter().find(|at| at.0 == px).map(|at| at.1));
    format!(
        "<tr><td>{layer}<td>{source}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}</tr>",
        share(of.accuracy),
        share(of.completeness),
        share(of.f1),
        share(of.accuracy_alone),
        within(1.0),
        within(2.0),
        grouped(of.points)
    )
}

fn charts(frames: &[EvaluatedFrame]) -> String {
    let numbers: Vec<usize> = frames.iter().map(|frame| frame.frame).collect();
    let percent = |value: Option<f64>| value.map_or(f64::NAN, |value| 100.0 * value);
    let chart = |title: &str, value: &dyn Fn(&EvaluatedFrame, usize) -> f64| {
        let of = |source: usize| frames.iter().map(|frame| value(frame, source)).collect::<Vec<f64>>();
        chart::lines(
            &numbers,
            &[Series { name: "input", colour: COLOURS[5], values: of(0) }, Series { name: "map", colour: COLOURS[0], values: of(1) }],
            title,
            100.0,
        )
    };
    let street = Layer::Static as usize;
    debug_assert!(RULES[0].share > 0.0, "KITTI's rule is the first");
    let accuracy = chart("street: accuracy, %", &|frame, source| percent(frame.layers[street].accuracy(source, 0)));
    let completeness = chart("street: completeness, %", &|frame, source| percent(frame.layers[street].completeness(source)));
    format!("<div class=\"two\" style=\"margin-top:12px\"><div>{accuracy}</div><div>{completeness}</div></div>")
}

fn legend() -> String {
    let spot = |[r, g, b]: [u8; 3], what: &str| format!("<span><i style=\"background:rgb({r},{g},{b})\"></i>{what}</span> ");
    let mut html = "<span class=\"legend\">".to_owned();
    let names = ["up to a quarter of the error allowed", "up to half", "right", "wrong: up to twice", "up to four times", "more"];
    for ((_, colour), name) in pictures::ERRORS.iter().zip(names) {
        html += &spot(*colour, name);
    }
    html + &spot(pictures::MISSING, "nothing there") + &spot(pictures::IGNORED, "in no figure") + "</span>"
}
