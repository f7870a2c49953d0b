//! Triangle meshes as binary PLY files, written and read piece by piece.

mod axes;
mod read;
mod records;
mod write;

pub use axes::{Axes, MeshAxes};
pub use read::{PlyMesh, PlyVertex, PlyVertices};
pub use write::{Mesh, PlyWriter};
