//! Links of the documents lead somewhere: each file is there, and each anchor is a heading's.
#![allow(missing_docs)]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Component, Path, PathBuf},
};

/// Pages beside the folder docs.
const PAGES: [&str; 9] = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "core/capi/README.md",
    "core/capi/examples/ros2/README.md",
    "fixtures/README.md",
    "host/python/README.md",
    "tests/targets/README.md",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Markdown files of a folder and those below it, relative to the repository.
fn markdown_below(folder: &str, found: &mut Vec<String>) {
    for entry in fs::read_dir(root().join(folder)).unwrap().flatten() {
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            markdown_below(&path, found);
        } else if path.ends_with(".md") {
            found.push(path);
        }
    }
}

fn pages() -> BTreeMap<String, String> {
    let mut names: Vec<String> = PAGES.map(str::to_owned).into();
    markdown_below("docs", &mut names);
    names
        .into_iter()
        .map(|name| {
            let text = fs::read_to_string(root().join(&name)).unwrap();
            (name, text)
        })
        .collect()
}

/// The lines outside code blocks.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    page.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// The anchors that GitHub and mdBook give a page's headings.
fn anchors(page: &str) -> BTreeSet<String> {
    prose(page)
        .filter(|line| line.starts_with('#'))
        .map(|line| {
            let heading = line.trim_start_matches('#').trim().to_lowercase();
            let kept = |letter: &char| letter.is_alphanumeric() || [' ', '-', '_'].contains(letter);
            heading
                .chars()
                .filter(kept)
                .map(|letter| if letter == ' ' { '-' } else { letter })
                .collect()
        })
        .collect()
}

/// Targets of `[text](target)`, code spans left out.
fn links(page: &str) -> Vec<String> {
    let text: String = prose(page).collect::<Vec<_>>().join("\n");
    let outside_code: String = text.split('`').step_by(2).collect();
    outside_code
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target.to_owned())
        .collect()
}

/// The path that a link of `page` leads to, without `.` and `..`.
fn resolved(page: &str, target: &str) -> String {
    let mut parts = Vec::new();
    for part in Path::new(page).parent().unwrap().join(target).components() {
        match part {
            Component::ParentDir => drop(parts.pop()),
            Component::Normal(name) => parts.push(name.to_string_lossy().into_owned()),
            _ => {}
        }
    }
    parts.join("/")
}

#[test]
fn every_link_of_the_documents_leads_to_a_file_and_a_heading() {
    let pages = pages();
    let (mut dead, mut checked) = (Vec::new(), 0);
    for (name, text) in &pages {
        // Links to other sites are not followed.
        for link in links(text).iter().filter(|link| !link.contains("://")) {
            checked += 1;
            let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if path.is_empty() { name.clone() } else { resolved(name, path) };
            let heading = anchor.is_empty()
                || pages.get(&target).is_none_or(|page| anchors(page).contains(anchor));
            if !root().join(&target).exists() || !heading {
                dead.push(format!("{name}: {link}"));
            }
        }
    }
    assert!(dead.is_empty() && checked > 100, "{checked} links, dead: {dead:#?}");
}

#[test]
fn every_page_is_in_the_summary_and_every_decision_in_the_index() {
    let pages = pages();
    let listed = |index: &str| -> BTreeSet<String> {
        links(&pages[index]).iter().map(|link| resolved(index, link)).collect()
    };
    let known = &listed("docs/SUMMARY.md") | &listed("docs/decisions/README.md");
    let missing: Vec<_> = pages
        .keys()
        .filter(|name| name.starts_with("docs/") && *name != "docs/SUMMARY.md")
        .filter(|name| !known.contains(*name))
        .collect();
    assert!(missing.is_empty(), "in no table of contents: {missing:?}");
}
