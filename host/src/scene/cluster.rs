//! Mesh simplification by vertex clustering (Rossignac, Borrel, 1993): vertices in one cell of a lattice become their mean.
//!
//! Triangles stream in; whenever there are more than may be, the cells grow and what is kept is clustered again. So the memory is bounded by
//! the result, not by the input, and the order of the input alone decides the result. A vertex counts once for all triangles that share it
//! within [`RECENT`] numbers of vertices; one that returns later counts again.

use super::IndexedMesh;
use dynvox_core::view::Vertex;
use hashbrown::{HashMap, HashSet};

/// Side of the first cells, m.
const FIRST_CELL_M: f32 = 0.03;
/// By how much cells grow: a surface then keeps two thirds of its triangles.
const GROWTH: f32 = 1.26;
/// Cells for each triangle that may stay: small fragments have cells and no triangle.
const CELLS_PER_TRIANGLE: usize = 2;
/// Vertices whose cell is remembered: what triangles share lies near each other in a file.
const RECENT: usize = 1 << 16;

/// A vertex and its cluster, by number.
#[derive(Clone, Copy)]
struct Recent {
    vertex: u32,
    cluster: u32,
}

impl Recent {
    /// None yet: no mesh has clusters of this number.
    const NONE: Self = Self { vertex: 0, cluster: u32::MAX };
}

/// The vertices of one cell.
#[derive(Clone, Copy, Default)]
struct Cluster {
    position_sum_m: [f64; 3],
    count: f64,
    colour_sum: [f64; 3],
    coloured: f64,
    weight_sum: f64,
}

impl Cluster {
    fn of(Vertex { position_m, colour, weight }: Vertex) -> Self {
        let coloured = if colour == [0; 3] { 0.0 } else { 1.0 };
        Self {
            position_sum_m: position_m.map(f64::from),
            count: 1.0,
            colour_sum: colour.map(f64::from),
            coloured,
            weight_sum: f64::from(weight),
        }
    }

    fn add(&mut self, other: &Self) {
        for axis in 0..3 {
            self.position_sum_m[axis] += other.position_sum_m[axis];
            self.colour_sum[axis] += other.colour_sum[axis];
        }
        self.count += other.count;
        self.coloured += other.coloured;
        self.weight_sum += other.weight_sum;
    }

    fn position_m(&self) -> [f32; 3] {
        self.position_sum_m.map(|sum| (sum / self.count) as f32)
    }

    /// Mean of the observations.
    fn weight(&self) -> u8 {
        (self.weight_sum / self.count).round() as u8
    }

    fn colour(&self) -> [u8; 3] {
        if self.coloured == 0.0 { [0; 3] } else { self.colour_sum.map(|sum| (sum / self.coloured).round() as u8) }
    }
}

/// A mesh that is simplified while it comes in.
pub struct VertexClustering {
    most_triangles: usize,
    cell_m: f32,
    cells: HashMap<[i32; 3], u32>,
    clusters: Vec<Cluster>,
    /// Each in the slot of its number.
    recent: Vec<Recent>,
    triangles: Vec<[u32; 3]>,
    /// Corners of the triangles in ascending order: two sides of a thin sheet would flicker.
    known: HashSet<[u32; 3]>,
}

impl VertexClustering {
    /// Keeps at most so many triangles of about so many that will come: cells begin so large that little has to be clustered again.
    pub fn new(most_triangles: usize, coming: u64) -> Self {
        let side = (coming as f64 / most_triangles.max(1) as f64).sqrt() as f32;
        Self {
            most_triangles,
            // A surface has triangles by the inverse square of their sides.
            cell_m: FIRST_CELL_M * side.max(1.0),
            cells: HashMap::new(),
            clusters: Vec::new(),
            recent: vec![Recent::NONE; RECENT],
            triangles: Vec::new(),
            known: HashSet::new(),
        }
    }

    /// Adds a triangle: its vertices and their numbers in the mesh that comes in.
    pub fn add(&mut self, corners: [(u32, Vertex); 3]) {
        if corners.iter().flat_map(|(_, vertex)| vertex.position_m).any(|metres| !metres.is_finite()) {
            return;
        }
        let triangle = corners.map(|(number, vertex)| self.cluster_of(number, vertex));
        self.connect(triangle);
        while self.triangles.len() > self.most_triangles || self.clusters.len() > CELLS_PER_TRIANGLE * self.most_triangles {
            self.coarsen();
        }
    }

    /// The number of the cell that a vertex is in; it counts there unless it has just done so.
    fn cluster_of(&mut self, vertex: u32, at: Vertex) -> u32 {
        let slot = vertex as usize % RECENT;
        let known = self.recent[slot];
        if known.vertex == vertex && known.cluster != Recent::NONE.cluster {
            return known.cluster;
        }
        let cluster = self.cluster(at.position_m, &Cluster::of(at));
        self.recent[slot] = Recent { vertex, cluster };
        cluster
    }

    /// Adds vertices to their cell and returns its number.
    fn cluster(&mut self, position_m: [f32; 3], vertices: &Cluster) -> u32 {
        let cell = position_m.map(|metres| (metres / self.cell_m).floor() as i32);
        let number = *self.cells.entry(cell).or_insert(self.clusters.len() as u32);
        match self.clusters.get_mut(number as usize) {
            Some(cluster) => cluster.add(vertices),
            None => self.clusters.push(*vertices),
        }
        number
    }

    /// Adds a triangle between cells, unless it is a line, a point or there already.
    fn connect(&mut self, triangle: [u32; 3]) {
        let mut sorted = triangle;
        sorted.sort_unstable();
        if sorted[0] < sorted[1] && sorted[1] < sorted[2] && self.known.insert(sorted) {
            self.triangles.push(triangle);
        }
    }

    /// Clusters what there is in larger cells.
    fn coarsen(&mut self) {
        let (clusters, triangles) = (std::mem::take(&mut self.clusters), std::mem::take(&mut self.triangles));
        self.cells.clear();
        self.known.clear();
        self.recent.fill(Recent::NONE);
        self.cell_m *= GROWTH;
        let numbers: Vec<u32> = clusters.iter().map(|cluster| self.cluster(cluster.position_m(), cluster)).collect();
        triangles.iter().for_each(|triangle| self.connect(triangle.map(|corner| numbers[corner as usize])));
    }

    /// The mesh: vertices in the order in which triangles name them.
    pub fn finish(self) -> IndexedMesh {
        let mut numbers = vec![u32::MAX; self.clusters.len()];
        let mut mesh = IndexedMesh::default();
        for triangle in &self.triangles {
            let corners = triangle.map(|corner| {
                let (number, cluster) = (&mut numbers[corner as usize], &self.clusters[corner as usize]);
                if *number == u32::MAX {
                    *number = mesh.positions_m.len() as u32;
                    mesh.positions_m.push(cluster.position_m());
                    mesh.colours.push(cluster.colour());
                    mesh.weights.push(cluster.weight());
                }
                *number
            });
            mesh.triangles.push(corners);
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `side` x `side` squares of 5 cm, two triangles each, that lies at a depth of 2 m.
    fn plane(side: u32, most_triangles: usize) -> IndexedMesh {
        let mut clustering = VertexClustering::new(most_triangles, u64::from(2 * side * side));
        let corner = |x: u32, y: u32| {
            let position_m = [0.05 * x as f32, 0.05 * y as f32, 2.0];
            (x + y * (side + 1), Vertex { position_m, colour: [200, x as u8, 0], weight: 0 })
        };
        for (x, y) in (0..side * side).map(|at| (at % side, at / side)) {
            clustering.add([corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
            clustering.add([corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
        }
        clustering.finish()
    }

    #[test]
    fn a_small_mesh_stays_as_it_is() {
        let mesh = plane(10, 1_000);
        assert_eq!((mesh.positions_m.len(), mesh.triangles.len()), (121, 200));
        assert_eq!((mesh.positions_m[1], mesh.colours[1]), ([0.05, 0.0, 2.0], [200, 1, 0]));
    }

    #[test]
    fn a_large_mesh_keeps_its_extent_and_surface_within_the_bound() {
        let mesh = plane(100, 2_000);
        assert!((1_000..=2_000).contains(&mesh.triangles.len()), "{}", mesh.triangles.len());
        let [low, high] = mesh.bounds_m().unwrap();
        assert!(low[0] < 0.2 && high[0] > 4.8 && low[2] == 2.0 && high[2] == 2.0, "{low:?} {high:?}");
        let area = |[a, b, c]: [[f32; 3]; 3]| 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        let whole: f32 = mesh.triangles.iter().map(|triangle| area(triangle.map(|corner| mesh.positions_m[corner as usize]))).sum();
        assert!((22.0..=25.1).contains(&whole), "of 25 square metres {whole} are covered once");
        assert!(mesh.normals().iter().all(|normal| normal[2] > 0.999));
    }

    #[test]
    fn the_two_sides_of_a_sheet_become_one_and_nonsense_is_left_out() {
        let mut clustering = VertexClustering::new(10, 3);
        let corner = |number: u32, position_m: [f32; 3]| (number, Vertex { position_m, ..Vertex::default() });
        let corners = [corner(0, [0.0, 0.0, 1.0]), corner(1, [1.0, 0.0, 1.0]), corner(2, [0.0, 1.0, 1.0])];
        clustering.add(corners);
        clustering.add([corners[0], corners[2], corners[1]]);
        clustering.add([corners[0], corners[1], corner(3, [f32::NAN, 0.0, 0.0])]);
        assert_eq!(clustering.finish().triangles, [[0, 1, 2]]);
    }

    #[test]
    fn a_vertex_counts_once_however_many_triangles_share_it() {
        let corner = |number: u32, x: f32, y: f32| (number, Vertex { position_m: [x, y, 1.0], ..Vertex::default() });
        // A fan: its centre, and a vertex of one triangle in the same cell.
        let (centre, beside) = (corner(0, 0.01, 0.0), corner(1, 0.02, 0.0));
        let rim = [(0.5, 0.0), (0.0, 0.5), (-0.5, 0.0), (0.0, -0.5)];
        let rim: Vec<_> = (2..).zip(rim).map(|(number, (x, y))| corner(number, x, y)).collect();
        let mut clustering = VertexClustering::new(10, 5);
        for pair in rim.windows(2) {
            clustering.add([centre, pair[0], pair[1]]);
        }
        clustering.add([beside, rim[3], rim[0]]);
        let x_m = clustering.finish().positions_m[0][0];
        assert!((x_m - 0.015).abs() < 1e-6, "{x_m}: the mean of two vertices, not of four corners");
    }
}
