//! Page of every message that an error can give: `docs/messages.md`, written from the errors
//! themselves.
//!
//! Each error has a table of its variants and examples. A new variant does not compile until it
//! has its line.

use dynvox_core::{BudgetError, BudgetOptions, Capacity};
use std::{
    io::{Error, ErrorKind},
    path::{Path, PathBuf},
};

/// The sentences of an error: each line has a variant's pattern and an example. Variants that hand
/// on another error's sentence stand behind `hands_on`.
macro_rules! sentences {
    ($error:ty; hands_on [$($inner:pat),*]; $($variant:pat => $example:expr,)*) => {{
        // Exhaustive: a new variant is a compile error here.
        fn is_known(error: &$error) -> bool {
            match error {
                $($variant => true,)*
                $($inner => false,)*
            }
        }
        let examples: Vec<$error> = vec![$($example),*];
        assert!(examples.iter().all(is_known));
        let fits = [$(matches!($example, $variant)),*];
        assert!(fits.iter().all(|fits| *fits), "an example of another variant: {fits:?}");
        examples.iter().map(ToString::to_string).collect::<Vec<_>>()
    }};
}

mod core_errors;
mod inputs;
mod results;
mod runs;

fn path(text: &str) -> PathBuf {
    text.into()
}

fn io(kind: ErrorKind) -> Error {
    kind.into()
}

fn text(text: &str) -> String {
    text.to_owned()
}

/// The page.
fn page() -> String {
    let mut page = text(
        "# Messages\n\nAll sentences that an error can give, with examples of files and figures. \
         Each says what\nhappened, in which file or frame, and what to do next; those of the core \
         say what happened, and the\nprogram that embeds it says where.\n\n\
         `DYNVOX_BLESS=1 cargo test -p dynvox --lib cli::messages` writes this page from the \
         errors.\n",
    );
    for (part, sections) in [
        ("Inputs", inputs::all()),
        ("Runs", runs::all()),
        ("Results", results::all()),
        ("The core", core_errors::all()),
    ] {
        page += &format!("\n## {part}\n");
        for (title, sentences) in sections {
            page += &format!("\n### {title}\n\n");
            sentences.iter().for_each(|sentence| page += &format!("- {sentence}\n"));
        }
    }
    page
}

#[test]
fn the_page_of_messages_is_that_of_the_errors() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/messages.md");
    if std::env::var_os("DYNVOX_BLESS").is_some() {
        std::fs::write(&file, page()).unwrap();
    } else {
        let written = std::fs::read_to_string(&file).unwrap();
        assert_eq!(written, page(), "DYNVOX_BLESS=1 writes it anew");
    }
}

#[test]
fn messages_are_whole_sentences_that_end_without_a_full_stop() {
    let parts = [inputs::all(), runs::all(), results::all(), core_errors::all()];
    for sentence in parts.iter().flatten().flat_map(|(_, sentences)| sentences) {
        let is_plain = !sentence.contains("Some(")
            && !sentence.contains("{ ")
            && !sentence.contains("  ")
            && !sentence.contains("?.")
            && !sentence.replace("...", "").contains("..");
        assert!(is_plain, "Rust or a riddle: {sentence}");
        assert!(!sentence.ends_with('.') && sentence.len() > 10, "{sentence}");
    }
}

#[test]
fn messages_of_commands_say_what_to_do() {
    for (title, sentences) in [inputs::all(), runs::all(), results::all()].concat() {
        for sentence in sentences {
            // Two sentences, or one with its advice behind a colon or a semicolon, or the rule that
            // a setting breaks.
            let actions = [". ", "; ", ": ", " must be "];
            let has_action = actions.iter().any(|action| sentence.contains(action));
            assert!(has_action, "{title}: {sentence}");
        }
    }
}

#[test]
fn a_budget_that_is_too_small_is_told_in_bytes() {
    let error = Capacity::for_budget(1_000, 640, 480, &BudgetOptions::default()).unwrap_err();
    let BudgetError::TooSmall { least } = error else { panic!("{error}") };
    assert!(error.to_string().contains(&least.to_string()));
}
