//! Results that a run leaves behind: tables, the summary, the page and the last lines on the
//! console; and two runs compared by their tables.

pub mod bounds;
pub mod chart;
pub mod compare;
mod console;
mod csv;
pub mod html;
mod inertial;
mod poor_map;
pub mod rig;
mod summary;
pub mod text;
pub mod viewer;

pub use console::summary_lines;
pub use csv::{write_reference, write_surface_errors, write_tracks_truth};
pub use summary::Summary;
