//! What moves or could: tracks over time in the colours of their states, a table, and the objects' meshes.

use super::{escaped, grouped};
use crate::evaluate::objects::{Late, Medians};
use crate::evaluate::surfaces::SurfaceFigures;
use crate::observe::{KeptObject, TrackRecord, state_name};
use crate::run::RunRecord;
use base64::{Engine, engine::general_purpose::STANDARD};
use dynvox_core::tracking::State;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Tracks drawn and listed at most: those seen in most frames.
const TRACKS: usize = 60;
const WIDTH: f64 = 1180.0;
const LEFT: f64 = 96.0;
const ROW: f64 = 20.0;
/// Narrowest piece of a track that has room for a speed.
const LABEL: f64 = 58.0;

/// The section; empty when nothing was seen.
pub fn section(run: &RunRecord) -> String {
    let record = &run.objects;
    if record.tracks.is_empty() && record.detections.given == 0 {
        return String::new();
    }
    let mut shown: Vec<&TrackRecord> = record.tracks.iter().collect();
    shown.sort_by_key(|track| (usize::MAX - track.frames, track.id));
    shown.truncate(TRACKS);
    shown.sort_by_key(|track| track.id);
    let seen = &record.detections;
    let mut html = format!(
        "<section><h2>What moves, or could</h2><p class=\"soft small\">{} detections, {} taken, {} too small, {} of classes left to the map, {} \
         refused; {} tracks{}. A bar is a track, its colour the state in each frame, the number its speed over ground in m/s, paler where the \
         motion was not measured; the line below it is the truth, where it is known.</p>",
        grouped(u64::from(seen.given)),
        grouped(u64::from(seen.taken)),
        grouped(u64::from(seen.too_small)),
        grouped(u64::from(seen.ignored)),
        grouped(u64::from(seen.refused())),
        record.tracks.len(),
        if record.tracks.len() > shown.len() { format!(", the {} seen longest are shown", shown.len()) } else { String::new() }
    );
    let refused = record.refusals.named().into_iter().filter(|(_, count)| *count > 0);
    let refused: Vec<String> = refused.map(|(name, count)| format!("{count} {name}")).collect();
    if !refused.is_empty() {
        let _ = write!(html, "<p class=\"soft small\">The source of masks: {}.</p>", refused.join(", "));
    }
    html += &truth(run);
    html += &lanes(run, &shown);
    html += &table(&shown);
    html + &gallery(&record.kept) + "</section>"
}

/// Figures against truth in a sentence each.
fn truth(run: &RunRecord) -> String {
    let mut html = String::new();
    if let Some(figures) = &run.objects.figures {
        let errors = |name: &str, of: &Medians| match (of.t_m, of.r_deg) {
            (Some(t_m), Some(r_deg)) => format!("; {name}: {:.1} cm and {r_deg:.2}° in {} motions", 100.0 * t_m, of.frames),
            _ => String::new(),
        };
        let _ = write!(
            html,
            "<p class=\"small\">Against the truth: {} tracks, {} with a state not right in time, {} flips, a standing thing called dynamic for {} \
             frames at most. Median error of a frame's motion{}{}{}.</p>",
            figures.tracks,
            figures.tracks_late,
            figures.flips,
            figures.false_dynamic_frames,
            errors("moving within 20 m", &figures.moving_near),
            errors("moving at 20 to 32 m", &figures.moving_far),
            errors("standing within 20 m", &figures.standing_near)
        );
        let late = |name: &str, of: &Late| {
            let apart = match (of.late_cut, of.late_small) {
                (0, 0) => String::new(),
                (cut, small) => format!(" ({cut} of them only while the picture's border cut the thing, {small} while it was small)"),
            };
            format!("{name} {} of {}{apart}", of.late, of.tracks)
        };
        let _ = write!(
            html,
            "<p class=\"small\">Tracks with a state not right in time, of those whose state was due: {}; {}.</p>",
            late("within 20 m", &figures.late_near),
            late("at 20 to 32 m", &figures.late_far)
        );
        let [still, moving] = figures.confusion;
        let cells = |counts: [u32; 3]| counts.map(|count| format!("<td class=n>{count}")).concat();
        let _ = write!(
            html,
            "<table class=\"small\" style=\"width:auto\"><tr><th>frames<th class=n>called uncertain<th class=n>static<th class=n>dynamic</tr>\
             <tr><td>standing{}</tr><tr><td>moving{}</tr></table>",
            cells(still),
            cells(moving)
        );
        if let Some(of) = &figures.association {
            let _ = write!(
                html,
                "<p class=\"small\">Tracks and things, paired by boxes that overlap by 0.4: HOTA at that threshold {:.3} (detection {:.3}, association \
                 {:.3}); {} pairs, {} things missed, {} tracks of nothing, {} changes of track.</p>",
                of.hota,
                of.deta,
                of.assa,
                grouped(of.matched),
                grouped(of.missed),
                grouped(of.spurious),
                of.switches
            );
        }
    }
    if let Some(count) = run.objects.swept_triangles {
        let _ = write!(html, "<p class=\"small\">Triangles of the static map where something drove: <b>{}</b>.</p>", grouped(count));
    }
    html
}

/// A piece of a track in one state.
struct Piece {
    from: usize,
    to: usize,
    state: State,
    measured: bool,
    speed_m_s: Option<f32>,
}

/// Tracks over frames.
fn lanes(run: &RunRecord, shown: &[&TrackRecord]) -> String {
    let mut pieces = BTreeMap::<u32, Vec<Piece>>::new();
    for (at, row) in run.rows.iter().enumerate() {
        for track in &row.tracks {
            let lane = pieces.entry(track.id).or_default();
            let speed_m_s = track.speed_m_s.map(|[speed, _]| speed);
            match lane.last_mut().filter(|last| last.to == at && last.state == track.state && last.measured == track.measured) {
                Some(last) => (last.to, last.speed_m_s) = (at + 1, speed_m_s),
                None => lane.push(Piece { from: at, to: at + 1, state: track.state, measured: track.measured, speed_m_s }),
            }
        }
    }
    let frames = run.rows.len().max(1) as f64;
    let x = |at: usize| LEFT + (WIDTH - LEFT - 8.0) * at as f64 / frames;
    let height = ROW * shown.len() as f64 + 24.0;
    let mut svg = format!(r#"<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="tracks over frames">"#);
    for (lane, track) in shown.iter().enumerate() {
        let y = ROW * lane as f64;
        let _ = write!(
            svg,
            r#"<text x="{}" y="{:.1}" text-anchor="end">{} {}</text><path class="grid" d="M{LEFT} {:.1}H{WIDTH}"/>"#,
            LEFT - 8.0,
            y + 14.0,
            track.class.name(),
            track.id,
            y + ROW - 1.0
        );
        for piece in pieces.get(&track.id).into_iter().flatten() {
            let (from, to) = (x(piece.from), x(piece.to));
            let paler = if piece.measured { "" } else { r#" fill-opacity="0.55""# };
            let state = state_name(piece.state);
            let _ = write!(
                svg,
                r#"<rect class="{state}" x="{from:.1}" y="{:.1}" width="{:.1}" height="{}"{paler}/>"#,
                y + 2.0,
                (to - from).max(1.0),
                ROW - 5.0
            );
            if let Some(speed) = piece.speed_m_s.filter(|_| to - from > LABEL && piece.state != State::Static) {
                let _ = write!(svg, r#"<text class="on" x="{:.1}" y="{:.1}">{speed:.1} m/s</text>"#, from + 4.0, y + 13.5);
            }
        }
        for &(at, moving) in track.errors.iter().flat_map(|errors| &errors.moving) {
            let state = state_name(if moving { State::Dynamic } else { State::Static });
            let _ = write!(
                svg,
                r#"<rect class="{state}" x="{:.1}" y="{:.1}" width="{:.1}" height="2"/>"#,
                x(at),
                y + ROW - 3.0,
                (x(at + 1) - x(at)).max(1.0)
            );
        }
    }
    let base = ROW * shown.len() as f64 + 16.0;
    for tick in 0..=6 {
        let at = tick * (run.rows.len().saturating_sub(1)) / 6;
        let frame = run.rows.get(at).map_or(0, |row| row.frame);
        let anchor = if tick == 6 { "end" } else { "start" };
        let label = if tick == 0 { format!("frame {frame}") } else { frame.to_string() };
        let _ = write!(svg, r#"<text x="{:.1}" y="{base:.1}" text-anchor="{anchor}">{label}</text>"#, x(at));
    }
    let names = [State::Uncertain, State::Static, State::Dynamic].map(state_name);
    let legend: String = names.iter().map(|name| format!("<span><i class=\"{name}\"></i>{name}</span>")).collect();
    format!("{svg}</svg><div class=\"legend\">{legend}</div>")
}

fn table(shown: &[&TrackRecord]) -> String {
    let mut html =
        "<details><summary class=\"small\">Track by track</summary><div class=\"scroll\"><table><tr><th>track<th>class<th class=n>frames\
                    <th>state<th class=n>uncertain<th class=n>static<th class=n>dynamic<th class=n>m/s<th class=n>true m/s<th class=n>thing\
                    <th class=n>nearest, m<th class=n>motions<th class=n>median error, cm<th class=n>°<th class=n>RMS, cm<th class=n>°\
                    <th class=n>late<th class=n>blocks</tr>"
            .to_owned();
    let number = |value: Option<f64>, digits: usize| value.map_or(String::new(), |value| format!("{value:.digits$}"));
    let whole = |value: Option<u64>| value.map_or(String::new(), |value| value.to_string());
    for track in shown {
        let errors = track.errors.as_ref();
        let [uncertain, still, moving] = track.states;
        let _ = write!(
            html,
            "<tr><td>{}<td>{}<td class=n>{} ({} to {})<td>{}<td class=n>{uncertain}<td class=n>{still}<td class=n>{moving}<td class=n>{}\
             <td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}\
             <td class=n>{}</tr>",
            track.id,
            track.class.name(),
            track.frames,
            track.first_frame,
            track.last_frame,
            state_name(track.state),
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
            track.blocks
        );
    }
    html + "</table></div></details>"
}

/// Meshes with a picture.
fn gallery(kept: &[KeptObject]) -> String {
    let shown: Vec<&KeptObject> = kept.iter().filter(|object| !object.portrait_png.is_empty()).collect();
    if shown.is_empty() {
        return String::new();
    }
    let mut html = format!(
        "<h3 style=\"margin-top:18px\">Reconstructed objects</h3><p class=\"soft small\">{} meshes in <code>objects/</code>. Each from the camera that \
         saw it first, from its left, and from above; without perspective.</p><div class=\"gallery\">",
        kept.len()
    );
    for object in shown {
        let _ = write!(
            html,
            "<figure><img alt=\"mesh of object {0}\" src=\"data:image/png;base64,{1}\"><figcaption>{2} <code>{0}.ply</code>, {3}: {4} frames, {5} \
             triangles{6}</figcaption></figure>",
            escaped(&object.name),
            STANDARD.encode(&object.portrait_png),
            object.class.name(),
            state_name(object.state),
            object.frames,
            grouped(object.triangles),
            object.surface.as_ref().map(surface).unwrap_or_default()
        );
    }
    html + "</div>"
}

/// A mesh against the true surface in a few words.
fn surface(figures: &SurfaceFigures) -> String {
    let median = figures.median_m.map_or_else(|| "far".to_owned(), |median_m| format!("{:.1} cm", 100.0 * median_m));
    format!(
        "; {median} from the true surface (median), {:.0} % of what was seen of it, from {:.0} m on",
        100.0 * figures.completeness,
        figures.nearest_m
    )
}
