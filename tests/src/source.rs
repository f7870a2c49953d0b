//! The repository's own files, read for the tests that hold them to the rules of style.

use std::fs;
use std::path::{Path, PathBuf};

/// The repository's top folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests lie in the repository")
        .to_owned()
}

/// All files with one of the extensions, by path relative to [`root`]; build output and hidden
/// folders are left out.
pub fn files(extensions: &[&str]) -> Vec<PathBuf> {
    let (root, mut found) = (root(), Vec::new());
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)
            .expect("a readable folder")
            .map(|entry| entry.expect("a readable entry"))
        {
            let (path, name) = (entry.path(), entry.file_name());
            let kind = entry.file_type().expect("a known file type");
            // Hidden folders and links lead out of the sources.
            if name.to_string_lossy().starts_with('.') || kind.is_symlink() {
                continue;
            }
            if kind.is_dir() && name != "target" && name != "out" {
                folders.push(path);
            } else if path
                .extension()
                .is_some_and(|extension| extensions.iter().any(|&known| extension == known))
            {
                found.push(path.strip_prefix(&root).expect("below the root").to_owned());
            }
        }
    }
    // One order on every machine.
    found.sort();
    found
}

/// The text of a file, by path relative to [`root`].
pub fn text(path: &Path) -> String {
    fs::read_to_string(root().join(path))
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A Rust file taken apart: each part has the line breaks of the file and blanks where the other
/// part stands.
pub struct Parts {
    /// Code, without comments and without the content of string and character literals.
    pub code: String,
    /// Comments and the content of string literals.
    pub prose: String,
}

/// Takes Rust source apart.
pub fn parts(rust: &str) -> Parts {
    let chars: Vec<char> = rust.chars().collect();
    let mut parts = Parts { code: String::new(), prose: String::new() };
    let mut at = 0;
    while at < chars.len() {
        let (prose, end) = next(&chars, at);
        for &char in &chars[at..end] {
            let blank = if char == '\n' { '\n' } else { ' ' };
            parts.code.push(if prose { blank } else { char });
            parts.prose.push(if prose { char } else { blank });
        }
        at = end;
    }
    parts
}

/// Returns true if a piece of prose begins at `at`, and the end of that piece, or of the one
/// character of code.
fn next(chars: &[char], at: usize) -> (bool, usize) {
    let rest = &chars[at..];
    let before = at.checked_sub(1).map(|before| chars[before]);
    let in_name = before.is_some_and(|char| char.is_alphanumeric() || char == '_');
    // Comments and strings are prose; a quote of a character is not the beginning of a string.
    match rest {
        ['/', '/', ..] => {
            (true, at + rest.iter().position(|&char| char == '\n').unwrap_or(rest.len()))
        }
        ['/', '*', ..] => (true, at + block_comment(rest)),
        ['"', ..] => (true, at + string(rest)),
        ['r', '"' | '#', ..] if !in_name => {
            raw_string(rest).map_or((false, at + 1), |len| (true, at + len))
        }
        ['b', 'r', '"' | '#', ..] if !in_name => {
            raw_string(&rest[1..]).map_or((false, at + 1), |len| (true, at + 1 + len))
        }
        ['\'', '\\', ..] => {
            (false, at + 3 + rest.iter().skip(3).position(|&char| char == '\'').unwrap_or(0) + 1)
        }
        ['\'', _, '\'', ..] => (false, at + 3),
        _ => (false, at + 1),
    }
}

fn block_comment(rest: &[char]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        match rest[at..] {
            ['/', '*', ..] => (depth, at) = (depth + 1, at + 2),
            ['*', '/', ..] if depth == 1 => return at + 2,
            ['*', '/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
    }
    at
}

fn string(rest: &[char]) -> usize {
    let mut at = 1;
    while at < rest.len() {
        match rest[at] {
            '\\' => at += 2,
            '"' => return at + 1,
            _ => at += 1,
        }
    }
    rest.len()
}

fn raw_string(rest: &[char]) -> Option<usize> {
    let hashes = rest[1..].iter().take_while(|&&char| char == '#').count();
    if rest.get(1 + hashes) != Some(&'"') {
        return None;
    }
    let closing: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
    let content = 2 + hashes;
    Some(
        rest[content..]
            .windows(closing.len())
            .position(|end| end == closing)
            .map_or(rest.len(), |end| content + end + closing.len()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_code_from_comments_and_literals() {
        let rust = "let a = \"in \\\" text\"; // a note\nlet b = r#\"raw \" text\"#; /* one /* two \
                    */ */ let c: &'static str = 'x';";
        let Parts { code, prose } = parts(rust);
        assert_eq!(
            code.split_whitespace().collect::<Vec<_>>().join(" "),
            "let a = ; let b = ; let c: &'static str = 'x';"
        );
        assert_eq!(
            prose.split_whitespace().collect::<Vec<_>>().join(" "),
            "\"in \\\" text\" // a note r#\"raw \" text\"# /* one /* two */ */"
        );
        assert_eq!(code.lines().count(), 2);
    }
}
