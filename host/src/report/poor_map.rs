//! A map with less in it than its depth could give: what became of the depth, and what to set.

use super::text::counted;
use crate::run::RunRecord;

/// A map with fewer triangles than this share of what the depth of one frame gives is poor.
const POOR_SHARE: f64 = 0.1;
/// Depth at fewer pixels than this share of an image is hardly any.
const SPARSE_SHARE: f64 = 0.05;
/// A reason counts where it took this share of the depth, or of the frames.
const MAIN_SHARE: f64 = 0.5;

/// The sentence on a map that is empty or poor; `None` where the map is as large as its depth
/// lets it be.
pub fn sentence(run: &RunRecord) -> Option<String> {
    let mesh = &run.sections.blocks.mesh;
    let triangles = mesh.static_triangles() + mesh.object_triangles;
    // What one frame's depth alone would have given: a map has at least a share of that.
    let best = run.sections.blocks.depth.triangles_most;
    if triangles > 0 && triangles as f64 >= POOR_SHARE * best {
        return None;
    }
    let found = match triangles {
        0 => "the map is empty".to_owned(),
        some => format!(
            "the map has {some} triangles, where the depth of one frame gives about {best:.0}"
        ),
    };
    Some(format!("{found}: {}", reason(run)))
}

/// The main reason, with the next step.
fn reason(run: &RunRecord) -> String {
    let frames = run.frames.len().max(1);
    let all = run.sections.blocks.depth;
    let share = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
    let known = all.known();
    let lost = run.sections.trajectory.extrapolated_frames;
    let pruned = run.sections.blocks.totals.voxels_reset;
    let volume = &run.plan.config.volume;
    // In the order in which they hide each other: without depth nothing else can be told.
    if share(known, all.pixels) < SPARSE_SHARE {
        return format!(
            "there is depth at {:.1} % of the pixels. Check the calibration with `dynvox inspect`, \
             and that the pictures are sharp and textured",
            100.0 * share(known, all.pixels)
        );
    }
    if share(all.farther, known) > MAIN_SHARE {
        return format!(
            "{:.0} % of the depth is farther than volume.far_m, {} m. Set a larger one, or \
             --scale room or street",
            100.0 * share(all.farther, known),
            volume.far_m
        );
    }
    if share(all.nearer, known) > MAIN_SHARE {
        return format!(
            "{:.0} % of the depth is nearer than volume.near_m, {} m. Set a smaller one, or \
             --scale desk",
            100.0 * share(all.nearer, known),
            volume.near_m
        );
    }
    // Frames without a pose are not fused.
    if share(lost as u64, frames as u64) > MAIN_SHARE {
        return format!(
            "{lost} of {} had no pose and are not in it. frames.csv has the reason of each",
            counted(frames, "frame")
        );
    }
    if pruned > 0 {
        return format!(
            "{pruned} voxels were seen in {} at most and went as noise. Set volume.prune_weight=0 \
             to keep them",
            counted(usize::from(volume.prune_weight), "frame")
        );
    }
    // None of the usual reasons.
    "frames.csv says what became of each frame, and summary.json what was refused".to_owned()
}
