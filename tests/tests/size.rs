//! No function is longer than a screen and no file longer than can be read in one go.

#[path = "size/parameters.rs"]
mod parameters;

use dynvox_tests::source::{files, parts, text};
use parameters::parameter_lists;
use std::{collections::BTreeMap, path::Path};

/// Most lines of a function, from its `fn` to its closing brace.
const FUNCTION_LINES: usize = 101;
/// Most lines of a file.
const FILE_LINES: usize = 520;

/// Parameters from which on a function is wide: `self` is one, a tuple counts as its elements.
const WIDE: usize = 6;
/// Most wide functions of the repository, tests included. The figure only ever falls.
const MAX_WIDE: usize = 20;
/// Most functions that are not wide and take a tuple apart in their parameter list, which hides
/// parameters. The figure only ever falls.
const MAX_TAKING_APART: usize = 30;

/// Name, first line and number of lines of each function with a body.
fn functions(rust: &str) -> Vec<(String, usize, usize)> {
    let code: Vec<char> = parts(rust).code.chars().collect();
    let line = |at: usize| 1 + code[..at].iter().filter(|&&char| char == '\n').count();
    let in_name = |char: char| char.is_alphanumeric() || char == '_';
    // A whole word `fn` with a name behind it.
    let starts = (1..code.len().saturating_sub(3)).filter(|&at| {
        code[at..at + 3] == ['f', 'n', ' ']
            && !in_name(code[at - 1])
            && code[at + 3].is_alphabetic() | (code[at + 3] == '_')
    });
    starts
        .filter_map(|start| {
            let name = code[start + 3..].iter().take_while(|&&char| in_name(char)).collect();
            let (mut depth, mut braces) = (0, 0);
            for (at, char) in code.iter().enumerate().skip(start) {
                match char {
                    '(' | '[' => depth += 1,
                    ')' | ']' => depth -= 1,
                    // A declaration without a body does not count.
                    ';' if depth == 0 && braces == 0 => return None,
                    '{' => braces += 1,
                    '}' if braces == 1 && depth == 0 => {
                        return Some((name, line(start), line(at) + 1 - line(start)));
                    }
                    '}' => braces -= 1,
                    _ => {}
                }
            }
            None
        })
        .collect()
}

#[test]
fn no_function_is_longer_than_its_bound() {
    let mut long = Vec::new();
    for path in files(&["rs"]) {
        for (name, line, lines) in functions(&text(&path)) {
            if lines > FUNCTION_LINES {
                long.push(format!("{}:{line}: {name} has {lines} lines", path.display()));
            }
        }
    }
    assert!(
        long.is_empty(),
        "{} functions above {FUNCTION_LINES} lines:\n{}",
        long.len(),
        long.join("\n")
    );
}

#[test]
fn no_file_is_longer_than_its_bound() {
    let lines = |path: &std::path::PathBuf| text(path).lines().count();
    let long: Vec<_> = files(&["rs"]).into_iter().filter(|path| lines(path) > FILE_LINES).collect();
    let list: Vec<_> =
        long.iter().map(|path| format!("{}: {} lines", path.display(), lines(path))).collect();
    assert!(list.is_empty(), "{} files above {FILE_LINES} lines:\n{}", list.len(), list.join("\n"));
}

/// Folder of a file, at most three levels deep: `core/src/stereo`.
fn folder(path: &Path) -> String {
    let parts = path.parent().into_iter().flat_map(Path::components).take(3);
    parts.collect::<std::path::PathBuf>().display().to_string()
}

/// Checks that at most so many functions are listed, each by folder and description; prints them
/// by folder.
fn assert_at_most(most: usize, what: &str, functions: &[(String, String)]) {
    let mut folders = BTreeMap::<_, Vec<_>>::new();
    for (folder, function) in functions {
        folders.entry(folder).or_default().push(function.as_str());
    }
    let list = folders.iter().map(|(folder, functions)| {
        format!("{} in {folder}\n  {}\n", functions.len(), functions.join("\n  "))
    });
    let list = format!("{} functions {what}:\n{}", functions.len(), list.collect::<String>());
    println!("{list}");
    assert!(functions.len() <= most, "at most {most}, and fewer from change to change: {list}");
}

#[test]
fn few_functions_take_six_parameters_or_more() {
    let (mut wide, mut taking_apart) = (Vec::new(), Vec::new());
    for path in files(&["rs"]) {
        for list in parameter_lists(&text(&path)) {
            let at = format!("{}:{}: {}", path.display(), list.line, list.name);
            let function = (folder(&path), format!("{at} has {}", list.count));
            if list.count >= WIDE {
                wide.push(function);
            } else if list.takes_apart {
                taking_apart.push(function);
            }
        }
    }
    assert_at_most(MAX_WIDE, "take six parameters or more", &wide);
    assert_at_most(MAX_TAKING_APART, "take fewer, and hide some in a tuple", &taking_apart);
}

#[test]
fn the_count_sees_bodies_and_nothing_else() {
    let rust = "trait A {
    fn declared(&self) -> [u8; 3];
}
// fn comment() {
fn short() -> [u8; 2] {
    let f = |x: u8| {
        x
    };
    [f(1); 2]
}
";
    assert_eq!(functions(rust), [("short".to_owned(), 5, 6)]);
}
