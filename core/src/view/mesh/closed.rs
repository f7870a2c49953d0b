//! The surface after all loops: each block where its submap is now, and each wall once.

use super::{
    MeshConfig, MeshSink, Patch, Triangle, Vertex, VertexNames,
    covered::{Drawn, NotCovered, OtherSubmaps, block_of},
};
use crate::{
    geometry::{MapSegment, Transform},
    volume::{BlockKey, Slot, Volume, submaps::LEFT_AFTER},
};

impl Volume<'_> {
    /// Hands the surface of a segment after all loops closed so far to `sink` and returns how many
    /// triangles it has. Each block is drawn where its submap is after them, archived ones too;
    /// where blocks that the camera saw on several visits show one surface, the block counts whose
    /// voxels were observed most, and of equals the newest. Without loops it is [`Volume::mesh`] of
    /// the segment.
    ///
    /// ```
    /// # use dynvox_core::{Capacity, Config, Mapper, geometry::StereoRig, memory::SLAB_ALIGN};
    /// use dynvox_core::{geometry::MapSegment, view::{MeshConfig, Triangle}};
    ///
    /// # let rig =
    /// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
    /// # let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
    /// # let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
    /// let (map, mut triangles) = (mapper.static_map(), Vec::new());
    /// let mut sink = |triangle: Triangle| triangles.push(triangle);
    /// let count = map.closed_mesh(&MeshConfig::default(), MapSegment::FIRST, &mut sink);
    /// assert_eq!((count, triangles.len()), (0, 0), "no frame was taken yet");
    /// # Ok::<(), dynvox_core::NewError>(())
    /// ```
    pub fn closed_mesh(
        &self,
        config: &MeshConfig,
        segment: MapSegment,
        sink: &mut impl MeshSink,
    ) -> u64 {
        if !self.is_bent() {
            return self.mesh(config, |key| key.segment == segment, sink);
        }
        let (mut count, mut names) = (0, VertexNames::new());
        for slot in self.pool().live() {
            let Some(key) = self.blocks().key(slot) else { continue };
            let Some(drawn) = self.drawn(slot, key).filter(|drawn| drawn.segment == segment) else {
                // Of a later segment than the last submap of a full table: where it was fused.
                if key.segment == segment {
                    let patch = Patch::load(self, slot, key.coord, |offset| {
                        self.find_key(key.offset(offset)?)
                    });
                    count += patch.draw(config, &mut names, &NotCovered, sink);
                }
                continue;
            };
            // Cells reach into blocks of the same stretch of way.
            let beside = |offset| self.beside(&drawn, key.offset(offset)?);
            let others = OtherSubmaps::new(self, drawn, key.coord);
            let patch = Patch::load(self, slot, key.coord, beside);
            let t_closed_driven = &drawn.submap.t_closed_driven;
            let mut moved = Moved { sink: &mut *sink, t_closed_driven };
            count += patch.draw(config, &mut names, &others, &mut moved);
        }
        count
    }

    /// A block as one of its submap.
    fn drawn(&self, slot: Slot, key: BlockKey) -> Option<Drawn> {
        let submaps = self.submaps();
        let archived = key.segment.archived_submap();
        let number = archived.or_else(|| submaps.of(slot))?;
        let submap = *submaps.get(number)?;
        let segment = submap.segment;
        // A full table has blocks of later segments in its last submap.
        (archived.is_some() || segment == key.segment).then_some(Drawn {
            slot,
            segment,
            number,
            submap,
        })
    }

    /// The block at a key's coordinates that is of the same stretch of way as a drawn one, the
    /// nearest in submaps first.
    fn beside(&self, drawn: &Drawn, key: BlockKey) -> Option<Slot> {
        (0..LEFT_AFTER).find_map(|apart| {
            let earlier = drawn.number.checked_sub(apart);
            let later = drawn.number.checked_add(apart);
            let of = |number| block_of(self, drawn.segment, number, key.coord);
            earlier.and_then(of).or_else(|| later.and_then(of))
        })
    }
}

/// Sink that hands a surface on, moved.
struct Moved<'m, S> {
    sink: &'m mut S,
    t_closed_driven: &'m Transform,
}

impl<S> Moved<'_, S> {
    fn moved(&self, vertex: &Vertex) -> Vertex {
        if *self.t_closed_driven == Transform::IDENTITY {
            return *vertex;
        }
        let at_m = self.t_closed_driven.transform_point(vertex.position_m.map(f64::from));
        Vertex { position_m: at_m.map(|at| at as f32), ..*vertex }
    }
}

impl<S: MeshSink> MeshSink for Moved<'_, S> {
    type Name = S::Name;

    fn vertex(&mut self, vertex: &Vertex, may_recur: bool) -> S::Name {
        let moved = self.moved(vertex);
        self.sink.vertex(&moved, may_recur)
    }

    fn triangle(&mut self, triangle: &Triangle, names: [S::Name; 3]) {
        let vertices = triangle.vertices.each_ref().map(|vertex| self.moved(vertex));
        self.sink.triangle(&Triangle { vertices }, names);
    }
}
