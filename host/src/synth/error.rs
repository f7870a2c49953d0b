//! Reasons why a synthetic world or its files cannot be made.

/// Reason why a world or its files cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum SynthError {
    /// A figure of the configuration is out of range.
    #[error("{0}")]
    Config(String),
    /// The target folder holds something already.
    #[error("{0} exists and is not empty. Name another folder, or remove it")]
    NotEmpty(std::path::PathBuf),
    /// A file could not be written.
    #[error("{path} cannot be written: {source}. Check the disk and the permissions")]
    Write {
        /// Path of the file.
        path: std::path::PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
}
