//! A sweep as CSV.

use super::{Kind, Plan, Point, Results, RunResult};
use crate::evaluate::reference::on_common_points;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::io;

/// One point. Cells are empty where a value is unknown, all of them where the run is missing.
#[derive(Serialize)]
struct PointColumns<'a> {
    data: &'a str,
    value: &'a str,
    run: &'a str,
    frames: Option<u64>,
    reference: Option<&'a str>,
    evaluated: Option<u64>,
    static_input_accuracy: Option<f64>,
    static_input_completeness: Option<f64>,
    static_input_f1: Option<f64>,
    static_fused_accuracy: Option<f64>,
    static_fused_completeness: Option<f64>,
    static_fused_f1: Option<f64>,
    static_fused_accuracy_alone: Option<f64>,
    static_fused_accuracy_common: Option<f64>,
    static_common_points: Option<u64>,
    dynamic_input_accuracy: Option<f64>,
    dynamic_input_completeness: Option<f64>,
    dynamic_input_f1: Option<f64>,
    dynamic_fused_accuracy: Option<f64>,
    dynamic_fused_completeness: Option<f64>,
    dynamic_fused_f1: Option<f64>,
    map_blocks: Option<u64>,
    map_bytes: Option<u64>,
    triangles: Option<u64>,
    swept_triangles: Option<u64>,
    t_err_percent: Option<f64>,
    ate_m: Option<f64>,
    extrapolated_frames: Option<u64>,
    tracking_failures: Option<u64>,
    tracking: Option<&'a str>,
    digest: Option<&'a str>,
}

/// The points of one sweep.
///
/// # Errors
/// A row cannot be written.
pub fn csv(plan: &Plan, kind: Kind, results: &Results) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for point in plan.points.iter().filter(|point| point.kind == kind) {
        let common = common_accuracy(plan, kind, &point.data, results);
        writer
            .serialize(columns(point, results.get(&point.run), common.get(&point.run).copied()))
            .map_err(io::Error::other)?;
    }
    writer.into_inner().map_err(|error| io::Error::other(error.to_string()))
}

/// By run: accuracy of the static map on the points that the maps of all finished runs of a sweep
/// on one data set show, and how many these are.
pub(super) fn common_accuracy(
    plan: &Plan,
    kind: Kind,
    data: &str,
    results: &Results,
) -> BTreeMap<String, (f64, u64)> {
    // What the tracker lost shows nothing that could be compared.
    let is_whole =
        |result: &&RunResult| !result.outcomes.is_empty() && result.tracking_failures().is_none();
    // Only finished runs whose tracking held.
    let runs: BTreeMap<&String, &RunResult> = plan
        .of(kind, data)
        .filter_map(|point| Some((&point.run, results.get(&point.run).filter(is_whole)?)))
        .collect();
    let outcomes: Vec<_> = runs.values().map(|result| result.outcomes.as_slice()).collect();
    // One run has nothing in common with another.
    let Some((accuracy, points)) = on_common_points(&outcomes).filter(|_| runs.len() > 1) else {
        return BTreeMap::new();
    };
    runs.into_keys()
        .zip(accuracy)
        .map(|(run, accuracy)| (run.clone(), (accuracy, points)))
        .collect()
}

fn columns<'a>(
    point: &'a Point,
    result: Option<&'a RunResult>,
    common: Option<(f64, u64)>,
) -> PointColumns<'a> {
    // By the names of summary.json, so that results of earlier versions can be read: what they lack
    // stays empty.
    let value =
        |group: &str, name: &str| -> Option<&'a Value> { result?.summary.get(group)?.get(name) };
    let number = |group: &str, name: &str| value(group, name).and_then(Value::as_f64);
    let whole = |group: &str, name: &str| value(group, name).and_then(Value::as_u64);
    let share = |region: &str, source: &str, name: &str| result?.share(region, source, name);
    PointColumns {
        data: &point.data,
        value: &point.value,
        run: &point.run,
        frames: result.and_then(|result| result.summary.get("frames")?.as_u64()),
        reference: value("lidar", "source").and_then(Value::as_str),
        evaluated: whole("lidar", "frames"),
        static_input_accuracy: share("static", "input", "accuracy"),
        static_input_completeness: share("static", "input", "completeness"),
        static_input_f1: share("static", "input", "f1"),
        static_fused_accuracy: share("static", "fused", "accuracy"),
        static_fused_completeness: share("static", "fused", "completeness"),
        static_fused_f1: share("static", "fused", "f1"),
        static_fused_accuracy_alone: share("static", "fused", "accuracy_alone"),
        static_fused_accuracy_common: common.map(|(accuracy, _)| accuracy),
        static_common_points: common.map(|(_, points)| points),
        dynamic_input_accuracy: share("dynamic", "input", "accuracy"),
        dynamic_input_completeness: share("dynamic", "input", "completeness"),
        dynamic_input_f1: share("dynamic", "input", "f1"),
        dynamic_fused_accuracy: share("dynamic", "fused", "accuracy"),
        dynamic_fused_completeness: share("dynamic", "fused", "completeness"),
        dynamic_fused_f1: share("dynamic", "fused", "f1"),
        map_blocks: whole("map", "blocks"),
        map_bytes: whole("map", "bytes"),
        triangles: whole("map", "triangles"),
        swept_triangles: whole("map", "swept_triangles"),
        t_err_percent: number("egomotion", "t_err_percent"),
        ate_m: number("egomotion", "ate_m"),
        extrapolated_frames: whole("egomotion", "extrapolated_frames"),
        tracking_failures: whole("egomotion", "tracking_failures"),
        tracking: value("egomotion", "status").and_then(Value::as_str),
        digest: result.and_then(|result| result.summary.get("digest")?.as_str()),
    }
}
