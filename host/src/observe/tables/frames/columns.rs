//! Columns of `frames.csv` but for those of the stages: a column is one entry of these tables.
//! The values of a `charted` column are kept for charts of the report.

use super::{Cell, FrameColumn, Value};
use crate::observe::FrameRow;
use std::borrow::Cow;

/// All tables, in the order of the columns.
pub(super) static TABLES: [&[FrameColumn]; 7] = [FRAME, POSE, INERTIAL, INPUT, MAP, OBJECTS, WORK];

type Of = fn(&FrameRow) -> Cell;

const fn column(name: &'static str, unit: &'static str, doc: &'static str, of: Of) -> FrameColumn {
    FrameColumn { name: Cow::Borrowed(name), unit, doc, value: Value::Of(of), charted: false }
}

const fn charted(name: &'static str, unit: &'static str, doc: &'static str, of: Of) -> FrameColumn {
    FrameColumn { name: Cow::Borrowed(name), unit, doc, value: Value::Of(of), charted: true }
}

/// The frame as a whole.
static FRAME: &[FrameColumn] = &[
    column("frame", "", "number of the frame in the data set", |row| row.frame.into()),
    column("time_s", "s", "time of the frame, by its stamp or by an assumed rate", |row| {
        Cell::Number(row.time_s)
    }),
    column("digest", "", "hash of the results of all stages", |row| {
        Cell::Text(format!("{:016x}", row.report.digest))
    }),
    charted("step_ms", "ms", "wall time of the step", |row| Cell::rounded(row.step_ms, 4)),
    column("step_cpu_ms", "ms", "CPU time of all threads in the step", |row| {
        Cell::rounded(row.times.cpu_ms, 4)
    }),
    column("severity", "", "worst event: info, recovered or map affected", |row| {
        row.severity().name().into()
    }),
];

/// The inertial unit; empty without one.
static INERTIAL: &[FrameColumn] = &[
    column("inertial_samples", "", "samples of the inertial unit with the frame", |row| {
        row.report.inertial.map_or(Cell::Unknown, |inertial| inertial.samples.into())
    }),
    column("inertial_state", "", "trusted, or the reason not to trust the unit", |row| {
        row.report.inertial.map_or(Cell::Unknown, |inertial| match inertial.doubt {
            _ if inertial.trusted => "trusted".into(),
            Some(doubt) => doubt.name().into(),
            None => Cell::Unknown,
        })
    }),
    column("inertial_turn_rad", "rad", "turn since the frame before, as the unit says", |row| {
        let turn = row.report.inertial.and_then(|inertial| inertial.turn_rad);
        turn.map_or(Cell::Unknown, |[x, y, z]| {
            Cell::rounded((x * x + y * y + z * z).sqrt().into(), 6)
        })
    }),
    column("inertial_turn_sigma_rad", "rad", "standard deviation of that turn", |row| {
        let known = row.report.inertial.filter(|inertial| inertial.turn_rad.is_some());
        known.map_or(Cell::Unknown, |known| Cell::rounded(known.turn_sigma_rad.into(), 6))
    }),
    column("inertial_use", "", "turned: a guessed pose; refused: a contradicting one", |row| {
        row.report.inertial.map_or(Cell::Unknown, |inertial| {
            match (inertial.turned, inertial.refused) {
                (_, true) => "refused".into(),
                (true, _) => "turned".into(),
                _ => Cell::Unknown,
            }
        })
    }),
    column("inertial_clock_offset_s", "s", "time added to the samples' times", |row| {
        row.report
            .inertial
            .map_or(Cell::Unknown, |inertial| Cell::rounded(inertial.clock_offset_s.into(), 5))
    }),
];

/// The camera's pose and the rig.
static POSE: &[FrameColumn] = &[
    column("motion", "", "way in which the pose was found, in one word", |row| row.motion().into()),
    column(
        "segment",
        "",
        "number of the map's segment, from 0: another one begins where the camera was lost and not \
         found again",
        |row| u32::from(row.report.segment.get()).into(),
    ),
    charted("matches", "", "matches that the pose was estimated from", |row| {
        row.matches().0.into()
    }),
    charted("inliers", "", "inliers among these matches", |row| row.matches().1.into()),
    column("residual_px", "px", "RMS error of the inliers", |row| {
        Cell::rounded(row.matches().2, 4)
    }),
    column("weak_directions", "", "directions in which matches do not hold the camera", |row| {
        row.report.egomotion.map_or(Cell::Unknown, |motion| match motion.weak.any() {
            true => Cell::Text(motion.weak.to_string().replace(", ", "+")),
            false => Cell::Unknown,
        })
    }),
    column("motion_sigma_right_m", "m", "standard deviation of the motion to the right", |row| {
        Cell::if_known(row.motion_sigma().map(|sigma| sigma.translation_sigma_m()[0]), 5)
    }),
    column("motion_sigma_down_m", "m", "standard deviation of the motion downwards", |row| {
        Cell::if_known(row.motion_sigma().map(|sigma| sigma.translation_sigma_m()[1]), 5)
    }),
    column("motion_sigma_ahead_m", "m", "standard deviation of the motion ahead", |row| {
        Cell::if_known(row.motion_sigma().map(|sigma| sigma.translation_sigma_m()[2]), 5)
    }),
    column("motion_sigma_pitch_rad", "rad", "standard deviation of the turn up or down", |row| {
        Cell::if_known(row.motion_sigma().map(|sigma| sigma.rotation_sigma_rad()[0]), 7)
    }),
    column("motion_sigma_yaw_rad", "rad", "standard deviation of the turn to a side", |row| {
        Cell::if_known(row.motion_sigma().map(|sigma| sigma.rotation_sigma_rad()[1]), 7)
    }),
    column(
        "motion_sigma_roll_rad",
        "rad",
        "standard deviation of the turn about the view",
        |row| Cell::if_known(row.motion_sigma().map(|sigma| sigma.rotation_sigma_rad()[2]), 7),
    ),
    column(
        "right_ahead_m",
        "m",
        "distance of the right camera ahead of its place, as matches show it: far where the \
         cameras do not expose at the same time",
        |row| Cell::if_known(row.right_ahead().map(|ahead| ahead.distance_m), 4),
    ),
    column("right_ahead_sigma_m", "m", "standard deviation of `right_ahead_m`", |row| {
        Cell::if_known(row.right_ahead().map(|ahead| ahead.sigma_m), 4)
    }),
    charted(
        "disparity_offset_px",
        "px",
        "offset that self-calibration found: what must be added to disparities",
        |row| Cell::if_known(row.rig().map(|rig| rig.offset_px), 4),
    ),
    column("disparity_offset_sigma_px", "px", "standard deviation of the offset", |row| {
        Cell::if_known(row.rig().map(|rig| rig.offset_sigma_px), 4)
    }),
    charted("disparity_offset_applied_px", "px", "offset added to the disparities", |row| {
        Cell::rounded(row.report.self_calibration.applied_offset_px, 4)
    }),
    column("icp_points", "", "pixels with depth, of the depth tracker", |row| {
        row.report.icp.map(|icp| icp.points).into()
    }),
    column("icp_pairs", "", "pairs of points that the depth tracker compared", |row| {
        row.report.icp.map(|icp| icp.pairs).into()
    }),
    column("icp_residual_m", "m", "RMS distance of the pairs", |row| {
        Cell::if_known(row.report.icp.map(|icp| icp.residual_rms_m), 4)
    }),
    column("icp_eigen_share", "", "share of the pairs in the least constrained direction", |row| {
        Cell::if_known(row.report.icp.map(|icp| icp.eigen_share), 5)
    }),
];

/// Features, disparity and the process.
static INPUT: &[FrameColumn] = &[
    column("features_dropped", "", "features and matches that did not fit", |row| {
        row.report.dropped_features().into()
    }),
    charted("stereo_density", "", "share of pixels with a disparity", |row| {
        Cell::rounded(f64::from(row.report.stereo.density()), 4)
    }),
    column("disparity_mean_px", "px", "mean disparity of these pixels", |row| {
        Cell::if_known(row.depth.disparity_mean_px, 4)
    }),
    column("ignored_pixels", "", "pixels left out by --ignore-mask", |row| {
        row.report.ignored_pixels.into()
    }),
    column(
        "attached_pixels",
        "",
        "other pixels left out because they move with the camera",
        |row| row.report.attached_pixels.into(),
    ),
    column("depth_refused", "", "invalid values of given depth", |row| row.depth_refused.into()),
    charted("rss_bytes", "bytes", "resident memory of the process", |row| row.rss_bytes.into()),
];

/// The static map.
static MAP: &[FrameColumn] = &[
    charted("blocks_used", "", "blocks in the pool", |row| row.report.blocks.used.into()),
    column("blocks_peak", "", "most blocks in the pool so far", |row| {
        row.report.blocks.peak.into()
    }),
    charted("blocks_visible", "", "blocks visible in the frame", |row| {
        row.report.blocks.visible.into()
    }),
    column("blocks_made", "", "blocks made", |row| row.report.allocate.made.into()),
    column("blocks_refused", "", "blocks refused: no slot, or beyond the map", |row| {
        row.blocks_refused().into()
    }),
    column("blocks_stored", "", "blocks evicted and stored", |row| {
        row.report.allocate.eviction.stored.into()
    }),
    column("blocks_lost", "", "blocks evicted and not stored", |row| {
        row.report.allocate.eviction.lost.into()
    }),
    column("blocks_empty", "", "blocks evicted with nothing in them", |row| {
        row.report.allocate.eviction.empty.into()
    }),
    column("blocks_loaded", "", "blocks loaded from the store", |row| {
        row.report.allocate.eviction.loaded.into()
    }),
    column("probes_most", "", "most comparisons in one lookup of the index", |row| {
        row.report.allocate.probes_most.into()
    }),
    column("prune_visited", "", "blocks that pruning visited", |row| {
        row.report.prune.visited.into()
    }),
    column("prune_voxels_reset", "", "voxels that pruning reset", |row| {
        row.report.prune.voxels_reset.into()
    }),
    column("prune_blocks_freed", "", "blocks that pruning freed", |row| {
        row.report.prune.blocks_freed.into()
    }),
    column("prune_carried_over", "", "blocks whose pruning waits for a later frame", |row| {
        row.report.prune.carried_over.into()
    }),
    column("prune_early", "", "frames pruned before their lag", |row| {
        row.report.prune.early.into()
    }),
    column(
        "prune_voxels_erased",
        "",
        "voxels reset where an object had been before it was known to move",
        |row| row.report.prune.voxels_erased.into(),
    ),
    column("history_frames", "", "frames in the visible history", |row| row.history_frames.into()),
];

/// Detections, tracks, objects.
static OBJECTS: &[FrameColumn] = &[
    column("detections_given", "", "detections given with the frame", |row| {
        row.report.tracking.detections.given.into()
    }),
    column("detections_accepted", "", "detections accepted", |row| {
        row.report.tracking.detections.accepted.into()
    }),
    column("detections_refused", "", "detections refused", |row| {
        row.report.tracking.detections.refused().into()
    }),
    column("tracks", "", "tracks", |row| row.report.tracking.tracks.tracks.into()),
    column("uncertain", "", "tracks seen whose motion state is uncertain", |row| {
        row.track_states[0].into()
    }),
    column("static", "", "static tracks seen", |row| row.track_states[1].into()),
    column("dynamic", "", "dynamic tracks seen", |row| row.track_states[2].into()),
    column("objects", "", "objects with a volume", |row| row.report.objects.objects.into()),
    column("object_blocks", "", "blocks of all objects", |row| row.report.objects.blocks.into()),
    column("matches_excluded", "", "matches excluded from egomotion", |row| {
        row.report.tracking.matches_excluded.into()
    }),
];

/// Units of work, the same on every machine.
static WORK: &[FrameColumn] = &[
    column("work_stereo_pixels", "", "pixels of the rows that stereo matched", |row| {
        row.report.work.stereo_pixels.into()
    }),
    column(
        "work_support_candidates",
        "",
        "support points looked for, each over all disparities",
        |row| row.report.work.support_candidates.into(),
    ),
    column("work_triangles", "", "triangles of the support points of both images", |row| {
        row.report.work.triangles.into()
    }),
    column("work_features", "", "features kept in both images, of both passes", |row| {
        row.report.work.features.into()
    }),
    column("work_compared_descriptors", "", "descriptors compared with a feature's", |row| {
        row.report.work.compared_descriptors.into()
    }),
    column("work_circles", "", "circles of matches that closed, of both passes", |row| {
        row.report.work.circles.into()
    }),
    column("work_cast_pixels", "", "pixels of pictures that the step took of the map", |row| {
        row.report.work.cast_pixels.into()
    }),
    column("work_block_requests", "", "blocks looked up because a ray ran through them", |row| {
        row.report.work.block_requests.into()
    }),
    column(
        "work_moved_blocks",
        "",
        "blocks that left the pool for others, or were loaded",
        |row| row.report.work.moved_blocks.into(),
    ),
    column("work_fused_voxels", "", "voxels of the blocks that the frame was fused into", |row| {
        row.report.work.fused_voxels.into()
    }),
    column("work_pruned_voxels", "", "voxels of the blocks that pruning visited", |row| {
        row.report.work.pruned_voxels.into()
    }),
    column("deferred_fused_blocks", "", "visible blocks left out of fusion by the budget", |row| {
        row.report.deferred.fused_blocks.into()
    }),
    column("deferred_pruned_blocks", "", "blocks left to a later frame by the budget", |row| {
        row.report.deferred.pruned_blocks.into()
    }),
];
