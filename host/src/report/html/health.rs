//! Matches, disparity density, and everything that was refused or lost.

use super::{frames, series, table};
use crate::report::chart::{COLOURS, lines};
use crate::report::text::{grouped, lost_because};
use crate::run::RunRecord;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let frames = frames(run);
    let matches = lines(
        &frames,
        &[
            series(run, "matches", COLOURS[5], "matches"),
            series(run, "inliers", COLOURS[0], "inliers"),
        ],
        "matches",
        0.0,
    );
    let density = lines(
        &frames,
        &[series(run, "pixels with a disparity", COLOURS[3], "stereo_density").scaled(100.0)],
        "%",
        // The whole range, so that runs can be compared by eye.
        100.0,
    );
    html! {
        section {
            h2 { "Health" }
            p.soft.small { (blocks(run)) }
            details {
                summary.small { "All counters; worst severity: " (run.sections.health.worst.name()) }
                (table(&[("", false), ("", true)], &counters(run)))
            }
            div.two { div { (matches) } div { (density) } }
        }
    }
}

fn blocks(run: &RunRecord) -> Markup {
    let blocks = &run.sections.blocks;
    let (refused, lost) = (blocks.totals.refused, blocks.lost());
    html! {
        @if refused + lost == 0 { "No block was refused or lost." }
        @if refused > 0 { b { "Blocks refused: " (grouped(refused)) "." } " The pool was full; a \
            larger profile maps them. " }
        @if lost > 0 { b { "Blocks lost: " (grouped(lost)) "." } " " (lost_because(run)) "." }
    }
}

/// Everything that is counted, over all frames.
fn counters(run: &RunRecord) -> Vec<Vec<String>> {
    let (blocks, health, trajectory) =
        (&run.sections.blocks, &run.sections.health, &run.sections.trajectory);
    let totals = &blocks.totals;
    let rows = [
        ("peak of blocks in use", u64::from(totals.peak)),
        ("blocks refused", totals.refused),
        ("blocks evicted and stored", totals.stored),
        ("blocks evicted empty", totals.empty),
        ("blocks loaded back", totals.loaded),
        ("most comparisons in one lookup of the index", u64::from(totals.probes_most)),
        ("blocks lost", blocks.lost()),
        ("blocks stored at the end", u64::from(blocks.store.end.stored)),
        ("records on disk, superseded ones included", blocks.store.records),
        ("bytes on disk", blocks.store.bytes),
        ("most frames in the pruning window", totals.history_frames_most as u64),
        ("blocks visited by pruning", totals.prune_visited),
        ("voxels reset", totals.voxels_reset),
        ("blocks freed by pruning", totals.blocks_freed),
        ("most pruning visits carried over", u64::from(totals.carried_over_most)),
        ("frames pruned early", totals.early),
        ("voxels erased where moving objects had been", totals.voxels_erased),
        ("features and matches dropped", health.matches_dropped),
        ("values of given depth refused", health.depth_values_refused),
        ("detections refused", u64::from(health.detections.refused())),
        ("tracks and object volumes refused", health.tracks_refused),
        ("poses extrapolated", trajectory.extrapolated_frames as u64),
        ("segments of the map", u64::from(trajectory.segments)),
    ];
    rows.iter().map(|(name, value)| vec![(*name).to_owned(), grouped(*value)]).collect()
}
