//! The binary as a user meets it, in one program that is compiled once:
//! `cargo test -p dynvox --test command_line fleet::` runs one part.
#![allow(missing_docs)]

mod bags;
mod binary;
mod bombs;
mod book;
mod browser;
mod calibration;
mod capacity;
mod cli;
mod commands;
mod diff;
mod documents;
mod egomotion;
mod endings;
mod export;
mod faults;
mod first_steps;
mod fixtures;
mod fleet;
mod inertial;
mod layouts;
mod masks;
mod mavlink;
mod networks;
mod ownership;
mod requests;
mod resume;
mod run_folder;
mod same_run;
mod segments;
mod stream;
mod sweep;
mod terminal;
mod viewer;
