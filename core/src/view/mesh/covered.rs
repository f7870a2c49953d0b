//! Surfaces that another submap shows better.
//!
//! A triangle is left out where a surface of a submap that the camera left long before or entered
//! long after lies within the truncation along the triangle's normal, faces the same way, and its
//! block counts for more: by the bits of the mean weight of its observed voxels, so that small
//! differences make no patchwork, then by the newer submap.

use super::Triangle;
use crate::{
    geometry::{MapSegment, Transform},
    volume::{
        BlockCoord, BlockKey, Slot, Volume,
        submaps::{LEFT_AFTER, Submap, in_blocks},
    },
};
use nalgebra::Vector3;

/// Most other submaps that a block is compared with, newest first.
const OTHERS_MAX: usize = 16;

/// Tells which triangles are left out.
pub(super) trait Covers {
    /// Returns true if another surface is shown instead of a triangle.
    fn covers(&self, triangle: &Triangle) -> bool;
}

/// No other surface is known.
pub(super) struct NotCovered;

impl Covers for NotCovered {
    #[inline(always)]
    fn covers(&self, _: &Triangle) -> bool {
        false
    }
}

/// Block whose triangles are drawn, as one of a submap.
#[derive(Clone, Copy)]
pub(super) struct Drawn {
    pub slot: Slot,
    /// Segment that the camera was in.
    pub segment: MapSegment,
    /// Number of the block's submap.
    pub number: u16,
    pub submap: Submap,
}

/// Submaps that may show what a block shows.
pub(super) struct OtherSubmaps<'v, 's> {
    volume: &'v Volume<'s>,
    drawn: Drawn,
    /// Grade of the block.
    grade: u32,
    /// Numbers of the submaps, and from the block's coordinates as driven to theirs.
    others: [(u16, Transform); OTHERS_MAX],
    len: usize,
}

impl<'v, 's> OtherSubmaps<'v, 's> {
    /// Finds the submaps that may hold blocks where a block is.
    pub fn new(volume: &'v Volume<'s>, drawn: Drawn, coord: BlockCoord) -> Self {
        let grade = grade(volume, drawn.slot);
        let others = [(0, Transform::IDENTITY); OTHERS_MAX];
        let mut found = Self { volume, drawn, grade, others, len: 0 };
        let submaps = volume.submaps();
        let voxel_size_m = volume.config().voxel_size_m;
        let center_m = coord.origin().map(|at| (f64::from(at) + 3.5) * f64::from(voxel_size_m));
        for number in submaps.numbers().rev() {
            // Neighbours on the way share one surface.
            let Some(other) = submaps.get(number).filter(|other| {
                other.segment == drawn.segment && number.abs_diff(drawn.number) >= LEFT_AFTER
            }) else {
                continue;
            };
            let t_other_drawn = other.t_closed_driven.inverse() * drawn.submap.t_closed_driven;
            let at = in_blocks(t_other_drawn.transform_point(center_m), voxel_size_m);
            if !other.may_hold(at) {
                continue;
            }
            let Some(entry) = found.others.get_mut(found.len) else { break };
            *entry = (number, t_other_drawn);
            found.len += 1;
        }
        found
    }

    /// Block of a submap at a lattice point, and the voxel's distance where it was observed.
    fn voxel(&self, number: u16, point: [i32; 3]) -> Option<(Slot, i16)> {
        let volume = self.volume;
        let slot = block_of(volume, self.drawn.segment, number, BlockCoord::of_lattice(point)?)?;
        let [x, y, z] = point.map(|at| (at & 7) as usize);
        let voxel = x + 8 * y + 64 * z;
        let weight = *volume.blocks().weight(slot)?.get(voxel)?;
        (weight > 0).then_some((slot, *volume.blocks().sdf(slot)?.get(voxel)?))
    }

    /// Block of a submap whose surface faces the same way as a triangle and lies within the
    /// truncation along its normal.
    fn surface(&self, number: u16, at_m: Vector3<f64>, normal: Vector3<f64>) -> Option<Slot> {
        let config = self.volume.config();
        let voxel_m = f64::from(config.voxel_size_m);
        let steps = libm::ceil(f64::from(config.truncation_m) / voxel_m) as i32;
        let mut before = None;
        // From free space inwards, a voxel at a time.
        for step in -steps..=steps {
            let at = (at_m - normal * (voxel_m * f64::from(step))) / voxel_m;
            let point = [at.x, at.y, at.z].map(|at| libm::floor(at + 0.5) as i32);
            let voxel = self.voxel(number, point);
            if let (Some((_, outside)), Some((slot, inside))) = (before, voxel)
                && outside > 0
                && inside <= 0
            {
                return Some(slot);
            }
            before = voxel;
        }
        None
    }
}

impl Covers for OtherSubmaps<'_, '_> {
    fn covers(&self, triangle: &Triangle) -> bool {
        if self.len == 0 {
            return false;
        }
        let corners =
            triangle.vertices.map(|vertex| Vector3::from(vertex.position_m.map(f64::from)));
        let [a, b, c] = corners;
        let (center_m, normal) = ((a + b + c) / 3.0, (b - a).cross(&(c - a)));
        let length = libm::sqrt(normal.dot(&normal));
        // A triangle without area has no side, nor has one that is not finite.
        if length.is_nan() || length <= 0.0 {
            return false;
        }
        self.others.iter().take(self.len).any(|(number, t_other_drawn)| {
            let at_m: Vector3<f64> = t_other_drawn.transform_point(center_m);
            let normal: Vector3<f64> = t_other_drawn.rotate(normal / length);
            let Some(slot) = self.surface(*number, at_m, normal) else { return false };
            (grade(self.volume, slot), *number) > (self.grade, self.drawn.number)
        })
    }
}

/// Block of a submap at some coordinates: the newest one there, or an archived one.
pub(super) fn block_of(
    volume: &Volume<'_>,
    segment: MapSegment,
    number: u16,
    coord: BlockCoord,
) -> Option<Slot> {
    let archived = BlockKey { segment: MapSegment::from_archived_submap(number), coord };
    volume.find_key(archived).or_else(|| {
        let newest = volume.find_key(BlockKey { segment, coord })?;
        (volume.submaps().of(newest)? == number).then_some(newest)
    })
}

/// Grade of a block: bits of the mean weight of its observed voxels.
fn grade(volume: &Volume<'_>, slot: Slot) -> u32 {
    let Some(weights) = volume.blocks().weight(slot) else { return 0 };
    let (mut sum, mut observed) = (0u32, 0u32);
    for weight in weights {
        sum += u32::from(*weight);
        observed += u32::from(*weight > 0);
    }
    u32::BITS - sum.checked_div(observed).unwrap_or(0).leading_zeros()
}
