//! Tracks over time in the colours of their motion states, a table, and the objects' meshes.

use super::{frames, image, table};
use crate::evaluate::objects::association::AssociationFigures;
use crate::evaluate::objects::{LateStates, OVERLAP_MIN, ObjectFigures};
use crate::evaluate::surfaces::SurfaceFigures;
use crate::observe::{ReconstructedObject, TrackRecord, TracksSection, state_name};
use crate::report::chart::{Bar, Lane, lanes};
use crate::report::text::{grouped, motion_error, moving_masks, states_in_time};
use crate::run::RunRecord;
use dynvox_core::tracking::MotionState;
use maud::{Markup, html};

/// Tracks drawn and listed at most: those seen in most frames.
const TRACKS: usize = 60;

/// The section; empty when nothing was detected.
pub fn section(run: &RunRecord) -> Markup {
    let (tracks, health) = (&run.sections.tracks, &run.sections.health);
    let detections = &health.detections;
    // A run without detections has nothing to show here.
    if tracks.tracks.is_empty() && detections.given == 0 {
        return html! {};
    }
    let shown = shown(tracks);
    // Only refusals that happened are named.
    let refused: Vec<String> = health
        .mask_refusals
        .named()
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    html! {
        section {
            h2 { "Objects and tracks" }
            p.soft.small {
                (grouped(u64::from(detections.given))) " detections: " (grouped(u64::from(detections.accepted))) " accepted, "
                (grouped(u64::from(detections.too_small))) " too small, " (grouped(u64::from(detections.ignored)))
                " of static classes, " (grouped(u64::from(detections.refused()))) " refused; " (tracks.tracks.len()) " tracks"
                @if tracks.tracks.len() > shown.len() { ", the " (shown.len()) " longest are shown" }
                ". A bar is a track, its colour the motion state in each frame, the number its \
                 speed over ground, paler where the motion was "
                "not measured; the thin bar below is ground truth, where it is known."
            }
            @if !refused.is_empty() { p.soft.small { "The source of masks: " (refused.join(", ")) "." } }
            @if let Some(figures) = &tracks.figures { (truth(figures)) }
            @if let Some(masks) = &tracks.masks { p.small { "Moving objects, masks against exact \
                ones: " (moving_masks(masks)) "." } }
            @if let Some(count) = run.sections.objects.swept_triangles {
                p.small { "Triangles of the static map in the volume that moving objects swept: " b { (grouped(count)) } "." }
            }
            (lanes(
                &frames(run),
                run.frames.len(),
                &lanes_of(&shown),
                "tracks over frames",
                &[MotionState::Uncertain, MotionState::Static, MotionState::Dynamic]
                    .map(state_name),
            ))
            (track_table(&shown))
            (gallery(&run.sections.objects.objects))
        }
    }
}

/// The tracks seen in most frames, by number.
fn shown(tracks: &TracksSection) -> Vec<&TrackRecord> {
    let mut shown: Vec<&TrackRecord> = tracks.tracks.iter().collect();
    shown.sort_by_key(|track| (usize::MAX - track.frames, track.id));
    shown.truncate(TRACKS);
    shown.sort_by_key(|track| track.id);
    shown
}

/// Figures against ground truth.
fn truth(figures: &ObjectFigures) -> Markup {
    let motions = [
        ("moving within 20 m", &figures.moving_near),
        ("moving at 20 to 32 m", &figures.moving_far),
        ("static within 20 m", &figures.standing_near),
    ];
    let motions: Vec<String> = motions
        .iter()
        .filter_map(|(name, of)| {
            Some(format!("{name}: {} in {} motions", motion_error(of)?, of.frames))
        })
        .collect();
    // Rows are the truth, columns what was said.
    let confusion = figures.confusion.iter().zip(["static", "moving"]).map(|(counts, name)| {
        std::iter::once(name.to_owned())
            .chain(counts.iter().map(ToString::to_string))
            .collect::<Vec<_>>()
    });
    html! {
        p.small {
            "Against ground truth: " (figures.tracks) " tracks. Within 20 m: " (late(&figures.late_near)) ". At 20 to 32 m: "
            (late(&figures.late_far)) ". " (figures.flips) " state flips; a static object is \
                classified as dynamic in at most "
            (figures.false_dynamic_frames) " frames."
        }
        @if !motions.is_empty() { p.small { "Median per-frame motion error: " (motions.join("; ")) "." } }
        div.narrow {
            (table(
                &[("frames", false), ("uncertain", true), ("static", true), ("dynamic", true)],
                &confusion.collect::<Vec<_>>(),
            ))
        }
        @if let Some(of) = &figures.association { (association(of)) }
    }
}

fn late(of: &LateStates) -> Markup {
    html! {
        (states_in_time(of))
        @if of.late_cut + of.late_small > 0 {
            " (" (of.late_cut) " of the others late only while the image border cuts the object, " (of.late_small) " while it is small)"
        }
    }
}

fn association(of: &AssociationFigures) -> Markup {
    html! {
        p.small {
            (format!(
                "Association by boxes that overlap by at least {OVERLAP_MIN}: HOTA at that \
                 threshold {:.3} (detection {:.3}, association {:.3}); ",
                of.hota, of.deta, of.assa
            ))
            (grouped(of.matched)) " matches, " (grouped(of.misses)) " misses, " (grouped(of.false_tracks)) " false tracks, "
            (of.id_switches) " ID switches."
        }
    }
}

/// The bars of the tracks shown.
fn lanes_of(shown: &[&TrackRecord]) -> Vec<Lane> {
    let lane = |record: &&TrackRecord| {
        let bars = record.spans.iter().map(|span| Bar {
            from: span.from,
            to: span.to,
            // A static track has a speed of noise.
            style: state_name(span.state),
            pale: !span.measured,
            text: span
                .speed_m_s
                .filter(|_| span.state != MotionState::Static)
                .map(|speed| format!("{speed:.1} m/s")),
        });
        // The truth is drawn frame by frame beneath the track's bars.
        let truth =
            record.errors.iter().flat_map(|errors| &errors.moving).map(|&(at, moving)| Bar {
                from: at,
                to: at + 1,
                style: state_name(if moving { MotionState::Dynamic } else { MotionState::Static }),
                pale: false,
                text: None,
            });
        Lane {
            name: format!("{} {}", record.class.name(), record.id),
            truth: truth.collect(),
            bars: bars.collect(),
        }
    };
    shown.iter().map(lane).collect()
}

const TRACK_HEADS: [(&str, bool); 18] = [
    ("track", false),
    ("class", false),
    ("frames", true),
    ("state", false),
    ("uncertain", true),
    ("static", true),
    ("dynamic", true),
    ("m/s", true),
    ("true m/s", true),
    ("true object", true),
    ("nearest, m", true),
    ("motions", true),
    ("median error, cm", true),
    ("°", true),
    ("RMS, cm", true),
    ("°", true),
    ("late frames", true),
    ("blocks", true),
];

fn track_table(shown: &[&TrackRecord]) -> Markup {
    let rows: Vec<Vec<String>> = shown.iter().map(|track| track_row(track)).collect();
    html! { details { summary.small { "Track by track" } (table(&TRACK_HEADS, &rows)) } }
}

fn track_row(track: &TrackRecord) -> Vec<String> {
    // A figure that is not known is an empty cell, not a zero.
    let number = |value: Option<f64>, digits: usize| {
        value.map_or(String::new(), |value| format!("{value:.digits$}"))
    };
    let whole = |value: Option<u64>| value.map_or(String::new(), |value| value.to_string());
    let errors = track.errors.as_ref();
    let [uncertain, still, moving] = track.states.map(|frames| frames.to_string());
    vec![
        track.id.to_string(),
        track.class.name().to_owned(),
        format!("{} ({} to {})", track.frames, track.first_frame, track.last_frame),
        state_name(track.state).to_owned(),
        uncertain,
        still,
        moving,
        number(track.speed_m_s, 2),
        number(errors.map(|errors| errors.true_speed_m_s), 2),
        whole(errors.map(|errors| u64::from(errors.truth))),
        number(errors.map(|errors| errors.nearest_m), 1),
        whole(errors.map(|errors| errors.motions as u64)),
        number(errors.and_then(|errors| errors.me_t_m).map(|error| 100.0 * error), 1),
        number(errors.and_then(|errors| errors.me_r_deg), 3),
        number(errors.and_then(|errors| errors.me_t_rms_m).map(|error| 100.0 * error), 1),
        number(errors.and_then(|errors| errors.me_r_rms_deg), 3),
        whole(errors.map(|errors| u64::from(errors.late_frames))),
        track.blocks.to_string(),
    ]
}

/// Meshes with a thumbnail.
fn gallery(objects: &[ReconstructedObject]) -> Markup {
    let shown: Vec<&ReconstructedObject> =
        objects.iter().filter(|object| !object.thumbnail_jpeg.is_empty()).collect();
    if shown.is_empty() {
        return html! {};
    }
    html! {
        h3.apart { "Reconstructed objects" }
        p.soft.small {
            (objects.len()) " meshes in " code { "objects/" } ". Each as the camera first saw it, \
                from its left, and from above; orthographic."
        }
        div.gallery {
            @for object in shown {
                figure {
                    (image(&object.thumbnail_jpeg, &format!("mesh of object {}", object.name)))
                    figcaption {
                        (object.class.name()) " " code { (object.name) ".ply" } ", "
                        (state_name(object.state)) ": " (object.frames) " frames, "
                        (grouped(object.triangles)) " triangles"
                        @if let Some(figures) = &object.surface { (surface(figures)) }
                    }
                }
            }
        }
    }
}

/// A mesh against the true surface.
fn surface(figures: &SurfaceFigures) -> String {
    let median = figures.median_m.map_or_else(
        || "beyond two voxels".to_owned(),
        |median_m| format!("{:.1} cm", 100.0 * median_m),
    );
    format!(
        "; median distance to the true surface {median}, {:.0} % of the seen surface \
         reconstructed, nearest at {:.0} m",
        100.0 * figures.completeness,
        figures.nearest_m
    )
}
