//! Names in commands that a user may copy into a shell.

use super::escape::is_control;
use std::fmt::Write;
use std::path::Path;

/// Returns a path as one word of a POSIX shell. A name that needs no quotes has none; one with
/// control characters is in `$'...'`, which bash, zsh and dash from 0.5.13 know.
pub fn quoted(path: &Path) -> String {
    let text = path.to_string_lossy();
    let is_plain = |char: char| char.is_alphanumeric() || "/._-+=:,@%".contains(char);
    // A word that begins with a dash would be an option.
    let text = if text.starts_with('-') { format!("./{text}") } else { text.into_owned() };
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    if !text.contains(is_control) {
        return format!("'{}'", text.replace('\'', "'\\''"));
    }
    let mut word = "$'".to_owned();
    for char in text.chars() {
        // Writing to a String cannot fail.
        let _ = match char {
            '\'' | '\\' => write!(word, "\\{char}"),
            char if is_control(char) => {
                let mut bytes = [0; 4];
                char.encode_utf8(&mut bytes)
                    .bytes()
                    .try_for_each(|byte| write!(word, "\\{byte:03o}"))
            }
            char => word.write_char(char),
        };
    }
    word + "'"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_one_word_of_a_shell() {
        for (path, word) in [
            ("out/street-001", "out/street-001"),
            ("x;touch PWNED", "'x;touch PWNED'"),
            ("it's", "'it'\\''s'"),
            ("$(reboot)", "'$(reboot)'"),
            ("-rf", "./-rf"),
            ("~/x", "'~/x'"),
            ("", "''"),
            ("a\u{1b}b\n'", "$'a\\033b\\012\\''"),
        ] {
            assert_eq!(quoted(Path::new(path)), word);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_shell_reads_back_what_was_quoted() {
        for path in
            ["a b", "it's;\n$x `y` \"z\" \\", "\u{1b}[2J\u{9b}", "-x", "*?[a]{b,c}", "#!&|<>"]
        {
            let script = format!("printf %s {}", quoted(Path::new(path)));
            let read = std::process::Command::new("bash").args(["-c", &script]).output().unwrap();
            let read = String::from_utf8(read.stdout).unwrap();
            assert_eq!(read.strip_prefix("./").unwrap_or(&read), path);
        }
    }
}
