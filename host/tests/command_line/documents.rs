//! Documents say what there is: files, keys and columns of a run folder, settings with their
//! defaults, options.

use super::binary::{dynvox, output_text};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Words that stand for any name in documents.
const PLACEHOLDERS: [&str; 3] = ["STAGE", "NAME", "NNNNNN"];
/// Commands whose options are looked up.
const COMMANDS: [&str; 27] = [
    "run",
    "settings",
    "inspect",
    "calibration",
    "budget",
    "evaluate trajectory",
    "evaluate stereo",
    "evaluate masks",
    "evaluate faults",
    "sweep",
    "synth",
    "view",
    "diff",
    "bench",
    "localize",
    "fixtures new",
    "fixtures verify",
    "fixtures bless",
    "fixtures pack",
    "fleet plan",
    "fleet run",
    "fleet status",
    "fleet align",
    "fleet resample",
    "fleet merge",
    "fleet mesh",
    "fleet report",
];

fn document(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)).unwrap()
}

/// The part of a document below a heading that begins so, up to the next of its level; the part
/// before the first heading for none.
fn section<'d>(document: &'d str, heading: &str) -> &'d str {
    document
        .split("\n## ")
        .find(|part| part.starts_with(heading))
        .unwrap_or_else(|| panic!("no section {heading}"))
}

/// Returns the words between backticks; `a.{b, c}` becomes `a.b` and `a.c`.
fn names(text: &str) -> BTreeSet<String> {
    text.split('`')
        .skip(1)
        .step_by(2)
        .flat_map(expanded)
        .flat_map(|name| name.split(' ').map(str::to_owned).collect::<Vec<_>>())
        .collect()
}

fn expanded(name: &str) -> Vec<String> {
    let braces =
        name.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)));
    let Some((before, (within, after))) = braces else { return vec![name.to_owned()] };
    within.split(',').flat_map(|part| expanded(&[before, part.trim(), after].concat())).collect()
}

/// Returns true if a documented name stands for `name`.
fn stands_for(documented: &str, name: &str) -> bool {
    match PLACEHOLDERS.iter().find_map(|word| documented.split_once(word)) {
        None => documented == name,
        Some((before, after)) => name.strip_prefix(before).is_some_and(|rest| {
            (1..=rest.len()).any(|at| rest.is_char_boundary(at) && stands_for(after, &rest[at..]))
        }),
    }
}

fn undocumented<'n>(
    found: impl IntoIterator<Item = &'n str>,
    documented: &BTreeSet<String>,
) -> Vec<&'n str> {
    found.into_iter().filter(|name| !documented.iter().any(|one| stands_for(one, name))).collect()
}

/// Paths of all values, `[]` for the items of a list of tables.
fn keys(prefix: &str, value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) if !map.is_empty() => {
            for (key, value) in map {
                keys(
                    &if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") },
                    value,
                    found,
                );
            }
        }
        // The items of a list have the keys of one item.
        Value::Array(list) if list.first().is_some_and(Value::is_object) => {
            list.iter().for_each(|value| keys(&format!("{prefix}[]"), value, found));
        }
        _ => drop(found.insert(prefix.to_owned())),
    }
}

/// A key or one above it is documented.
fn is_documented(key: &str, documented: &BTreeSet<String>) -> bool {
    let ends = key.match_indices('.').map(|(at, _)| at).chain([key.len()]);
    ends.map(|end| &key[..end]).any(|key| {
        documented.iter().any(|one| stands_for(one, key) || one.strip_suffix("[]") == Some(key))
    })
}

/// Files of a folder, those in folders with their folder.
fn files(folder: &Path, prefix: &str, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            files(&entry.path(), &format!("{name}/"), found)
        } else {
            found.push(name)
        }
    }
}

/// A run that leaves every kind of file.
fn run(root: &Path, frames: u32) {
    let frames = format!("street.frames={frames}");
    let street = ["--set", "street.width=320", "--set", "street.height=96", "--set", &frames];
    // All options that add files.
    let all = [
        "--profile",
        "tiny",
        "--evaluate",
        "exact",
        "--instances",
        "exact",
        "--mcap",
        "--planning",
        "40x40x8",
        "--keep-blocks",
    ];
    let done =
        dynvox(root, &[&["run", "--quiet", "--out", "result"], &street[..], &all[..]].concat());
    assert!(done.status.success(), "{}", output_text(&done));
}

#[test]
fn every_file_key_and_column_of_a_run_folder_is_on_its_page() {
    let root = TempDir::new().unwrap();
    run(root.path(), 14);
    let (page, folder) = (document("docs/run_folder.md"), root.path().join("result"));
    // Files first, then keys of the summary, then columns of each table.
    let mut written = Vec::new();
    files(&folder, "", &mut written);
    let table = names(section(&page, "# The run folder"));
    // Files of a folder are named with it once, and then without.
    let known: BTreeSet<String> = table
        .iter()
        .flat_map(|name| {
            ["", "objects/", "pictures/", "planning/"].map(|folder| format!("{folder}{name}"))
        })
        .chain(
            table
                .iter()
                .filter(|name| name.starts_with('_'))
                .map(|name| format!("pictures/NNNNNN{name}")),
        )
        .collect();
    assert_eq!(
        undocumented(written.iter().map(String::as_str), &known),
        Vec::<&str>::new(),
        "files"
    );
    let summary: Value =
        serde_json::from_slice(&fs::read(folder.join("summary.json")).unwrap()).unwrap();
    // A key may be described by the line of its group.
    let (mut found, documented) = (BTreeSet::new(), names(section(&page, "`summary.json`")));
    keys("", &summary, &mut found);
    let missing: Vec<_> = found.iter().filter(|key| !is_documented(key, &documented)).collect();
    assert!(
        missing.is_empty() && found.len() > 60,
        "keys of summary.json that no line describes: {missing:?}"
    );
    for (file, heading) in [
        ("frames.csv", "`frames.csv`"),
        ("tracks.csv", "`tracks.csv`"),
        ("tracks_truth.csv", "`tracks.csv`"),
        ("lidar.csv", "`lidar.csv`"),
        ("surface_errors.csv", "`surface_errors.csv`"),
        ("blocks.csv", "`surface_errors.csv`"),
    ] {
        let table = fs::read_to_string(folder.join(file)).unwrap();
        let columns: Vec<&str> = table.lines().next().unwrap().split(',').collect();
        assert_eq!(
            undocumented(columns, &names(section(&page, heading))),
            Vec::<&str>::new(),
            "columns of {file}"
        );
    }
}

#[test]
fn the_page_of_settings_is_the_one_that_the_program_prints() {
    let root = TempDir::new().unwrap();
    let printed = dynvox(root.path(), &["settings", "--markdown"]);
    let page = String::from_utf8(printed.stdout).unwrap();
    assert!(page.matches("\n| `").count() > 100, "{page}");
    for (documented, line) in document("docs/settings.md").lines().zip(page.lines()) {
        assert_eq!(documented, line, "`dynvox settings --markdown > docs/settings.md` corrects it");
    }
    assert!(document("docs/settings.md") == page);
}

#[test]
fn keys_of_a_run_are_described_and_misspelt_ones_get_near_ones() {
    let root = TempDir::new().unwrap();
    run(root.path(), 1);
    let config: toml::Table =
        fs::read_to_string(root.path().join("result/config.toml")).unwrap().parse().unwrap();
    let page = document("docs/settings.md");
    // Every key of the written settings has its row in the documentation.
    for (section, keys) in &config {
        for key in keys.as_table().unwrap().keys() {
            assert!(page.contains(&format!("| `{section}.{key}")), "{section}.{key} has no row");
        }
    }
    // Settings that bound each other name each other.
    let one = dynvox(root.path(), &["settings", "volume.far_m"]);
    let row = String::from_utf8_lossy(&one.stdout);
    assert!(row.contains("volume.near_m"), "{row}");
    // A key that is misspelt gets the nearest one.
    let none = dynvox(root.path(), &["settings", "volume.fare_m"]);
    assert!(!none.status.success() && output_text(&none).contains("`volume.far_m`"));
}

/// Options of a command with the text behind them.
fn options(root: &Path, command: &str) -> BTreeMap<String, String> {
    // The page of `run` is long enough to be split.
    let help = if command == "run" { "--help-all" } else { "--help" };
    let line: Vec<&str> = command.split(' ').chain([help]).collect();
    let help = String::from_utf8(dynvox(root, &line).stdout).unwrap();
    let mut found = BTreeMap::<String, String>::new();
    let mut last = None;
    for line in help.lines() {
        // Options stand at the beginning of a line, with two blanks before their text.
        let text = line.trim_start();
        let option = text
            .split([' ', ','])
            .find(|word| word.starts_with("--"))
            .filter(|_| text.starts_with('-'));
        if let Some(option) = option {
            let rest = text.split_once("  ").map_or("", |(_, rest)| rest.trim());
            found.insert(option.to_owned(), rest.to_owned());
            last = Some(option.to_owned());
        } else if let Some(text_of) = last.as_ref().and_then(|last| found.get_mut(last)) {
            text_of.push_str(text);
        }
    }
    found
}

#[test]
fn the_page_on_bits_shows_the_last_digest_of_the_clip_it_names() {
    let lines = document("fixtures/street-320x96/digests.txt");
    let digest = lines.lines().last().unwrap().split(' ').nth(1).unwrap();
    let page = document("docs/bits.md");
    assert!(page.lines().any(|line| line == digest), "docs/bits.md shows {digest}");
}

#[test]
fn every_option_is_described_and_documents_use_options_that_are_there() {
    let root = TempDir::new().unwrap();
    // Options as the program's own help lists them.
    let known: BTreeMap<&str, BTreeMap<String, String>> =
        COMMANDS.map(|command| (command, options(root.path(), command))).into();
    for (command, options) in &known {
        assert!(options.len() > 1, "dynvox {command} --help lists its options");
        for (option, text) in options {
            assert!(text.len() > 8, "dynvox {command} {option} has no description");
        }
    }
    let pages = [
        "README.md",
        "docs/inputs.md",
        "docs/run_folder.md",
        "docs/fleet.md",
        "docs/pin_your_rig.md",
        "docs/faults.md",
        "host/python/README.md",
    ];
    for page in pages {
        // Every command in the documents, found by its first words.
        let text = document(page);
        for line in text.split(['`', '\n', '#', '|']) {
            let words: Vec<&str> =
                line.split_whitespace().skip_while(|word| *word != "dynvox").skip(1).collect();
            let Some(first) = words.first() else { continue };
            let two = words.get(1).map(|second| format!("{first} {second}"));
            let Some(options) =
                two.and_then(|two| known.get(two.as_str())).or_else(|| known.get(*first))
            else {
                continue;
            };
            for word in
                words.iter().take_while(|word| **word != "--").filter(|word| word.starts_with("--"))
            {
                let option = word.split(['=', ',', ')', ':', '.', ';']).next().unwrap_or_default();
                // What follows `bench` is a run's.
                let known = options.contains_key(option)
                    || *first == "bench" && known["run"].contains_key(option);
                assert!(known, "{page}: dynvox {first} has no {option}: {line}");
            }
        }
    }
}
