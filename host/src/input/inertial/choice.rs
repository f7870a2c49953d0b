//! Source of inertial samples.

use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::path::PathBuf;
use std::str::FromStr;

/// Source of inertial samples, as the command line names it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InertialChoice {
    /// The recording's own unit, where it has one.
    #[default]
    Auto,
    /// None.
    None,
    /// A file or folder.
    File(PathBuf),
}

impl FromStr for InertialChoice {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "auto" => Self::Auto,
            "none" => Self::None,
            path => Self::File(PathBuf::from(path)),
        })
    }
}
