//! YAML, JSON and OpenCV's XML as one tree of values whose errors name line and key.

use crate::formats::bounds::{CALIBRATION_TEXT, MAX_YAML_ALIASES, MAX_YAML_NODES};
use crate::formats::xml::xml;
use crate::formats::{FormatError, read_text_within};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// A file's values.
#[derive(Debug)]
pub struct Tree {
    path: PathBuf,
    text: String,
    value: Value,
}

/// One value of a tree.
#[derive(Clone, Copy, Debug)]
pub struct Node<'t> {
    tree: &'t Tree,
    key: &'t str,
    value: &'t Value,
}

impl Tree {
    /// Reads a file as [`Tree::from_text`] does.
    pub fn read(path: &Path) -> Result<Self, FormatError> {
        Self::from_text(&read_text_within(path, &CALIBRATION_TEXT)?, path)
    }

    /// Parses XML or JSON if the file's name or text says so, else YAML. `path` names the text in
    /// errors.
    pub fn from_text(text: &str, path: &Path) -> Result<Self, FormatError> {
        let ends_in =
            |end: &str| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(end));
        let begin = text.trim_start_matches('\u{feff}').trim_start();
        let value = if ends_in("xml") || begin.starts_with("<?xml") {
            from_xml(text, path)?
        } else if begin.starts_with('{') {
            from_json(begin, path)?
        } else {
            from_yaml(text, path)?
        };
        Ok(Self { path: path.to_path_buf(), text: text.to_owned(), value })
    }

    /// Lines `key: word word ...`.
    pub fn of_lines(text: &str, path: &Path) -> Self {
        let line = |line: &str| {
            let (key, words) = line.split_once(':')?;
            Some((key.trim().to_owned(), words_of(words)))
        };
        Self {
            path: path.to_path_buf(),
            text: text.to_owned(),
            value: Value::Object(text.lines().filter_map(line).collect()),
        }
    }

    /// Values that another parser read of a text.
    pub fn of_values(value: Value, text: &str, path: &Path) -> Self {
        Self { path: path.to_path_buf(), text: text.to_owned(), value }
    }

    /// The whole.
    pub fn root(&self) -> Node<'_> {
        Node { tree: self, key: "", value: &self.value }
    }

    /// Number of the only line that begins with a key; `None` where none or several do.
    fn line_of(&self, key: &str) -> Option<usize> {
        let begins = |line: &str| {
            let line = line.trim_start().trim_start_matches(['"', '-', ' ', '<']);
            line.strip_prefix(key).is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
        };
        let mut lines = self.text.lines().zip(1..).filter(|(line, _)| begins(line));
        let (_, number) = lines.next()?;
        lines.next().is_none().then_some(number)
    }
}

const CHECK_WHOLE: &str = "Check that the file is whole and of the format its ending says";

fn from_json(text: &str, path: &Path) -> Result<Value, FormatError> {
    serde_json::from_str(text).map_err(|error| {
        FormatError::content(path, format!("it is not JSON: {error}"), CHECK_WHOLE)
    })
}

fn from_yaml(text: &str, path: &Path) -> Result<Value, FormatError> {
    let text = as_opencv_reads(text.strip_prefix('\u{feff}').unwrap_or(text));
    let options = serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_nodes: MAX_YAML_NODES,
            max_aliases: MAX_YAML_ALIASES,
        },
    };
    let value: Value = serde_saphyr::from_str_with_options(&text, options).map_err(|error| {
        let first = error
            .to_string()
            .lines()
            .next()
            .unwrap_or_default()
            .trim_start_matches("error: ")
            .to_owned();
        FormatError::content(path, format!("it is not YAML: {first}"), CHECK_WHOLE)
    })?;
    if value.is_object() {
        Ok(value)
    } else {
        Err(FormatError::content(path, "it holds no keys", CHECK_WHOLE))
    }
}

/// OpenCV's dialect as YAML: `%YAML:1.0` is no directive, `key:value` needs no space, and lines may
/// be indented by tabs. Lines keep their numbers.
fn as_opencv_reads(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 64);
    for (at, line) in text.lines().enumerate() {
        let body = line.trim_start();
        let key = body.find(|c: char| !(c.is_alphanumeric() || "_.".contains(c))).unwrap_or(0);
        let (key, rest) = body.split_at(key);
        let joined = rest.strip_prefix(':').filter(|value| !value.is_empty());
        if at == 0 && line.starts_with("%YAML") {
            out.push('#');
        }
        line[..line.len() - body.len()].chars().for_each(|c| match c {
            '\t' => out.push_str("    "),
            other => out.push(other),
        });
        match joined {
            Some(value) if !key.is_empty() && !value.starts_with(char::is_whitespace) => {
                out.extend([key, ": ", value, "\n"]);
            }
            _ => out.extend([body, "\n"]),
        }
    }
    out
}

fn from_xml(text: &str, path: &Path) -> Result<Value, FormatError> {
    let refuse = |reason: String| FormatError::content(path, reason, CHECK_WHOLE);
    let document = xml(text).map_err(refuse)?;
    let root = document.root_element();
    if root.has_tag_name("opencv_storage") {
        Ok(element(root, 0))
    } else {
        Err(refuse("it has no opencv_storage".to_owned()))
    }
}

/// Deepest nesting that is read; calibrations have three levels.
const DEEPEST: usize = 8;

/// An element's children by name, or its words as numbers.
fn element(node: roxmltree::Node<'_, '_>, depth: usize) -> Value {
    let children: Map<String, Value> = node
        .children()
        .filter(|child| child.is_element() && depth < DEEPEST)
        .map(|child| (child.tag_name().name().to_owned(), element(child, depth + 1)))
        .collect();
    if !children.is_empty() {
        return Value::Object(children);
    }
    words_of(node.text().unwrap_or_default())
}

/// Words as numbers where they are; one word alone is no list.
fn words_of(text: &str) -> Value {
    let word = |word: &str| {
        let number = word.parse::<f64>().ok().and_then(serde_json::Number::from_f64);
        number.map_or_else(|| Value::String(word.to_owned()), Value::Number)
    };
    let words: Vec<Value> = text.split_whitespace().map(word).collect();
    match words.as_slice() {
        [one] => one.clone(),
        _ => Value::Array(words),
    }
}

impl<'t> Node<'t> {
    /// The file, to name it.
    pub fn path(&self) -> &'t Path {
        &self.tree.path
    }

    /// The value of a key; `None` if the key is missing.
    pub fn get(&self, key: &str) -> Option<Node<'t>> {
        let (key, value) = self.value.as_object()?.get_key_value(key)?;
        Some(Node { tree: self.tree, key, value })
    }

    /// Tells whether a key is there.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Keys with their values.
    pub fn entries(&self) -> impl Iterator<Item = Node<'t>> + use<'t> {
        let tree = self.tree;
        self.value.as_object().into_iter().flatten().map(move |(key, value)| Node {
            tree,
            key,
            value,
        })
    }

    /// Elements of a list; none of another value.
    pub fn elements(&self) -> impl Iterator<Item = Node<'t>> + use<'t> {
        let (tree, key) = (self.tree, self.key);
        self.value.as_array().into_iter().flatten().map(move |value| Node { tree, key, value })
    }

    /// Name of the value's key.
    pub fn key(&self) -> &'t str {
        self.key
    }

    /// The value of the first of some keys.
    pub fn any(&self, keys: &[&str]) -> Option<Node<'t>> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// The value of a key that must be there.
    pub fn need(&self, key: &str) -> Result<Node<'t>, FormatError> {
        self.get(key).ok_or_else(|| {
            let within =
                if self.key.is_empty() { String::new() } else { format!(" in {}", self.key) };
            self.refuse(
                &format!("{key} is missing{within}"),
                "Compare it with the calibration tool's own output: the file may be cut off or of \
                 another tool",
            )
        })
    }

    /// The text of a value.
    pub fn text(&self) -> Result<&'t str, FormatError> {
        self.value
            .as_str()
            .ok_or_else(|| self.refuse(&format!("{} is not a word", self.key), CHECK_WHOLE))
    }

    /// Tells whether the value is `true` or `yes`.
    pub fn is_true(&self) -> bool {
        *self.value == Value::Bool(true) || self.value.as_str() == Some("yes")
    }

    /// A number, or a matrix of one.
    pub fn number(&self) -> Result<f64, FormatError> {
        match self.value.get("data") {
            Some(_) => self.array().map(|[number]| number),
            None => self.as_number(self.value),
        }
    }

    /// The number of a key.
    pub fn value_of(&self, key: &str) -> Result<f64, FormatError> {
        self.need(key)?.number()
    }

    fn as_number(&self, value: &Value) -> Result<f64, FormatError> {
        let number = match value {
            Value::Number(number) => number.as_f64(),
            // Numbers in quotes.
            Value::String(word) => word.trim().parse().ok(),
            _ => None,
        };
        match number {
            Some(number) if number.is_finite() => Ok(number),
            _ => Err(self.refuse(
                &format!("{} holds {value}, which is not a finite number", self.key),
                "Calibrate again, or correct the number",
            )),
        }
    }

    /// The numbers of a list, of a list of lists, or of an OpenCV matrix (its `data`), row by row.
    pub fn numbers(&self) -> Result<Vec<f64>, FormatError> {
        let list = self.value.get("data").unwrap_or(self.value);
        let Value::Array(rows) = list else { return Ok(vec![self.as_number(list)?]) };
        let flat = rows
            .iter()
            .flat_map(|row| row.as_array().map_or(std::slice::from_ref(row), Vec::as_slice));
        flat.map(|value| self.as_number(value)).collect()
    }

    /// So many numbers.
    pub fn array<const N: usize>(&self) -> Result<[f64; N], FormatError> {
        let numbers = self.numbers()?;
        let found = numbers.len();
        numbers.try_into().map_err(|_| {
            self.refuse(&format!("{} has {found} numbers, not {N}", self.key), CHECK_WHOLE)
        })
    }

    /// A whole number of pixels.
    pub fn pixels(&self) -> Result<u32, FormatError> {
        let number = self.number()?;
        if is_side(number) {
            Ok(number as u32)
        } else {
            Err(self.refuse(
                &format!("{} is {number}, which is not a number of pixels", self.key),
                "Correct the image size",
            ))
        }
    }

    /// Width and height from a list of two.
    pub fn size(&self) -> Result<[u32; 2], FormatError> {
        let [width, height] = self.array()?;
        if is_side(width) && is_side(height) {
            Ok([width as u32, height as u32])
        } else {
            Err(self.refuse(
                &format!("{} is not a width and a height", self.key),
                "Correct the image size",
            ))
        }
    }

    /// An error about this value.
    pub fn refuse(&self, reason: &str, action: &str) -> FormatError {
        let line = Some(self.key).filter(|key| !key.is_empty());
        let line = line.and_then(|key| self.tree.line_of(key));
        let line = line.map_or(String::new(), |line| format!(" (line {line})"));
        FormatError::content(self.path(), format!("{reason}{line}"), action)
    }
}

/// Returns true if an image can be so wide or high, px.
fn is_side(number: f64) -> bool {
    (1.0..=65_535.0).contains(&number) && number.fract() == 0.0
}
