//! Memory: the block pool, the process, the slab region by region.

use super::{constant, frames, series, table};
use crate::observe::BoundUse;
use crate::report::bounds;
use crate::report::chart::{COLOURS, lines};
use crate::report::text::{MIB, grouped};
use crate::run::RunRecord;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let (frames, plan) = (frames(run), &run.plan);
    let pool = lines(
        &frames,
        &[
            series(run, "blocks in use", COLOURS[0], "blocks_used"),
            series(run, "visible", COLOURS[3], "blocks_visible"),
            constant(run, "pool", COLOURS[5], plan.capacity.blocks as f64),
        ],
        "blocks",
        0.0,
    );
    // Beside the slab: what the host needs for images, tables and pictures.
    let resident = lines(
        &frames,
        &[
            series(run, "resident memory of the process", COLOURS[4], "rss_bytes")
                .scaled(1.0 / MIB),
            constant(run, "slab", COLOURS[5], plan.capacity.bytes() as f64 / MIB),
            constant(run, "limit", COLOURS[2], plan.rss_limit_bytes as f64 / MIB),
        ],
        "MiB",
        0.0,
    );
    html! {
        section {
            h2 { "Memory" }
            p.soft.small {
                "The core uses one slab of " (grouped(plan.capacity.bytes() as u64)) " bytes, \
                    allocated before the first frame, and no other memory."
            }
            div.two { div { (pool) } div { (resident) } }
            p.small { "Bounds: " (bounds::sentence(run)) "." }
            details {
                    summary.small { "Bound by bound" }
                    (table(
                        &[("bound", false), ("of the run", true), ("needed", true), ("refused", true)],
                        &bounds_table(run),
                    ))
                }
            details { summary.small { "The slab, region by region" } (regions(run)) }
        }
    }
}

fn bounds_table(run: &RunRecord) -> Vec<Vec<String>> {
    let rows = run.sections.bounds.uses.rows(&run.plan.capacity);
    let cells = |(name, bound, of): (&str, usize, BoundUse)| {
        std::iter::once(name.to_owned())
            .chain([bound as u64, of.needed as u64, of.refused].map(grouped))
            .collect()
    };
    rows.into_iter().map(cells).collect()
}

fn regions(run: &RunRecord) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label="table" { table {
            tr { th { "region" } th.n { "bytes" } th.n { "used" } th.n { "peak" } th { "peak share" } }
            @for region in &run.sections.blocks.regions {
                tr {
                    td { code { (region.name) } }
                    @for bytes in [region.bytes, region.used, region.peak] { td.n { (grouped(bytes as u64)) } }
                    // A region of 0 bytes has no peak.
                    td { span.bar { u style=(format!("width:{:.0}%", 100.0 * region.peak as f64 / region.bytes.max(1) as f64)) {} } }
                }
            }
        } }
    }
}
