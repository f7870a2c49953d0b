//! The host of dynvox: feeds the core, watches its ceilings, shows what it made.

pub mod cli;
pub mod compare;
pub mod dataset;
pub mod depth;
pub mod evaluation;
pub mod export;
pub mod fixtures;
pub mod harness;
pub mod segmentation;
pub mod store;
pub mod sweep;
pub mod synth;
