//! Regions of the map as tiles of triangles.

use crate::scene::IndexedMesh;
use crate::scene::tiles::{TileHead, VALUES, tiles};
use crate::volume_copy::VolumeCopy;
use dynvox_core::geometry::MapSegment;
use dynvox_core::view::{MeshConfig, MeshSink, Triangle, Vertex};
use dynvox_core::volume::{BlockCoord, BlockKey};
use hashbrown::HashMap;
use serde::Serialize;
use std::io;
use std::sync::Arc;

/// Blocks along a region's side.
const SIDE_BLOCKS: i16 = 8;

/// A cube of blocks that is drawn at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MapRegion {
    segment: MapSegment,
    cell: [i16; 3],
}

impl MapRegion {
    /// Region of a block.
    pub fn new(BlockKey { segment, coord: BlockCoord { x, y, z } }: BlockKey) -> Self {
        Self { segment, cell: [x, y, z].map(|at| at.div_euclid(SIDE_BLOCKS)) }
    }

    /// Regions whose triangles need a block: its own, and those before it on each axis where it is
    /// the first. Some come twice.
    pub fn touched_by(key: BlockKey) -> impl Iterator<Item = Self> {
        let own = Self::new(key);
        let BlockCoord { x, y, z } = key.coord;
        let back = [x, y, z].map(|at| i16::from(at.rem_euclid(SIDE_BLOCKS) == 0));
        (0..8_u8).map(move |corner| {
            let cell = [0, 1, 2].map(|axis| {
                own.cell[axis].saturating_sub(back[axis] * i16::from(corner >> axis & 1))
            });
            Self { segment: own.segment, cell }
        })
    }
}

/// Blocks of some regions, and of what these need of others.
pub struct MapUpdate {
    /// The regions.
    pub regions: Vec<MapRegion>,
    /// The blocks.
    pub blocks: VolumeCopy,
    /// Rules of the mesh.
    pub mesh: MeshConfig,
}

/// A region as bytes for the page: the length of a description, the description, and the tiles it
/// describes, deflated.
pub struct DrawnRegion {
    pub region: MapRegion,
    pub triangles: usize,
    pub bytes: Arc<[u8]>,
}

/// A tile, and how many bytes it has.
#[derive(Serialize)]
struct TileOfBytes<'t> {
    head: &'t TileHead,
    bytes: usize,
}

/// Draws the regions of an update.
///
/// # Errors
/// Memory is short.
pub fn draw(update: &MapUpdate) -> io::Result<Vec<DrawnRegion>> {
    let meshes: Vec<IndexedMesh> = update.blocks.with_volume(|volume| {
        let mesh_of = |region: &MapRegion| {
            let mut sink = IndexSink::default();
            volume.mesh(&update.mesh, |key| MapRegion::new(key) == *region, &mut sink);
            sink.mesh
        };
        update.regions.iter().map(mesh_of).collect()
    })?;
    let drawn = update.regions.iter().zip(&meshes);
    drawn.map(|(&region, mesh)| encoded(region, mesh)).collect()
}

fn encoded(region: MapRegion, mesh: &IndexedMesh) -> io::Result<DrawnRegion> {
    let values = vec![[0; VALUES]; mesh.positions_m.len()];
    let tiles = tiles(mesh, &values, None)?;
    let heads: Vec<_> = tiles
        .iter()
        .map(|tile| TileOfBytes { head: &tile.head, bytes: tile.bytes.len() })
        .collect();
    let heads = serde_json::to_vec(&heads)?;
    let mut bytes = (heads.len() as u32).to_le_bytes().to_vec();
    bytes.extend(heads);
    tiles.iter().for_each(|tile| bytes.extend(&tile.bytes));
    Ok(DrawnRegion { region, triangles: mesh.triangles.len(), bytes: bytes.into() })
}

/// Collects triangles with shared vertices.
#[derive(Default)]
struct IndexSink {
    mesh: IndexedMesh,
    /// Vertices that may come again, by the bits of their positions.
    known: HashMap<[u32; 3], u32>,
}

impl MeshSink for IndexSink {
    type Name = u32;

    fn vertex(&mut self, vertex: &Vertex, may_recur: bool) -> u32 {
        let next = self.mesh.positions_m.len() as u32;
        if may_recur {
            let number = *self.known.entry(vertex.position_m.map(f32::to_bits)).or_insert(next);
            if number != next {
                return number;
            }
        }
        self.mesh.positions_m.push(vertex.position_m);
        self.mesh.colours.push(vertex.colour);
        self.mesh.weights.push(vertex.weight);
        next
    }

    fn triangle(&mut self, _: &Triangle, names: [u32; 3]) {
        self.mesh.triangles.push(names);
    }
}
