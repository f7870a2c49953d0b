//! The camera's path, and its errors against ground truth.

use super::table;
use crate::evaluate::trajectory::TrajectoryErrors;
use crate::report::chart::{Path, from_above};
use crate::run::RunRecord;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let trajectory = &run.sections.trajectory;
    // From above: x to the right, z ahead.
    let above = |position_m: [f64; 3]| (position_m[0], position_m[2]);
    let mut paths = vec![Path {
        name: "estimate",
        colour: "var(--accent)",
        dashed: false,
        points: trajectory.path.points_m().map(above).collect(),
    }];
    if let Some(truth) = &trajectory.truth {
        paths.push(Path {
            name: "ground truth",
            colour: "var(--truth)",
            dashed: true,
            points: truth.iter().map(|pose| above(pose.translation_m)).collect(),
        });
    }
    let length_m = trajectory.path.length_m();
    html! {
        section {
            h2 { "Trajectory from above" }
            p.soft.small {
                (format!("{length_m:.1} m travelled; ")) (trajectory.extrapolated_frames) " of " (run.frames.len())
                " poses extrapolated at constant velocity"
            }
            (from_above(&paths))
            @if let Some(failures) = trajectory.failures {
                p {
                    b { "Tracking failure in " (failures.frames) " of " (run.frames.len()) " frames" }
                    ", first in frame " (failures.first) ": " (failures.cause)
                    ". Their poses are extrapolated, and they are not in the map."
                }
            }
            @if let Some(errors) = &trajectory.errors { (errors_of(errors)) }
        }
    }
}

fn errors_of(errors: &TrajectoryErrors) -> Markup {
    // A row for each length of segment, as KITTI reports them, then their mean.
    let mut rows: Vec<Vec<String>> = errors
        .per_length
        .iter()
        .map(|(length_m, percent, deg_per_m, segments)| {
            vec![
                length_m.to_string(),
                format!("{percent:.3}"),
                format!("{deg_per_m:.5}"),
                segments.to_string(),
            ]
        })
        .collect();
    if let (Some(percent), Some(deg_per_m)) = (errors.t_err_percent, errors.r_err_deg_per_m) {
        rows.push(vec![
            "all".to_owned(),
            format!("{percent:.3}"),
            format!("{deg_per_m:.5}"),
            String::new(),
        ]);
    }
    html! {
        p.small.apart {
            (format!(
                "Against ground truth: from frame to frame {:.2} cm and {:.4}° (RMS); {:.3} m \
                 (RMS) after rigid alignment.",
                100.0 * errors.rpe_t_m, errors.rpe_r_deg, errors.ate_m
            ))
        }
        @if let Some(without) = errors.without_boresight {
            p.small {
                (format!(
                    "The camera's axes differ from those of the truth by {:.2}° throughout \
                     (boresight angle), which is calibration, not drift. Without it \
                    {:.3} % of a segment, {:.2} cm from frame to frame.",
                    without.angle_deg, without.t_err_percent, 100.0 * without.rpe_t_m
                ))
            }
        }
        @if !rows.is_empty() {
            (table(&[("segment, m", true), ("translation, %", true), ("rotation, °/m", true), ("segments", true)], &rows))
        }
    }
}
