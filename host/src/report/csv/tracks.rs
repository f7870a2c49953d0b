//! `tracks.csv`: one row for each track seen in a frame.

use crate::evaluate::objects::Judged;
use crate::observe::state_name;
use crate::run::FrameRow;
use std::io::{self, Write};

/// Writes the table. The box is in px, its last column and row not among it; speeds are empty until a motion was measured.
pub fn write_tracks(out: &mut impl Write, rows: &[FrameRow]) -> io::Result<()> {
    writeln!(out, "frame,id,class,state,speed_m_s,speed_sigma_m_s,x1,y1,x2,y2,score,matches,inliers,measured,blocks")?;
    for row in rows {
        for track in &row.tracks {
            let (id, class, state, pixels) = (track.id, track.class.name(), state_name(track.state), &track.pixels);
            let [speed, sigma] = track.speed_m_s.map_or([String::new(), String::new()], |speeds| speeds.map(|value| format!("{value:.3}")));
            write!(out, "{},{id},{class},{state},{speed},{sigma}", row.frame)?;
            write!(out, ",{},{},{},{}", pixels.left, pixels.top, pixels.left + pixels.width, pixels.top + pixels.height)?;
            let measured = u8::from(track.measured);
            writeln!(out, ",{:.3},{},{},{measured},{}", track.score, track.matches, track.inliers, track.blocks)?;
        }
    }
    Ok(())
}

/// Writes `tracks_truth.csv`: one row for each track in a frame that was compared with a true thing. Errors are empty where no motion was
/// estimated or the thing was not seen before. `settled` counts the frames since the track began and since the thing last started or stopped;
/// `view` is whole, small or cut.
pub fn write_tracks_truth(out: &mut impl Write, rows: &[FrameRow], judged: &[(u32, Judged)]) -> io::Result<()> {
    writeln!(out, "frame,id,truth,moving,state,distance_m,me_t_m,me_r_deg,true_speed_m_s,speed_m_s,settled,view")?;
    for (id, one) in judged {
        let Some(row) = rows.get(one.at) else { continue };
        let (moving, state) = (u8::from(one.moving), state_name(one.state));
        write!(out, "{},{id},{},{moving},{state},{:.3}", row.frame, one.truth, one.distance_m)?;
        let [t, r] = one.error.map_or([String::new(), String::new()], |error| error.map(|value| format!("{value:.5}")));
        let speed = one.speed_m_s.map(|speed| format!("{speed:.3}")).unwrap_or_default();
        writeln!(out, ",{t},{r},{:.3},{speed},{},{}", one.true_speed_m_s, one.settled, one.view.name())?;
    }
    Ok(())
}
