//! Circles of files: those that import each other, directly or through others.
//!
//! A path leads to the file that defines its name: names that a `mod.rs` hands on from a child lead
//! to the child. What a module and the modules within it import of each other is no circle.

use crate::imports::{Source, module};
use std::collections::{BTreeMap, BTreeSet};

/// Most `use` declarations that hand a name on.
const MAX_HANDED_ON: usize = 8;

/// A module's path from the root of its crate.
type Module = Vec<String>;

/// Finds the circles among files, each by its path below `src` with its text: the paths of the
/// files in each circle, sorted. Modules for tests only do not count.
pub fn circles(files: &[(String, String)]) -> Vec<Vec<String>> {
    let graph = Graph::new(files);
    let reached: BTreeMap<&Module, BTreeSet<&Module>> =
        graph.edges.keys().map(|module| (module, graph.reached(module))).collect();
    let mut found = BTreeSet::new();
    for (module, others) in &reached {
        if others.contains(module) {
            let circle = others.iter().filter(|other| reached[*other].contains(module));
            found.insert(circle.map(|other| graph.paths[*other].clone()).collect::<Vec<_>>());
        }
    }
    found.into_iter().collect()
}

/// Files and the files that each imports.
struct Graph {
    paths: BTreeMap<Module, String>,
    edges: BTreeMap<Module, BTreeSet<Module>>,
}

impl Graph {
    fn new(files: &[(String, String)]) -> Self {
        let mut sources: BTreeMap<Module, (String, Source)> = files
            .iter()
            .map(|(path, text)| (module(path), (path.clone(), Source::new(text))))
            .collect();
        let only_tests: Vec<Module> = sources
            .iter()
            .flat_map(|(module, (_, source))| {
                source.test_modules.iter().map(|name| joined(module, std::slice::from_ref(name)))
            })
            .collect();
        // Modules of tests, and all within them, may import anything.
        sources.retain(|module, _| !only_tests.iter().any(|tests| module.starts_with(tests)));
        let names = Names::new(&sources);
        let edges = sources
            .iter()
            .map(|(module, (_, source))| (module.clone(), names.imports(module, source)))
            .collect();
        let paths = sources.into_iter().map(|(module, (path, _))| (module, path)).collect();
        Self { paths, edges }
    }

    /// The modules that imports lead to from a module.
    fn reached(&self, from: &Module) -> BTreeSet<&Module> {
        let (mut reached, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            for next in &self.edges[module] {
                if reached.insert(next) {
                    open.push(next);
                }
            }
        }
        reached
    }
}

/// The modules, and the names they hand on from their children.
struct Names {
    modules: BTreeSet<Module>,
    handed_on: BTreeMap<Module, Module>,
}

impl Names {
    fn new(sources: &BTreeMap<Module, (String, Source)>) -> Self {
        let modules: BTreeSet<Module> = sources.keys().cloned().collect();
        let mut handed_on = BTreeMap::new();
        for (module, (_, source)) in sources {
            for path in source.child_imports() {
                let (target, name) = (joined(module, &path), &path[path.len() - 1..]);
                if modules.contains(&joined(module, &path[..1])) {
                    handed_on.insert(joined(module, name), target);
                }
            }
        }
        Self { modules, handed_on }
    }

    /// The other modules that a module imports, but for those it lies in and those in it.
    fn imports(&self, from: &Module, source: &Source) -> BTreeSet<Module> {
        let targets = source.paths.iter().map(|path| self.file_of(absolute(from, path)));
        targets.filter(|to| !to.starts_with(from) && !from.starts_with(to)).collect()
    }

    /// The module whose file defines a path.
    fn file_of(&self, mut path: Module) -> Module {
        for _ in 0..MAX_HANDED_ON {
            let next = (0..=path.len()).rev().find_map(|len| {
                let target = self.handed_on.get(&path[..len])?;
                (*target != path[..len]).then(|| joined(target, &path[len..]))
            });
            let Some(next) = next.filter(|_| !self.modules.contains(&path)) else { break };
            path = next;
        }
        while !self.modules.contains(&path) && !path.is_empty() {
            path.pop();
        }
        path
    }
}

fn joined(module: &[String], path: &[String]) -> Module {
    [module, path].concat()
}

/// A path that begins with `crate`, `super` or `self`, from the root of its crate.
fn absolute(module: &[String], path: &[String]) -> Module {
    let mut at = if path[0] == "crate" { Vec::new() } else { module.to_vec() };
    for step in path {
        match step.as_str() {
            "crate" | "self" => {}
            "super" => {
                at.pop();
            }
            name => at.push(name.to_owned()),
        }
    }
    at
}
