//! Capacity that a run needed: figures, a sentence, and a file to run again with.

use super::text::MIB;
use crate::formats::{CapacityFile, CapacityTable};
use crate::run::RunRecord;
use serde::Serialize;
use std::collections::BTreeMap;

/// The capacity's part of `summary.json`.
#[derive(Debug, Serialize)]
pub struct CapacitySummary {
    /// Bound by bound, under the names of `--capacity` files.
    bounds: BTreeMap<&'static str, BoundSummary>,
    /// The least capacity that would have held this run.
    least: CapacityTable,
    /// Bytes of its slab.
    least_bytes: usize,
    /// True if nothing was refused, so that the bound is enough; otherwise more may be needed.
    enough: bool,
}

#[derive(Debug, Serialize)]
struct BoundSummary {
    /// The run's bound.
    bound: usize,
    /// The most needed at once.
    needed: usize,
    /// Number of items refused because of this bound.
    refused: u64,
}

/// The figures.
pub fn summary(run: &RunRecord) -> CapacitySummary {
    let section = &run.sections.bounds;
    let rows = section.uses.rows(&run.plan.capacity);
    // What the capacity has, and what the run would have used.
    let bounds = rows.iter().map(|&(name, bound, of)| {
        (name, BoundSummary { bound, needed: of.needed, refused: of.refused })
    });
    CapacitySummary {
        bounds: bounds.collect(),
        least: CapacityTable(section.least),
        least_bytes: section.least.bytes(),
        enough: refusals(run).is_empty(),
    }
}

/// Bounds that something was refused for, and how much.
fn refusals(run: &RunRecord) -> Vec<(&'static str, u64)> {
    let rows = run.sections.bounds.uses.rows(&run.plan.capacity);
    rows.iter().filter(|(.., of)| of.refused > 0).map(|(name, _, of)| (*name, of.refused)).collect()
}

/// Writes the sentence that names the capacity that would have been enough.
pub fn sentence(run: &RunRecord) -> String {
    let mib = run.sections.bounds.least.bytes() as f64 / MIB;
    let refused: Vec<String> =
        refusals(run).iter().map(|(name, count)| format!("{name} {count}")).collect();
    // A refusal hides how much would have been needed.
    if refused.is_empty() {
        format!("{mib:.1} MiB would have held this run without a refusal: --capacity capacity.toml")
    } else {
        format!(
            "refused for want of {}; --capacity capacity.toml has {mib:.1} MiB, and may still be \
             too little",
            refused.join(", ")
        )
    }
}

/// The least capacity as a file for `--capacity`.
///
/// # Errors
/// A bound is beyond TOML's integers.
pub fn capacity_toml(run: &RunRecord) -> Result<String, toml::ser::Error> {
    let least = &run.sections.bounds.least;
    // As a comment of the file, which may be used long after the report was read.
    let refused = if refusals(run).is_empty() {
        ""
    } else {
        "# Something was refused in that run, so more may be needed than stands here.\n"
    };
    Ok(format!(
        "# The least that a run over {} frames of {} needed: {} bytes.\n{refused}# dynvox run PATH \
         --capacity capacity.toml\n{}",
        run.frames.len(),
        run.plan.dataset.name(),
        least.bytes(),
        CapacityFile::of(least).to_toml()?
    ))
}
