//! Triangle meshes and the few shapes the street is built from.

use dynvox_core::geometry::Transform;
use nalgebra::{Matrix3, Vector3};

use super::surface::Surface;

/// A point in space, m.
pub type Point = Vector3<f64>;

/// A corner: position, texture coordinates in metres, normal.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Place in the mesh's frame, m.
    pub position_m: Point,
    /// Surface coordinates, m: along, across or down, and a third the surface may use.
    pub surface_m: [f32; 3],
    /// Outward normal.
    pub normal: [f32; 3],
}

/// Three corners and what covers them.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Positions in `Mesh::vertices`, clockwise seen from outside in x right, y down.
    pub corners: [u32; 3],
    /// Position in `Mesh::surfaces`.
    pub surface: u16,
    /// Part of something about a tenth of a metre thick that covers no hole: not drawn where that
    /// is far below a pixel.
    pub slight: bool,
}

/// A rigid mesh.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Faces.
    pub triangles: Vec<Triangle>,
    /// Each face's plane: normal and offset, a face is seen from where normal * eye >= offset;
    /// infinite where seen from both sides.
    pub planes: Vec<[f64; 4]>,
    /// Materials.
    pub surfaces: Vec<Surface>,
    /// Middle of the bounding sphere.
    pub middle_m: Point,
    /// Radius of the bounding sphere.
    pub radius_m: f64,
    /// True if triangles added from here on are slight.
    pub slight: bool,
}

/// A parallelogram in space, m.
#[derive(Clone, Copy)]
pub struct Parallelogram {
    origin: Point,
    u: Point,
    v: Point,
}

impl Parallelogram {
    /// Spans a parallelogram from `origin` along `u` and `v`.
    pub fn new(origin: Point, u: Point, v: Point) -> Self {
        Self { origin, u, v }
    }
}

/// End of a round bar: the middle of its circle and the radius, m.
#[derive(Clone, Copy)]
pub struct BarEnd {
    middle: Point,
    radius_m: f64,
}

impl BarEnd {
    /// Ends a bar at a point, with a radius there.
    pub fn new(middle: Point, radius_m: f64) -> Self {
        Self { middle, radius_m }
    }
}

impl Mesh {
    /// Adds a material and returns its number.
    pub fn surface(&mut self, surface: Surface) -> u16 {
        self.surfaces.push(surface);
        (self.surfaces.len() - 1) as u16
    }

    /// Adds a convex polygon that faces `outward`; texture coordinates come with the corners.
    pub fn polygon(&mut self, surface: u16, outward: Point, corners: &[(Point, [f32; 3])]) {
        // Newell's normal of the fan: well defined for any convex polygon, thin ones, too.
        let fan = corners.windows(2).skip(1);
        let raw = fan.fold(Point::zeros(), |sum, pair| {
            sum + (pair[0].0 - corners[0].0).cross(&(pair[1].0 - corners[0].0))
        });
        // The caller says where outside is; the order of corners follows.
        let flipped = raw.dot(&outward) < 0.0;
        let scale = if flipped { -1.0 } else { 1.0 } / (raw.norm() + 1e-12);
        let normal = [0, 1, 2].map(|k| (raw[k] * scale) as f32);
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners.iter().map(|&(position_m, surface_m)| Vertex {
            position_m,
            surface_m,
            normal,
        }));
        // A fan about the first corner.
        for k in 1..corners.len() as u32 - 1 {
            let (a, b) = if flipped { (k + 1, k) } else { (k, k + 1) };
            self.triangles.push(Triangle {
                corners: [first, first + a, first + b],
                surface,
                slight: self.slight,
            });
        }
    }

    /// Adds a parallelogram that faces `outward`; texture coordinates are metres from `texture`.
    pub fn sheet(&mut self, surface: u16, outward: Point, area: Parallelogram, texture: [f64; 3]) {
        let Parallelogram { origin, u, v } = area;
        let (lu, lv) = (u.norm(), v.norm());
        let at = |a: f64, b: f64| {
            [(texture[0] + a * lu) as f32, (texture[1] + b * lv) as f32, texture[2] as f32]
        };
        let corner = |a: f64, b: f64| (origin + u * a + v * b, at(a, b));
        self.polygon(
            surface,
            outward,
            &[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)],
        );
    }

    /// Adds an upright box between two corners. `faces` lists what to leave out: -x, +x, -y (top),
    /// +y (bottom), -z, +z.
    pub fn cuboid(&mut self, surface: u16, low: Point, high: Point, omit: &[usize]) {
        let size = high - low;
        for face in 0..6 {
            if omit.contains(&face) {
                continue;
            }
            // Two opposite faces for each axis.
            let axis = face / 2;
            let (u, v) = [(2, 1), (0, 2), (0, 1)][axis];
            let mut outward = Point::zeros();
            outward[axis] = if face % 2 == 0 { -1.0 } else { 1.0 };
            let mut origin = low;
            if face % 2 == 1 {
                origin[axis] = high[axis];
            }
            let (mut along, mut across) = (Point::zeros(), Point::zeros());
            along[u] = size[u];
            across[v] = size[v];
            self.sheet(
                surface,
                outward,
                Parallelogram::new(origin, along, across),
                [origin[u], origin[v], 0.0],
            );
        }
    }

    /// Adds a round bar from `from` to `to` with smooth normals, open at its ends.
    pub fn bar(&mut self, surface: u16, from: BarEnd, to: BarEnd, sides: u32) {
        let axis = to.middle - from.middle;
        let length = axis.norm();
        // Any direction that is not along the bar gives the axes across it.
        let helper = if axis.y.abs() > 0.9 * length { Point::x() } else { Point::y() };
        let u = axis.cross(&helper).normalize();
        let v = axis.cross(&u).normalize();
        let first = self.vertices.len() as u32;
        // The seam's vertices come twice, because texture begins there anew.
        for k in 0..=sides {
            let angle = 2.0 * core::f64::consts::PI * f64::from(k % sides) / f64::from(sides);
            let out = u * libm::cos(angle) + v * libm::sin(angle);
            let round =
                2.0 * core::f64::consts::PI * from.radius_m * f64::from(k) / f64::from(sides);
            for (end, down) in [(from, 0.0), (to, length)] {
                self.vertices.push(Vertex {
                    position_m: end.middle + out * end.radius_m,
                    surface_m: [round as f32, down as f32, 0.0],
                    normal: [out.x as f32, out.y as f32, out.z as f32],
                });
            }
        }
        for k in 0..sides {
            let (a, b) = (first + 2 * k, first + 2 * k + 2);
            for corners in [[a, b, a + 1], [b, b + 1, a + 1]] {
                self.facing(corners, surface);
            }
        }
    }

    /// Adds a triangle, wound so that it faces the way its first corner's normal does.
    pub fn facing(&mut self, corners: [u32; 3], surface: u16) {
        let [a, b, c] = corners.map(|k| self.vertices[k as usize]);
        let raw = (b.position_m - a.position_m).cross(&(c.position_m - a.position_m));
        let normal = [0, 1, 2]
            .map(|k| f64::from(a.normal[k]) + f64::from(b.normal[k]) + f64::from(c.normal[k]));
        let corners = if raw.dot(&Point::from(normal)) < 0.0 {
            [corners[0], corners[2], corners[1]]
        } else {
            corners
        };
        self.triangles.push(Triangle { corners, surface, slight: self.slight });
    }

    /// Moves everything from vertex `first` on into another frame.
    pub fn move_by(&mut self, first: usize, t_mesh_part: &Transform) {
        let rotation = Matrix3::from(t_mesh_part.rotation_matrix()).transpose();
        for vertex in &mut self.vertices[first..] {
            vertex.position_m =
                rotation * vertex.position_m + Vector3::from(t_mesh_part.translation_m);
            let normal = rotation * Point::from(vertex.normal.map(f64::from));
            vertex.normal = [normal.x as f32, normal.y as f32, normal.z as f32];
        }
    }

    /// Finds the bounding sphere and the faces' planes; call it when the mesh is complete.
    pub fn finish(mut self) -> Self {
        // Planes decide whether a face is seen from behind before its corners are projected.
        let plane = |triangle: &Triangle| {
            if self.surfaces[triangle.surface as usize].two_sided {
                return [f64::INFINITY; 4];
            }
            let [a, b, c] =
                triangle.corners.map(|corner| self.vertices[corner as usize].position_m);
            let normal = (b - a).cross(&(c - a));
            [normal.x, normal.y, normal.z, normal.dot(&a)]
        };
        self.planes = self.triangles.iter().map(plane).collect();
        let (low, high) = self.bounds_m();
        self.middle_m = (low + high) * 0.5;
        self.radius_m = self
            .vertices
            .iter()
            .map(|vertex| (vertex.position_m - self.middle_m).norm())
            .fold(0.0, f64::max);
        self
    }

    /// Smallest upright box around the mesh.
    pub fn bounds_m(&self) -> (Point, Point) {
        self.vertices
            .iter()
            .fold((Point::repeat(1e9), Point::repeat(-1e9)), |(low, high), vertex| {
                (low.inf(&vertex.position_m), high.sup(&vertex.position_m))
            })
    }
}
