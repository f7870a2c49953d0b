//! Input and map against LiDAR or exact depth: a table, charts over the frames, pictures of the
//! errors.

use super::{image, table};
use crate::evaluate::reference::{
    ACCEPTANCE_RULES, EvaluatedFrame, PairFigures, ReferenceFigures, Region, SourceFigures,
};
use crate::observe::{ReferenceSection, pictures};
use crate::report::chart::{COLOURS, Series, lines};
use crate::report::text::grouped;
use crate::run::RunRecord;
use maud::{Markup, html};

/// The section; empty when nothing was evaluated.
pub fn section(run: &RunRecord) -> Markup {
    let Some(section) = &run.sections.reference else { return html! {} };
    let Some(figures) = &section.figures else { return html! {} };
    let name = if figures.source == "exact" { "exact depth" } else { "LiDAR" };
    html! {
        section {
            h2 { "Evaluation against " (name) }
            p.soft.small { (explanation(figures)) }
            (table_of(figures))
            (charts(&section.frames))
            p.soft.small { (legend()) }
            (error_pictures(section, name))
        }
    }
}

fn explanation(figures: &ReferenceFigures) -> Markup {
    let when = match figures.delay_frames {
        0 => "right after each frame".to_owned(),
        frames => format!("{frames} frames later"),
    };
    html! {
        (figures.frames) " frames; the map is evaluated " (when) ". Accuracy: share of the points \
            both input and map have that is right (off by "
        "at most " (figures.rule) "). Completeness: share of the points each has. Means over \
                                   frames. " (grouped(figures.ignored_points))
        " points on objects without a volume are in no figure; " (grouped(figures.left_out_points))
        " points lie beyond the fused depth or outside the image; " (grouped(figures.epipolar_violations))
        " violate the epipolar constraint by more than 1.2 px."
        @if let Some(depth) = figures.map_depth_error {
            (format!(
                " Static map: median depth error {:.1} cm at a median depth of {:.1} m.",
                100.0 * depth.median_error_m, depth.median_depth_m
            ))
            @if let Some(surface_m) = depth.median_surface_m {
                (format!(" Median distance of the reference's points from the surface: {:.1} \
                          cm.", 100.0 * surface_m))
            }
        }
    }
}

fn table_of(figures: &ReferenceFigures) -> Markup {
    let heads = [
        ("", false),
        ("", false),
        ("accuracy", true),
        ("completeness", true),
        ("F1", true),
        ("accuracy alone", true),
        ("within 1 px", true),
        ("within 2 px", true),
        ("points", true),
    ];
    // Two rows for each part of the scene: what came in, and what the map made of it.
    let mut rows = Vec::new();
    let dynamic = figures.dynamic.iter().map(|of| ("dynamic objects", of));
    for (name, PairFigures { input, fused, .. }) in
        std::iter::once(("static", &figures.still)).chain(dynamic)
    {
        rows.push(row(name, "input", input));
        rows.push(row("", "map", fused));
    }
    table(&heads, &rows)
}

fn row(region: &str, source: &str, of: &SourceFigures) -> Vec<String> {
    let share = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.4}"));
    let within = |px: f32| share(of.accuracy_by_px.iter().find(|at| at.0 == px).map(|at| at.1));
    let shares = [of.accuracy, of.completeness, of.f1, of.accuracy_alone].map(share);
    let names = [region, source].map(str::to_owned);
    names.into_iter().chain(shares).chain([within(1.0), within(2.0), grouped(of.points)]).collect()
}

fn charts(frames: &[EvaluatedFrame]) -> Markup {
    let numbers: Vec<usize> = frames.iter().map(|frame| frame.frame).collect();
    // A frame without points is a gap in the curve.
    let percent = |value: Option<f64>| value.map_or(f64::NAN, |value| 100.0 * value);
    let chart = |title: &str, value: &dyn Fn(&EvaluatedFrame, usize) -> f64| {
        let of =
            |source: usize| frames.iter().map(|frame| value(frame, source)).collect::<Vec<f64>>();
        let [input, map] = [("input", COLOURS[5], 0), ("map", COLOURS[0], 1)];
        let series =
            [input, map].map(|(name, colour, source)| Series { name, colour, values: of(source) });
        lines(&numbers, &series, title, 100.0)
    };
    let region = Region::Static as usize;
    debug_assert!(ACCEPTANCE_RULES[0].share > 0.0, "KITTI's rule is the first");
    html! {
        div.two.apart {
            div { (chart("static: accuracy, %", &|frame, source| percent(frame.regions[region].accuracy(source, 0)))) }
            div { (chart("static: completeness, %", &|frame, source| percent(frame.regions[region].completeness(source)))) }
        }
    }
}

fn error_pictures(section: &ReferenceSection, name: &str) -> Markup {
    html! {
        @for of in &section.pictures {
            figure {
                (image(&of.input_jpeg, &format!("input against {name}")))
                figcaption { "frame " (of.frame) ": input against " (name) }
                (image(&of.map_jpeg, &format!("map against {name}")))
                figcaption { "frame " (of.frame) ": map against " (name) }
            }
        }
    }
}

fn legend() -> Markup {
    let names = [
        "error up to a quarter of what is right",
        "up to half",
        "right",
        "wrong: up to twice",
        "up to four times",
        "more",
    ];
    let errors = pictures::ERRORS.iter().zip(names).map(|((_, colour), name)| (*colour, name));
    let spots: Vec<([u8; 3], &str)> = errors
        .chain([(pictures::MISSING, "no estimate"), (pictures::IGNORED, "in no figure")])
        .collect();
    html! {
        span.legend {
            @for ([r, g, b], name) in spots { span { i style=(format!("background:rgb({r},{g},{b})")) {} (name) } " " }
        }
    }
}
