//! The host of dynvox: feeds the core, checks its limits, evaluates and shows its results.

pub mod cli;
pub mod evaluate;
pub mod fixtures;
pub mod fleet;
pub mod formats;
pub mod input;
pub mod observe;
pub mod owned;
pub mod report;
pub mod request;
pub mod run;
pub mod scene;
mod sentence;
pub mod slab;
pub mod sweep;
pub mod synth;

pub use request::Request;
pub use sentence::sentence;
