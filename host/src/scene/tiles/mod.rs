//! A mesh in tiles: compact pieces with indices of 16 bits, deflated.
//!
//! A tile's bytes are planes, one after the other, each a byte of every vertex or corner: positions
//! (x, y, z as 16 bits of the tile's box, low bytes before high ones), normals (two bytes,
//! octahedral), colours (red, green, blue), values, corners (16 bits, low bytes before high ones).
//! Positions, colours and values are differences from the vertex before. A corner is the number of
//! vertices named so far less its own number, so that a vertex named for the first time is 0. Such
//! planes deflate to about a third.

pub mod planes;

use super::IndexedMesh;
use flate2::{Compression, write::ZlibEncoder};
use planes::{longest_side, morton, push_byte_differences, push_word_differences, push_words};
use serde::Serialize;
use std::io::{self, Write};

/// Values of a vertex, by which the surface can be coloured besides its photo.
pub const VALUES: usize = 3;
/// A byte of each value: 0 where it is not known, otherwise 1 for the least to 255 for the
/// greatest.
pub type ValueBytes = [u8; VALUES];

/// Triangles of a tile: it cannot have more vertices than 16 bits count.
const TRIANGLES: usize = 16_384;
/// Steps along the longest side of the largest tile. All tiles of a mesh share one step, so that no
/// crack opens between them.
const STEPS: f32 = 65_534.0;

/// Description of a tile for the page's script.
#[derive(Debug, Serialize)]
pub struct TileHead {
    /// Position of its object among the objects; absent for the static map.
    pub object: Option<usize>,
    /// Least corner of its box, m.
    pub low_m: [f32; 3],
    /// Greatest corner of its box, m.
    pub high_m: [f32; 3],
    /// Length that 65,535 steps of a position stand for, m.
    pub size_m: f32,
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
}

/// A tile.
pub struct Tile {
    /// Description of the tile.
    pub head: TileHead,
    /// Contents, deflated.
    pub bytes: Vec<u8>,
}

/// A mesh with what is known of its vertices.
struct Surface<'m> {
    mesh: &'m IndexedMesh,
    normals: Vec<[f32; 3]>,
    values: &'m [ValueBytes],
}

/// Divides a mesh; `values` are those of its vertices, `object` is the position of its object.
///
/// # Errors
/// The encoder fails, which it does not in memory.
pub fn tiles(
    mesh: &IndexedMesh,
    values: &[ValueBytes],
    object: Option<usize>,
) -> io::Result<Vec<Tile>> {
    let Some(bounds_m) = mesh.bounds_m() else { return Ok(Vec::new()) };
    let surface = Surface { mesh, normals: mesh.normals(), values };
    // Triangles in Morton order: a tile is a compact piece of the map.
    let mut order: Vec<(u32, usize)> = mesh
        .triangles
        .iter()
        .enumerate()
        .map(|(at, [first, ..])| (morton(mesh.positions_m[*first as usize], bounds_m), at))
        .collect();
    order.sort_unstable();
    let chunks: Vec<Vec<[u32; 3]>> = order
        .chunks(TRIANGLES)
        .map(|chunk| chunk.iter().map(|(_, at)| mesh.triangles[*at]).collect())
        .collect();
    // One step for all tiles: vertices on a common border fall on the same point.
    let longest_m = chunks
        .iter()
        .map(|chunk| longest_side(box_of(mesh, chunk.iter().flatten())))
        .fold(1e-3, f32::max);
    chunks.iter().map(|chunk| tile(&surface, chunk, object, longest_m / STEPS)).collect()
}

/// The box around some vertices, m.
fn box_of<'c>(mesh: &IndexedMesh, corners: impl Iterator<Item = &'c u32>) -> [[f32; 3]; 2] {
    let positions_m = corners.map(|&corner| mesh.positions_m[corner as usize]).collect();
    IndexedMesh { positions_m, ..IndexedMesh::default() }.bounds_m().unwrap_or_default()
}

/// Encodes some triangles, positions to multiples of `step_m`.
fn tile(
    surface: &Surface<'_>,
    triangles: &[[u32; 3]],
    object: Option<usize>,
    step_m: f32,
) -> io::Result<Tile> {
    let Surface { mesh, normals, values } = surface;
    let (mut numbers, mut vertices, mut corners) =
        (hashbrown::HashMap::new(), Vec::<usize>::new(), Vec::new());
    // Vertices are numbered as triangles first use them; corners then count back from the newest.
    for &corner in triangles.iter().flatten() {
        let next = vertices.len() as u16;
        let number = *numbers.entry(corner).or_insert(next);
        if number == next {
            vertices.push(corner as usize);
        }
        corners.push(next - number);
    }
    let [low_m, high_m] = box_of(mesh, triangles.iter().flatten());
    // Multiples of the step, from the origin and not from the tile's corner, for the same reason.
    let lowest = low_m.map(|metres| (f64::from(metres) / f64::from(step_m)).floor());
    let steps = |at: usize, axis: usize| {
        (f64::from(mesh.positions_m[at][axis]) / f64::from(step_m)).round() - lowest[axis]
    };
    let quantised = |axis: usize| vertices.iter().map(move |&at| steps(at, axis) as u16);
    // Planes of one kind of number each, which deflate better than interleaved ones.
    let mut planes = Vec::with_capacity((11 + VALUES) * vertices.len() + 2 * corners.len());
    (0..3).for_each(|axis| push_word_differences(&mut planes, quantised(axis)));
    let octahedral: Vec<[i8; 2]> = vertices.iter().map(|&at| octahedral(normals[at])).collect();
    (0..2).for_each(|axis| planes.extend(octahedral.iter().map(|normal| normal[axis] as u8)));
    (0..3).for_each(|channel| {
        push_byte_differences(&mut planes, vertices.iter().map(|&at| mesh.colours[at][channel]))
    });
    (0..VALUES).for_each(|value| {
        push_byte_differences(&mut planes, vertices.iter().map(|&at| values[at][value]))
    });
    push_words(&mut planes, &corners);
    let mut deflated = ZlibEncoder::new(Vec::new(), Compression::default());
    deflated.write_all(&planes)?;
    let low_m = lowest.map(|steps| (steps * f64::from(step_m)) as f32);
    let head = TileHead {
        object,
        low_m,
        high_m,
        size_m: 65_535.0 * step_m,
        vertices: vertices.len(),
        triangles: triangles.len(),
    };
    Ok(Tile { head, bytes: deflated.finish()? })
}

/// A direction as a point of the octahedron, unfolded to a square (Cigolle et al., 2014).
fn octahedral(normal: [f32; 3]) -> [i8; 2] {
    let sum = normal.iter().map(|value| value.abs()).sum::<f32>().max(1e-6);
    let [x, y, z] = normal.map(|value| value / sum);
    let signed = |magnitude: f32, of: f32| if of < 0.0 { -magnitude } else { magnitude };
    let [x, y] =
        if z < 0.0 { [signed(1.0 - y.abs(), x), signed(1.0 - x.abs(), y)] } else { [x, y] };
    [x, y].map(|value| (127.0 * value).round() as i8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Positions, colours with the first value, and triangles of a tile.
    type Decoded = (Vec<[f32; 3]>, Vec<[u8; 4]>, Vec<[usize; 3]>);

    /// Decodes a tile as the page's script does.
    fn decoded(tile: &Tile) -> Decoded {
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(&tile.bytes[..]).read_to_end(&mut bytes).unwrap();
        let (count, corners) = (tile.head.vertices, 3 * tile.head.triangles);
        // Two bytes for each coordinate, the colour, the values, and two bytes a corner.
        assert_eq!(bytes.len(), (11 + VALUES) * count + 2 * corners);
        let (mut positions, mut colours) = (vec![[0.0; 3]; count], vec![[0u8; 4]; count]);
        for axis in 0..3 {
            // Differences to the vertex before, the sign in the lowest bit.
            let mut at = 0u16;
            for (vertex, position) in positions.iter_mut().enumerate() {
                let word = u16::from(bytes[2 * axis * count + vertex])
                    | u16::from(bytes[(2 * axis + 1) * count + vertex]) << 8;
                at = at.wrapping_add(word >> 1 ^ (word & 1).wrapping_neg());
                position[axis] =
                    tile.head.low_m[axis] + f32::from(at) / 65_535.0 * tile.head.size_m;
            }
        }
        for channel in 0..4 {
            let mut colour = 0u8;
            for (vertex, tint) in colours.iter_mut().enumerate() {
                colour = colour.wrapping_add(bytes[(8 + channel) * count + vertex]);
                tint[channel] = colour;
            }
        }
        // A corner counts back from the newest vertex: 0 is a vertex not named before.
        let (mut named, mut triangles) = (0, vec![[0; 3]; tile.head.triangles]);
        for at in 0..corners {
            let word = usize::from(bytes[(11 + VALUES) * count + at])
                | usize::from(bytes[(11 + VALUES) * count + corners + at]) << 8;
            triangles[at / 3][at % 3] = named - word;
            named += usize::from(word == 0);
        }
        (positions, colours, triangles)
    }

    #[test]
    fn every_triangle_is_in_one_tile_to_a_millimetre() {
        // More than one tile holds.
        let side = 150u32;
        let at = |x: u32, y: u32| y * (side + 1) + x;
        let (mut mesh, mut values) = (IndexedMesh::default(), Vec::new());
        for (x, y) in (0..(side + 1) * (side + 1)).map(|at| (at % (side + 1), at / (side + 1))) {
            mesh.positions_m.push([0.1 * x as f32, 0.2 * y as f32 - 7.0, (x * y % 7) as f32]);
            mesh.colours.push([x as u8, y as u8, (x ^ y) as u8]);
            values.push([(x * y) as u8; VALUES]);
        }
        for (x, y) in (0..side * side).map(|at| (at % side, at / side)) {
            mesh.triangles.extend([
                [at(x, y), at(x + 1, y), at(x, y + 1)],
                [at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)],
            ]);
        }
        let tiles = tiles(&mesh, &values, Some(3)).unwrap();
        assert!(tiles.len() == 3 && tiles.iter().all(|tile| tile.head.object == Some(3)));
        // By millimetres, since positions are quantised; sorted, since tiles have their own order.
        let key = |corners: [([f32; 3], [u8; 4]); 3]| {
            corners.map(|(at, colour)| (at.map(|metres| (1_000.0 * metres).round() as i32), colour))
        };
        let vertex = |at: u32| {
            let [red, green, blue] = mesh.colours[at as usize];
            (mesh.positions_m[at as usize], [red, green, blue, values[at as usize][0]])
        };
        let mut given: Vec<_> =
            mesh.triangles.iter().map(|triangle| key(triangle.map(vertex))).collect();
        let mut found = Vec::new();
        for tile in &tiles {
            let (positions, colours, triangles) = decoded(tile);
            found.extend(
                triangles
                    .iter()
                    .map(|triangle| key(triangle.map(|at| (positions[at], colours[at])))),
            );
        }
        given.sort();
        found.sort();
        assert!(given == found);
        assert!(super::tiles(&IndexedMesh::default(), &[], None).unwrap().is_empty());
    }

    #[test]
    fn normals_come_back_within_a_degree() {
        for normal in [[0.0, 0.0, 1.0], [0.6, -0.8, 0.0], [-0.36, 0.48, -0.8], [0.0, -1.0, 0.0]] {
            let [x, y] = octahedral(normal).map(|value| f32::from(value) / 127.0);
            let z = 1.0 - x.abs() - y.abs();
            let fold = (-z).max(0.0);
            let back = [x - fold.copysign(x), y - fold.copysign(y), z];
            let length = back.iter().map(|value| value * value).sum::<f32>().sqrt();
            let cosine: f32 = back.iter().zip(normal).map(|(a, b)| a * b / length).sum();
            assert!(cosine > 0.9998, "{normal:?}: {back:?}");
        }
    }
}
