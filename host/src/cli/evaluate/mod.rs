//! `dynvox evaluate`: figures from files, without a run.

mod stereo;
mod trajectory;

#[derive(Debug, clap::Args)]
pub struct EvaluateArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Hold a trajectory against the true one
    Trajectory(trajectory::TrajectoryArgs),
    /// Hold disparity against a stereo benchmark: KITTI 2012 or 2015
    Stereo(stereo::StereoArgs),
}

pub fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    match &args.what {
        What::Trajectory(args) => trajectory::run(args),
        What::Stereo(args) => stereo::run(args),
    }
}
