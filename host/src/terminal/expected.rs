//! Names of the command line with line breaks. In a message a line break of ours cannot be told
//! from one of a name; a name that was given is known.

use super::escape::name;
use std::ffi::OsString;
use std::path::Path;
use std::sync::OnceLock;

/// Names with line breaks or tabs, longest first.
static NAMES: OnceLock<Vec<String>> = OnceLock::new();

/// Notes the arguments of this process, and the paths that may be parts of them.
pub fn expect(arguments: impl Iterator<Item = OsString>) {
    let mut names = Vec::new();
    for argument in arguments {
        let whole = argument.to_string_lossy().into_owned();
        // `--out=PATH` and `files:PATH`.
        for separator in ['=', ':'] {
            names.extend(whole.split_once(separator).map(|(_, rest)| rest.to_owned()));
        }
        names.push(whole);
    }
    let last = |text: &String| Some(Path::new(text).file_name()?.to_string_lossy().into_owned());
    let parts: Vec<String> = names.iter().filter_map(last).collect();
    names.extend(parts);
    names.retain(|text| text.contains(['\n', '\t']));
    names.sort_by_key(|text| std::cmp::Reverse(text.len()));
    // A process has one command line.
    let _ = NAMES.set(names);
}

/// Shows the noted names of a text in one line each.
pub(super) fn in_one_line(text: String) -> String {
    let names = NAMES.get().map(Vec::as_slice).unwrap_or_default();
    names.iter().fold(text, |text, raw| {
        if text.contains(raw.as_str()) { text.replace(raw, &name(raw)) } else { text }
    })
}
