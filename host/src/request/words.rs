//! Options as other programs give them: a number where the command line has a word, one value
//! where it repeats an option, a table where it has `KEY=VALUE`.

use serde::{Deserialize, Deserializer, de};
use serde_json::Value;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

/// Reads a value that the command line parses from a word.
pub fn parsed<'de, D, T>(from: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: FromStr<Err: Display>,
{
    match Value::deserialize(from)? {
        Value::Null => Ok(None),
        value => word(&value).parse().map(Some).map_err(de::Error::custom),
    }
}

/// Reads one path, or a list of them.
pub fn paths<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<PathBuf>, D::Error> {
    Ok(match Value::deserialize(from)? {
        Value::Null => Vec::new(),
        Value::Array(list) => list.iter().map(|path| word(path).into()).collect(),
        path => vec![word(&path).into()],
    })
}

/// Reads one value that the command line parses from a word, or a list of them.
pub fn list<'de, D, T>(from: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: FromStr<Err: Display>,
{
    let words = match Value::deserialize(from)? {
        Value::Null => Vec::new(),
        Value::Array(list) => list,
        one => vec![one],
    };
    words.iter().map(|one| word(one).parse().map_err(de::Error::custom)).collect()
}

/// Reads settings: a table of keys and values, one `KEY=VALUE`, or a list of them.
pub fn settings<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    Ok(match Value::deserialize(from)? {
        Value::Null => Vec::new(),
        Value::Object(table) => {
            table.iter().map(|(key, value)| format!("{key}={}", word(value))).collect()
        }
        Value::Array(list) => list.iter().map(word).collect(),
        one => vec![word(&one)],
    })
}

/// Reads a switch on the command line.
pub fn on_or_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("must be on or off".to_owned()),
    }
}

/// Reads a rate on the command line, Hz.
pub fn rate_hz(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| "must be a number above 0".to_owned())
}

/// A value as the command line has it.
fn word(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
