//! The head of the page: what was run, and the figures first looked for.

use crate::report::poor_map;
use crate::report::text::{MIB, counted, grouped};
use crate::run::RunRecord;
use maud::{Markup, html};

/// Name of the run and warnings: what stands above the map.
pub fn title(run: &RunRecord) -> Markup {
    let (plan, (width, height)) = (&run.plan, run.plan.dataset.size());
    html! {
        h1 { (plan.dataset.name()) }
        p.soft {
            (run.frames.len()) " frames of " (width) " × " (height) " px, profile " code { (plan.profile) } ", "
            (counted(plan.threads, "thread")) ", dynvox " (env!("CARGO_PKG_VERSION")) ". Digest of the last frame: "
            code { (format!("{:016x}", run.digest())) }
        }
        @if let Some(incomplete) = &run.incomplete { p { b { "Incomplete: " (incomplete.reason) } } }
        @for warning in &plan.warnings { p { b { "Warning: " (warning) } } }
        @if let Some(warning) = poor_map::sentence(run) { p { b { "Warning: " (warning) } } }
    }
}

/// Figures that a reader looks for first, and notes on the input.
pub fn figures(run: &RunRecord) -> Markup {
    let notes = run.plan.dataset.notes();
    html! {
        div.cards { @for (value, name) in cards(run) { div.card { b { (value) } span { (name) } } } }
        @if !notes.is_empty() { ul.soft.small { @for note in notes { li { (note) } } } }
    }
}

fn cards(run: &RunRecord) -> Vec<(String, &'static str)> {
    let sections = &run.sections;
    let mut cards = vec![(format!("{:.1} fps", run.fps()), "mapping and reading images")];
    // The map's figures come first, where there is a reference.
    if let Some(figures) =
        sections.reference.as_ref().and_then(|reference| reference.figures.as_ref())
    {
        let map = &figures.still.fused;
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        if let Some(depth) = figures.map_depth_error {
            cards.push((
                format!("{:.1} cm", 100.0 * depth.median_error_m),
                "median depth error of the static map",
            ));
        }
        cards.extend(map.accuracy.map(|share| (percent(share), "accuracy of the static map")));
        cards.extend(
            map.completeness.map(|share| (percent(share), "completeness of the static map")),
        );
    }
    if let Some(errors) = &sections.trajectory.errors {
        // A short path has no segments: the error by frame stands in.
        cards.push(match errors.t_err_percent {
            Some(percent) => (format!("{percent:.2} %"), "translation error over segments"),
            None => (format!("{:.2} cm", 100.0 * errors.rpe_t_m), "translation error per frame"),
        });
        cards.push((format!("{:.3} m", errors.ate_m), "absolute trajectory error"));
    }
    let (peak, blocks) = (sections.blocks.totals.peak, run.plan.capacity.blocks);
    cards.push((
        format!("{:.1} MiB", run.plan.capacity.bytes() as f64 / MIB),
        "slab: all memory of the core",
    ));
    cards.push((
        format!("{:.0} %", 100.0 * f64::from(peak) / blocks as f64),
        "peak use of the block pool",
    ));
    cards.push((grouped(sections.blocks.mesh.static_triangles()), "triangles of the static map"));
    cards
}
