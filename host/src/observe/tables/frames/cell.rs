//! One value of a row.

use crate::observe::tables::rounded;
use serde::Serialize;

/// A cell of `frames.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// A value that is not known: an empty cell.
    Unknown,
    /// A whole number.
    Count(u64),
    /// A number.
    Number(f64),
    /// One of a few words.
    Word(&'static str),
    /// Digests.
    Text(String),
}

impl Cell {
    /// A number to so many decimals.
    pub fn rounded(value: f64, decimals: i32) -> Self {
        Self::Number(rounded(value, decimals))
    }

    /// A number to so many decimals, where it is known.
    pub fn if_known(value: Option<f64>, decimals: i32) -> Self {
        value.map_or(Self::Unknown, |value| Self::rounded(value, decimals))
    }

    /// The number of a chart; NaN where it is unknown or no number.
    pub fn as_f32(&self) -> f32 {
        match self {
            Self::Count(count) => *count as f32,
            Self::Number(number) => *number as f32,
            Self::Unknown | Self::Word(_) | Self::Text(_) => f32::NAN,
        }
    }
}

impl From<u32> for Cell {
    fn from(count: u32) -> Self {
        Self::Count(count.into())
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Self::Count(count as u64)
    }
}

impl From<&'static str> for Cell {
    fn from(word: &'static str) -> Self {
        Self::Word(word)
    }
}

impl<C: Into<Cell>> From<Option<C>> for Cell {
    fn from(value: Option<C>) -> Self {
        value.map_or(Self::Unknown, Into::into)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}
