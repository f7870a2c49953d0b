//! Time per stage.

use super::{frames, series, table};
use crate::report::chart::{COLOURS, Series, lines, stacked};
use crate::run::RunRecord;
use dynvox_core::Stage;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let frames = frames(run);
    // The step as a whole, then its stages.
    let mut wall = vec![series(run, "whole step", "currentColor", "step_ms")];
    wall.extend(stages(run, "ms"));
    let rows: Vec<Vec<String>> = run
        .frames
        .stage_statistics()
        .into_iter()
        .map(|(name, of)| {
            let times = [of.median_ms, of.p99_ms, of.cpu_median_ms].map(|ms| format!("{ms:.2}"));
            std::iter::once(name.to_owned()).chain(times).chain([of.frames.to_string()]).collect()
        })
        .collect();
    html! {
        section {
            h2 { "Time per stage" }
            p.soft.small {
                "Left: wall time; stereo and scene flow run in parallel where there are two \
                 threads, and the load of the machine counts. Right: "
                "CPU time of all threads, stacked. Raycasts are taken for this page on some \
                 frames, outside the step."
            }
            div.two {
                div { (lines(&frames, &wall, "ms, wall", 0.0)) }
                div { (stacked(&frames, &stages(run, "cpu_ms"), "ms, CPU")) }
            }
            (table(&[("stage", false), ("median, ms", true), ("p99, ms", true), ("CPU median, ms", true), ("frames", true)], &rows))
        }
    }
}

/// A line for each stage within the step: its column of `frames.csv` that ends in `_{end}`.
fn stages(run: &RunRecord, end: &str) -> Vec<Series<'static>> {
    let within = Stage::ALL.iter().enumerate().filter(|(_, stage)| **stage != Stage::Raycast);
    within
        .map(|(at, stage)| {
            let column = format!("{}_{end}", stage.name());
            series(run, stage.name(), COLOURS[at % COLOURS.len()], &column)
        })
        .collect()
}
