//! `dynvox evaluate trajectory`.

use crate::evaluate::trajectory::{
    self, MatchedPoses, TrajectoryErrors, WithoutBoresight, frames_of_run, matched,
    read_trajectory, truth_of_frames,
};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct TrajectoryArgs {
    /// Estimated poses: a file of KITTI's, TUM's, EuRoC's or KITTI-360's format, or a run folder
    estimate: PathBuf,
    /// True poses, in any of these formats; joined one to one by time where both have times, by the
    /// frames' numbers where rows or a run folder have them, row by row otherwise
    truth: PathBuf,
    /// Write the figures to standard output as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &TrajectoryArgs) -> anyhow::Result<()> {
    let mut truth = read_trajectory(&args.truth)?;
    // A run of some frames of a sequence, with the true poses of all of them.
    if let Some(frames) = frames_of_run(&args.estimate)? {
        truth = truth_of_frames(truth, &frames)?;
    }
    let estimate = read_trajectory(&args.estimate)?;
    let matched = matched(&estimate, &truth)?;
    for note in estimate.notes.iter().chain(&truth.notes) {
        errln!("note: {note}");
    }
    let MatchedPoses { first: estimate, second: truth, of: [of_estimate, of_truth] } = matched;
    let found = trajectory::errors(&truth, &estimate)
        .ok_or_else(|| anyhow::anyhow!("two poses are needed. Give longer trajectories"))?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&found)?);
        return Ok(());
    }
    let length_m = trajectory::travelled_m(&truth).last().copied().unwrap_or_default();
    let count = truth.len();
    let of = if count == of_estimate && count == of_truth {
        String::new()
    } else {
        format!(" of {of_estimate} poses, and of {of_truth} true ones,")
    };
    outln!("{:<28}{count}{of} over {length_m:.1} m", "poses");
    print_figures(&found);
    Ok(())
}

fn print_figures(found: &TrajectoryErrors) {
    outln!("{:<28}{:.4} m, {:.4} deg", "frame to frame, RMS", found.rpe_t_m, found.rpe_r_deg);
    outln!("{:<28}{:.4} m", "after alignment (ATE), RMS", found.ate_m);
    for (length_m, percent, deg_per_m, segments) in &found.per_length {
        outln!(
            "{:<28}{percent:.4} %, {deg_per_m:.5} deg/m, {segments} segments",
            format!("segments of {length_m} m")
        );
    }
    if let (Some(percent), Some(deg_per_m)) = (found.t_err_percent, found.r_err_deg_per_m) {
        outln!("{:<28}{percent:.4} %, {deg_per_m:.5} deg/m", "all segments (t_err, r_err)");
    }
    if let Some([right, down, forward]) = found.mean_error_percent {
        outln!(
            "{:<28}{right:.3} % right, {down:.3} % down, {forward:.3} % forward",
            "mean error as a vector"
        );
    }
    if let Some(WithoutBoresight { angle_deg, t_err_percent, rpe_t_m }) = found.without_boresight {
        outln!(
            "{:<28}{t_err_percent:.4} %, {rpe_t_m:.4} m; the angle: {angle_deg:.3} deg",
            "without a boresight angle"
        );
    }
}
