//! Mesh files simplified to a number of triangles.

use super::IndexedMesh;
use super::cluster::VertexClustering;
use crate::formats::{FormatError, PlyMesh, PlyVertex};
use std::io;
use std::ops::ControlFlow;
use std::path::Path;

/// Side of the smallest cells, m.
const LEAST_CELL_M: f32 = 0.03;
/// By how much cells grow at least where too many triangles stay.
const LEAST_GROWTH: f32 = 1.05;
/// Triangles that may stay at least: the eight cells around the origin, however large, have 56.
const LEAST_TRIANGLES: usize = 64;
/// The share of the triangles that may stay which is aimed at: those that are counted first need
/// not be like the others.
const AIM: f64 = 0.9;
/// Share of a large mesh's pieces that is counted first, one of so many; and the fewest pieces
/// counted of a small one.
const COUNTED_OF: u64 = 16;
const COUNTED: u64 = 8;
/// Number of counts: triangles of a rough surface fall more slowly than by the square of the cells'
/// sides, so a count far off is not enough.
const COUNTS: usize = 2;

/// The triangles of a mesh, of the static map alone where that is asked for, so many at most; and
/// their number on disk.
///
/// # Errors
/// The file cannot be read, or is no mesh.
pub fn simplified(
    path: &Path,
    static_only: bool,
    max_triangles: usize,
) -> Result<(IndexedMesh, u64), FormatError> {
    let mut mesh = MeshFile { ply: PlyMesh::open(path)?, static_only };
    mesh.simplified(max_triangles.max(LEAST_TRIANGLES)).map_err(FormatError::read(path))
}

struct MeshFile {
    ply: PlyMesh,
    static_only: bool,
}

/// Result of clustering a mesh.
struct Clustered {
    clustering: VertexClustering,
    /// Triangles read, until too many stayed.
    read: u64,
    /// Number of triangles among them that the caller asked for.
    asked_for: u64,
}

impl MeshFile {
    fn simplified(&mut self, max_triangles: usize) -> io::Result<(IndexedMesh, u64)> {
        let mut cell_m = self.cell_m(max_triangles)?;
        loop {
            let Clustered { clustering, read, asked_for } =
                self.clustered(cell_m, max_triangles, 1)?;
            if !clustering.is_full() {
                return Ok((clustering.finish(), asked_for));
            }
            cell_m *= growth(self.ply.triangles as f64 / read as f64).max(LEAST_GROWTH);
        }
    }

    /// Finds the cells' size: if a mesh has more triangles than may stay, some of its pieces are
    /// clustered to predict how many would.
    fn cell_m(&mut self, max_triangles: usize) -> io::Result<f32> {
        let (all, most) = (self.ply.triangles as f64, max_triangles as f64);
        if all <= most {
            return Ok(LEAST_CELL_M);
        }
        let every = (self.ply.pieces() / COUNTED).min(COUNTED_OF) as usize;
        // A surface's triangles fall with the square of the cells' size.
        let mut cell_m = LEAST_CELL_M * (all / most).sqrt() as f32;
        for _ in 0..COUNTS {
            let Clustered { clustering, read, .. } =
                self.clustered(cell_m, max_triangles, every)?;
            // From the share that was read to all.
            let will_stay = clustering.triangles() as f64 * all / read as f64;
            cell_m = (cell_m * growth(will_stay / most)).max(LEAST_CELL_M);
        }
        Ok(cell_m)
    }

    /// Clusters the first of every so many pieces, until too many triangles stay.
    fn clustered(
        &mut self,
        cell_m: f32,
        max_triangles: usize,
        every: usize,
    ) -> io::Result<Clustered> {
        // The number of faces asked for tells later how large the cells have to be.
        let (mut clustering, mut read, mut asked_for) =
            (VertexClustering::new(cell_m, max_triangles), 0, 0);
        let static_only = self.static_only;
        self.ply.faces(every, |corners, vertices| {
            read += 1;
            asked_for += u64::from(clustering.add(corners, |number| {
                let PlyVertex { object, vertex, .. } = vertices.get(number)?;
                Ok((object == 0 || !static_only).then_some(vertex))
            })?);
            // A full clustering is of no use: the next one has larger cells.
            Ok(if clustering.is_full() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            })
        })?;
        Ok(Clustered { clustering, read, asked_for })
    }
}

/// By how much cells grow where so many times the triangles stay that may: a surface has triangles
/// by the inverse square of their sides.
fn growth(times: f64) -> f32 {
    (times / AIM).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::PlyWriter;
    use dynvox_core::view::Vertex;
    use std::collections::HashMap;
    use tempfile::TempDir;

    /// A wavy square of `squares` x `squares` squares of a side, m, two triangles each, columns of
    /// eight squares one after the other.
    fn write(path: &Path, squares: u32, side_m: f32) {
        let mut ply = PlyWriter::begin(path).unwrap();
        let corner = |x: u32, y: u32| {
            let [right, down] = [x, y].map(|at| side_m * at as f32);
            Vertex {
                position_m: [right, down, 3.0 + 0.4 * side_m * (0.3 * x as f32).sin()],
                ..Vertex::default()
            }
        };
        // Column by column, as blocks come from a mesh, so that each part of the file is local.
        for first in (0..squares).step_by(8) {
            for (x, y) in
                (0..squares).flat_map(|y| (first..(first + 8).min(squares)).map(move |x| (x, y)))
            {
                ply.triangle([corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
                ply.triangle([corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
            }
        }
        ply.finish().unwrap();
    }

    #[test]
    fn a_mesh_keeps_most_of_the_triangles_that_may_stay_and_no_crack_opens() {
        let folder = TempDir::new().unwrap();
        drop(crate::owned::OwnedFolder::create(folder.path()).unwrap());
        let path = folder.path().join("map.ply");
        for (side_m, most) in [(0.01, 20_000), (0.05, 20_000), (0.4, 20_000), (0.05, 700)] {
            let squares = 300;
            write(&path, squares, side_m);
            let (mesh, on_disk) = simplified(&path, true, most).unwrap();
            assert_eq!(on_disk, u64::from(2 * squares * squares));
            assert!(
                (most / 2..=most).contains(&mesh.triangles.len()),
                "{} of {most} with sides of {side_m} m",
                mesh.triangles.len()
            );
            let mut sides: HashMap<[u32; 2], i32> = HashMap::new();
            for [a, b, c] in mesh.triangles.iter().copied() {
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *sides.entry([from.min(to), from.max(to)]).or_default() += 1;
                }
            }
            let extent_m = side_m * squares as f32;
            // Cells at the rim are cut off by it.
            let margin_m = 2.5 * extent_m / (most as f32 / 2.0).sqrt();
            let is_inside = |at: u32| {
                mesh.positions_m[at as usize][..2]
                    .iter()
                    .all(|c| (margin_m..extent_m - margin_m).contains(c))
            };
            assert!(
                sides
                    .iter()
                    .all(|(ends, &triangles)| triangles > 1
                        || !ends.iter().all(|&end| is_inside(end))),
                "a crack"
            );
        }
    }

    #[test]
    fn a_small_mesh_stays_as_it_is_and_none_has_no_triangle() {
        let folder = TempDir::new().unwrap();
        drop(crate::owned::OwnedFolder::create(folder.path()).unwrap());
        let path = folder.path().join("map.ply");
        write(&path, 10, 0.05);
        let (mesh, on_disk) = simplified(&path, true, 1_000).unwrap();
        assert_eq!((mesh.positions_m.len(), mesh.triangles.len(), on_disk), (121, 200, 200));
        assert!(simplified(&path, true, 0).unwrap().0.triangles.len() <= LEAST_TRIANGLES);
        write(&path, 0, 0.05);
        assert_eq!(simplified(&path, true, 1_000).unwrap(), (IndexedMesh::default(), 0));
    }
}
