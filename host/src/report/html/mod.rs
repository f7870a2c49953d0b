//! `report.html`: the run on one page, in one file. Pictures and drawings are inside; nothing is
//! fetched, and only the viewer has a script.

mod head;
mod health;
mod memory;
mod objects;
mod pictures;
mod reference;
mod rig;
mod time;
mod trajectory;

use super::chart::Series;
use crate::run::RunRecord;
use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::io::{self, Write};

const STYLE: &str = include_str!("style.css");

/// A page of its own with the common style.
pub fn page(title: &str, content: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (content) } }
        }
    }
}

/// Writes the page, with the viewer in it.
///
/// # Errors
/// The disk refuses.
pub fn write(out: &mut impl Write, run: &RunRecord, viewer: &Markup) -> io::Result<()> {
    // From what a reader asks first to what explains a fault.
    let content = html! {
        (head::title(run))
        (viewer)
        (head::figures(run))
        (trajectory::section(run))
        (pictures::section(run))
        (reference::section(run))
        (objects::section(run))
        (memory::section(run))
        (time::section(run))
        (health::section(run))
        (rig::section(run))
        (configuration(run))
    };
    out.write_all(
        page(&format!("dynvox: {}", run.plan.dataset.name()), &content).into_string().as_bytes(),
    )
}

fn configuration(run: &RunRecord) -> Markup {
    let rig = run.plan.dataset.rig();
    html! {
        section { details {
            summary { "Configuration" }
            p.soft.small {
                (format!(
                    "Rig: focal length {:.3} px, principal point ({:.2}, {:.2}) px, baseline {:.4} \
                     m.",
                    rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m
                ))
            }
            pre { (run.plan.config_toml) }
        } }
    }
}

/// A picture inside the page.
fn image(jpeg: &[u8], alt: &str) -> Markup {
    html! { img alt=(alt) src={ "data:image/jpeg;base64," (STANDARD.encode(jpeg)) }; }
}

/// A table that scrolls where the page is narrow: heads with whether their column holds numbers,
/// then rows of cells.
fn table(heads: &[(&str, bool)], rows: &[Vec<String>]) -> Markup {
    html! {
        div.scroll tabindex="0" role="region" aria-label="table" { table {
            tr { @for (head, number) in heads { th.n[*number] { (head) } } }
            @for row in rows {
                tr { @for (cell, (_, number)) in row.iter().zip(heads) { td.n[*number] { (cell) } } }
            }
        } }
    }
}

/// A charted column of `frames.csv`: one value for each frame, or for several frames where there
/// are many.
fn series<'a>(run: &RunRecord, name: &'a str, colour: &'a str, column: &str) -> Series<'a> {
    Series { name, colour, values: run.frames.charts().series(column) }
}

/// Makes a series with one value for all frames.
fn constant<'a>(run: &RunRecord, name: &'a str, colour: &'a str, value: f64) -> Series<'a> {
    Series { name, colour, values: vec![value; frames(run).len()] }
}

/// Numbers of the frames that values are of.
fn frames(run: &RunRecord) -> Vec<usize> {
    run.frames.charts().frames()
}
