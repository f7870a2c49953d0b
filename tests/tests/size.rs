//! No function is longer than a screen and no file longer than can be read in one go.

use dynvox_tests::source::{files, parts, text};

/// Most lines of a function, from its `fn` to its closing brace.
const FUNCTION_LINES: usize = 112;
/// Most lines of a file.
const FILE_LINES: usize = 565;

/// Name, first line and number of lines of each function with a body.
fn functions(rust: &str) -> Vec<(String, usize, usize)> {
    let code: Vec<char> = parts(rust).code.chars().collect();
    let line = |at: usize| 1 + code[..at].iter().filter(|&&char| char == '\n').count();
    let in_name = |char: char| char.is_alphanumeric() || char == '_';
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

#[test]
fn the_count_sees_bodies_and_nothing_else() {
    let rust = "trait A {\n    fn declared(&self) -> [u8; 3];\n}\n// fn comment() {\nfn short() -> [u8; 2] {\n    let f = |x: u8| {\n        x\n    };\n    [f(1); 2]\n}\n";
    assert_eq!(functions(rust), [("short".to_owned(), 5, 6)]);
}
