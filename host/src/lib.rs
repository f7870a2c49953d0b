//! The host of dynvox: feeds the core, watches its ceilings, shows what it made.

pub mod cli;
pub mod dataset;
pub mod depth;
pub mod evaluate;
pub mod export;
pub mod fixtures;
pub mod observe;
pub mod report;
pub mod run;
pub mod segmentation;
pub mod sweep;
pub mod synth;
