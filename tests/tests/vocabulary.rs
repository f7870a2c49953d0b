//! Code, messages and documents use the field's words: `tests/vocabulary.txt` lists those they do
//! not use, and what stands in their place.
//!
//! `cargo test -p dynvox-tests --test vocabulary -- --nocapture` prints how many there are, folder
//! by folder, and where.

use dynvox_tests::source::{files, parts, text};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The list, which names every word it bans, and this test.
const EXEMPT: [&str; 2] = ["tests/vocabulary.txt", "tests/tests/vocabulary.rs"];
/// Heading under which the changelog names renamed keys, up to the next heading.
const RENAMED: &str = "### Renamed";

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Word,
    Name,
    Phrase,
}

struct Rule {
    kind: Kind,
    /// Single words, or whole phrases in lower case.
    words: BTreeSet<String>,
    folders: Vec<String>,
}

impl Rule {
    /// A folder with `-` before it is left out.
    fn covers(&self, path: &Path) -> bool {
        let within = |folder: &str| folder == "*" || path.starts_with(folder);
        let excluded =
            self.folders.iter().filter_map(|folder| folder.strip_prefix('-')).any(within);
        !excluded && self.folders.iter().any(|folder| within(folder))
    }
}

fn rules(list: &str) -> Vec<Rule> {
    let lines = list.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    let rule = |line: &str| {
        let columns: Vec<&str> = line.split('|').map(str::trim).collect();
        assert_eq!(columns.len(), 5, "five columns: {line}");
        let (kind, separator) = match columns[0] {
            "word" => (Kind::Word, ' '),
            "name" => (Kind::Name, ' '),
            // Phrases have blanks of their own.
            "phrase" => (Kind::Phrase, ';'),
            other => panic!("an unknown kind: {other}"),
        };
        assert!(kind == Kind::Word || !columns[3].is_empty(), "something to write instead: {line}");
        let words = columns[1]
            .split(separator)
            .map(|word| word.trim().to_owned())
            .filter(|word| !word.is_empty())
            .collect();
        Rule { kind, words, folders: columns[2].split(' ').map(str::to_owned).collect() }
    };
    lines.map(rule).collect()
}

/// Runs of letters and digits, with `_`, and where each begins.
fn names(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let in_name = |char: char| char.is_alphanumeric() || char == '_';
    let starts = text.char_indices().scan(false, move |within, (at, char)| {
        let begins = in_name(char) && !*within;
        *within = in_name(char);
        Some(begins.then_some(at))
    });
    starts
        .flatten()
        .map(move |at| (at, text[at..].split(|char| !in_name(char)).next().unwrap_or_default()))
}

/// The words a name is made of, in lower case: `mask_room` and `MaskRoom` are mask and room.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = '_';
    for char in name.chars() {
        if char == '_' || char.is_uppercase() && before.is_lowercase() {
            words.push(String::new());
        }
        if char != '_' {
            words.last_mut().expect("never empty").extend(char.to_lowercase());
        }
        before = char;
    }
    words
}

/// Names that are methods, or belong to another path, are of their owner's choosing:
/// `iterator.chain()`.
fn is_defined_here(code: &str, at: usize) -> bool {
    let before = code[..at].trim_end();
    !(before.ends_with('.') && !before.ends_with("..") || before.ends_with("::"))
}

/// Text in lower case with the marks of comments left out and every run of blanks made one, and
/// where each byte stood.
fn joined(prose: &str) -> (String, Vec<usize>) {
    let (mut joined, mut places) = (String::from(" "), vec![0]);
    for (at, char) in prose.char_indices() {
        let mark = matches!(char, '/' | '!' | '*' | '`' | '\\') || char.is_whitespace();
        if !mark {
            joined.extend(char.to_lowercase());
        } else if !joined.ends_with(' ') {
            joined.push(' ');
        }
        places.resize(joined.len(), at);
    }
    joined.push(' ');
    places.push(prose.len());
    (joined, places)
}

/// Each banned word in a file and the byte where it stands.
fn banned(path: &Path, content: &str, rules: &[Rule]) -> Vec<(String, usize)> {
    // In Rust, names are looked for in code, and phrases in comments and strings.
    let (code, prose) = match path.extension().is_some_and(|extension| extension == "rs") {
        true => {
            let parts = parts(content);
            (parts.code, parts.prose)
        }
        false => (String::new(), content.to_owned()),
    };
    // Phrases may run over the end of a line.
    let (joined, places) = joined(&prose);
    let code_names: Vec<(usize, &str)> = names(&code).collect();
    let words_of = |(at, name)| words(name).into_iter().map(move |word| (word, at));
    let all_words: Vec<(String, usize)> =
        code_names.iter().copied().chain(names(&prose)).flat_map(words_of).collect();
    let mut found = Vec::new();
    for rule in rules.iter().filter(|rule| rule.covers(path)) {
        match rule.kind {
            Kind::Word => found
                .extend(all_words.iter().filter(|(word, _)| rule.words.contains(word)).cloned()),
            Kind::Name => {
                let of_code = code_names
                    .iter()
                    .filter(|&&(at, name)| rule.words.contains(name) && is_defined_here(&code, at));
                found.extend(of_code.map(|&(at, name)| (name.to_owned(), at)));
            }
            Kind::Phrase => {
                for phrase in &rule.words {
                    // Whole words only.
                    let whole = |&(at, _): &(usize, &str)| {
                        let edge = |char: Option<char>| !char.is_some_and(char::is_alphanumeric);
                        edge(joined[..at].chars().next_back())
                            && edge(joined[at + phrase.len()..].chars().next())
                    };
                    found.extend(
                        joined
                            .match_indices(phrase.as_str())
                            .filter(whole)
                            .map(|(at, _)| (phrase.clone(), places[at])),
                    );
                }
            }
        }
    }
    found
}

/// The changelog without its tables of renamed keys.
fn without_renamed(content: &str) -> String {
    let mut within = false;
    let keep = |line: &str| {
        within = line.starts_with(RENAMED) || within && !line.starts_with('#');
        if within { "\n".to_owned() } else { format!("{line}\n") }
    };
    content.lines().map(keep).collect()
}

#[test]
fn only_words_of_the_field_are_used() {
    let rules = rules(&text(Path::new("tests/vocabulary.txt")));
    let mut folders: BTreeMap<String, usize> = BTreeMap::new();
    let mut list = Vec::new();
    for path in files(&["rs", "md", "h", "c", "toml", "sh", "py", "txt", "html"]) {
        // The list itself names what it forbids.
        if EXEMPT.iter().any(|exempt| path == Path::new(exempt))
            || path.starts_with("fixtures") && path.extension().is_some_and(|e| e == "txt")
        {
            continue;
        }
        let content = without_renamed(&text(&path));
        for (word, at) in banned(&path, &content, &rules) {
            let folder: Vec<_> = path
                .parent()
                .into_iter()
                .flat_map(Path::components)
                .take(3)
                .map(|part| part.as_os_str().to_string_lossy())
                .collect();
            *folders.entry(folder.join("/")).or_default() += 1;
            list.push(format!(
                "{}:{}: {word}",
                path.display(),
                1 + content[..at.min(content.len())].matches('\n').count()
            ));
        }
    }
    list.sort();
    let counts: Vec<_> =
        folders.iter().map(|(folder, count)| format!("{count:5}  {folder}")).collect();
    println!("{}\n{}\n{:5}  in all", list.join("\n"), counts.join("\n"), list.len());
    assert!(
        list.is_empty(),
        "{} words of our own; see tests/vocabulary.txt for what to write instead",
        list.len()
    );
}

#[test]
fn the_count_sees_names_words_and_phrases() {
    let list = "word | room | * | buffer |\nname | keep | core | store | to keep\nphrase | goes on \
                behind | * | resumes after |";
    let rust = "/// It goes\n/// on behind it. Keep this.\nfn mask_room(keep: u8) \
                { values.keep(); let text = \"a room\"; }";
    let found = banned(Path::new("core/a.rs"), rust, &rules(list));
    let words: Vec<_> = found.iter().map(|(word, _)| word.as_str()).collect();
    assert_eq!(words, ["room", "room", "keep", "goes on behind"]);
    assert_eq!(banned(Path::new("host/a.rs"), "fn keep() {}", &rules(list)), []);
    assert_eq!(without_renamed("a\n### Renamed\nroom\n## 0.1\nb"), "a\n\n\n## 0.1\nb\n");
}
