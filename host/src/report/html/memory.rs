//! Memory: the block pool, the process, the slab region by region.

use super::{frames, series};
use crate::report::chart::{COLOURS, lines};
use crate::report::text::{MIB, grouped};
use crate::run::RunRecord;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let (frames, header) = (frames(run), &run.header);
    let pool = lines(
        &frames,
        &[
            series(run, "blocks in use", COLOURS[0], |row| f64::from(row.report.blocks.used)),
            series(run, "visible", COLOURS[3], |row| f64::from(row.report.blocks.visible)),
            series(run, "pool", COLOURS[5], |_| header.capacity.blocks as f64),
        ],
        "blocks",
        0.0,
    );
    let resident = lines(
        &frames,
        &[
            series(run, "resident memory of the process", COLOURS[4], |row| row.rss_bytes.map_or(f64::NAN, |bytes| bytes as f64 / MIB)),
            series(run, "slab", COLOURS[5], |_| header.slab_bytes as f64 / MIB),
            series(run, "limit", COLOURS[2], |_| header.rss_limit_bytes as f64 / MIB),
        ],
        "MiB",
        0.0,
    );
    html! {
        section {
            h2 { "Memory" }
            p.soft.small {
                "The core uses one slab of " (grouped(header.slab_bytes as u64)) " bytes, allocated before the first frame, and no other memory."
            }
            div.two { div { (pool) } div { (resident) } }
            details { summary.small { "The slab, region by region" } (regions(run)) }
        }
    }
}

fn regions(run: &RunRecord) -> Markup {
    html! {
        div.scroll { table {
            tr { th { "region" } th.n { "bytes" } th.n { "used" } th.n { "peak" } th { "peak share" } }
            @for region in &run.sections.blocks.regions {
                tr {
                    td { code { (region.name) } }
                    @for bytes in [region.bytes, region.used, region.peak] { td.n { (grouped(bytes as u64)) } }
                    td { span.bar { u style=(format!("width:{:.0}%", 100.0 * region.peak as f64 / region.bytes.max(1) as f64)) {} } }
                }
            }
        } }
    }
}
