//! The page: every sweep, on every data set, beside the original's numbers. One file, nothing fetched, no script.

use super::{
    FrameSample, Kind, Plan, Point, Results, RunResult,
    draw::{Boxes, Curve, drawing, five},
    published as theirs,
};
use crate::report::chart::COLOURS;
use crate::report::html::{STYLE, escaped};
use std::fmt::Write;

/// Draws the page.
pub fn html(plan: &Plan, results: &Results) -> String {
    let done = plan.runs.keys().filter(|key| results.contains_key(*key)).count();
    let mut html = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\"><title>dynvox: sweeps</title>\
         <style>{STYLE}</style></head><body><main><h1>Sweeps</h1><p class=\"soft\">{done} of {} runs made. dynvox {}. Boxes: quartiles and median over \
         evaluated frames, whiskers to the last frame within 1.5 box heights. Accuracy is judged on the points that input and map both show: a map that \
         was lost shows few. Broken lines: the original's published numbers, on other data; shapes can be \
         compared, values cannot.</p>",
        plan.runs.len(),
        env!("CARGO_PKG_VERSION")
    );
    for kind in plan.kinds() {
        let _ = write!(html, "<section><h2>{}</h2>", title(kind));
        for data in plan.data(kind) {
            let rows: Vec<(&Point, Option<&RunResult>)> = plan.of(kind, data).map(|point| (point, results.get(&point.run))).collect();
            let _ = write!(html, "<h3 style=\"margin-top:16px\">{} <span class=\"soft small\">{}</span></h3>", escaped(data), about(&rows));
            let figures = match kind {
                Kind::PruneWeight => prune(&rows),
                Kind::FrameRate => rate(&rows),
                Kind::Scale => scale(&rows),
                Kind::Depth => depth(&rows),
                Kind::Dynamic | Kind::Methods => String::new(),
            };
            html += &figures;
            html += &table(kind, &rows);
        }
        html += &originals(kind);
        html += "</section>";
    }
    html + &commands(plan) + "</main></body></html>"
}

fn title(kind: Kind) -> &'static str {
    match kind {
        Kind::PruneWeight => "What the prune weight buys",
        Kind::FrameRate => "Fusing every k-th frame",
        Kind::Scale => "Smaller images",
        Kind::Depth => "Where depth comes from",
        Kind::Dynamic => "What moves, kept apart or not",
        Kind::Methods => "Three methods (Table I)",
    }
}

/// What the map was held against.
fn about(rows: &[(&Point, Option<&RunResult>)]) -> String {
    let Some(result) = rows.iter().find_map(|(_, result)| *result) else { return "no run made yet".to_owned() };
    let (frames, lidar) = (&result.summary["frames"], &result.summary["lidar"]);
    match lidar["source"].as_str() {
        Some(source) => {
            let what = if source == "lidar" { "LiDAR" } else { "exact depth" };
            format!("{frames} frames; {} held against {what}, {} frames later", lidar["frames"], lidar["delay_frames"])
        }
        None => format!("{frames} frames; nothing to hold the map against"),
    }
}

type Rows<'r> = [(&'r Point, Option<&'r RunResult>)];

fn labels(rows: &Rows<'_>) -> Vec<String> {
    rows.iter().map(|(point, _)| escaped(&point.value)).collect()
}

fn boxes(rows: &Rows<'_>, of: impl Fn(&FrameSample) -> Option<f64>) -> Vec<Option<[f64; 5]>> {
    rows.iter().map(|(_, result)| five(&result.as_ref()?.samples.iter().filter_map(&of).collect::<Vec<f64>>())).collect()
}

fn shares(rows: &Rows<'_>, source: &str, name: &str) -> Vec<Option<f64>> {
    rows.iter().map(|(_, result)| result.as_ref()?.share("static", source, name)).collect()
}

/// Looks up each row's value in a table of the original's.
fn published(rows: &Rows<'_>, of: impl Fn(u32) -> Option<f64>) -> Vec<Option<f64>> {
    rows.iter().map(|(point, _)| of(point.value.parse().ok()?)).collect()
}

fn ours<'a>(name: &'a str, colour: &'a str, numbers: Vec<Option<f64>>) -> Curve<'a> {
    Curve { name, colour, theirs: false, numbers }
}

fn original<'a>(name: &'a str, colour: &'a str, numbers: Vec<Option<f64>>) -> Curve<'a> {
    Curve { name, colour, theirs: true, numbers }
}

fn side_by_side(figures: &[String]) -> String {
    format!("<div class=\"two\">{}</div>", figures.concat())
}

fn prune(rows: &Rows<'_>) -> String {
    let at =
        |table: [f64; 7]| published(rows, |weight| theirs::PRUNE.weights.iter().position(|known| *known == weight).map(|at| table[at]));
    let labels = labels(rows);
    let part = |of: &dyn Fn(&FrameSample) -> Option<f64>| [Boxes { name: "map, by frame", colour: COLOURS[0], boxes: boxes(rows, of) }];
    let accuracy = drawing(
        "accuracy of the static map by prune weight",
        &labels,
        &part(&|sample| sample.accuracy[1]),
        &[
            ours("mean", COLOURS[0], shares(rows, "fused", "accuracy")),
            original("ELAS", COLOURS[1], at(theirs::PRUNE.elas.accuracy)),
            original("DispNet", COLOURS[5], at(theirs::PRUNE.dispnet.accuracy)),
        ],
    );
    let completeness = drawing(
        "completeness by prune weight",
        &labels,
        &part(&|sample| sample.completeness[1]),
        &[
            ours("mean", COLOURS[0], shares(rows, "fused", "completeness")),
            original("ELAS", COLOURS[1], at(theirs::PRUNE.elas.completeness)),
            original("DispNet", COLOURS[5], at(theirs::PRUNE.dispnet.completeness)),
        ],
    );
    let relative = |table: [f64; 7]| at(table.map(|gib| gib / table[0]));
    let whole = rows.iter().find(|(point, _)| point.value == "0").and_then(|(_, result)| result.as_ref()?.blocks_in_the_end());
    let memory: Vec<Option<f64>> = rows.iter().map(|(_, result)| Some(result.as_ref()?.blocks_in_the_end()? / whole?)).collect();
    let memory = drawing(
        "blocks in the end, as a share of weight 0",
        &labels,
        &[],
        &[
            ours("map", COLOURS[0], memory),
            original("ELAS", COLOURS[1], relative(theirs::PRUNE.elas.memory_gib)),
            original("DispNet", COLOURS[5], relative(theirs::PRUNE.dispnet.memory_gib)),
        ],
    );
    side_by_side(&[accuracy, completeness]) + &side_by_side(&[memory, over_time(rows)])
}

/// Blocks in use while driving, a line for each value.
fn over_time(rows: &Rows<'_>) -> String {
    const PLACES: usize = 12;
    let frames = rows.iter().filter_map(|(_, result)| Some(result.as_ref()?.blocks.len())).max().unwrap_or_default();
    if frames < 2 {
        return String::new();
    }
    let places: Vec<usize> = (0..PLACES).map(|nth| nth * (frames - 1) / (PLACES - 1)).collect();
    let curves: Vec<Curve<'_>> = rows
        .iter()
        .zip(COLOURS.iter().cycle())
        .map(|((point, result), colour)| {
            let numbers = places.iter().map(|&at| Some(f64::from(*result.as_ref()?.blocks.get(at)?) / 1e3)).collect();
            ours(&point.value, colour, numbers)
        })
        .collect();
    let labels: Vec<String> = places.iter().map(ToString::to_string).collect();
    drawing("thousand blocks in use by frame, a line a weight", &labels, &[], &curves)
}

fn rate(rows: &Rows<'_>) -> String {
    let labels = labels(rows);
    let of = |table: [f64; 12]| published(rows, |k| table.get((k as usize).checked_sub(1)?).copied());
    let figure = |name: &str, of_sample: fn(&FrameSample) -> Option<f64>, table| {
        drawing(
            name,
            &labels,
            &[Boxes { name: "map, by frame", colour: COLOURS[0], boxes: boxes(rows, of_sample) }],
            &[original("DispNet, medians", COLOURS[1], of(table))],
        )
    };
    side_by_side(&[
        figure("accuracy, fusing every k-th frame", |sample| sample.accuracy[1], theirs::RATE_ACCURACY),
        figure("completeness, fusing every k-th frame", |sample| sample.completeness[1], theirs::RATE_COMPLETENESS),
    ])
}

fn scale(rows: &Rows<'_>) -> String {
    let labels = labels(rows);
    let wrong = |source: &str| shares(rows, source, "accuracy").into_iter().map(|share| share.map(|share| 1.0 - share)).collect();
    let at = |column: usize| published(rows, |percent| theirs::SCALE_ERRORS.iter().find(|row| row.0 == percent).map(|row| row.1[column]));
    let errors = drawing(
        "error rate (1 - accuracy) by scale, %",
        &labels,
        &[],
        &[
            ours("input", COLOURS[3], wrong("input")),
            ours("map", COLOURS[0], wrong("fused")),
            original("ELAS, input", COLOURS[2], at(0)),
            original("ELAS, fused", COLOURS[1], at(1)),
        ],
    );
    let completeness = drawing(
        "completeness by scale, %",
        &labels,
        &[],
        &[ours("input", COLOURS[3], shares(rows, "input", "completeness")), ours("map", COLOURS[0], shares(rows, "fused", "completeness"))],
    );
    side_by_side(&[errors, completeness])
}

fn depth(rows: &Rows<'_>) -> String {
    let labels = labels(rows);
    let both = |of: fn(&FrameSample, usize) -> Option<f64>| {
        [
            Boxes { name: "input", colour: COLOURS[3], boxes: boxes(rows, |sample| of(sample, 0)) },
            Boxes { name: "map", colour: COLOURS[0], boxes: boxes(rows, |sample| of(sample, 1)) },
        ]
    };
    side_by_side(&[
        drawing("static accuracy by source of depth", &labels, &both(|sample, source| sample.accuracy[source]), &[]),
        drawing("static completeness by source of depth", &labels, &both(|sample, source| sample.completeness[source]), &[]),
    ])
}

/// Every value with what was measured.
fn table(kind: Kind, rows: &Rows<'_>) -> String {
    let mut html = format!(
        "<div class=\"scroll\"><table><tr><th>{}<th>tracking<th class=n>input accuracy<th class=n>input compl.<th class=n>map accuracy<th class=n>map compl.<th class=n>map F1\
         <th class=n>cars: input<th class=n>cars: map<th class=n>blocks<th class=n>trail triangles<th class=n>ATE, m</tr>",
        kind.name()
    );
    for (point, result) in rows {
        let share = |layer: &str, source: &str, name: &str| {
            let share = result.as_ref().and_then(|result| result.share(layer, source, name));
            share.map_or_else(|| "–".to_owned(), |share| format!("{share:.3}"))
        };
        let number = |group: &str, name: &str, digits: usize| {
            let number = result.as_ref().and_then(|result| result.summary[group][name].as_f64());
            number.map_or_else(|| "–".to_owned(), |number| format!("{number:.digits$}"))
        };
        let tracking = match result {
            None => "not run yet".to_owned(),
            Some(result) => match result.lost() {
                Some(failures) => format!("<b>tracking failure</b> in {failures} of {} frames", result.summary["frames"]),
                None => "ok".to_owned(),
            },
        };
        let _ = write!(
            html,
            "<tr><td>{}<td>{tracking}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}</tr>",
            escaped(&point.value),
            share("static", "input", "accuracy"),
            share("static", "input", "completeness"),
            share("static", "fused", "accuracy"),
            share("static", "fused", "completeness"),
            share("static", "fused", "f1"),
            share("dynamic", "input", "accuracy"),
            share("dynamic", "fused", "accuracy"),
            number("map", "blocks", 0),
            number("map", "swept_triangles", 0),
            number("egomotion", "ate_m", 3)
        );
    }
    html + "</table></div>"
}

/// Tables of the original that are not in the figures.
fn originals(kind: Kind) -> String {
    let mut html = String::new();
    match kind {
        Kind::Methods => {
            html += "<h3 style=\"margin-top:16px\">The original <span class=\"soft small\">Table I: tracking sequence 09</span></h3><div class=\"scroll\"><table><tr><th>method\
                     <th class=n>ELAS accuracy<th class=n>ELAS compl.<th class=n>DispNet accuracy<th class=n>DispNet compl.</tr>";
            for (method, shares) in theirs::METHODS {
                let cells = shares.map_or_else(
                    || "<td colspan=4>tracking failure".to_owned(),
                    |shares| shares.iter().map(|share| format!("<td class=n>{share:.3}")).collect(),
                );
                let _ = write!(html, "<tr><td>{method}{cells}</tr>");
            }
        }
        Kind::Dynamic => {
            html += "<h3 style=\"margin-top:16px\">The original <span class=\"soft small\">static accuracy on the tracking sequences, ELAS</span></h3><div class=\"scroll\"><table>\
                     <tr><th>sequence<th class=n>input<th class=n>off<th class=n>on</tr>";
            for (sequence, [input, off, on]) in theirs::DYNAMIC_ELAS.iter().enumerate() {
                let _ = write!(html, "<tr><td>{sequence:02}<td class=n>{input:.4}<td class=n>{off:.4}<td class=n>{on:.4}</tr>");
            }
        }
        Kind::Depth => {
            html += "<h3 style=\"margin-top:16px\">The original <span class=\"soft small\">odometry 00 to 10: means, and quartiles over frames of the static accuracy</span></h3>\
                     <div class=\"scroll\"><table><tr><th>source<th class=n>static accuracy<th class=n>static compl.<th class=n>dynamic accuracy\
                     <th class=n>dynamic compl.<th class=n>quartiles</tr>";
            for ((source, shares), (_, [low, middle, high])) in theirs::DEPTHS.iter().zip(theirs::DEPTH_QUARTILES) {
                let cells: String = shares.iter().map(|share| format!("<td class=n>{share:.3}")).collect();
                let _ = write!(html, "<tr><td>{source}{cells}<td class=n>{low:.3} / {middle:.3} / {high:.3}</tr>");
            }
        }
        Kind::PruneWeight | Kind::FrameRate | Kind::Scale => return html,
    }
    html + "</table></div>"
}

/// What made every run.
fn commands(plan: &Plan) -> String {
    let rows: String = plan
        .runs
        .iter()
        .map(|(key, arguments)| format!("<tr><td><code>{key}</code><td><code>{}</code></tr>", escaped(&arguments.join(" "))))
        .collect();
    format!(
        "<section><details><summary>Arguments of every run</summary><p class=\"soft small\">After <code>dynvox run</code> and the data set.</p>\
         <div class=\"scroll\"><table>{rows}</table></div></details></section>"
    )
}
