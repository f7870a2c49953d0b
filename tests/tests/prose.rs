//! Item docs can be read alone in an editor's hover, and lines fit beside another window.
//!
//! An item's doc opens with a noun or a verb and names its subject. Words that this project once
//! used in a sense of its own (`PHRASES`) have a plain one. The bounds hold what the tree has
//! today; lower them with every folder that is rewritten, and never raise one.
//!
//! `cargo test -p dynvox-tests --test prose -- --nocapture` prints the counts of each folder and
//! the line of every finding.

use dynvox_tests::source::{files, parts, text};
use std::collections::BTreeMap;
use std::path::Path;

/// Widest line of code and comments, columns.
const COLUMNS: usize = 100;
/// Longest name of a test, characters.
const NAME_CHARS: usize = 70;
/// Fewest comment lines in a thousand lines of code, over all folders. The figure only ever rises;
/// none of them may repeat the code.
const MIN_COMMENTS: usize = 29;
/// This test, which names what it forbids.
const EXEMPT: &str = "tests/tests/prose.rs";

/// Words that make a doc's first sentence a clause without a subject.
const CLAUSES: [&str; 10] =
    ["What", "How", "Whether", "Where", "Which", "That", "When", "Those", "Who", "Why"];
/// Words that make a doc lean on its neighbour.
const LEANING: [&str; 7] = ["The same", "Its", "As", "Of", "Their", "Likewise", "Ditto"];
/// Phrases with a plainer word: instead of, compared with, only, because.
const PHRASES: [&str; 5] = [
    "in place of",
    "the same about any other",
    "is no matter of",
    "likewise the other",
    "of it alone",
];

/// Kinds of findings, with the most there may be of each.
const BOUNDS: [(&str, usize); 7] = [
    ("doc opens with a clause", 0),
    ("doc leans on a neighbour", 0),
    ("line over 100 columns", 216),
    ("line over 140 columns", 0),
    ("test name over 70 characters", 0),
    ("number without its zero", 0),
    ("phrase with a plainer word", 0),
];
const CLAUSE: usize = 0;
const LEANS: usize = 1;
const WIDE: usize = 2;
const VERY_WIDE: usize = 3;
const LONG_NAME: usize = 4;
const NO_ZERO: usize = 5;
const PHRASE: usize = 6;

/// One finding: its kind, and its line.
type Finding = (usize, usize);

/// Returns true if a sentence begins with one of the words, as a whole word.
fn opens_with(sentence: &str, words: &[&str]) -> bool {
    let ends = |rest: &str| !rest.starts_with(|char: char| char.is_alphanumeric() || char == '_');
    words.iter().any(|word| sentence.strip_prefix(word).is_some_and(ends))
}

/// Returns true if a text holds a decimal fraction that begins with its point: `.06`, and not
/// `1.06`, `x.0` or `..9`.
fn lacks_zero(text: &str) -> bool {
    let chars: Vec<char> = text.chars().collect();
    let at = |at: usize| chars.get(at).copied().unwrap_or(' ');
    (0..chars.len()).any(|dot| {
        let before = if dot == 0 { ' ' } else { at(dot - 1) };
        at(dot) == '.' && at(dot + 1).is_ascii_digit() && (before.is_whitespace() || before == '(')
    })
}

/// Everything in a Rust file that a reader stumbles over.
fn findings(rust: &str) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut within_doc = false;
    let prose = parts(rust).prose;
    for (at, (line, prose)) in rust.lines().zip(prose.lines()).enumerate() {
        let (number, trimmed) = (at + 1, line.trim());
        let columns = line.chars().count();
        // A line with an address cannot be broken.
        if columns > COLUMNS && !line.contains("://") {
            found.push((WIDE, number));
        }
        if columns > 140 && !line.contains("://") {
            found.push((VERY_WIDE, number));
        }
        // Four slashes are no doc comment.
        if let Some(doc) = trimmed.strip_prefix("///").filter(|doc| !doc.starts_with('/')) {
            if !within_doc && opens_with(doc.trim(), &CLAUSES) {
                found.push((CLAUSE, number));
            }
            if !within_doc && opens_with(doc.trim(), &LEANING) {
                found.push((LEANS, number));
            }
            within_doc = true;
        } else {
            // Attributes stand between a doc comment's parts.
            within_doc &= trimmed.starts_with("#[");
        }
        if trimmed.starts_with("//") && lacks_zero(trimmed) {
            found.push((NO_ZERO, number));
        }
        let lower = prose.to_lowercase();
        if PHRASES.iter().any(|phrase| lower.contains(phrase)) {
            found.push((PHRASE, number));
        }
    }
    found.extend(long_test_names(rust));
    found.sort_by_key(|&(kind, line)| (line, kind));
    found
}

/// Names of tests beyond [`NAME_CHARS`].
fn long_test_names(rust: &str) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut is_test = false;
    for (at, line) in rust.lines().enumerate() {
        let trimmed = line.trim();
        if trimmed == "#[test]" {
            is_test = true;
        } else if let Some(rest) = trimmed.strip_prefix("fn ").filter(|_| is_test) {
            let name = rest.split('(').next().unwrap_or_default();
            if name.chars().count() > NAME_CHARS {
                found.push((LONG_NAME, at + 1));
            }
            is_test = false;
        }
    }
    found
}

#[test]
fn prose_can_be_read_alone_and_lines_fit() {
    let mut folders: BTreeMap<String, [usize; BOUNDS.len()]> = BTreeMap::new();
    let (mut totals, mut list) = ([0; BOUNDS.len()], Vec::new());
    for path in files(&["rs"]).into_iter().filter(|path| path != Path::new(EXEMPT)) {
        let names = path.components().map(|part| part.as_os_str().to_string_lossy());
        let folder = names.take(3).collect::<Vec<_>>().join("/");
        for (kind, line) in findings(&text(&path)) {
            folders.entry(folder.clone()).or_default()[kind] += 1;
            totals[kind] += 1;
            list.push(format!("{}:{line}: {}", path.display(), BOUNDS[kind].0));
        }
    }
    println!("{}", list.join("\n"));
    for (folder, counts) in &folders {
        println!("{counts:5?}  {folder}");
    }
    println!("{totals:5?}  in all: {:?}", BOUNDS.map(|(name, _)| name));
    let over: Vec<_> = BOUNDS
        .iter()
        .zip(totals)
        .filter(|((_, most), count)| count > most)
        .map(|((name, most), count)| format!("{name}: {count}, at most {most}"))
        .collect();
    assert!(over.is_empty(), "{}; run with --nocapture for the lines", over.join("; "));
}

/// Lines of comments, and lines of code, of a Rust file. Docs and blank lines are neither.
fn comment_and_code_lines(rust: &str) -> [usize; 2] {
    let mut counts = [0; 2];
    let lines = rust.lines().map(str::trim).filter(|line| !line.is_empty());
    for line in lines.filter(|line| !line.starts_with("///") && !line.starts_with("//!")) {
        counts[usize::from(!line.starts_with("//"))] += 1;
    }
    counts
}

#[test]
fn code_has_comments_that_say_why() {
    let mut sums = [0; 2];
    for path in files(&["rs"]) {
        let counts = comment_and_code_lines(&text(&path));
        sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    let [comments, code] = sums;
    let per_thousand = 1_000 * comments / code;
    println!("{comments} lines of comments, {code} of code: {per_thousand} in a thousand");
    assert!(per_thousand >= MIN_COMMENTS, "{per_thousand} in a thousand, at least {MIN_COMMENTS}");
}

#[test]
fn docs_and_blank_lines_are_neither_comments_nor_code() {
    let rust = "//! Module.\n\n/// Item.\nfn f() {\n    // Reason.\n    g(); // not a line\n}\n";
    assert_eq!(comment_and_code_lines(rust), [1, 3]);
}

#[test]
fn each_kind_of_finding_is_found() {
    let wide = format!("// {}", "x".repeat(100));
    let very = format!("// {}", "x".repeat(150));
    let name = "a".repeat(NAME_CHARS + 1);
    let kinds = |rust: &str| findings(rust).into_iter().map(|(kind, _)| kind).collect::<Vec<_>>();
    assert_eq!(kinds("/// What is taken.\nfn f() {}"), [CLAUSE]);
    assert_eq!(kinds("/// The same about any axis.\nfn f() {}"), [LEANS]);
    assert_eq!(kinds("/// Width, px.\n/// Which counts.\nfn f() {}"), [0; 0]);
    assert_eq!(kinds(&wide), [WIDE]);
    assert_eq!(kinds(&very), [WIDE, VERY_WIDE]);
    assert_eq!(kinds(&format!("#[test]\nfn {name}() {{}}")), [LONG_NAME]);
    assert_eq!(kinds("// It takes .06 s, not 1.06 or 0.06, in 1..6."), [NO_ZERO]);
    assert_eq!(kinds("// A sum in place of a mean."), [PHRASE]);
    assert_eq!(kinds("let text = \"a sum in place of a mean\";"), [PHRASE]);
    assert_eq!(kinds("/// Howitzer shells.\nfn f() {}"), [0; 0], "a whole word");
}
