//! `lidar.csv`: for each evaluated frame a row for each region and acceptance rule.

use super::write_rows;
use crate::evaluate::reference::{ACCEPTANCE_RULES, Counts, EvaluatedFrame, Region, Rule};
use serde::Serialize;
use std::io::{self, Write};

/// `points = error + missing + correct` for input and map and every rule; columns `alone` count
/// each source by itself. `rule_px` is the largest error that counts as correct; with `rule_share`
/// above 0 an error up to that share of the true disparity is correct as well.
#[derive(Serialize)]
struct ReferenceColumns {
    frame: usize,
    region: &'static str,
    rule_px: f32,
    rule_share: f32,
    points: u32,
    missing: u32,
    input_missing_alone: u32,
    map_missing_alone: u32,
    input_error: u32,
    map_error: u32,
    input_error_alone: u32,
    map_error_alone: u32,
    scan_points: u32,
    out_of_range: u32,
    outside: u32,
    epipolar: u32,
}

/// Writes the table.
///
/// # Errors
/// The disk refuses.
pub fn write_reference(out: &mut impl Write, frames: &[EvaluatedFrame]) -> io::Result<()> {
    let rules = ACCEPTANCE_RULES.iter().enumerate();
    let regions =
        |frame: &EvaluatedFrame| Region::ALL.into_iter().zip(frame.regions).collect::<Vec<_>>();
    // A row for each frame, region and rule.
    let counts = frames.iter().flat_map(|frame| {
        regions(frame).into_iter().map(move |(region, counts)| (frame, region, counts))
    });
    let row = |(frame, region, counts)| {
        rules.clone().map(move |rule| columns(frame, region, &counts, rule))
    };
    write_rows(out, counts.flat_map(row))
}

fn columns(
    frame: &EvaluatedFrame,
    region: Region,
    counts: &Counts,
    rule: (usize, &Rule),
) -> ReferenceColumns {
    let ([input, map], scan) = (&counts.sources, &frame.count);
    let (at, rule) = rule;
    ReferenceColumns {
        frame: frame.frame,
        region: region.name(),
        rule_px: rule.px,
        rule_share: rule.share,
        points: counts.total,
        missing: counts.missing,
        input_missing_alone: input.missing_alone,
        map_missing_alone: map.missing_alone,
        input_error: input.errors[at],
        map_error: map.errors[at],
        input_error_alone: input.errors_alone[at],
        map_error_alone: map.errors_alone[at],
        scan_points: scan.points,
        out_of_range: scan.out_of_range,
        outside: scan.outside,
        epipolar: scan.epipolar,
    }
}
