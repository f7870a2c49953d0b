//! Help in two sizes: a page that fits a terminal, and `--help-all` with every option and example.

use clap::{Arg, ArgAction, Command};

/// Overview of the commands, within the 24 rows of a terminal. Tests compare its names with the
/// sub-commands.
pub const OVERVIEW: &str = "\
Dense stereo mapping of streets with moving cars: the same bits on every machine.

Map      demo         map the synthetic street into ./dynvox-demo: no data set needed
         run          map a recording, a folder of pairs or a stream of images
         synth        write the synthetic street as a data set with its ground truth
Look     inspect      describe a folder, what is missing in it, and the command that maps it
         calibration  explain a calibration of raw cameras, and write it as a file of dynvox
         settings     explain the settings, each with its unit, range and default
         localize     place a recording in the map of an old run
         view         show the map of a finished run in the browser, frame by frame
Measure  evaluate     compare trajectories, disparities or masks with ground truth
         diff         name the first frame and stage in which two runs differ
         bench        measure the CPU time of every stage
         budget       list how many bytes each part of the mapper takes
Build    fixtures     pin the digests of a rig, and replay them in a CI
         completions  write completions for a shell
         man          write the manual
Many     sweep        vary one setting over many runs and compare them on one page
         fleet        map many recordings and add their maps

Start with `dynvox demo`. `dynvox COMMAND --help` explains a command, `--help-all` lists everything.
";

/// Examples of most commands, for `--help-all` and the manual.
pub const EXAMPLES: &str = "\
Examples:
  dynvox demo                                   map the synthetic street: no data set needed
  dynvox inspect ~/kitti                        its content, and the command that maps it
  dynvox run ~/kitti --sequence 06              map a KITTI odometry sequence
  dynvox run ~/tracking --sequence 0003 --frames 100 --threads 4
  dynvox run ~/my-rig                           a folder with left/, right/, calib.txt
  dynvox run ~/kitti --sequence 06 --profile small --scale 0.5
  dynvox run --set volume.voxel_size_m=0.1 --set street.seed=7 --out out/coarse
  dynvox run --config out/coarse/config.toml    the same again
  dynvox run ~/kitti --sequence 06 --snapshot-every 100 --out out/long
  dynvox run --resume out/long                  resume an interrupted run from its last snapshot
  dynvox run ~/raw-rig --calibration camchain.yaml   images as the cameras deliver them
  dynvox calibration camchain.yaml              what a calibration means
  dynvox settings volume.voxel_size_m           what a setting means, its range and its default
  dynvox budget --profile small                 where the bytes of a profile go
  dynvox budget --memory 48MiB --image 752x480   bounds that fit a number of bytes
  dynvox run ~/my-rig --memory 48MiB            the same, for the images that come
  dynvox run ~/kitti --sequence 06 --evaluate lidar     accuracy and completeness of input and map
  dynvox evaluate trajectory out/kitti-odometry-06-001 ~/kitti/poses/06.txt
  dynvox evaluate stereo ~/kitti-stereo-2015        D1 and coverage of the matcher, by region
  dynvox evaluate masks masks/motion ~/tracking/instances/0003   IoU of masks that a run saved
  dynvox sweep street ~/kitti:06 --out sweep    prune weights, frame rates and scales on one page
  dynvox synth --out street --set street.frames=50
  dynvox bench ~/kitti --sequence 06 --frames 60    CPU time of every stage, on one thread and on \
  two
  dynvox fixtures new pinned --from ~/my-rig --memory 32MiB   digests of your own rig, for your CI
  dynvox fleet plan recordings.toml --out fleet   jobs for many recordings, whose maps become one
  dynvox localize ~/new --in out/old            poses of a recording in the map of an old run
  dynvox run ~/new --continue out/old           map a recording into a copy of an old map
  dynvox view out/street-001                    its map in the browser
  dynvox diff out/a out/b                       the first frame and stage in which two runs diverge

A run leaves a folder with map.ply, trajectories, frames.csv, summary.json and report.html: open \
the last in a browser.

Exit codes: 0 done; 1 failed; 2 wrong command line; 3 images refused; 4 the run ended early or \
lacks a file: what was mapped is in its folder,
and summary.json says why under `incomplete`.";

/// Options of `dynvox run` that the short page shows, by their identifiers, each in one line.
const COMMON: [(&str, &str); 15] = [
    ("sequence", "Sequence within the data set: 06, 0003"),
    ("calibration", "Calibration instead of the recording's own"),
    ("side_by_side", "Both images of a pair lie in one, the left one left"),
    ("start", "First frame [default: 0]"),
    ("frames", "Frames to map at most"),
    ("scale", "Scene (desk, room, street, field), or a factor that shrinks images"),
    ("memory", "Memory of the mapper: 48MiB, 1GiB [default: 256MiB]"),
    ("threads", "Threads; the result does not depend on them"),
    ("instances", "Masks of objects: auto, motion, none, files:DIR [default: auto]"),
    ("config", "Settings from a file, such as config.toml of an earlier run"),
    ("set", "One setting: volume.voxel_size_m=0.1; may be repeated"),
    ("evaluate", "Evaluate the map against a reference"),
    ("out", "Folder for the results [default: out/NAME-001, -002, ...]"),
    ("snapshot_every", "Write a snapshot every N frames, to resume from"),
    ("resume", "Resume the interrupted run to that folder"),
];

/// Lines that close the short page of `dynvox run`.
const RUN_EXAMPLES: &str = "\
Example: dynvox run ~/my-rig --calibration camchain.yaml --out result
`dynvox inspect FOLDER` prints the command for a folder; `--help-all` lists every option.";

/// The command line with a short page for `--help`; the pages of `run` in two sizes.
pub fn in_two_sizes(command: Command) -> Command {
    let command = command.mut_subcommand("run", |run| {
        let short = Arg::new("help").short('h').long("help").action(ArgAction::HelpShort);
        let all = Arg::new("help_all").long("help-all").action(ArgAction::HelpLong);
        run.disable_help_flag(true)
            .arg(short.help("Print this page"))
            .arg(all.help("Print every option, with all that it takes"))
            .mut_args(shortened)
            .mut_arg("path", |arg| {
                let short = "Recording or folder; - for a stream; none for the synthetic street";
                with_short(arg, short)
            })
            .after_long_help("")
            .after_help(RUN_EXAMPLES)
    });
    command.override_help(OVERVIEW)
}

/// An option as the short page shows it: in one line, or not at all.
fn shortened(arg: Arg) -> Arg {
    let id = arg.get_id().as_str().to_owned();
    match COMMON.iter().find(|(common, _)| *common == id) {
        Some((_, short)) => with_short(arg, short),
        None if matches!(id.as_str(), "path" | "help" | "help_all") => arg,
        None => arg.hide_short_help(true),
    }
}

/// An option with a line of its own for the short page; the long one keeps its text.
fn with_short(arg: Arg, short: &'static str) -> Arg {
    let long = arg.get_long_help().or(arg.get_help()).cloned().unwrap_or_default();
    arg.long_help(long).help(short)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::{CommandFactory, Parser};

    /// Help of a line, as it is printed.
    fn help(line: &[&str]) -> String {
        let error = in_two_sizes(Cli::command()).try_get_matches_from(line).unwrap_err();
        assert!(!error.use_stderr(), "{line:?} asks for help");
        error.render().to_string()
    }

    #[test]
    fn the_command_line_is_well_formed_and_every_example_parses() {
        Cli::command().debug_assert();
        in_two_sizes(Cli::command()).debug_assert();
        for line in EXAMPLES.lines().filter(|line| line.trim_start().starts_with("dynvox")) {
            let command = line.trim().split("   ").next().unwrap();
            assert!(Cli::try_parse_from(command.split_whitespace()).is_ok(), "{command}");
        }
    }

    #[test]
    fn the_overview_names_every_command_once_and_fits_a_terminal() {
        let column =
            |line: &str| line.get(9..).and_then(|rest| rest.split(' ').next()).map(str::to_owned);
        let lines = OVERVIEW.lines().skip(2).take_while(|line| !line.is_empty());
        let mut named: Vec<String> = lines.filter_map(column).collect();
        let command = Cli::command();
        let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
        let mut known: Vec<String> = shown.map(|command| command.get_name().to_owned()).collect();
        named.sort();
        known.sort();
        assert_eq!(named, known);
        assert!(OVERVIEW.lines().count() < 24, "{} lines", OVERVIEW.lines().count());
        assert_eq!(help(&["dynvox", "--help"]).trim(), OVERVIEW.trim());
        // Pages of other commands are their own.
        assert!(help(&["dynvox", "inspect", "--help"]).contains("--dataset"));
    }

    #[test]
    fn help_on_run_fits_forty_lines_and_leaves_nothing_out_of_the_long_page() {
        let (short, all) = (help(&["dynvox", "run", "-h"]), help(&["dynvox", "run", "--help-all"]));
        assert_eq!(short, help(&["dynvox", "run", "--help"]));
        assert!(short.lines().count() <= 40, "{short}");
        assert!(short.lines().all(|line| line.len() <= 100), "{short}");
        let run = Cli::command().find_subcommand("run").unwrap().clone();
        for arg in run.get_arguments() {
            let Some(long) = arg.get_long() else { continue };
            let is_common = COMMON.iter().any(|(id, _)| *id == arg.get_id().as_str());
            let option = format!("--{long} ");
            let padded = |page: &str| page.replace(['\n', '['], " ").contains(&option);
            assert_eq!(padded(&short), is_common, "--{long} on the short page\n{short}");
            assert!(padded(&all), "--{long} on the long page");
        }
        for (id, _) in COMMON {
            assert!(run.get_arguments().any(|arg| arg.get_id().as_str() == id), "{id}");
        }
    }
}
