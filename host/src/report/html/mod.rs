//! `report.html`: the run on one page, in one file. Pictures and drawings are inside; nothing is fetched, no script runs.

mod objects;
mod reference;

use crate::report::chart::{self, COLOURS, Path, Series};
use crate::run::{FrameRow, RunRecord, StageTime};
use base64::{Engine, engine::general_purpose::STANDARD};
use dynvox_core::Stage;
use std::fmt::Write as _;
use std::io::{self, Write};

pub(crate) const STYLE: &str = include_str!("style.css");
const MIB: f64 = 1_048_576.0;

/// Writes the page.
pub fn write(out: &mut impl Write, run: &RunRecord) -> io::Result<()> {
    let title = format!("dynvox: {}", escaped(&run.name));
    write!(
        out,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{title}</title><style>{STYLE}</style></head><body><main>"
    )?;
    for part in [
        head(run),
        cards(run),
        trajectory(run),
        pictures(run),
        reference::section(run),
        objects::section(run),
        memory(run),
        time(run),
        health(run),
        configuration(run),
    ] {
        out.write_all(part.as_bytes())?;
    }
    write!(out, "</main></body></html>")
}

fn head(run: &RunRecord) -> String {
    let (width, height) = run.size;
    let mut html = format!(
        "<h1>{}</h1><p class=\"soft\">{} frames of {width} × {height} px, profile <code>{}</code>, {} thread{}, dynvox {}. \
         Digest of the last frame: <code>{:016x}</code></p>",
        escaped(&run.name),
        run.rows.len(),
        escaped(&run.profile),
        run.threads,
        if run.threads == 1 { "" } else { "s" },
        env!("CARGO_PKG_VERSION"),
        run.digest()
    );
    if !run.notes.is_empty() {
        let notes: String = run.notes.iter().map(|note| format!("<li>{}</li>", escaped(note))).collect();
        let _ = write!(html, "<ul class=\"soft small\">{notes}</ul>");
    }
    html
}

fn cards(run: &RunRecord) -> String {
    let mut cards = Vec::new();
    let mut card = |value: String, name: &str| cards.push(format!("<div class=\"card\"><b>{value}</b><span>{name}</span></div>"));
    card(format!("{:.1} fps", run.fps()), "mapping, images included");
    if let Some(exact) = &run.exact {
        card(format!("{:.1} cm", 100.0 * exact.median_error_m), "median depth error of the map");
        card(format!("{:.1} %", 100.0 * exact.completeness), "of what is within 20 m mapped");
    }
    if let Some(errors) = &run.errors {
        match errors.t_err_percent {
            Some(percent) => card(format!("{percent:.2} %"), "translation error of pieces"),
            None => card(format!("{:.2} cm", 100.0 * errors.rpe_t_m), "translation error per frame"),
        }
        card(format!("{:.3} m", errors.ate_m), "absolute trajectory error");
    }
    card(format!("{:.1} MiB", run.slab_bytes as f64 / MIB), "slab: all the core uses");
    let (used, blocks) = (run.blocks_peak(), run.capacity.blocks);
    card(format!("{:.0} %", 100.0 * f64::from(used) / blocks as f64), "of the block pool used at most");
    card(grouped(run.mesh.triangles), "triangles in map.ply");
    format!("<div class=\"cards\">{}</div>", cards.concat())
}

fn trajectory(run: &RunRecord) -> String {
    let above =
        |poses: &[dynvox_core::geometry::Transform]| poses.iter().map(|pose| (pose.translation_m[0], pose.translation_m[2])).collect();
    let poses = run.poses();
    let mut paths = vec![Path { name: "estimated", colour: "var(--accent)", dashed: false, points: above(&poses) }];
    if let Some(truth) = &run.truth {
        paths.push(Path { name: "true", colour: "var(--truth)", dashed: true, points: above(truth) });
    }
    let length = crate::evaluate::trajectory::travelled_m(&poses).last().copied().unwrap_or_default();
    let mut html = format!(
        "<section><h2>Trajectory from above</h2><p class=\"soft small\">{length:.1} m driven, {} of {} frames held at constant velocity</p>{}",
        run.held_frames(),
        run.rows.len(),
        chart::from_above(&paths)
    );
    if let Some((failures, first, cause)) = run.tracking_failures() {
        let _ = write!(
            html,
            "<p><b>Tracking failure in {failures} of {} frames</b>, first in frame {first}: {cause}. Their poses are guesses, and they are not in \
             the map.</p>",
            run.rows.len()
        );
    }
    if let Some(errors) = &run.errors {
        let _ = write!(
            html,
            "<p class=\"small\" style=\"margin-top:12px\">Against the true poses: from frame to frame {:.2} cm and {:.4}° (RMS); \
             {:.3} m (RMS) after rigid alignment.</p>",
            100.0 * errors.rpe_t_m,
            errors.rpe_r_deg,
            errors.ate_m
        );
        if !errors.per_length.is_empty() {
            html += "<div class=\"scroll\"><table><tr><th class=n>piece, m<th class=n>translation, %<th class=n>rotation, °/m<th class=n>pieces</tr>";
            for (length_m, percent, deg_per_m, pieces) in &errors.per_length {
                let _ =
                    write!(html, "<tr><td class=n>{length_m}<td class=n>{percent:.3}<td class=n>{deg_per_m:.5}<td class=n>{pieces}</tr>");
            }
            if let (Some(percent), Some(deg_per_m)) = (errors.t_err_percent, errors.r_err_deg_per_m) {
                let _ = write!(html, "<tr><td class=n><b>all</b><td class=n><b>{percent:.3}</b><td class=n><b>{deg_per_m:.5}</b><td></tr>");
            }
            html += "</table></div>";
        }
    }
    html + "</section>"
}

fn pictures(run: &RunRecord) -> String {
    let image = |png: &[u8], what: &str| format!("<img alt=\"{what}\" src=\"data:image/png;base64,{}\">", STANDARD.encode(png));
    let mut html =
        "<section><h2>What it saw, measured and mapped</h2><p class=\"soft small\">Left image; disparity from far (blue) to near (red), \
                    none where dark; the map from the camera's place after this frame.</p>"
            .to_owned();
    if run.keyframes.iter().any(|keyframe| !keyframe.composed_png.is_empty()) {
        html += "<p class=\"soft small\">Last: the map and, in front of it, every object where it is at that time, from a volume of its own: \
                 blue those that stand, orange those that move.</p>";
    }
    for keyframe in &run.keyframes {
        let (layout, composed) = match &keyframe.composed_png[..] {
            [] => ("three", String::new()),
            png => ("four", image(png, "map with objects")),
        };
        let _ = write!(
            html,
            "<figure><div class=\"{layout}\">{}{}{}{composed}</div><figcaption>frame {}</figcaption></figure>",
            image(&keyframe.input_png, "left image"),
            image(&keyframe.disparity_png, "disparity"),
            image(&keyframe.raycast_png, "map"),
            keyframe.frame
        );
    }
    if !run.overview_png.is_empty() {
        let overview = image(&run.overview_png, "map from behind and above");
        let _ = write!(html, "<figure>{overview}<figcaption>The finished map from behind and above the last camera</figcaption></figure>");
    }
    html + "</section>"
}

fn series<'a>(run: &RunRecord, name: &'a str, colour: &'a str, value: impl Fn(&FrameRow) -> f64) -> Series<'a> {
    Series { name, colour, values: run.rows.iter().map(value).collect() }
}

fn frames(run: &RunRecord) -> Vec<usize> {
    run.rows.iter().map(|row| row.frame).collect()
}

fn memory(run: &RunRecord) -> String {
    let frames = frames(run);
    let pool = chart::lines(
        &frames,
        &[
            series(run, "blocks in use", COLOURS[0], |row| f64::from(row.report.blocks.used)),
            series(run, "visible", COLOURS[3], |row| f64::from(row.report.blocks.visible)),
            series(run, "pool", COLOURS[5], |_| run.capacity.blocks as f64),
        ],
        "blocks",
        0.0,
    );
    let resident = chart::lines(
        &frames,
        &[
            series(run, "resident memory of the process", COLOURS[4], |row| row.rss_bytes.map_or(f64::NAN, |bytes| bytes as f64 / MIB)),
            series(run, "slab", COLOURS[5], |_| run.slab_bytes as f64 / MIB),
            series(run, "ceiling: the run fails above", COLOURS[2], |_| run.rss_limit_bytes as f64 / MIB),
        ],
        "MiB",
        0.0,
    );
    let mut html = format!(
        "<section><h2>Memory</h2><p class=\"soft small\">The core works in one slab of {} bytes cut before the first frame; it never asks for more.</p>\
         <div class=\"two\"><div>{pool}</div><div>{resident}</div></div>\
         <details><summary class=\"small\">The slab, region by region</summary><div class=\"scroll\"><table>\
         <tr><th>region<th class=n>bytes<th class=n>used<th class=n>peak<th>peak share</tr>",
        grouped(run.slab_bytes as u64)
    );
    for region in &run.regions {
        let share = 100.0 * region.peak as f64 / region.bytes.max(1) as f64;
        let _ = write!(
            html,
            "<tr><td><code>{}</code><td class=n>{}<td class=n>{}<td class=n>{}<td><span class=bar><u style=\"width:{share:.0}%\"></u></span></tr>",
            region.name,
            grouped(region.bytes as u64),
            grouped(region.used as u64),
            grouped(region.peak as u64)
        );
    }
    html + "</table></div></details></section>"
}

fn time(run: &RunRecord) -> String {
    let frames = frames(run);
    let stages = |of: fn(&StageTime) -> f64| {
        let within = Stage::ALL.iter().enumerate().filter(|(_, stage)| **stage != Stage::Raycast);
        let one = |(at, stage): (usize, &Stage)| series(run, stage.name(), COLOURS[at % COLOURS.len()], move |row| of(&row.stages[at]));
        within.map(one).collect::<Vec<_>>()
    };
    let mut wall = vec![series(run, "whole step", "currentColor", |row| row.step_ms)];
    wall.extend(stages(|time| time.wall_ms));
    let mut html = format!(
        "<section><h2>Time per stage</h2><p class=\"soft small\">Left: wall time; stereo and scene flow run side by side where there are two \
         threads, and other work on the machine counts. Right: CPU time of all threads, stacked. Raycasts are taken for this page on some \
         frames, outside the step.</p><div class=\"two\"><div>{}</div><div>{}</div></div><div class=\"scroll\"><table>\
         <tr><th>stage<th class=n>median, ms<th class=n>p99, ms<th class=n>CPU median, ms<th class=n>frames</tr>",
        chart::lines(&frames, &wall, "ms, wall", 0.0),
        chart::stacked(&frames, &stages(|time| time.cpu_ms), "ms, CPU")
    );
    for (name, of) in run.stage_statistics() {
        let _ = write!(
            html,
            "<tr><td>{name}<td class=n>{:.2}<td class=n>{:.2}<td class=n>{:.2}<td class=n>{}</tr>",
            of.median_ms, of.p99_ms, of.cpu_median_ms, of.frames
        );
    }
    html + "</table></div></section>"
}

fn health(run: &RunRecord) -> String {
    let frames = frames(run);
    let matches = chart::lines(
        &frames,
        &[
            series(run, "matches", COLOURS[5], |row| f64::from(row.matches().0)),
            series(run, "inliers", COLOURS[0], |row| f64::from(row.matches().1)),
        ],
        "matches",
        0.0,
    );
    let density = chart::lines(
        &frames,
        &[series(run, "pixels with a disparity", COLOURS[3], |row| 100.0 * f64::from(row.report.stereo.density()))],
        "%",
        100.0,
    );
    let refused = run.blocks_refused();
    let mut words = match (refused, run.blocks_lost()) {
        (0, 0) => "Every block asked for found room, and none was lost.".to_owned(),
        (0, lost) => format!("<b>{} blocks are lost.</b>", grouped(lost)),
        (refused, _) => format!("<b>The pool was full: {} blocks found no room.</b> A larger profile maps them.", grouped(refused)),
    };
    if let Some(failure) = &run.shelf_failure {
        let _ = write!(words, " <b>map.blocks took no more ({}): what left the pool from there on is lost.</b>", escaped(failure));
    }
    format!(
        "<section><h2>Health</h2><p class=\"soft small\">{words}</p>{}<div class=\"two\"><div>{matches}</div><div>{density}</div></div></section>",
        counters(run)
    )
}

/// Everything that is counted, over all frames.
fn counters(run: &RunRecord) -> String {
    let sum = |of: fn(&FrameRow) -> u32| run.rows.iter().map(|row| u64::from(of(row))).sum::<u64>();
    let most = |of: fn(&FrameRow) -> u64| run.rows.iter().map(of).max().unwrap_or_default();
    let rows = [
        ("blocks used at most", u64::from(run.blocks_peak())),
        ("blocks refused", run.blocks_refused()),
        ("blocks that left the pool and were kept", sum(|row| row.report.allocation.eviction.kept)),
        ("blocks that left with nothing in them", sum(|row| row.report.allocation.eviction.empty)),
        ("blocks brought back", run.blocks_back()),
        ("blocks compared in one lookup of the index at most", most(|row| u64::from(row.report.allocation.probes_most))),
        ("blocks lost", run.blocks_lost()),
        ("blocks written at the end", u64::from(run.shelf.end.kept)),
        ("records on disk, replaced ones included", run.shelf.records),
        ("bytes on disk", run.shelf.bytes),
        ("frames in the pruning window at most", most(|row| row.history_frames as u64)),
        ("blocks visited by pruning", sum(|row| row.report.prune.visited) + u64::from(run.finish.visited)),
        ("voxels reset", sum(|row| row.report.prune.voxels_reset) + u64::from(run.finish.voxels_reset)),
        ("blocks freed by pruning", sum(|row| row.report.prune.blocks_freed) + u64::from(run.finish.blocks_freed)),
        ("pruning visits carried over at most", most(|row| u64::from(row.report.prune.carried_over))),
        ("frames pruned early", sum(|row| row.report.prune.early)),
        ("features and matches dropped", sum(|row| row.report.dropped_features())),
        ("values of given depth refused", sum(|row| row.depth_refused)),
        ("frames with a guessed motion", run.held_frames() as u64),
    ];
    let rows: String = rows.iter().map(|(name, value)| format!("<tr><td>{name}<td class=n>{}</tr>", grouped(*value))).collect();
    format!(
        "<details><summary class=\"small\">Everything counted; worst: {}</summary><div class=\"scroll\"><table>{rows}</table></div></details>",
        run.worst().name()
    )
}

fn configuration(run: &RunRecord) -> String {
    let rig = run.rig;
    format!(
        "<section><details><summary>Configuration</summary><p class=\"soft small\">Rig: focal length {:.3} px, principal point ({:.2}, {:.2}) px, \
         baseline {:.4} m.</p><pre>{}</pre></details></section>",
        rig.focal_px,
        rig.center_u_px,
        rig.center_v_px,
        rig.baseline_m,
        escaped(&run.config_toml)
    )
}

/// 1234567 as 1,234,567.
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
