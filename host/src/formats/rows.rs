//! Rows of text tables: lines that hold something, and the numbers in them.
//!
//! Numbers stand between white space, commas or semicolons. Decimal commas are read where something
//! else separates the numbers. A first line of words is a heading.

use std::borrow::Cow;

/// The lines of a table that hold something, with their numbers from 1: neither empty, nor a
/// comment, which begins with `#` or `%`, nor a heading in the first such line.
pub(super) fn lines_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut is_first = true;
    (1..)
        .zip(text.lines().map(str::trim))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', '%']))
        .filter(move |(_, line)| !(std::mem::take(&mut is_first) && is_heading(line)))
}

/// Returns true for a line of several words, none a number.
fn is_heading(line: &str) -> bool {
    let words = || line.split(|c: char| c.is_whitespace() || [',', ';'].contains(&c));
    let words = || words().filter(|word| !word.is_empty());
    let is_name = |word: &str| {
        word.contains(|c: char| c.is_ascii_alphabetic())
            && word.parse::<f64>().is_err()
            && !word.starts_with(|c: char| c.is_ascii_digit())
            && !word.contains('.')
    };
    words().count() > 1 && words().all(is_name)
}

/// The rows of a table: numbers of lines, from 1, and the numbers in them, if all its words are
/// finite ones.
pub fn number_rows(text: &str) -> impl Iterator<Item = (usize, Option<Vec<f64>>)> {
    lines_of(text).map(|(line, row)| (line, numbers_of(row)))
}

/// The numbers of a line, if all its words are finite numbers.
pub(super) fn numbers_of(line: &str) -> Option<Vec<f64>> {
    words_of(line).map(|word| word.parse().ok().filter(|value: &f64| value.is_finite())).collect()
}

/// The words of a line, decimal commas as points.
pub(super) fn words_of(line: &str) -> impl Iterator<Item = Cow<'_, str>> {
    let decimal_commas = has_decimal_commas(line);
    let separates = move |c: char| c.is_whitespace() || c == ';' || (c == ',' && !decimal_commas);
    line.split(separates).filter(|word| !word.is_empty()).map(move |word| {
        if decimal_commas && word.contains(',') {
            Cow::Owned(word.replacen(',', ".", 1))
        } else {
            Cow::Borrowed(word)
        }
    })
}

/// Returns true if commas stand within numbers and something else between them.
fn has_decimal_commas(line: &str) -> bool {
    let words = || line.split(|c: char| c.is_whitespace() || c == ';').filter(|w| !w.is_empty());
    let is_digit = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_digit);
    let within = |word: &str| match word.split_once(',') {
        None => true,
        Some((whole, fraction)) => {
            is_digit(whole.as_bytes().last())
                && is_digit(fraction.as_bytes().first())
                && !fraction.contains(',')
                && !word.contains('.')
        }
    };
    words().count() > 1 && line.contains(',') && words().all(within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_may_stand_between_anything_and_have_decimal_commas() {
        let expected = Some(vec![0.5, -1.25, 3.0]);
        for line in [
            "0.5 -1.25 3",
            "0.5\t-1.25\t3",
            "0.5,-1.25,3",
            "0.5, -1.25, 3",
            "0.5;-1.25;3",
            "0,5 -1,25 3,0",
            "0,5;-1,25;3",
            "0,5\t-1,25\t3",
            "5e-1 -1.25 3e0",
        ] {
            assert_eq!(numbers_of(line), expected, "{line}");
        }
        for line in ["0.5 soon 3", "0.5 nan 3", "0,5,1 2 3 x", "1 2 inf"] {
            assert_eq!(numbers_of(line), None, "{line}");
        }
    }

    #[test]
    fn comments_headings_and_empty_lines_are_no_rows() {
        let text = "# a\n\ntimestamp, p_x [m], p_y\n1 2\n% b\r\n3 4\r\n";
        assert_eq!(lines_of(text).collect::<Vec<_>>(), [(4, "1 2"), (6, "3 4")]);
        assert_eq!(lines_of("1 2\nx y\n").count(), 2, "a heading comes first");
        assert_eq!(lines_of("nan 1 2\n").count(), 1);
        assert_eq!(lines_of("-\n1 2 3\n").count(), 2, "a lone word is none");
    }
}
