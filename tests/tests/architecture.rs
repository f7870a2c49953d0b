//! Dependencies point downwards: each folder of the core and of the host imports what the table
//! allows, and nothing else.
//!
//! The `crate::`, `super::` and `self::` paths of every file are read from its text, tests left
//! out, and each is compared with the table. A new edge is a decision: add it here, with the reason
//! in the commit, or move what is imported.

use dynvox_tests::source::{files, parts, text};
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
    ("parallel", &[]),
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
            "state",
            "tracking",
            "volume",
        ],
    ),
    (
        "planning",
        &[
            "digest", "geometry", "image", "memory", "slices", "settings", "state", "tracking",
            "view", "volume",
        ],
    ),
    (
        "mapper",
        &[
            "invariants",
            "digest",
            "egomotion",
            "geometry",
            "image",
            "masks",
            "memory",
            "objects",
            "parallel",
            "planning",
            "settings",
            "rectify",
            "scene_flow",
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
    ("formats", &[]),
    ("synth", &["formats"]),
    ("input", &["formats", "slab", "synth"]),
    ("scene", &["formats"]),
    ("evaluate", &["formats", "input"]),
    ("request", &["evaluate", "formats", "input", "synth"]),
    ("observe", &["evaluate", "formats", "input", "request", "scene", "slab"]),
    ("run", &["evaluate", "formats", "input", "observe", "request", "scene", "slab"]),
    ("report", &["evaluate", "formats", "observe", "request", "run", "scene"]),
    ("sweep", &["evaluate", "formats", "input", "observe", "report", "request", "run"]),
    ("fixtures", &["formats", "input", "request", "run", "slab"]),
    ("fleet", &["formats", "request", "run"]),
    (
        "cli",
        &[
            "evaluate", "fixtures", "fleet", "formats", "input", "observe", "report", "request",
            "run", "scene", "sentence", "slab", "sweep", "synth",
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

/// Whether code leads a path through the module of the command line.
fn uses_the_command_line(code: &str) -> bool {
    let code = parts(code).code;
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
            "{line}"
        );
    }
}

#[test]
fn what_is_allowed_or_no_import_is_not_a_fault() {
    let clean = [
        "use crate::{memory::Capacity, parallel::{Executor, each}};",
        "use super::{super::block::Blocks, band};",
        "// use crate::mapper::Mapper;\n/// [`crate::mapper::Mapper`]\nconst TEXT: &str = \"crate::mapper\";",
        "#[cfg(test)]\nmod tests {\n    use crate::mapper::Mapper;\n    fn f() { if true { } }\n}",
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
fn a_folder_that_the_table_does_not_know_and_a_cycle_in_the_table_are_faults() {
    let unknown = Crate::of([("lib.rs", "mod helpers;"), ("helpers.rs", "fn help() {}")]);
    assert_eq!(faults(CORE, &unknown), ["helpers is not in the table"]);
    let cycle: Layers = &[("a", &["b"]), ("b", &["a"])];
    assert_eq!(
        faults(cycle, &Crate::of([("lib.rs", "")])),
        ["a may import b, which stands after it: order the table, or break the cycle"]
    );
}

/// The root of a planted crate.
const LIB: &str = "pub mod mapper;\npub mod memory;\npub use mapper::{Mapper, Report};\npub use memory::Capacity;";

/// What breaks the rules: every folder stands in the table, imports only what its line names, and a
/// line names only lines before it, so that there can be no cycle.
fn faults(layers: Layers, read: &Crate) -> Vec<String> {
    let mut faults = Vec::new();
    for (at, (name, allowed)) in layers.iter().enumerate() {
        for below in
            allowed.iter().filter(|below| !layers[..at].iter().any(|(name, _)| name == *below))
        {
            faults.push(format!("{name} may import {below}, which stands after it: order the table, or break the cycle"));
        }
    }
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

/// The folders of a crate, and who imports whom: with the first file that does.
struct Crate {
    folders: BTreeSet<String>,
    edges: BTreeMap<(String, String), String>,
}

impl Crate {
    /// Reads the files below a folder of the repository.
    fn read(src: &str) -> Self {
        let inside = |path: &std::path::PathBuf| {
            path.strip_prefix(src)
                .ok()
                .map(|inside| inside.to_str().expect("a plain name").to_owned())
        };
        let found = files(&["rs"])
            .into_iter()
            .filter_map(|path| inside(&path).map(|inside| (inside, text(Path::new(&path)))));
        let found: Vec<(String, String)> = found.collect();
        Self::of(found.iter().map(|(path, text)| (path.as_str(), text.as_str())))
    }

    /// Takes in files, by path below `src`.
    fn of<'t>(files: impl IntoIterator<Item = (&'t str, &'t str)>) -> Self {
        let files: Vec<(Vec<String>, &str, Source)> =
            files.into_iter().map(|(path, text)| (module(path), path, Source::of(text))).collect();
        let exported: BTreeMap<&str, &str> = files
            .iter()
            .filter(|(module, ..)| module.is_empty())
            .flat_map(|(.., lib)| lib.exports())
            .collect();
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
                    read.edges
                        .entry((folder.clone(), target))
                        .or_insert_with(|| (*path).to_owned());
                }
            }
        }
        read
    }
}

/// The module a file is, by its path below `src`: none for `lib.rs`.
fn module(path: &str) -> Vec<String> {
    let mut module: Vec<String> =
        path.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if module.last().is_some_and(|last| last == "mod" || last == "lib") {
        module.pop();
    }
    module
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

/// What a file says, tests left out.
struct Source {
    code: String,
    /// Modules in files of their own that only tests have.
    test_modules: Vec<String>,
    /// Paths that begin with `crate`, `super` or `self`.
    paths: Vec<Vec<String>>,
}

impl Source {
    fn of(text: &str) -> Self {
        let (code, test_modules) = without_tests(&parts(text).code);
        let begins = |at: usize| {
            let before = code[..at].chars().next_back();
            let alone = before.is_none_or(|char| !(char.is_alphanumeric() || "_:$".contains(char)));
            alone
                && ["crate::", "super::", "self::"]
                    .iter()
                    .any(|start| code[at..].starts_with(start))
        };
        let starts = code.char_indices().map(|(at, _)| at).filter(|&at| begins(at));
        let paths = starts.flat_map(|at| paths(&code, at).0).collect();
        Self { code, test_modules, paths }
    }

    /// What `pub use` of a root says: each name, and the module it comes from.
    fn exports(&self) -> Vec<(&str, &str)> {
        const USE: &str = "pub use ";
        let uses = self.code.match_indices(USE).flat_map(|(at, _)| {
            let end = self.code[at..].find(';').map_or(self.code.len(), |len| at + len);
            let line = &self.code[at + USE.len()..end];
            let module = line.split("::").next().unwrap_or(line).trim();
            line.split(|char: char| !(char.is_alphanumeric() || char == '_'))
                .map(move |name| (name, module))
        });
        uses.filter(|(name, module)| !name.is_empty() && name != module).collect()
    }
}

/// The paths that a path with braces stands for, and where it ends.
fn paths(code: &str, at: usize) -> (Vec<Vec<String>>, usize) {
    let rest = &code[at..];
    if rest.starts_with('{') {
        let (mut all, mut at) = (Vec::new(), at + 1);
        loop {
            at += code[at..]
                .find(|char: char| !(char.is_whitespace() || char == ','))
                .unwrap_or(code.len() - at);
            if at >= code.len() || code[at..].starts_with('}') {
                return (all, (at + 1).min(code.len()));
            }
            let (inner, end) = paths(code, at);
            all.extend(inner);
            at = end + code[end..].find([',', '}']).unwrap_or(code.len() - end);
        }
    }
    let len =
        rest.find(|char: char| !(char.is_alphanumeric() || char == '_')).unwrap_or(rest.len());
    let (name, end) = (rest[..len].to_owned(), at + len);
    let goes_on = |code: &str| {
        code.starts_with(|char: char| char.is_alphanumeric() || char == '_' || char == '{')
    };
    match code[end..].strip_prefix("::") {
        Some(more) if goes_on(more) => {
            let (inner, end) = paths(code, end + 2);
            (inner.into_iter().map(|path| [vec![name.clone()], path].concat()).collect(), end)
        }
        _ => (vec![vec![name]], end),
    }
}

/// Code without the items that only tests have, and the names of the modules among them that lie in
/// files of their own.
fn without_tests(code: &str) -> (String, Vec<String>) {
    const TEST: &str = "#[cfg(test)]";
    let (mut kept, mut modules, mut rest) = (String::new(), Vec::new(), code);
    while let Some(at) = rest.find(TEST) {
        kept += &rest[..at];
        let item = &rest[at + TEST.len()..];
        let head = item.find(['{', ';']).unwrap_or(item.len());
        if let Some(name) =
            item[..head].trim().rsplit_once("mod ").filter(|_| item[head..].starts_with(';'))
        {
            modules.push(name.1.trim().to_owned());
        }
        rest = &item[item_len(item, head)..];
    }
    (kept + rest, modules)
}

/// Length of an item whose body, or semicolon, begins at `head`.
fn item_len(item: &str, head: usize) -> usize {
    let mut depth = 0;
    for (at, char) in item.char_indices().skip_while(|(at, _)| *at < head) {
        depth += i32::from(char == '{') - i32::from(char == '}');
        if depth == 0 && (char == ';' || char == '}') {
            return at + 1;
        }
    }
    item.len()
}
