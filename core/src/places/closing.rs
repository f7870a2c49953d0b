//! Change of places by the loops closed so far: from coordinates as driven to those after them.

use super::Places;
use crate::geometry::{MapSegment, Transform};

/// Change at a keyframe.
#[derive(Clone, Copy)]
struct Closing {
    frame: u32,
    segment: MapSegment,
    t_closed_driven: Transform,
}

impl Places<'_> {
    /// Change at each keyframe of this run, oldest first.
    fn closings(&self) -> impl DoubleEndedIterator<Item = Closing> {
        self.table.slots().filter_map(|slot| {
            let (frame, closed) = self.graph.corrected(slot)?;
            let driven = self.table.pose(slot)?;
            let t_closed_driven = if closed == driven.t_world_camera {
                Transform::IDENTITY
            } else {
                (closed * driven.t_world_camera.inverse()).normalized()
            };
            Some(Closing { frame, segment: driven.segment, t_closed_driven })
        })
    }

    /// Change at the newest keyframe of a segment.
    pub(crate) fn newest_closing(&self, segment: MapSegment) -> Transform {
        // Before the first change both differ by rounding only.
        if self.graph.counts().moved == 0 {
            return Transform::IDENTITY;
        }
        let newest = self.closings().next_back().filter(|newest| newest.segment == segment);
        newest.map_or(Transform::IDENTITY, |newest| newest.t_closed_driven)
    }

    /// Tells the change at frames asked for in ascending order, each by the keyframe of its segment
    /// that is nearest: one walk over the keyframes for all of them.
    pub(crate) fn closing_by_frame(&self) -> impl FnMut(MapSegment, u32) -> Option<Transform> {
        let mut later = self.closings().peekable();
        let mut before: Option<Closing> = None;
        move |segment, frame| {
            while let Some(next) = later.next_if(|next| next.frame <= frame) {
                before = Some(next);
            }
            let after = later.peek().filter(|after| after.segment == segment);
            let before = before.as_ref().filter(|before| before.segment == segment);
            let nearest = match (before, after) {
                (Some(before), Some(after)) if after.frame - frame < frame - before.frame => after,
                (Some(only), _) | (None, Some(only)) => only,
                (None, None) => return None,
            };
            Some(nearest.t_closed_driven)
        }
    }
}
