//! The page: every sweep, on every data set, next to the original's numbers. One file, nothing
//! fetched, no script.

use super::figures;
use super::table::common_accuracy;
use super::{Kind, Plan, Point, Results, RunResult, published};
use crate::report::html::page;
use maud::{Markup, html};
use std::collections::BTreeMap;

/// A point of a sweep and the result of its run, once there is one.
pub(super) type Row<'r> = (&'r Point, Option<&'r RunResult>);

/// Draws the page.
pub fn html(plan: &Plan, results: &Results) -> Markup {
    let done = plan.runs.keys().filter(|key| results.contains_key(*key)).count();
    let content = html! {
        h1 { "Sweeps" }
        p.soft {
            (done) " of " (plan.runs.len()) " runs are finished. dynvox " (env!("CARGO_PKG_VERSION")) ". Boxes: quartiles and median over \
                evaluated "
            "frames, whiskers to the last frame within 1.5 box heights. Accuracy is measured at \
             the points that both input and map show: a lost "
            "map shows few. \"Map alone\" is of all points the map shows, \"common points\" of \
             those that the maps of all rows show: only these tell one row "
            "from another, for a map that drops what is hard looks more accurate. Dashed lines: \
             the original's published numbers, on other data; compare shapes, not values."
        }
        @for kind in plan.kinds() {
            section {
                h2 { (title(kind)) }
                @for data in plan.data(kind) {
                    @let rows: Vec<Row<'_>> = plan.of(kind, data).map(|point| (point, results.get(&point.run))).collect();
                    h3.apart { (data) " " span.soft.small { (evaluated_against(&rows)) } }
                    (figures::figures(kind, &rows))
                    (table(kind, &rows, &common_accuracy(plan, kind, data, results)))
                }
                (originals(kind))
            }
        }
        (commands(plan))
    };
    page("dynvox: sweeps", &content)
}

fn title(kind: Kind) -> &'static str {
    match kind {
        Kind::PruneWeight => "Prune weight",
        Kind::FrameRate => "Fusing every k-th frame",
        Kind::Scale => "Image scale",
        Kind::Depth => "Source of depth",
        Kind::Dynamic => "Dynamic objects separate, or fused into the static map",
        Kind::Methods => "Three methods (Table I)",
    }
}

/// The reference the map was evaluated against.
fn evaluated_against(rows: &[Row<'_>]) -> String {
    let Some(result) = rows.iter().find_map(|(_, result)| *result) else {
        return "not run yet".to_owned();
    };
    let (frames, reference) = (&result.summary["frames"], &result.summary["lidar"]);
    match reference["source"].as_str() {
        Some(source) => {
            let name = if source == "lidar" { "LiDAR" } else { "exact depth" };
            format!(
                "{frames} frames; {} evaluated against {name}, {} frames later",
                reference["frames"], reference["delay_frames"]
            )
        }
        None => format!("{frames} frames; the data set has no reference depth"),
    }
}

/// Every value with what was measured.
fn table(kind: Kind, rows: &[Row<'_>], common: &BTreeMap<String, (f64, u64)>) -> Markup {
    let numbers = [
        "input accuracy",
        "input compl.",
        "map accuracy",
        "map compl.",
        "map F1",
        "map alone",
        "map, common points",
        "objects: input",
        "objects: map",
        "blocks",
        "trail triangles",
        "ATE, m",
    ];
    html! {
        div.scroll tabindex="0" role="region" aria-label="table" { table {
            tr { th { (kind.name()) } th { "tracking" } @for name in numbers { th.n { (name) } } }
            @for (point, result) in rows {
                tr {
                    td { (point.value) }
                    td { (tracking(*result)) }
                    @for cell in cells(*result, common.get(&point.run)) { td.n { (cell) } }
                }
            }
        } }
    }
}

fn tracking(result: Option<&RunResult>) -> Markup {
    match result.map(|result| (result.tracking_failures(), &result.summary["frames"])) {
        None => html! { "not run yet" },
        Some((Some(failures), frames)) => {
            html! { b { "tracking failure" } " in " (failures) " of " (frames) " frames" }
        }
        Some((None, _)) => html! { "ok" },
    }
}

fn cells(result: Option<&RunResult>, common: Option<&(f64, u64)>) -> Vec<String> {
    // A run that is not finished, or lacks the figure, shows a dash.
    let unknown = || "–".to_owned();
    let shares = [
        ("static", "input", "accuracy"),
        ("static", "input", "completeness"),
        ("static", "fused", "accuracy"),
        ("static", "fused", "completeness"),
        ("static", "fused", "f1"),
        ("static", "fused", "accuracy_alone"),
    ];
    let objects = [("dynamic", "input", "accuracy"), ("dynamic", "fused", "accuracy")];
    let shown = |(region, source, name): (&str, &str, &str)| {
        let share = result.and_then(|result| result.share(region, source, name));
        share.map_or_else(unknown, |share| format!("{share:.3}"))
    };
    let common = common.map_or_else(unknown, |(accuracy, _)| format!("{accuracy:.3}"));
    let numbers = [("map", "blocks", 0), ("map", "swept_triangles", 0), ("egomotion", "ate_m", 3)]
        .map(|(group, name, digits)| {
            let number = result.and_then(|result| result.summary[group][name].as_f64());
            number.map_or_else(unknown, |number| format!("{number:.digits$}"))
        });
    shares.map(shown).into_iter().chain([common]).chain(objects.map(shown)).chain(numbers).collect()
}

/// Tables of the original that are not in the figures.
fn originals(kind: Kind) -> Markup {
    let heading = |about: &str| html! { h3.apart { "The original " span.soft.small { (about) } } };
    match kind {
        Kind::Methods => html! {
            (heading("Table I: tracking sequence 09"))
            div.scroll tabindex="0" role="region" aria-label="table" { table {
                tr {
                    th { "method" }
                    @for name in [
                        "ELAS accuracy", "ELAS compl.", "DispNet accuracy", "DispNet compl."
                    ] { th.n { (name) } }
                }
                @for (method, shares) in published::METHODS {
                    tr {
                        td { (method) }
                        @match shares {
                            Some(shares) => @for share in shares { td.n { (format!("{share:.3}")) } },
                            None => td colspan="4" { "tracking failure" },
                        }
                    }
                }
            } }
        },
        Kind::Dynamic => html! {
            (heading("static accuracy on the tracking sequences, ELAS"))
            div.scroll tabindex="0" role="region" aria-label="table" { table {
                tr { th { "sequence" } @for name in ["input", "off", "on"] { th.n { (name) } } }
                @for (sequence, shares) in published::DYNAMIC_ELAS.iter().enumerate() {
                    tr { td { (format!("{sequence:02}")) } @for share in shares { td.n { (format!("{share:.4}")) } } }
                }
            } }
        },
        Kind::Depth => html! {
            (heading("odometry 00 to 10: means, and quartiles over frames of the static accuracy"))
            div.scroll tabindex="0" role="region" aria-label="table" { table {
                tr {
                    th { "source" }
                    @for name in ["static accuracy", "static compl.", "dynamic accuracy", "dynamic compl.", "quartiles"] { th.n { (name) } }
                }
                @for ((source, shares), (_, [low, middle, high])) in published::DEPTHS.iter().zip(published::DEPTH_QUARTILES) {
                    tr {
                        td { (source) }
                        @for share in shares { td.n { (format!("{share:.3}")) } }
                        td.n { (format!("{low:.3} / {middle:.3} / {high:.3}")) }
                    }
                }
            } }
        },
        Kind::PruneWeight | Kind::FrameRate | Kind::Scale => html! {},
    }
}

/// The command line of every run.
fn commands(plan: &Plan) -> Markup {
    html! {
        section { details {
            summary { "Commands" }
            p.soft.small { "Each run asks for its data set, and for these values unlike the \
                            defaults." }
            div.scroll tabindex="0" role="region" aria-label="table" { table {
                @for (key, request) in &plan.runs { tr { td { code { (key) } } td { code { (request.words()) } } } }
            } }
        } }
    }
}
