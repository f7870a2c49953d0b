//! Mesh simplification by vertex clustering (Rossignac, Borrel, 1993): vertices in one cell of a lattice become their mean.
//!
//! Triangles stream in; whenever there are more than may be, the cells grow and what is kept is clustered again. So the memory is bounded by
//! the result, not by the input, and the order of the input alone decides the result. A vertex counts once for all triangles that share it
//! within [`RECENT`] numbers of vertices; one that returns later counts again.
//!
//! A surface has triangles by the inverse square of their sides. So the triangles that have come and those that will tell how large cells have
//! to be: they grow early, while there is little to be clustered again.

use super::IndexedMesh;
use dynvox_core::view::Vertex;
use hashbrown::{HashMap, HashSet};
use std::io;

/// Side of the first cells, m.
const FIRST_CELL_M: f32 = 0.03;
/// By how much cells grow at least.
const LEAST_GROWTH: f32 = 1.05;
/// By how much at most.
const MOST_GROWTH: f32 = 2.0;
/// By how much less they grow than is foreseen: triangles that come first need not be like the others, and cells never shrink.
const CAUTION: f32 = 1.1;
/// Triangles after which is first foreseen how many will stay; then whenever there are twice as many.
const FORESEEN_AFTER: u64 = 1 << 14;
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
    count: u32,
    colour_sum: [u32; 3],
    coloured: u32,
    weight_sum: u32,
}

impl Cluster {
    fn of(Vertex { position_m, colour, weight }: Vertex) -> Self {
        Self {
            position_sum_m: position_m.map(f64::from),
            count: 1,
            colour_sum: colour.map(u32::from),
            coloured: u32::from(colour != [0; 3]),
            weight_sum: u32::from(weight),
        }
    }

    fn add(&mut self, other: &Self) {
        for axis in 0..3 {
            self.position_sum_m[axis] += other.position_sum_m[axis];
            self.colour_sum[axis] = self.colour_sum[axis].saturating_add(other.colour_sum[axis]);
        }
        self.count = self.count.saturating_add(other.count);
        self.coloured = self.coloured.saturating_add(other.coloured);
        self.weight_sum = self.weight_sum.saturating_add(other.weight_sum);
    }

    fn position_m(&self) -> [f32; 3] {
        self.position_sum_m.map(|sum| (sum / f64::from(self.count)) as f32)
    }

    /// Mean of the observations.
    fn weight(&self) -> u8 {
        mean(self.weight_sum, self.count)
    }

    fn colour(&self) -> [u8; 3] {
        self.colour_sum.map(|sum| if self.coloured == 0 { 0 } else { mean(sum, self.coloured) })
    }
}

/// The mean of so many bytes with this sum.
fn mean(sum: u32, count: u32) -> u8 {
    (f64::from(sum) / f64::from(count)).round() as u8
}

/// A mesh that is simplified while it comes in.
pub struct VertexClustering {
    most_triangles: usize,
    /// Triangles that have come, and will.
    came: u64,
    coming: u64,
    /// How many have to come until it is foreseen how many will stay.
    foreseen_at: u64,
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
    /// Keeps at most so many triangles of about so many that will come.
    pub fn new(most_triangles: usize, coming: u64) -> Self {
        Self {
            most_triangles,
            came: 0,
            coming,
            foreseen_at: FORESEEN_AFTER,
            cell_m: FIRST_CELL_M,
            cells: HashMap::new(),
            clusters: Vec::new(),
            recent: vec![Recent::NONE; RECENT],
            triangles: Vec::new(),
            known: HashSet::new(),
        }
    }

    /// Adds a triangle by the numbers of its vertices in the mesh that comes in; `vertex` tells those that are not known. Returns whether it counts: a
    /// triangle with a vertex that is `None`, or nowhere, does not.
    ///
    /// # Errors
    /// Those of `vertex`.
    pub fn add(&mut self, corners: [u32; 3], mut vertex: impl FnMut(u32) -> io::Result<Option<Vertex>>) -> io::Result<bool> {
        self.came += 1;
        let mut triangle = [0; 3];
        for (cluster, number) in triangle.iter_mut().zip(corners) {
            let Some(known) = self.cluster_of(number, &mut vertex)? else { return Ok(false) };
            *cluster = known;
        }
        self.connect(triangle);
        self.bound();
        Ok(true)
    }

    /// The number of the cell that a vertex is in; it counts there unless it has just done so.
    fn cluster_of(&mut self, number: u32, vertex: impl FnOnce(u32) -> io::Result<Option<Vertex>>) -> io::Result<Option<u32>> {
        let slot = number as usize % RECENT;
        let known = self.recent[slot];
        if known.vertex == number && known.cluster != Recent::NONE.cluster {
            return Ok(Some(known.cluster));
        }
        let Some(vertex) = vertex(number)?.filter(|vertex| vertex.position_m.iter().all(|metres| metres.is_finite())) else {
            return Ok(None);
        };
        let cluster = self.cluster(vertex.position_m, &Cluster::of(vertex));
        self.recent[slot] = Recent { vertex: number, cluster };
        Ok(Some(cluster))
    }

    /// Lets cells grow where there is too much, or will be.
    fn bound(&mut self) {
        let most = self.most_triangles;
        if self.came >= self.foreseen_at {
            self.foreseen_at = 2 * self.came;
            let will_stay = self.triangles.len() as f64 * (self.coming as f64 / self.came as f64);
            let growth = (will_stay / most.max(1) as f64).sqrt() as f32 / CAUTION;
            if growth > LEAST_GROWTH {
                self.coarsen(growth);
            }
        }
        while self.triangles.len() > most || self.clusters.len() > CELLS_PER_TRIANGLE * most {
            self.coarsen((self.coming as f64 / self.came as f64).sqrt() as f32);
        }
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

    /// Clusters what there is in cells that are larger by this factor, within the bounds of growth.
    fn coarsen(&mut self, growth: f32) {
        let (clusters, triangles) = (std::mem::take(&mut self.clusters), std::mem::take(&mut self.triangles));
        self.cells.clear();
        self.known.clear();
        self.recent.fill(Recent::NONE);
        self.cell_m *= growth.clamp(LEAST_GROWTH, MOST_GROWTH);
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

    /// Adds a triangle of vertices that come with their numbers.
    fn add(clustering: &mut VertexClustering, corners: [(u32, Vertex); 3]) -> bool {
        let vertex = |number| Ok(corners.iter().find(|(own, _)| *own == number).map(|(_, vertex)| *vertex));
        clustering.add(corners.map(|(number, _)| number), vertex).unwrap()
    }

    /// A square of `side` x `side` squares of 5 cm, two triangles each, that lies at a depth of 2 m.
    fn plane(side: u32, most_triangles: usize) -> IndexedMesh {
        let mut clustering = VertexClustering::new(most_triangles, u64::from(2 * side * side));
        let corner = |x: u32, y: u32| {
            let position_m = [0.05 * x as f32, 0.05 * y as f32, 2.0];
            (x + y * (side + 1), Vertex { position_m, colour: [200, x as u8, 0], weight: 0 })
        };
        for (x, y) in (0..side * side).map(|at| (at % side, at / side)) {
            add(&mut clustering, [corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
            add(&mut clustering, [corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
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
    fn cells_grow_as_the_bound_asks_for_triangles_of_any_size() {
        for side in [0.01, 0.05, 0.4] {
            let (squares, most) = (300, 20_000);
            let mut clustering = VertexClustering::new(most, 2 * squares * squares);
            let corner = |x: u64, y: u64| {
                let position_m = [side * x as f32, side * y as f32, 2.0];
                ((x + y * (squares + 1)) as u32, Vertex { position_m, ..Vertex::default() })
            };
            for (x, y) in (0..squares * squares).map(|at| (at % squares, at / squares)) {
                add(&mut clustering, [corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
                add(&mut clustering, [corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
            }
            let kept = clustering.finish().triangles.len();
            assert!((most / 2..=most).contains(&kept), "{kept} of {most} with sides of {side} m");
        }
    }

    #[test]
    fn the_two_sides_of_a_sheet_become_one_and_nonsense_is_left_out() {
        let mut clustering = VertexClustering::new(10, 3);
        let corner = |number: u32, position_m: [f32; 3]| (number, Vertex { position_m, ..Vertex::default() });
        let corners = [corner(0, [0.0, 0.0, 1.0]), corner(1, [1.0, 0.0, 1.0]), corner(2, [0.0, 1.0, 1.0])];
        assert!(add(&mut clustering, corners));
        add(&mut clustering, [corners[0], corners[2], corners[1]]);
        assert!(!add(&mut clustering, [corners[0], corners[1], corner(3, [f32::NAN, 0.0, 0.0])]));
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
            add(&mut clustering, [centre, pair[0], pair[1]]);
        }
        add(&mut clustering, [beside, rim[3], rim[0]]);
        let x_m = clustering.finish().positions_m[0][0];
        assert!((x_m - 0.015).abs() < 1e-6, "{x_m}: the mean of two vertices, not of four corners");
    }
}
