//! The host of dynvox: feeds the core, checks its limits, evaluates and shows its results.

#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::print_stdout, clippy::print_stderr)
)]

#[macro_use]
mod terminal;

pub mod cli;
pub mod evaluate;
pub mod fixtures;
pub mod fleet;
pub mod flight;
pub mod formats;
pub mod input;
pub mod live;
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
pub mod volume_copy;

pub use request::Request;
pub use sentence::sentence;
