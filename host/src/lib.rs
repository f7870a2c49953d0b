//! The host of dynvox: feeds the core, watches its ceilings, shows what it made.

pub mod cli;
pub mod evaluate;
pub mod fixtures;
pub mod formats;
pub mod input;
pub mod observe;
pub mod report;
pub mod run;
pub mod sweep;
pub mod synth;
