//! Printed text is for people: a closed output never ends a run, no name commands the terminal, and
//! a printed command can be copied into a shell.

use super::binary::{dynvox, names, rig};
use std::fs;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// Names that command a terminal, or a shell.
const NAMES: [&str; 10] = [
    "\u{1b}]0;owned\u{7}",
    "x;touch PWNED",
    "$(touch PWNED)",
    "a\nerror: b",
    "\u{9b}2J",
    "\u{202e}txt.exe",
    "it's `touch PWNED`",
    "\r\u{1b}[2K",
    "-rf",
    "a\tb c",
];

/// Asserts that a command printed nothing that a terminal would take for a command.
fn assert_shown(run: &Output, name: &str) {
    for printed in [&run.stdout, &run.stderr] {
        let text = String::from_utf8_lossy(printed);
        let raw = text.chars().find(|&char| {
            char.is_control() && char != '\n'
                || ('\u{202a}'..='\u{202e}').contains(&char)
                || ('\u{2066}'..='\u{2069}').contains(&char)
        });
        assert_eq!(raw, None, "{name:?}: {text:?}");
        assert!(!text.contains(name) || !name.contains('\n'), "{name:?}: {text:?}");
    }
}

#[test]
fn a_run_whose_reader_goes_away_is_mapped_to_its_end() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    for (out, closed) in [("stderr", [true, false]), ("both", [true, true])] {
        let closed_pipe = || {
            let (reader, writer) = std::io::pipe().unwrap();
            drop(reader);
            Stdio::from(writer)
        };
        let [stderr, stdout] =
            closed.map(|closed| if closed { closed_pipe() } else { Stdio::null() });
        let run = Command::new(env!("CARGO_BIN_EXE_dynvox"))
            .args(["run", "rig", "--profile", "tiny", "--out", out])
            .current_dir(root.path())
            .stdout(stdout)
            .stderr(stderr)
            .status()
            .unwrap();
        // A summary that could not be printed is told by the exit code.
        assert_eq!(run.code(), Some(i32::from(closed[1])), "{out}");
        assert!(root.path().join(out).join("summary.json").is_file(), "{out}");
        assert!(root.path().join(out).join("map.ply").is_file(), "{out}");
    }
    assert_eq!(names(root.path()), ["both", "rig", "stderr"]);
}

#[test]
fn no_name_commands_the_terminal() {
    let root = TempDir::new().unwrap();
    for name in NAMES {
        let given = if name.starts_with('-') { format!("./{name}") } else { name.to_owned() };
        let given = given.as_str();
        for args in [
            &["inspect", given][..],
            &["run", given],
            &["run", "--resume", given],
            &["run", "--config", given],
            &["view", given],
            &["diff", given, given],
            &["budget", "--capacity", given],
            &["fleet", "run", given],
            &["fleet", "plan", given, "--out", "jobs"],
            &["sweep", given, "--out", "swept"],
            &["sweep", "--merge", given, "--out", "swept"],
            &["evaluate", "stereo", given],
            &["calibration", given],
            &["fixtures", "verify", given],
            &["run", "--profile", given],
            &["run", "--set", given],
            &["run", "--nonsense", given],
            &[given],
        ] {
            let run = dynvox(root.path(), args);
            assert!(!run.status.success(), "{args:?}");
            assert_shown(&run, name);
        }
    }
}

#[cfg(unix)]
#[test]
fn a_printed_command_copied_into_a_shell_means_its_folder() {
    let root = TempDir::new().unwrap();
    // The shell prints the words instead of running the program.
    let words = |command: &str| -> Vec<String> {
        let script = format!("dynvox() {{ printf '%s\\0' \"$@\"; }}; {command}");
        let read = Command::new("bash").args(["-c", &script]).current_dir(root.path()).output();
        let read = String::from_utf8(read.unwrap().stdout).unwrap();
        read.split('\0').map(ToOwned::to_owned).collect()
    };
    for name in NAMES {
        let given = if name.starts_with('-') { format!("./{name}") } else { name.to_owned() };
        fs::create_dir(root.path().join(&given)).unwrap();
        fs::write(root.path().join(&given).join("summary.json"), "{}").unwrap();
        let run = dynvox(root.path(), &["inspect", &given]);
        assert_shown(&run, name);
        let text = String::from_utf8(run.stdout).unwrap();
        let command = text.lines().find_map(|line| line.split_once("trajectory: ")).unwrap().1;
        assert_eq!(words(command)[2], given, "{command}");
        fs::remove_dir_all(root.path().join(&given)).unwrap();
    }
    let small = ["--frames", "1", "--set", "street.width=160", "--set", "street.height=64"];
    let run = dynvox(root.path(), &[&["synth", "--out", NAMES[1]], &small[..]].concat());
    let text = String::from_utf8(run.stdout).unwrap();
    let command = text.lines().find_map(|line| line.strip_prefix("map it: ")).unwrap();
    assert_eq!(words(command)[1], NAMES[1], "{command}");
    assert_eq!(names(root.path()), [NAMES[1]], "no command within a name was run");
}
