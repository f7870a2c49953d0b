//! Receiver of a mesh, and the parts of a mesh.

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vertex {
    /// Place in the map's frame, m.
    pub position_m: [f32; 3],
    /// Red, green, blue; all 0 where neither lattice point beside it has a colour.
    pub colour: [u8; 3],
    /// Observations of the nearer lattice point beside it.
    pub weight: u8,
}

/// A piece of the surface, its corners counter-clockwise seen from free space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Triangle {
    /// The corners.
    pub vertices: [Vertex; 3],
}

/// Takes a mesh while it is made. A closure that takes triangles is one to which vertices have no
/// names.
pub trait MeshSink {
    /// Name that the sink gives a vertex.
    type Name: Copy + Default;

    /// Takes a vertex before the first triangle that has it, and names it. The same vertex comes
    /// again only where it `may_recur`: at the border of a block, and on a lattice point, where
    /// edges meet.
    fn vertex(&mut self, vertex: &Vertex, may_recur: bool) -> Self::Name;

    /// Takes a triangle, and what its corners are called.
    fn triangle(&mut self, triangle: &Triangle, names: [Self::Name; 3]);
}

impl<F: FnMut(Triangle)> MeshSink for F {
    type Name = ();

    fn vertex(&mut self, _: &Vertex, _: bool) {}

    fn triangle(&mut self, triangle: &Triangle, _: [(); 3]) {
        self(*triangle);
    }
}
