//! Files of `[sections]` with `key = value` lines, as one tree.

use super::tree::Tree;
use serde_json::{Map, Value};
use std::path::Path;

/// Reads lines; values are words, `;` and `#` begin comments.
pub fn tree_of(text: &str, path: &Path) -> Tree {
    let mut sections = Map::new();
    let mut name = String::new();
    for line in text.lines().map(str::trim).filter(|line| !line.starts_with([';', '#'])) {
        if let Some(section) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section.trim().clone_into(&mut name);
        } else if let Some((key, value)) = line.split_once('=') {
            let section = sections.entry(&name).or_insert_with(|| Value::Object(Map::new()));
            if let Value::Object(section) = section {
                section.insert(key.trim().to_owned(), Value::String(value.trim().to_owned()));
            }
        }
    }
    Tree::of_values(Value::Object(sections), text, path)
}
