//! Dependencies point downwards: each folder of the core and of the host imports what the table
//! allows, and nothing else.
//!
//! The `crate::`, `super::` and `self::` paths of every file are read from its text, tests left
//! out, and each is compared with the table. A new edge is a decision: add it here, with the reason
//! in the commit, or move what is imported.

#[path = "architecture/circles.rs"]
mod circles;
#[path = "architecture/imports.rs"]
mod imports;

use circles::circles;
use dynvox_tests::source::{files, parts, text};
use imports::{Source, module, paths};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A folder or file below `src`, and those it may import.
type Layers = &'static [(&'static str, &'static [&'static str])];

/// The core: leaves first.
const CORE: Layers = &[
    ("settings", &[]),
    ("invariants", &[]),
    ("digest", &[]),
    ("memory", &[]),
    ("slices", &[]),
    ("flags", &[]),
    ("lanes", &[]),
    ("bits", &[]),
    ("image", &["bits", "slices"]),
    ("stages", &[]),
    ("parallel", &["stages"]),
    ("sad", &["lanes", "parallel"]),
    ("geometry", &["image"]),
    ("state", &["digest", "geometry"]),
    ("random", &["state"]),
    (
        "rectify",
        &["digest", "geometry", "image", "memory", "parallel", "slices", "settings", "state"],
    ),
    (
        "stereo",
        &[
            "digest", "flags", "geometry", "image", "lanes", "memory", "parallel", "slices",
            "settings", "sad",
        ],
    ),
    (
        "scene_flow",
        &[
            "invariants",
            "digest",
            "geometry",
            "image",
            "lanes",
            "memory",
            "parallel",
            "slices",
            "settings",
            "sad",
            "state",
        ],
    ),
    (
        "egomotion",
        &["digest", "geometry", "image", "memory", "settings", "random", "scene_flow", "state"],
    ),
    ("attached", &["geometry", "image", "memory", "scene_flow", "state"]),
    ("inertial", &["digest", "egomotion", "geometry", "memory", "settings", "state"]),
    ("masks", &["digest", "image", "memory", "slices", "state"]),
    (
        "tracking",
        &[
            "invariants",
            "digest",
            "egomotion",
            "geometry",
            "image",
            "masks",
            "memory",
            "slices",
            "settings",
            "random",
            "scene_flow",
            "state",
        ],
    ),
    (
        "volume",
        &[
            "bits",
            "invariants",
            "digest",
            "flags",
            "geometry",
            "image",
            "memory",
            "parallel",
            "slices",
            "settings",
            "state",
        ],
    ),
    (
        "segmentation",
        &[
            "geometry",
            "image",
            "masks",
            "memory",
            "slices",
            "settings",
            "scene_flow",
            "state",
            "tracking",
            "volume",
        ],
    ),
    (
        "view",
        &[
            "flags", "geometry", "image", "lanes", "memory", "parallel", "slices", "settings",
            "volume",
        ],
    ),
    (
        "objects",
        &[
            "invariants",
            "digest",
            "geometry",
            "image",
            "masks",
            "memory",
            "parallel",
            "slices",
            "settings",
            "segmentation",
            "state",
            "tracking",
            "volume",
        ],
    ),
    (
        "planning",
        &["digest", "geometry", "image", "memory", "slices", "settings", "state", "view", "volume"],
    ),
    ("places", &["egomotion", "geometry", "image", "memory", "random", "scene_flow", "state"]),
    (
        "mapper",
        &[
            "attached",
            "invariants",
            "digest",
            "egomotion",
            "geometry",
            "image",
            "inertial",
            "masks",
            "memory",
            "objects",
            "parallel",
            "places",
            "planning",
            "settings",
            "rectify",
            "scene_flow",
            "segmentation",
            "stages",
            "state",
            "stereo",
            "tracking",
            "view",
            "volume",
        ],
    ),
];

/// The host: what knows nothing of runs first.
const HOST: Layers = &[
    ("sentence", &[]),
    ("slab", &[]),
    ("volume_copy", &["slab"]),
    ("owned", &[]),
    ("terminal", &[]),
    ("formats", &["owned"]),
    ("synth", &["formats", "owned"]),
    ("flight", &["synth"]),
    ("input", &["formats", "owned", "slab", "synth", "terminal"]),
    ("scene", &["formats"]),
    ("live", &["scene", "volume_copy"]),
    ("evaluate", &["formats", "input"]),
    ("request", &["evaluate", "formats", "input", "live", "synth"]),
    (
        "observe",
        &[
            "evaluate",
            "formats",
            "input",
            "live",
            "owned",
            "request",
            "scene",
            "slab",
            "volume_copy",
        ],
    ),
    (
        "run",
        &[
            "evaluate",
            "formats",
            "input",
            "observe",
            "owned",
            "request",
            "scene",
            "slab",
            "terminal",
            "volume_copy",
        ],
    ),
    ("report", &["evaluate", "formats", "observe", "request", "run", "scene"]),
    ("sweep", &["evaluate", "formats", "input", "observe", "owned", "report", "request", "run"]),
    ("fixtures", &["formats", "input", "owned", "request", "run", "slab"]),
    ("fleet", &["formats", "owned", "request", "run"]),
    (
        "cli",
        &[
            "evaluate", "fixtures", "fleet", "flight", "formats", "input", "live", "observe",
            "owned", "report", "request", "run", "scene", "sentence", "slab", "sweep", "synth",
            "terminal",
        ],
    ),
];

#[test]
fn the_core_imports_downwards_only() {
    assert_eq!(faults(CORE, &Crate::read("core/src")), Vec::<String>::new());
}

#[test]
fn the_host_imports_downwards_only() {
    assert_eq!(faults(HOST, &Crate::read("host/src")), Vec::<String>::new());
}

#[test]
fn only_the_binary_uses_the_command_line_as_a_library() {
    let is_program = |path: &&std::path::PathBuf| {
        let tests = path.components().any(|part| part.as_os_str() == "tests");
        !tests && !path.starts_with("host/src/cli") && !path.ends_with("host/src/main.rs")
    };
    let sources = files(&["rs"]);
    let found: Vec<_> = sources
        .iter()
        .filter(is_program)
        .filter(|path| uses_the_command_line(&text(path)))
        .collect();
    assert!(sources.iter().filter(is_program).any(|path| path.starts_with("host/python/src")));
    assert_eq!(found, Vec::<&std::path::PathBuf>::new(), "ask for a run by dynvox::Request");
}

#[test]
fn a_use_of_the_command_line_is_found_however_it_is_written() {
    for line in [
        "use dynvox::cli::main;",
        "use dynvox::{Request, cli};",
        "use dynvox::{\n    cli::plan_of,\n    run::Plan,\n};",
        "fn f() { crate::cli::main(); }",
    ] {
        assert!(uses_the_command_line(line), "{line}");
    }
    for line in ["use dynvox::Request;", "// use dynvox::cli::main;", "use clippy::cli;"] {
        assert!(!uses_the_command_line(line), "{line}");
    }
}

/// Returns true if code leads a path through the module of the command line.
fn uses_the_command_line(code: &str) -> bool {
    let code = parts(code).code;
    // By path, in a list, by way of the parent, by a name handed on, in a body, and renamed.
    let starts = ["dynvox::", "crate::"].into_iter().flat_map(|root| code.match_indices(root));
    let found: Vec<_> = starts.flat_map(|(at, _)| paths(&code, at).0).collect();
    found.iter().any(|path| path.get(1).is_some_and(|module| module == "cli"))
}

#[test]
fn a_forbidden_import_is_found_however_it_is_written() {
    let written = [
        "use crate::mapper::Mapper;",
        "use crate::{digest::Digest, image::{View, ViewMut}, mapper::{Mapper, Report}};",
        "use super::super::super::mapper::Mapper;",
        "use crate::Mapper;",
        "fn step() { crate::mapper::step(); }",
        "pub(crate) use crate::mapper::{self as top};",
    ];
    for line in written {
        let planted = Crate::of([("lib.rs", LIB), ("volume/fuse/row.rs", line)]);
        assert_eq!(
            faults(CORE, &planted),
            ["volume imports mapper (volume/fuse/row.rs)"],
            // Allowed folders, a comment and a string, tests, and an item of the crate itself.
            "{line}"
        );
    }
}

#[test]
fn what_is_allowed_or_no_import_is_not_a_fault() {
    let clean = [
        "use crate::{memory::Capacity, parallel::{Executor, each}};",
        "use super::{super::block::Blocks, band};",
        "// use crate::mapper::Mapper;\n/// [`crate::mapper::Mapper`]\nconst TEXT: &str = \
         \"crate::mapper\";",
        "#[cfg(test)]\nmod tests {\n    use crate::mapper::Mapper;\n    fn f() { if true { } }\n}",
        // A whole file that only tests have.
        "#[cfg(test)]\nuse crate::mapper::Mapper;\nfn f() {}",
        "use crate::Capacity;",
    ];
    for line in clean {
        let planted = Crate::of([("lib.rs", LIB), ("volume/fuse/row.rs", line)]);
        assert_eq!(faults(CORE, &planted), Vec::<String>::new(), "{line}");
    }
    let test_only = [
        ("lib.rs", LIB),
        ("volume/mod.rs", "#[cfg(test)]\nmod scene;"),
        ("volume/scene.rs", "use crate::mapper::Mapper;"),
    ];
    assert_eq!(faults(CORE, &Crate::of(test_only)), Vec::<String>::new(), "a module for tests");
}

#[test]
fn an_unknown_folder_and_a_cycle_in_the_table_are_faults() {
    let unknown = Crate::of([("lib.rs", "mod helpers;"), ("helpers.rs", "fn help() {}")]);
    assert_eq!(faults(CORE, &unknown), ["helpers is not in the table"]);
    let cycle: Layers = &[("a", &["b"]), ("b", &["a"])];
    assert_eq!(
        faults(cycle, &Crate::of([("lib.rs", "")])),
        ["a may import b, which stands after it: order the table, or break the cycle"]
    );
}

/// Circles of files that are still to be broken, by their files. A circle that is broken leaves the
/// list; none joins it.
const CIRCLES_LEFT: &[(&str, &[&str])] = &[
    ("host/src", &["cli/fleet/jobs.rs", "cli/sweep.rs"]),
    (
        "host/src",
        &[
            "fleet/distance_field.rs",
            "fleet/free_space.rs",
            "fleet/manifest.rs",
            "fleet/recordings.rs",
            "fleet/submap.rs",
        ],
    ),
    ("host/src", &["fleet/error.rs", "fleet/tile_file.rs"]),
    ("host/src", &["input/masks/network/model.rs", "input/masks/network/settings.rs"]),
    ("host/src", &["observe/tables/tracks.rs", "observe/tracks.rs"]),
    ("host/src", &["sweep/figures.rs", "sweep/page.rs", "sweep/store.rs", "sweep/table.rs"]),
    ("host/src", &["synth/car_paint.rs", "synth/paint.rs", "synth/window_paint.rs"]),
    ("host/src", &["synth/layout.rs", "synth/segment.rs", "synth/traffic.rs"]),
];

#[test]
fn no_files_import_each_other_in_a_circle() {
    let found: Vec<(&str, Vec<String>)> = ["core/src", "host/src"]
        .into_iter()
        .flat_map(|src| circles(&below(src)).into_iter().map(move |circle| (src, circle)))
        .collect();
    let left: Vec<(&str, Vec<String>)> = CIRCLES_LEFT
        .iter()
        .map(|(src, files)| (*src, files.iter().map(|file| (*file).to_owned()).collect()))
        .collect();
    assert_eq!(found, left, "move what they share below both; take broken ones off the list");
}

#[test]
fn a_circle_is_found_through_a_mod_that_hands_names_on() {
    let files = |ground: &str| {
        [
            ("lib.rs", "mod masks;"),
            (
                "masks/mod.rs",
                // By a name that the parent hands on, and by a path in a body.
                "mod grid;\nmod ground;\npub use grid::{Cell, Grid};\nuse ground::Ground;",
            ),
            ("masks/grid.rs", "use super::Ground;"),
            ("masks/ground.rs", ground),
        ]
        .map(|(path, text)| (path.to_owned(), text.to_owned()))
    };
    let circle = [["masks/grid.rs", "masks/ground.rs"]];
    assert_eq!(circles(&files("use super::Cell;")), circle);
    assert_eq!(circles(&files("fn f() { crate::masks::grid::cells(); }")), circle);
    let none: [[&str; 2]; 0] = [];
    assert_eq!(circles(&files("use super::SIZE;")), none, "a parent's own");
    assert_eq!(circles(&files("#[cfg(test)]\nmod tests { use super::super::Grid; }")), none);
}

/// The root of a planted crate.
const LIB: &str = "pub mod mapper;\npub mod memory;\npub use mapper::{Mapper, Report};\npub use \
                   memory::Capacity;";

/// Lists violations of the rules: every folder stands in the table, imports only what its line
/// names, and a line names only lines before it, so that there can be no cycle.
fn faults(layers: Layers, read: &Crate) -> Vec<String> {
    let mut faults = Vec::new();
    for (at, (name, allowed)) in layers.iter().enumerate() {
        // A folder may only name folders above its own line: then no cycle is possible.
        for below in
            allowed.iter().filter(|below| !layers[..at].iter().any(|(name, _)| name == *below))
        {
            faults.push(format!(
                "{name} may import {below}, which stands after it: order the \
                                 table, or break the cycle"
            ));
        }
    }
    // A new folder has to be put into the table.
    for folder in &read.folders {
        if !layers.iter().any(|(name, _)| name == folder) {
            faults.push(format!("{folder} is not in the table"));
        }
    }
    for ((from, to), file) in &read.edges {
        if layers.iter().any(|(name, allowed)| name == from && !allowed.contains(&to.as_str())) {
            faults.push(format!("{from} imports {to} ({file})"));
        }
    }
    faults
}

/// The files below a folder of the repository: each path below it, and the text.
fn below(src: &str) -> Vec<(String, String)> {
    let inside = |path: &Path| Some(path.strip_prefix(src).ok()?.to_str()?.to_owned());
    let paths = files(&["rs"]);
    paths.iter().filter_map(|path| Some((inside(path)?, text(path)))).collect()
}

/// The folders of a crate, and who imports whom: with the first file that does.
struct Crate {
    folders: BTreeSet<String>,
    edges: BTreeMap<(String, String), String>,
}

impl Crate {
    /// Reads the files below a folder of the repository.
    fn read(src: &str) -> Self {
        let found = below(src);
        Self::of(found.iter().map(|(path, text)| (path.as_str(), text.as_str())))
    }

    /// Takes in files, by path below `src`.
    fn of<'t>(files: impl IntoIterator<Item = (&'t str, &'t str)>) -> Self {
        let files: Vec<(Vec<String>, &str, Source)> =
            files.into_iter().map(|(path, text)| (module(path), path, Source::new(text))).collect();
        // Names that lib.rs exports stand for the modules they come from.
        let exported: BTreeMap<&str, &str> = files
            .iter()
            .filter(|(module, ..)| module.is_empty())
            .flat_map(|(.., lib)| lib.exports())
            .collect();
        // Modules of tests may import anything.
        let only_tests: Vec<Vec<String>> = files
            .iter()
            .flat_map(|(module, _, source)| {
                source
                    .test_modules
                    .iter()
                    .map(|name| [module.as_slice(), std::slice::from_ref(name)].concat())
            })
            .collect();
        let mut read = Self { folders: BTreeSet::new(), edges: BTreeMap::new() };
        for (module, path, source) in &files {
            // The crate's root and its program stand above all folders.
            let Some(folder) = module.first().filter(|name| *name != "main") else { continue };
            if only_tests.iter().any(|tests| module.starts_with(tests)) {
                continue;
            }
            read.folders.insert(folder.clone());
            for target in source.paths.iter().filter_map(|path| absolute(module, path)) {
                let target = exported
                    .get(target.as_str())
                    .map_or(target.clone(), |module| (*module).to_owned());
                if target != *folder {
                    // One file is enough to find the import.
                    read.edges
                        .entry((folder.clone(), target))
                        .or_insert_with(|| (*path).to_owned());
                }
            }
        }
        read
    }
}

/// The top-level name that a path of a module leads to.
fn absolute(module: &[String], path: &[String]) -> Option<String> {
    let mut at = if path[0] == "crate" { &[][..] } else { module };
    let mut names = path.iter().skip(usize::from(path[0] == "crate")).peekable();
    while let Some(step) = names.next_if(|name| *name == "super" || *name == "self") {
        if step == "super" {
            at = &at[..at.len().saturating_sub(1)];
        }
    }
    at.first().or_else(|| names.next()).cloned()
}
