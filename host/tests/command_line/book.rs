//! Commands in the documents are ones that the program takes: each is parsed by it, up to the end.

use super::binary::{dynvox, output_text};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const PAGES: [&str; 23] = [
    "README.md",
    "docs/bits.md",
    "docs/boards.md",
    "docs/fleet.md",
    "docs/inertial.md",
    "docs/inputs.md",
    "docs/measurements/accuracy.md",
    "docs/measurements/memory.md",
    "docs/measurements/robustness.md",
    "docs/measurements/speed.md",
    "docs/moving_objects.md",
    "docs/onboard.md",
    "docs/own_camera.md",
    "docs/own_recording.md",
    "docs/pin_your_rig.md",
    "docs/planners.md",
    "docs/porting.md",
    "docs/quick_start.md",
    "docs/run_folder.md",
    "docs/rust.md",
    "docs/scale.md",
    "docs/synthetic_worlds.md",
    "docs/work.md",
];

/// The lines of a page's shell blocks, continued ones as one, without comments.
fn shell_lines(page: &str) -> Vec<String> {
    let blocks = page.split("```sh\n").skip(1).filter_map(|rest| rest.split_once("```"));
    blocks
        .flat_map(|(block, _)| {
            let joined = block.replace("\\\n", " ").replace("|\n", "| ");
            joined
                .lines()
                .map(|line| line.split_once(" #").map_or(line, |(command, _)| command).to_owned())
                .collect::<Vec<_>>()
        })
        .collect()
}

/// The words of a command, as a shell takes quotes.
fn words(command: &str) -> Vec<String> {
    let quoted = command.split('"').enumerate();
    quoted
        .flat_map(|(index, part)| match index % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect(),
            _ => vec![part.to_owned()],
        })
        .collect()
}

/// The commands of a line that are the program's, as their arguments. Those of `bench` are a run's.
fn commands(line: &str) -> Vec<Vec<String>> {
    let commands = line.split(['|', '&', ';']).map(words);
    commands
        .filter(|words| words.first().is_some_and(|word| word == "dynvox"))
        .map(|words| match words[1].as_str() {
            "bench" => {
                // Only the report is an option of `bench` itself.
                let own =
                    if words[2..].first().is_some_and(|word| word == "--report") { 4 } else { 2 };
                ["run".to_owned()].into_iter().chain(words[own..].to_vec()).collect()
            }
            _ => words[1..].to_vec(),
        })
        .collect()
}

/// Asks for help where the command's own arguments end: all before it has been parsed then.
fn asking_for_help(words: &[String]) -> Vec<&str> {
    let end = words.iter().position(|word| word == "--").unwrap_or(words.len());
    let (own, rest) = words.split_at(end);
    let own = own.iter().map(String::as_str);
    own.chain(["--help"]).chain(rest.iter().map(String::as_str)).collect()
}

#[test]
fn every_command_in_the_documents_is_one_that_the_program_takes() {
    let folder = TempDir::new().unwrap();
    let (mut refused, mut parsed) = (Vec::new(), 0);
    for page in PAGES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page);
        let text = fs::read_to_string(path).unwrap();
        for line in &shell_lines(&text) {
            for words in commands(line) {
                // With --help in the end, so that nothing is run.
                let answer = dynvox(folder.path(), &asking_for_help(&words));
                parsed += 1;
                if !answer.status.success() {
                    refused.push(format!("{page}: {line}: {}", output_text(&answer)));
                }
            }
        }
    }
    assert!(refused.is_empty() && parsed > 60, "{parsed} parsed, refused: {refused:#?}");
}
