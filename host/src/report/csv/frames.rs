//! `frames.csv`: one row a frame.

use crate::run::FrameRow;
use dynvox_core::tracking::State;
use dynvox_core::{Digested, Stage};
use std::io::{self, Write};

/// Writes the table. Empty cells are values the machine cannot give.
pub fn write_frames(out: &mut impl Write, rows: &[FrameRow]) -> io::Result<()> {
    write!(
        out,
        "frame,time_s,digest,step_ms,severity,motion,matches,inliers,residual_px,icp_points,icp_pairs,icp_residual_m,icp_held,features_dropped,stereo_density,depth_refused"
    )?;
    write!(out, ",blocks_used,blocks_peak,blocks_visible,blocks_made,blocks_refused,blocks_out,blocks_lost")?;
    write!(out, ",blocks_empty,blocks_back,probes_most")?;
    write!(out, ",prune_visited,prune_voxels_reset,prune_blocks_freed,prune_carried_over,prune_early,history_frames,rss_bytes")?;
    write!(
        out,
        ",detections_given,detections_taken,detections_refused,tracks,uncertain,static,dynamic,objects,object_blocks,matches_withheld"
    )?;
    for stage in Stage::ALL {
        write!(out, ",{0}_ms,{0}_cpu_ms", stage.name())?;
    }
    for column in Digested::COLUMNS {
        write!(out, ",{column}_digest")?;
    }
    writeln!(out)?;
    for row in rows {
        let report = &row.report;
        let (matches, inliers, residual_px) = row.matches();
        let (blocks, allocation, eviction, prune) = (&report.blocks, &report.allocation, &report.allocation.eviction, &report.prune);
        write!(out, "{},{:?},{:016x},{:.4}", row.frame, row.time_s, report.digest, row.step_ms)?;
        write!(out, ",{},{},{matches},{inliers},{residual_px:.4}", report.severity().name(), row.motion())?;
        match &report.icp {
            Some(icp) => write!(out, ",{},{},{:.4},{:.5}", icp.points, icp.pairs, icp.residual_rms_m, icp.held)?,
            None => write!(out, ",,,,")?,
        }
        write!(out, ",{},{:.4},{}", report.dropped_features(), report.stereo.density(), row.depth_refused)?;
        write!(out, ",{},{},{},{}", blocks.used, blocks.peak, blocks.visible, allocation.made)?;
        write!(out, ",{},{},{}", row.blocks_refused(), eviction.kept, eviction.lost)?;
        write!(out, ",{},{},{}", eviction.empty, eviction.returned, allocation.probes_most)?;
        write!(out, ",{},{},{},{}", prune.visited, prune.voxels_reset, prune.blocks_freed, prune.carried_over)?;
        write!(out, ",{},{}", prune.early, row.history_frames)?;
        write!(out, ",{}", row.rss_bytes.map(|bytes| bytes.to_string()).unwrap_or_default())?;
        let seen = &report.instances;
        write!(out, ",{},{},{}", seen.detections.given, seen.detections.taken, seen.detections.refused())?;
        let [uncertain, still, moving] = [State::Uncertain, State::Static, State::Dynamic].map(|state| row.tracks_in(state));
        write!(out, ",{},{uncertain},{still},{moving}", seen.tracks.tracks)?;
        write!(out, ",{},{},{}", seen.objects.objects, seen.objects.blocks, seen.matches_withheld)?;
        for time in &row.stages {
            write!(out, ",{:.4},{:.4}", time.wall_ms, time.cpu_ms)?;
        }
        write!(out, ",{}", report.digests.to_string().replace(' ', ","))?;
        writeln!(out)?;
    }
    Ok(())
}
