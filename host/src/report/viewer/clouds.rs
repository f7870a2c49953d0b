//! Points as a layer of their own: planes of their positions (16 bits of the cloud's box) and
//! colours, as in [`crate::scene::tiles`], deflated.

use crate::scene::tiles::planes::{
    longest_side, morton, push_byte_differences, push_word_differences,
};
use crate::scene::{IndexedMesh, PlanningCell, PlanningWindow, Scene};
use flate2::{Compression, write::ZlibEncoder};
use serde::Serialize;
use std::io::{self, Write};

/// Points of a cloud at most: of more, every second, third and so on is shown.
const MAX_POINTS: usize = 60_000;
/// Steps along the longest side of a cloud's box.
const STEPS: f32 = 65_535.0;
/// Colour of voxels that pruning removed.
const PRUNED_COLOUR: [u8; 3] = [214, 51, 132];
/// Share of a block's side that stands for one that pruning took, so that blocks beside each other
/// are told apart.
const PRUNED_SHARE: f32 = 0.5;
/// An obstacle of the planner's window.
const OBSTACLE_COLOUR: [u8; 3] = [33, 37, 41];
/// Free ground beside an obstacle, and at [`CLEAR_M`] from the nearest.
const FREE_COLOURS: [[u8; 3]; 2] = [[250, 82, 82], [64, 192, 87]];
const CLEAR_M: f32 = 3.0;
/// Height above the ground at which the window is drawn, m: measured ground would hide half of it.
const LIFT_M: f32 = 0.1;

/// Description of a cloud for the page's script.
#[derive(Debug, Serialize)]
pub struct CloudHead {
    /// Key of its layer.
    layer: &'static str,
    /// Name of the values the cloud shows.
    name: String,
    /// Least corner of its box, m.
    low_m: [f32; 3],
    /// Length that 65,535 steps of a position stand for, m.
    size_m: f32,
    /// Side of a point, m.
    side_m: f32,
    /// Points.
    points: usize,
}

/// A cloud.
pub struct Cloud {
    /// Description of the cloud.
    pub head: CloudHead,
    /// Contents, deflated.
    pub bytes: Vec<u8>,
}

/// The clouds of a scene; those without a point are left out.
///
/// # Errors
/// The encoder fails, which it does not in memory.
pub fn clouds(scene: &Scene) -> io::Result<Vec<Cloud>> {
    let blocks = &scene.blocks;
    let pruned: Vec<_> = blocks.pruned_m.iter().map(|&at| (at, PRUNED_COLOUR)).collect();
    let name = format!("pruned blocks ({})", pruned.len());
    let planning = &scene.planning;
    let window: Vec<_> =
        planning.cells.iter().map(|cell| (lifted(planning, cell), planning_colour(cell))).collect();
    let clouds = [
        cloud("pruned", name, &pruned, PRUNED_SHARE * blocks.side_m)?,
        cloud("planning", "planning window".to_owned(), &window, planning.cell_m)?,
    ];
    Ok(clouds.into_iter().flatten().collect())
}

fn lifted(window: &PlanningWindow, cell: &PlanningCell) -> [f32; 3] {
    [0, 1, 2].map(|axis| cell.position_m[axis] + LIFT_M * window.up[axis])
}

fn planning_colour(cell: &PlanningCell) -> [u8; 3] {
    if cell.occupied {
        return OBSTACLE_COLOUR;
    }
    let share = cell.distance_m.map_or(1.0, |distance_m| (distance_m / CLEAR_M).clamp(0.0, 1.0));
    let [near, clear] = FREE_COLOURS.map(|colour| colour.map(f32::from));
    [0, 1, 2].map(|channel| (near[channel] + share * (clear[channel] - near[channel])) as u8)
}

fn cloud(
    layer: &'static str,
    name: String,
    points: &[([f32; 3], [u8; 3])],
    side_m: f32,
) -> io::Result<Option<Cloud>> {
    // Thinned evenly, so that the page stays small.
    let every = points.len().div_ceil(MAX_POINTS).max(1);
    let mut points: Vec<_> = points.iter().step_by(every).copied().collect();
    let positions_m = points.iter().map(|(at, _)| *at).collect();
    let Some(bounds_m) = IndexedMesh { positions_m, ..IndexedMesh::default() }.bounds_m() else {
        return Ok(None);
    };
    // Along a Morton curve neighbours follow each other: their differences are small and pack well.
    points.sort_by_key(|(at, _)| morton(*at, bounds_m));
    let (low_m, size_m) = (bounds_m[0], longest_side(bounds_m).max(1e-3));
    let mut planes = Vec::with_capacity(9 * points.len());
    for axis in 0..3 {
        // Planes of one kind of number each, which deflate better than interleaved ones.
        push_word_differences(
            &mut planes,
            points.iter().map(|(at, _)| ((at[axis] - low_m[axis]) / size_m * STEPS).round() as u16),
        );
    }
    (0..3).for_each(|channel| {
        push_byte_differences(&mut planes, points.iter().map(|(_, colour)| colour[channel]))
    });
    let mut deflated = ZlibEncoder::new(Vec::new(), Compression::default());
    deflated.write_all(&planes)?;
    let head = CloudHead { layer, name, low_m, size_m, side_m, points: points.len() };
    Ok(Some(Cloud { head, bytes: deflated.finish()? }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn a_cloud_is_thinned_out_and_keeps_places_and_colours() {
        // Without points no cloud, and no entry in the page.
        assert!(cloud("a", String::new(), &[], 1.0).unwrap().is_none());
        // 200 points in x at each step in z: thinning by three keeps the extent.
        let points: Vec<_> = (0..3 * MAX_POINTS)
            .map(|at| ([(at % 200) as f32, 5.0, (at / 200) as f32], [1, 2, 3]))
            .collect();
        let Cloud { head, bytes } = cloud("a", "b".to_owned(), &points, 0.4).unwrap().unwrap();
        assert_eq!((head.points, head.low_m, head.size_m), (MAX_POINTS, [0.0, 5.0, 0.0], 899.0));
        let mut planes = Vec::new();
        flate2::read::ZlibDecoder::new(&bytes[..]).read_to_end(&mut planes).unwrap();
        assert_eq!(planes.len(), 9 * MAX_POINTS);
        // Planes hold differences to the point before, so that equal colours are zeros.
        let sums = [6, 7, 8].map(|plane| {
            planes[plane * MAX_POINTS..][..MAX_POINTS]
                .iter()
                .map(|&byte| u32::from(byte))
                .sum::<u32>()
        });
        assert_eq!(sums, [1, 2, 3], "one colour: no difference but the first");
    }
}
