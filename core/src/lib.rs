//! Stereo dense mapping for streets full of moving cars, for machines without a heap.
//!
//! The caller hands over one slab of bytes; the core never uses other memory, never panics on what
//! the world sends it and gives the same bits on every machine. The pipeline is that of Bârsan,
//! Liu, Pollefeys, Geiger, *Robust Dense Mapping for Large-Scale Dynamic Environments* (ICRA 2018).
//!
//! Dependencies run one way: [`memory`], [`image`] and [`geometry`] depend on no stage; [`stereo`],
//! [`scene_flow`] and [`volume`] depend on them; [`egomotion`] on `scene_flow`; [`tracking`] on
//! `egomotion` and [`masks`]; [`objects`] on `tracking` and `volume`. Only [`mapper`] depends on
//! every stage.
//!
//! | feature | what it does |
//! |---|---|
//! | `hashbrown` (default) | The index of blocks is hashbrown's; without it no `alloc` is linked. |
//! | `plain-index` | The index of blocks is a plain table, also with `hashbrown`. |
//! | `serde` | Settings and reports can be written and read back. |
//! | `defmt` | Errors and reports can be printed by defmt. |
#![no_std]
#![cfg_attr(
    test,
    allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)
)]

#[cfg(test)]
extern crate std;

mod attached;
mod bits;
pub mod digest;
pub mod egomotion;
mod flags;
pub mod geometry;
pub mod image;
pub mod inertial;
mod invariants;
mod lanes;
pub mod mapper;
pub mod masks;
pub mod memory;
pub mod objects;
pub mod parallel;
pub mod places;
pub mod planning;
pub mod random;
pub mod rectify;
mod sad;
pub mod scene_flow;
pub mod segmentation;
pub mod settings;
mod slices;
mod stages;
mod state;
pub mod stereo;
pub mod tracking;
pub mod view;
pub mod volume;

pub use mapper::{
    BlockCount, BudgetError, BudgetOptions, CapacityProblem, Config, DeferredWork, Digested,
    FixError, LoadPlacesError, Mapper, MapperConfig, MotionSource, NewError, ObjectDigest,
    ObjectDigests, PoseOrigin, PosePrecision, Report, RestoreError, SAVED_PLACES_HEADER_BYTES,
    Scale, SetError, Severity, StageDigests, StepError, StereoFrame, WorkUnits, saved_keyframes,
};
pub use memory::{Capacity, Footprint, Slab};
pub use parallel::{Executor, Serial};
pub use settings::{Problem, Problems};
pub use stages::{Stage, StageNames};
