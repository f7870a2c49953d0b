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
///
/// ```
/// # use dynvox_core::{
/// #     Capacity, Config, Mapper, Serial, StereoFrame, geometry::{StereoRig, Transform},
/// #     image::View, memory::SLAB_ALIGN,
/// # };
/// # let rig =
/// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// # let capacity = Capacity {
/// #     planning_width: 40, planning_length: 40, planning_height: 10, ..Capacity::TINY
/// # };
/// # let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
/// # let mut mapper = Mapper::new(&capacity, &Config::for_rig(rig), &mut slab)?;
/// # let (grey, wall) = ([90; 320 * 96], [10 << 8; 320 * 96]);
/// # let view = View::new(&grey, 320, 96).unwrap();
/// # let frame = StereoFrame {
/// #     disparity_q8: View::new(&wall, 320, 96),
/// #     t_world_camera: Some(Transform::IDENTITY),
/// #     ..StereoFrame::pair(view, view)
/// # };
/// # for _ in 0..3 {
/// #     mapper.step(&frame, &Serial)?;
/// # }
/// let mut nearest_m = f32::MAX;
/// let count = mapper.triangles(&mut |triangle: dynvox_core::view::Triangle| {
///     nearest_m = nearest_m.min(triangle.vertices[0].position_m[2]);
/// });
/// assert!(count > 0 && (nearest_m - 10.0).abs() < 0.2, "the wall is 10 m ahead");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Triangle {
    /// The corners.
    pub vertices: [Vertex; 3],
}

/// Takes a mesh while it is made. A closure that takes triangles is one to which vertices have no
/// names.
///
/// ```
/// use dynvox_core::view::{MeshSink, Triangle, Vertex};
///
/// /// Numbers vertices as they come.
/// #[derive(Default)]
/// struct Numbered {
///     vertices: Vec<Vertex>,
///     triangles: Vec<[usize; 3]>,
/// }
/// impl MeshSink for Numbered {
///     type Name = usize;
///     fn vertex(&mut self, vertex: &Vertex, _: bool) -> usize {
///         self.vertices.push(*vertex);
///         self.vertices.len() - 1
///     }
///     fn triangle(&mut self, _: &Triangle, names: [usize; 3]) {
///         self.triangles.push(names);
///     }
/// }
/// let mut sink = Numbered::default();
/// let first = sink.vertex(&Vertex::default(), false);
/// sink.triangle(&Triangle::default(), [first; 3]);
/// assert_eq!(sink.triangles, [[0; 3]]);
/// ```
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
