//! The figures of a sweep: boxes over evaluated frames, curves of means, the original's curves
//! dashed.

use super::page::Row;
use super::{FrameSample, Kind, published};
use crate::evaluate::quantile::five_numbers;
use crate::report::chart::{Boxes, COLOURS, Curve, boxes_and_curves};
use maud::{Markup, html};

/// Frames at which a chart over time has a number.
const TIMES: usize = 12;

/// The figures of one sweep on one data set.
pub(super) fn figures(kind: Kind, rows: &[Row<'_>]) -> Markup {
    match kind {
        Kind::PruneWeight => prune(rows),
        Kind::FrameRate => rate(rows),
        Kind::Scale => scale(rows),
        Kind::Depth => depth(rows),
        Kind::Dynamic | Kind::Methods => html! {},
    }
}

fn side_by_side(figures: [Markup; 2]) -> Markup {
    html! { div.two { @for figure in figures { (figure) } } }
}

fn labels(rows: &[Row<'_>]) -> Vec<String> {
    rows.iter().map(|(point, _)| point.value.clone()).collect()
}

fn boxes<'a>(
    name: &'a str,
    colour: usize,
    rows: &[Row<'_>],
    of: impl Fn(&FrameSample) -> Option<f64>,
) -> Boxes<'a> {
    let numbers = |row: &Row<'_>| {
        five_numbers(&row.1.as_ref()?.samples.iter().filter_map(&of).collect::<Vec<f64>>())
    };
    Boxes { name, colour: COLOURS[colour], boxes: rows.iter().map(numbers).collect() }
}

fn shares(rows: &[Row<'_>], source: &str, name: &str) -> Vec<Option<f64>> {
    rows.iter().map(|(_, result)| result.as_ref()?.share("static", source, name)).collect()
}

/// Looks up each row's value in a table of the original's.
fn published_at(rows: &[Row<'_>], of: impl Fn(u32) -> Option<f64>) -> Vec<Option<f64>> {
    rows.iter().map(|(point, _)| of(point.value.parse().ok()?)).collect()
}

fn ours(name: &str, colour: usize, numbers: Vec<Option<f64>>) -> Curve<'_> {
    Curve { name, colour: COLOURS[colour % COLOURS.len()], dashed: false, numbers }
}

fn original(name: &str, colour: usize, numbers: Vec<Option<f64>>) -> Curve<'_> {
    Curve { name, colour: COLOURS[colour], dashed: true, numbers }
}

// The published curves are drawn where this sweep has their values.
fn prune(rows: &[Row<'_>]) -> Markup {
    let at = |table: [f64; 7]| {
        published_at(rows, |weight| {
            published::PRUNE.weights.iter().position(|known| *known == weight).map(|at| table[at])
        })
    };
    let (elas, dispnet) = (published::PRUNE.elas, published::PRUNE.dispnet);
    let labels = labels(rows);
    let figure =
        |title: &str, name: &str, of: fn(&FrameSample) -> Option<f64>, theirs: [[f64; 7]; 2]| {
            let curves = [
                ours("mean", 0, shares(rows, "fused", name)),
                original("ELAS (original)", 1, at(theirs[0])),
                original("DispNet (original)", 5, at(theirs[1])),
            ];
            boxes_and_curves(title, &labels, &[boxes("map, by frame", 0, rows, of)], &curves)
        };
    // Memory relative to no pruning: the original's blocks differ in size.
    let relative = |table: [f64; 7]| at(table.map(|gib| gib / table[0]));
    // Weight 0 is the run without pruning, which others are compared with.
    let unpruned = rows
        .iter()
        .find(|(point, _)| point.value == "0")
        .and_then(|(_, result)| result.as_ref()?.final_blocks());
    let memory =
        rows.iter().map(|(_, result)| Some(result.as_ref()?.final_blocks()? / unpruned?)).collect();
    let memory = boxes_and_curves(
        "blocks at the end, as a share of weight 0",
        &labels,
        &[],
        &[
            ours("map", 0, memory),
            original("ELAS (original)", 1, relative(elas.memory_gib)),
            original("DispNet (original)", 5, relative(dispnet.memory_gib)),
        ],
    );
    html! {
        (side_by_side([
            figure("accuracy of the static map by prune \
                    weight", "accuracy", |sample| sample.accuracy[1], [elas.accuracy, dispnet.accuracy]),
            figure(
                "completeness by prune weight",
                "completeness",
                |sample| sample.completeness[1],
                [elas.completeness, dispnet.completeness],
            ),
        ]))
        (side_by_side([memory, over_time(rows)]))
    }
}

/// Blocks in use frame by frame, a line for each value.
// A line needs two points.
fn over_time(rows: &[Row<'_>]) -> Markup {
    let results = || rows.iter().filter_map(|(_, result)| result.as_ref());
    let frames =
        results().map(|result| result.blocks.len() * result.blocks_every).max().unwrap_or_default();
    if frames < 2 {
        return html! {};
    }
    // Times evenly spread over the longest run.
    let times: Vec<usize> = (0..TIMES).map(|nth| nth * (frames - 1) / (TIMES - 1)).collect();
    let curve = |(colour, (point, result)): (usize, &Row<'_>)| {
        let blocks = |&at: &usize| {
            result.as_ref().and_then(|result| {
                Some(f64::from(*result.blocks.get(at / result.blocks_every)?) / 1e3)
            })
        };
        (point.value.clone(), colour, times.iter().map(blocks).collect::<Vec<_>>())
    };
    let curves: Vec<_> = rows.iter().enumerate().map(curve).collect();
    let curves: Vec<Curve<'_>> =
        curves.iter().map(|(name, colour, numbers)| ours(name, *colour, numbers.clone())).collect();
    let labels: Vec<String> = times.iter().map(ToString::to_string).collect();
    boxes_and_curves(
        "thousand blocks in use by frame, a line for each weight",
        &labels,
        &[],
        &curves,
    )
}

fn rate(rows: &[Row<'_>]) -> Markup {
    let labels = labels(rows);
    let of =
        // k begins at 1, and the published table has 12 values.
        |table: [f64; 12]| published_at(rows, |k| table.get((k as usize).checked_sub(1)?).copied());
    let figure = |title: &str, of_sample: fn(&FrameSample) -> Option<f64>, table| {
        let theirs = original("DispNet, medians (original)", 1, of(table));
        boxes_and_curves(title, &labels, &[boxes("map, by frame", 0, rows, of_sample)], &[theirs])
    };
    side_by_side([
        figure(
            "accuracy, fusing every k-th frame",
            |sample| sample.accuracy[1],
            published::RATE_ACCURACY,
        ),
        figure(
            "completeness, fusing every k-th frame",
            |sample| sample.completeness[1],
            published::RATE_COMPLETENESS,
        ),
    ])
}

fn scale(rows: &[Row<'_>]) -> Markup {
    let labels = labels(rows);
    // The original shows errors: what is not accurate.
    let wrong = |source: &str| {
        shares(rows, source, "accuracy")
            .into_iter()
            .map(|share| share.map(|share| 1.0 - share))
            .collect()
    };
    let at = |column: usize| {
        published_at(rows, |percent| {
            published::SCALE_ERRORS.iter().find(|row| row.0 == percent).map(|row| row.1[column])
        })
    };
    side_by_side([
        boxes_and_curves(
            "error rate (1 - accuracy) by scale, %",
            &labels,
            &[],
            &[
                ours("input", 3, wrong("input")),
                ours("map", 0, wrong("fused")),
                original("ELAS, input (original)", 2, at(0)),
                original("ELAS, fused (original)", 1, at(1)),
            ],
        ),
        boxes_and_curves(
            "completeness by scale, %",
            &labels,
            &[],
            &[
                ours("input", 3, shares(rows, "input", "completeness")),
                ours("map", 0, shares(rows, "fused", "completeness")),
            ],
        ),
    ])
}

fn depth(rows: &[Row<'_>]) -> Markup {
    let labels = labels(rows);
    let figure = |title: &str, of: fn(&FrameSample, usize) -> Option<f64>| {
        let both = [
            boxes("input", 3, rows, |sample| of(sample, 0)),
            boxes("map", 0, rows, |sample| of(sample, 1)),
        ];
        boxes_and_curves(title, &labels, &both, &[])
    };
    side_by_side([
        figure("static accuracy by source of depth", |sample, source| sample.accuracy[source]),
        figure("static completeness by source of depth", |sample, source| {
            sample.completeness[source]
        }),
    ])
}
