//! YAML and OpenCV's XML as one tree of values whose errors name the key.

use crate::formats::{FormatError, read_text};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// A file's values.
pub struct Tree {
    path: PathBuf,
    value: Value,
}

/// One value of a tree.
#[derive(Clone, Copy)]
pub struct Node<'t> {
    path: &'t Path,
    key: &'t str,
    value: &'t Value,
}

impl Tree {
    /// Reads a file as [`Tree::from_text`] does.
    pub fn read(path: &Path) -> Result<Self, FormatError> {
        Self::from_text(&read_text(path)?, path)
    }

    /// Parses XML if the file's name or text says so, else YAML. `path` names the text in errors.
    pub fn from_text(text: &str, path: &Path) -> Result<Self, FormatError> {
        let xml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml"))
            || text.trim_start().starts_with("<?xml");
        let value = if xml { from_xml(text, path)? } else { from_yaml(text, path)? };
        Ok(Self { path: path.to_path_buf(), value })
    }

    /// Lines `key: word word ...`.
    pub fn of_lines(text: &str, path: &Path) -> Self {
        let line = |line: &str| {
            let (key, words) = line.split_once(':')?;
            Some((key.trim().to_owned(), words_of(words)))
        };
        Self {
            path: path.to_path_buf(),
            value: Value::Object(text.lines().filter_map(line).collect()),
        }
    }

    /// The whole.
    pub fn root(&self) -> Node<'_> {
        Node { path: &self.path, key: "", value: &self.value }
    }
}

const CHECK_WHOLE: &str = "Check that the file is whole and of the format its ending says";

fn from_yaml(text: &str, path: &Path) -> Result<Value, FormatError> {
    // OpenCV writes `%YAML:1.0`, which is no directive of YAML.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let body = if text.starts_with("%YAML") {
        text.split_once('\n').map_or("", |(_, rest)| rest)
    } else {
        text
    };
    let value: Value = serde_saphyr::from_str(body).map_err(|error| {
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

fn from_xml(text: &str, path: &Path) -> Result<Value, FormatError> {
    let refuse = |reason: String| FormatError::content(path, reason, CHECK_WHOLE);
    let document = roxmltree::Document::parse(text)
        .map_err(|error| refuse(format!("it is not XML: {error}")))?;
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
        self.path
    }

    /// The value of a key; `None` if the key is missing.
    pub fn get(&self, key: &'t str) -> Option<Node<'t>> {
        Some(Node { path: self.path, key, value: self.value.get(key)? })
    }

    /// The value of a key that must be there.
    pub fn need(&self, key: &'t str) -> Result<Node<'t>, FormatError> {
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

    /// A number.
    pub fn number(&self) -> Result<f64, FormatError> {
        self.as_number(self.value)
    }

    /// The number of a key.
    pub fn value_of(&self, key: &'t str) -> Result<f64, FormatError> {
        self.need(key)?.number()
    }

    fn as_number(&self, value: &Value) -> Result<f64, FormatError> {
        let number = match value {
            Value::Number(number) => number.as_f64(),
            // YAML's `.nan` and `.inf`, and numbers in quotes.
            Value::String(word) => word.trim_start_matches('.').parse().ok().or(word.parse().ok()),
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
        FormatError::content(self.path, reason, action)
    }
}

/// Returns true if an image can be so wide or high, px.
fn is_side(number: f64) -> bool {
    (1.0..=65_535.0).contains(&number) && number.fract() == 0.0
}
