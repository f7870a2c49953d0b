//! What is asked of a run, as values.

mod settings;

pub use settings::Settings;
