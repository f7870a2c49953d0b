//! Segments of a map in files that show them together: each above the one before.
//!
//! Poses and blocks of a segment have its own frame of reference, so segments lie on each other.
//! Files of a run that are looked at as a whole have them apart: the mesh, trajectories and poses
//! of objects.

use dynvox_core::geometry::{MapSegment, Transform};
use dynvox_core::view::{MeshSink, Triangle, Vertex};

/// Height by which a segment is shown above the one before, m: farther than any frame is fused.
pub const SEGMENT_GAP_M: f64 = 100.0;

/// Change of y, which points down, from a segment's frame to the one that files share, m.
fn shift_m(segment: MapSegment) -> f64 {
    // Blocks that the camera came back to lie in the lattice of the segment it was in, which their
    // number does not tell; nearly always it is the first one.
    let number = if segment.archived_submap().is_some() { 0 } else { segment.get() };
    -SEGMENT_GAP_M * f64::from(number)
}

/// Pose in a segment as files show it. Poses of the first segment stay as they are, to the bit.
pub fn shown_pose(segment: MapSegment, pose: &Transform) -> Transform {
    let mut shown = *pose;
    shown.translation_m[1] += shift_m(segment);
    shown
}

/// Sink that hands a segment's surface on, as files show it.
pub struct ShownSegment<'s, S> {
    sink: &'s mut S,
    shift_m: f32,
}

impl<'s, S> ShownSegment<'s, S> {
    /// Sink of the surface of `segment`.
    pub fn new(segment: MapSegment, sink: &'s mut S) -> Self {
        Self { sink, shift_m: shift_m(segment) as f32 }
    }

    fn shown(&self, vertex: &Vertex) -> Vertex {
        let [x, y, z] = vertex.position_m;
        Vertex { position_m: [x, y + self.shift_m, z], ..*vertex }
    }
}

impl<S: MeshSink> MeshSink for ShownSegment<'_, S> {
    type Name = S::Name;

    fn vertex(&mut self, vertex: &Vertex, may_recur: bool) -> S::Name {
        let shown = self.shown(vertex);
        self.sink.vertex(&shown, may_recur)
    }

    fn triangle(&mut self, triangle: &Triangle, names: [S::Name; 3]) {
        let vertices = triangle.vertices.each_ref().map(|vertex| self.shown(vertex));
        self.sink.triangle(&Triangle { vertices }, names);
    }
}
