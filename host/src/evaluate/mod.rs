//! Quality of a run, where the truth is known.

pub mod certainty;
pub mod faults;
pub mod gauntlet;
pub mod histogram;
pub mod inertial;
pub mod masks;
pub mod objects;
pub mod quantile;
pub mod reference;
pub mod stereo;
pub mod surfaces;
pub mod swept;
pub mod trajectory;
