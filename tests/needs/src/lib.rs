//! Marks tests that need what a checkout does not hold. Where it is missing when they are compiled,
//! the test runner shows them as ignored, with the reason: a test that did not run never passes.
//!
//! Clips are looked for in `DYNVOX_DATA`, an absolute path, else in `../shared/data` next to the
//! checkout. A browser installed later is noticed when this crate is compiled again:
//! `touch tests/needs/build.rs`.
//!
//! Time is missing too, mostly: a test that takes long runs where `DYNVOX_LONG` is set, as
//! `.ci/long` does.

use proc_macro::{TokenStream, TokenTree};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Names of the browser, the first one found is taken.
const BROWSERS: [&str; 4] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Returns the folder of the clips for the crate that is being compiled, a folder of the
/// repository.
fn data() -> PathBuf {
    let krate = || {
        PathBuf::from(
            std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo names the crate's folder"),
        )
    };
    std::env::var_os("DYNVOX_DATA").map_or_else(|| krate().join("../../shared/data"), PathBuf::from)
}

/// Explains why a test that needs these paths cannot run.
fn missing(data: &Path, paths: &[String]) -> Option<String> {
    let missing: Vec<&str> =
        paths.iter().filter(|path| !data.join(path).exists()).map(String::as_str).collect();
    (!missing.is_empty())
        .then(|| format!("no {} in DYNVOX_DATA or ../shared/data", missing.join(", ")))
}

/// The first of the programs that is in one of the folders.
fn program<'a>(folders: &[PathBuf], names: &[&'a str]) -> Option<&'a str> {
    names.iter().copied().find(|name| folders.iter().any(|folder| folder.join(name).is_file()))
}

fn browser_found() -> Option<&'static str> {
    let folders: Vec<PathBuf> =
        std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).collect();
    program(&folders, &BROWSERS)
}

/// The test, ignored where there is a reason.
fn ignored(reason: Option<String>, test: TokenStream) -> TokenStream {
    let mut marked: TokenStream = reason
        .map(|reason| format!("#[ignore = {reason:?}]").parse().expect("an attribute"))
        .unwrap_or_default();
    marked.extend(test);
    marked
}

/// The content of string literals between commas.
fn strings(tokens: TokenStream) -> Vec<String> {
    let literal = |token: TokenTree| match token {
        TokenTree::Literal(literal) => Some(literal.to_string().trim_matches('"').to_owned()),
        _ => None,
    };
    tokens.into_iter().filter_map(literal).collect()
}

/// `#[clips("kitti-odometry/sequences/06", "...")]` above `#[test]`: the test needs all of these
/// files and folders of the clips.
#[proc_macro_attribute]
pub fn clips(paths: TokenStream, test: TokenStream) -> TokenStream {
    let paths = strings(paths);
    assert!(!paths.is_empty(), "name what the test needs");
    ignored(missing(&data(), &paths), test)
}

/// `#[browser]` above `#[test]`: the test needs Chromium or Chrome.
#[proc_macro_attribute]
pub fn browser(_: TokenStream, test: TokenStream) -> TokenStream {
    ignored(browser_found().is_none().then(|| "no Chromium is installed".to_owned()), test)
}

/// Explains why a long test does not run, for the values of `DYNVOX_LONG` and of variables that ask
/// for more of it.
fn too_long(asked: &[Option<OsString>]) -> Option<String> {
    let is_asked = asked.iter().flatten().any(|value| !value.is_empty() && value != "0");
    (!is_asked).then(|| "long: .ci/long and DYNVOX_LONG=1 run it".to_owned())
}

/// `#[long]` above `#[test]`: the test takes long, and shorter ones ask most of the same.
/// `#[long("DYNVOX_KILL_TRIALS")]`: it runs where that is set, too.
#[proc_macro_attribute]
pub fn long(variables: TokenStream, test: TokenStream) -> TokenStream {
    let variables = std::iter::once("DYNVOX_LONG".to_owned()).chain(strings(variables));
    ignored(too_long(&variables.map(std::env::var_os).collect::<Vec<_>>()), test)
}

/// `data_folder!()`: the folder of the clips, a string literal.
#[proc_macro]
pub fn data_folder(_: TokenStream) -> TokenStream {
    format!("{:?}", data().to_string_lossy()).parse().expect("a literal")
}

/// `browser_program!()`: the browser's name, a string literal.
#[proc_macro]
pub fn browser_program(_: TokenStream) -> TokenStream {
    format!("{:?}", browser_found().unwrap_or(BROWSERS[0])).parse().expect("a literal")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named_and_what_is_there_is_not() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let of = |paths: &[&str]| {
            missing(here, &paths.iter().map(|&path| path.to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(of(&["src/lib.rs", "src"]), None);
        assert_eq!(
            of(&["src", "none", "neither"]).unwrap(),
            "no none, neither in DYNVOX_DATA or ../shared/data"
        );
    }

    #[test]
    fn long_tests_run_where_they_are_asked_for() {
        let of = |value: &str| Some(OsString::from(value));
        for asked in [[of("1"), None], [None, of("200")], [of("0"), of("200")]] {
            assert_eq!(too_long(&asked), None);
        }
        for not in [[None, None], [of(""), None], [of("0"), of("")]] {
            assert!(too_long(&not).unwrap().contains(".ci/long"));
        }
    }

    #[test]
    fn the_first_program_that_is_there_is_taken() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let folders = [here.join("nowhere"), here.to_owned()];
        assert_eq!(program(&folders, &["none", "build.rs", "Cargo.toml"]), Some("build.rs"));
        assert_eq!(program(&folders, &["none", "src"]), None, "a folder is no program");
    }
}
