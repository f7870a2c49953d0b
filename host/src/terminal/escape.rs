//! Control characters as text: what a terminal would take for a command is shown instead.

use std::borrow::Cow;
use std::fmt::Write;

/// Returns true for characters that move the cursor, change the terminal or the order of letters:
/// C0 and C1, DEL, direction marks and overrides, separators of lines, and invisible ones that make
/// two names look alike.
pub(super) fn is_control(char: char) -> bool {
    char.is_control()
        || matches!(
            char,
            '\u{61c}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{feff}'
        )
}

/// Escapes control characters of a text that may have several lines and tabs.
pub fn escape(text: &str) -> Cow<'_, str> {
    escaped(text, |char| is_control(char) && !matches!(char, '\n' | '\t'))
}

/// Escapes all control characters of a name, of a file or a topic: it has one line.
pub fn name(text: &str) -> Cow<'_, str> {
    escaped(text, is_control)
}

fn escaped(text: &str, refused: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&refused) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for char in text.chars() {
        // Writing to a String cannot fail.
        let _ = match char {
            char if !refused(char) => shown.write_char(char),
            '\n' => shown.write_str("\\n"),
            '\t' => shown.write_str("\\t"),
            // As JSON has it, so that a printed document remains one.
            char => write!(shown, "\\u{:04x}", u32::from(char)),
        };
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_commands_a_terminal_remains() {
        let title = "a\u{1b}]0;owned\u{7}b";
        assert_eq!(escape(title), "a\\u001b]0;owned\\u0007b");
        for char in ['\0', '\r', '\u{8}', '\u{7f}', '\u{9b}', '\u{202e}', '\u{2066}', '\u{200f}'] {
            let text = format!("x{char}y");
            assert!(!escape(&text).contains(char), "{char:?}");
            assert!(!name(&text).contains(char), "{char:?}");
        }
        assert_eq!(escape("two\nlines\tand a tab"), "two\nlines\tand a tab");
        assert_eq!(name("two\nlines"), "two\\nlines");
        assert!(matches!(escape("straße 北京 é"), Cow::Borrowed(_)));
    }
}
