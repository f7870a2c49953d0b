//! `dynvox evaluate`: figures from files, without a run.

mod certainty;
mod faults;
mod flight;
mod mapped;
mod masks;
mod places;
mod stereo;
mod trajectory;

#[derive(Debug, clap::Args)]
pub struct EvaluateArgs {
    #[command(subcommand)]
    subject: Subject,
}

#[derive(Debug, clap::Subcommand)]
enum Subject {
    /// Evaluate a trajectory against ground truth
    Trajectory(trajectory::TrajectoryArgs),
    /// Evaluate disparity against a stereo benchmark: KITTI 2012 or 2015
    Stereo(stereo::StereoArgs),
    /// Evaluate instance masks against true ones: IoU mask by mask, and recall
    Masks(masks::MasksArgs),
    /// Compare the errors of motions and poses with the sigmas that are told of them
    Certainty(certainty::CertaintyArgs),
    /// Map with one fault after the other and say what is reported of each
    Faults(faults::FaultsArgs),
    /// Fly through a synthetic street or yard on what the map tells an autopilot; count collisions
    Flight(flight::FlightArgs),
    /// Place recordings of another day in the map of a synthetic town, and check each place
    Places(places::PlacesArgs),
}

pub fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    match &args.subject {
        Subject::Trajectory(args) => trajectory::run(args),
        Subject::Stereo(args) => stereo::run(args),
        Subject::Masks(args) => masks::run(args),
        Subject::Certainty(args) => certainty::run(args),
        Subject::Faults(args) => faults::run(args),
        Subject::Flight(args) => flight::run(args),
        Subject::Places(args) => places::run(args),
    }
}
