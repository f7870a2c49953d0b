//! Views of a map, made on demand: the picture a camera would take of it, and its surface as
//! triangles.
//!
//! A view reads a [`Volume`](crate::volume::Volume) and keeps no part of it.

mod mesh;
mod raycast;

pub use mesh::{MeshConfig, MeshSink, Triangle, Vertex};
pub(crate) use raycast::signs_of_block;
pub use raycast::{NORMAL_ONE, RaycastConfig, RaycastError, RaycastReport, RaycastView, Raycaster};
