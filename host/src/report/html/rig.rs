//! Section on the rig: the error of the calibration that the run found.

use super::{frames, series};
use crate::report::chart::{COLOURS, lines};
use crate::report::rig::{is_warning, sentence};
use crate::run::RunRecord;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let chart = lines(
        &frames(run),
        &[
            series(run, "size of what was found", COLOURS[0], "disparity_offset_px").sizes(),
            series(run, "size of what was taken out", COLOURS[3], "disparity_offset_applied_px")
                .sizes(),
        ],
        "px",
        0.1,
    );
    html! {
        section {
            h2 { "Disparity offset of the rig" }
            p.soft.small { @if is_warning(run) { b { (sentence(run)) "." } } @else { (sentence(run)) "." } }
            (chart)
        }
    }
}
