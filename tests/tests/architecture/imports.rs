//! The paths that a Rust file names, read from its text.

use dynvox_tests::source::parts;

/// The module of a file, by its path below `src`: none for `lib.rs`.
pub fn module(path: &str) -> Vec<String> {
    let mut module: Vec<String> =
        path.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if module.last().is_some_and(|last| last == "mod" || last == "lib") {
        module.pop();
    }
    module
}

/// The imports of a Rust file, tests left out.
pub struct Source {
    code: String,
    /// Modules in files of their own that only tests have.
    pub test_modules: Vec<String>,
    /// Paths that begin with `crate`, `super` or `self`.
    pub paths: Vec<Vec<String>>,
}

impl Source {
    /// Reads the text of a file.
    pub fn new(text: &str) -> Self {
        let (code, test_modules) = without_tests(&parts(text).code);
        let begins = |at: usize| {
            let before = code[..at].chars().next_back();
            let alone = before.is_none_or(|char| !(char.is_alphanumeric() || "_:$".contains(char)));
            alone
                && ["crate::", "super::", "self::"]
                    .iter()
                    .any(|start| code[at..].starts_with(start))
        };
        let starts = code.char_indices().map(|(at, _)| at).filter(|&at| begins(at));
        let paths = starts.flat_map(|at| paths(&code, at).0).collect();
        Self { code, test_modules, paths }
    }

    /// The `pub use` of a root: each name, and the module it comes from.
    pub fn exports(&self) -> Vec<(&str, &str)> {
        const USE: &str = "pub use ";
        let uses = self.code.match_indices(USE).flat_map(|(at, _)| {
            let end = self.code[at..].find(';').map_or(self.code.len(), |len| at + len);
            let line = &self.code[at + USE.len()..end];
            let module = line.split("::").next().unwrap_or(line).trim();
            line.split(|char: char| !(char.is_alphanumeric() || char == '_'))
                .map(move |name| (name, module))
        });
        uses.filter(|(name, module)| !name.is_empty() && name != module).collect()
    }

    /// Names that `use` declarations bring in from children of the module: each with its path,
    /// which begins with the child.
    pub fn child_imports(&self) -> Vec<Vec<String>> {
        const USE: &str = "use ";
        let is_item =
            |at: usize| self.code[..at].chars().next_back().is_none_or(|char| char.is_whitespace());
        let starts = self.code.match_indices(USE).map(|(at, _)| at).filter(|&at| is_item(at));
        let found = starts.flat_map(|at| paths(&self.code, at + USE.len()).0);
        found.filter(|path| path.len() > 1).collect()
    }
}

/// The paths that a path with braces stands for, and where it ends.
pub fn paths(code: &str, at: usize) -> (Vec<Vec<String>>, usize) {
    let rest = &code[at..];
    // A list in braces: each of its paths in turn.
    if rest.starts_with('{') {
        let (mut all, mut at) = (Vec::new(), at + 1);
        loop {
            at += code[at..]
                .find(|char: char| !(char.is_whitespace() || char == ','))
                .unwrap_or(code.len() - at);
            if at >= code.len() || code[at..].starts_with('}') {
                return (all, (at + 1).min(code.len()));
            }
            let (inner, end) = paths(code, at);
            all.extend(inner);
            at = end + code[end..].find([',', '}']).unwrap_or(code.len() - end);
        }
    }
    // One segment of the path, and what follows it.
    let len =
        rest.find(|char: char| !(char.is_alphanumeric() || char == '_')).unwrap_or(rest.len());
    let (name, end) = (rest[..len].to_owned(), at + len);
    let goes_on = |code: &str| {
        code.starts_with(|char: char| char.is_alphanumeric() || char == '_' || char == '{')
    };
    match code[end..].strip_prefix("::") {
        Some(more) if goes_on(more) => {
            let (inner, end) = paths(code, end + 2);
            (inner.into_iter().map(|path| [vec![name.clone()], path].concat()).collect(), end)
        }
        _ => (vec![vec![name]], end),
    }
}

/// Code without the items that only tests have, and the names of the modules among them that lie in
/// files of their own.
fn without_tests(code: &str) -> (String, Vec<String>) {
    const TEST: &str = "#[cfg(test)]";
    let (mut kept, mut modules, mut rest) = (String::new(), Vec::new(), code);
    while let Some(at) = rest.find(TEST) {
        kept += &rest[..at];
        // An item ends with its block, or with a semicolon.
        let item = &rest[at + TEST.len()..];
        let head = item.find(['{', ';']).unwrap_or(item.len());
        if let Some(name) =
            item[..head].trim().rsplit_once("mod ").filter(|_| item[head..].starts_with(';'))
        {
            modules.push(name.1.trim().to_owned());
        }
        rest = &item[item_len(item, head)..];
    }
    (kept + rest, modules)
}

/// Length of an item whose body, or semicolon, begins at `head`.
fn item_len(item: &str, head: usize) -> usize {
    let mut depth = 0;
    for (at, char) in item.char_indices().skip_while(|(at, _)| *at < head) {
        depth += i32::from(char == '{') - i32::from(char == '}');
        if depth == 0 && (char == ';' || char == '}') {
            return at + 1;
        }
    }
    item.len()
}
