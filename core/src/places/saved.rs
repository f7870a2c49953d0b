//! Places as bytes: those of a snapshot, and the keyframes of a map in a file of their own.

use super::{Places, table::Table};
use crate::{geometry::MapSegment, state::Visitor};

impl Places<'_> {
    /// Visits the keyframes for a file of their own.
    pub(crate) fn visit_keyframes(&mut self, visitor: &mut impl Visitor) {
        self.table.visit_in_order(visitor);
    }

    /// Makes keyframes that were read the places of an old map; with `is_fixed` none is added.
    /// Returns the last segment that one of them lies in; `None` without keyframes.
    pub(crate) fn take_up(&mut self, is_fixed: bool) -> Option<MapSegment> {
        let Self { table, index, .. } = self;
        index.clear();
        for slot in 0..table.len() {
            for (point, (_, descriptor)) in table.points(slot).enumerate() {
                index.insert(descriptor, Table::number(slot, point));
            }
        }
        self.is_fixed = is_fixed;
        table.poses().map(|pose| pose.segment).max()
    }

    /// Forgets all keyframes.
    pub(crate) fn clear(&mut self) {
        self.table.clear();
        self.index.clear();
        self.graph.clear();
        self.is_fixed = false;
    }

    /// Visits what lives from frame to frame; nothing where there are no keyframes.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        // The query is scratch memory, and each frame says anew whether poses moved.
        let Self {
            table,
            index,
            query: _,
            graph,
            pending,
            depth_m,
            has_moved: _,
            segment,
            frames,
            thinned,
            random,
            is_on,
            is_fixed,
        } = self;
        if !*is_on {
            return;
        }
        table.visit(visitor);
        index.visit(visitor);
        graph.visit(table.len(), visitor);
        pending.visit(visitor);
        visitor.f64(depth_m);
        visitor.code(
            segment,
            |segment| u32::from(segment.get()),
            |code| MapSegment::new(code as u16),
        );
        visitor.u32s([frames, thinned]);
        let mut fixed = u8::from(*is_fixed);
        visitor.u8(&mut fixed);
        *is_fixed = fixed != 0;
        random.visit(visitor);
    }
}
