//! Pictures of a scene: visibility first, then every visible surface is shaded once per pixel.
//!
//! The picture is cut into bands of fixed height; each is rasterized and shaded by itself, so that
//! the number of threads cannot matter. A pixel's depth and instance are those of the ray through
//! its centre; its colour is what a lens and the pixel's area see ([`super::filter`]).

use nalgebra::Vector3;
use rayon::prelude::*;

use super::filter::{Covers, Groups, Kernel, MARGIN_PX, SPREAD};
use super::light::{Exposure, Light, develop};
use super::mesh::{Mesh, Point, Triangle, Vertex};
use super::paint::Painter;
use super::pattern::SurfacePoint;
use super::raster::{Band, Pinhole, SKY, Setup};
use super::scene::{Scene, SceneObject};
use super::sensor::Sensor;
use super::surface::{Kind, Tone};

const BAND_ROWS: usize = 32;
/// Slight parts are left out where they are thinner than a third of a pixel: depth over focal
/// length, m/px.
const SLIGHT_PER_PX: f64 = 0.25;
/// A surface seen at less than this share of the inverse depth it was met at is near its horizon.
const NEAR_HORIZON: f64 = 0.5;

/// Scene, cameras and light from which pictures are rendered.
pub struct Renderer<'a> {
    /// Painter.
    pub painter: &'a Painter,
    /// Sun and sky.
    pub light: &'a Light,
    /// Camera.
    pub pinhole: Pinhole,
}

/// One camera's picture.
pub struct Picture {
    /// Light let in, row by row.
    pub light: Vec<Tone>,
    /// Depth of the centre's ray, m; 0 for the sky.
    pub depth_m: Vec<f32>,
    /// Instance at the centre, 0 for none.
    pub instances: Vec<u8>,
}

impl Picture {
    /// Adds the light of another picture of the same size.
    pub fn add(&mut self, other: &Self) {
        for (sum, part) in self.light.iter_mut().zip(&other.light) {
            *sum = [0, 1, 2].map(|channel| sum[channel] + part[channel]);
        }
    }

    /// Lets a share of the light in.
    pub fn scale(&mut self, share: f32) {
        if share != 1.0 {
            self.light.iter_mut().for_each(|light| *light = light.map(|value| value * share));
        }
    }

    /// The picture as a sensor reads it: light to grey levels.
    pub fn develop(&self, sensor: &Sensor) -> Vec<[u8; 3]> {
        let read = |(pixel, light): (usize, &Tone)| sensor.read(pixel, light.map(develop));
        self.light.par_iter().enumerate().map(read).collect()
    }
}

impl Renderer<'_> {
    /// Draws the scene `offset_m` to the right of the left camera, with so much light let in.
    pub fn picture(&self, scene: &Scene, offset_m: f64, gain: f32) -> Picture {
        let (width, height) = (self.pinhole.width, self.pinhole.height);
        // The kernel reaches beyond the border: all below draws a picture with a margin.
        let margin = MARGIN_PX as f64;
        let (u, v) = self.pinhole.center_px;
        let pinhole = Pinhole {
            width: width + 2 * MARGIN_PX,
            height: height + 2 * MARGIN_PX,
            focal_px: self.pinhole.focal_px,
            center_px: (u + margin, v + margin),
        };
        let wider = Renderer { pinhole, ..*self };
        let parts: Vec<Vec<Setup>> = scene
            .objects
            .par_iter()
            .enumerate()
            .map(|(number, object)| wider.set_up(object, number as u32, offset_m))
            .collect();
        let setups: Vec<Setup> = parts.into_iter().flatten().collect();
        let kernel = Kernel::new();
        let shading =
            Shading { renderer: &wider, scene, setups: &setups, kernel: &kernel, offset_m, gain };
        let lists = lists(&setups, height);
        let bands: Vec<Picture> = lists
            .par_iter()
            .enumerate()
            .map(|(index, list)| {
                let first_row = index * BAND_ROWS;
                let rows = BAND_ROWS.min(height - first_row) + 2 * MARGIN_PX;
                let mut band = Band::new(wider.pinhole.width, first_row, rows);
                for &number in list {
                    band.rasterize(number, &setups[number as usize]);
                }
                shading.band(&band)
            })
            .collect();
        // Bands come back in order.
        let mut picture = Picture { light: Vec::new(), depth_m: Vec::new(), instances: Vec::new() };
        for part in bands {
            picture.light.extend(part.light);
            picture.depth_m.extend(part.depth_m);
            picture.instances.extend(part.instances);
        }
        picture
    }

    fn set_up(&self, object: &SceneObject, number: u32, offset_m: f64) -> Vec<Setup> {
        let mesh = &*object.mesh;
        let shift = Point::new(offset_m, 0.0, 0.0);
        let middle = object.to_camera.point(mesh.middle_m) - shift;
        if self.out_of_sight(middle, mesh.radius_m) {
            return Vec::new();
        }
        // Beyond this distance small parts are less than a pixel.
        let far = middle.z - mesh.radius_m > SLIGHT_PER_PX * self.pinhole.focal_px;
        // The eye in the mesh's frame tells faces that look away before anything is computed.
        let eye = object.to_camera.rotation.tr_mul(&(shift - object.to_camera.shift));
        let positions: Vec<Point> = mesh
            .vertices
            .iter()
            .map(|vertex| object.to_camera.point(vertex.position_m) - shift)
            .collect();
        let mut setups = Vec::new();
        for (index, (triangle, plane)) in mesh.triangles.iter().zip(&mesh.planes).enumerate() {
            let two_sided = plane[0].is_infinite();
            if triangle.slight && far {
                continue;
            }
            // The eye is behind the face's plane.
            if !two_sided && plane[0] * eye.x + plane[1] * eye.y + plane[2] * eye.z < plane[3] {
                continue;
            }
            let corners = triangle.corners.map(|corner| positions[corner as usize]);
            if let Some(setup) = Setup::new(&self.pinhole, corners, two_sided) {
                let group = u64::from(number) << 32
                    | u64::from(triangle.surface) << 16
                    | u64::from(facet(mesh, triangle));
                setups.push(Setup { object: number, triangle: index as u32, group, ..setup });
            }
        }
        setups
    }

    fn out_of_sight(&self, middle: Point, radius_m: f64) -> bool {
        // The four sides of the field of view, a pixel wider: their planes go through the camera.
        let (u, v) = self.pinhole.center_px;
        let sides = [
            (u + 1.0, middle.x, 1.0),
            (self.pinhole.width as f64 - u, middle.x, -1.0),
            (v + 1.0, middle.y, 1.0),
            (self.pinhole.height as f64 - v, middle.y, -1.0),
        ];
        let focal = self.pinhole.focal_px;
        middle.z < -radius_m
            || sides.iter().any(|&(reach, offset, sign)| {
                // The distance of the sphere's middle from such a plane, against its radius.
                let length = libm::sqrt(reach * reach + focal * focal);
                (middle.z * reach + sign * offset * focal) / length < -radius_m
            })
    }
}

/// Triangles that reach each band, so that bands are independent; rows are those of the picture
/// with its margin.
fn lists(setups: &[Setup], height: usize) -> Vec<Vec<u32>> {
    let bands = height.div_ceil(BAND_ROWS);
    let mut lists: Vec<Vec<u32>> = vec![Vec::new(); bands];
    for (number, setup) in setups.iter().enumerate() {
        let (first, last) = (setup.rows.0 as usize, setup.rows.1 as usize);
        // A band also holds the margin's rows below it.
        let first = first.saturating_sub(2 * MARGIN_PX) / BAND_ROWS;
        let last = (last / BAND_ROWS).min(bands - 1);
        lists[first..=last].iter_mut().for_each(|list| list.push(number as u32));
    }
    lists
}

/// Tells parts of one surface apart that are shaded unlike: sides of a body by the axis they face,
/// leaves one by one. Samples of one part share their shade.
fn facet(mesh: &Mesh, triangle: &Triangle) -> u16 {
    if mesh.surfaces[triangle.surface as usize].kind == Kind::Leaves {
        return triangle.corners[0] as u16;
    }
    let normal = mesh.vertices[triangle.corners[0] as usize].normal;
    let size = normal.map(f32::abs);
    let axis = if size[0] >= size[1] && size[0] >= size[2] {
        0
    } else if size[1] >= size[2] {
        1
    } else {
        2
    };
    2 * axis as u16 + u16::from(normal[axis] < 0.0)
}

struct Shading<'a> {
    renderer: &'a Renderer<'a>,
    scene: &'a Scene,
    setups: &'a [Setup],
    kernel: &'a Kernel,
    offset_m: f64,
    gain: f32,
}

impl Shading<'_> {
    fn object(&self, seen: u32) -> &SceneObject {
        &self.scene.objects[self.setups[seen as usize].object as usize]
    }

    fn band(&self, band: &Band) -> Picture {
        // Sizes and positions with the margin, and the picture's own.
        let wide = self.renderer.pinhole.width;
        let (rows, width) = (band.rows - 2 * MARGIN_PX, wide - 2 * MARGIN_PX);
        let count = rows * width;
        let mut picture = Picture {
            light: Vec::with_capacity(count),
            depth_m: Vec::with_capacity(count),
            instances: Vec::with_capacity(count),
        };
        let groups = Groups::new(band, self.setups, self.kernel, wide);
        for row in MARGIN_PX..rows + MARGIN_PX {
            let centres = band.row(0, row);
            let v = (band.first_row + row) as f64;
            for (column, &centre) in
                centres.iter().enumerate().take(width + MARGIN_PX).skip(MARGIN_PX)
            {
                let u = column as f64;
                let (light, depth_m) = if groups.is_plain(row, column) {
                    self.sample(u, v, centre)
                } else {
                    (self.edge(u, v, &groups.covers(row, column)), self.depth_m(u, v, centre))
                };
                picture.light.push(light.map(|value| value * self.gain));
                picture.depth_m.push(depth_m);
                picture.instances.push(if centre == SKY {
                    0
                } else {
                    self.object(centre).instance
                });
            }
        }
        picture
    }

    /// Colour of a pixel that sees several surfaces.
    fn edge(&self, u: f64, v: f64, covers: &Covers) -> Tone {
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for cover in covers.seen() {
            let [right, down] = cover.middle_px().map(f64::from);
            let (mut u_part, mut v_part) = (u + right, v + down);
            // A triangle's plane is not followed over its own horizon.
            if cover.seen != SKY {
                let [right, down] = cover.sure_px().map(f64::from);
                let plane = self.setups[cover.seen as usize].inverse_depth();
                let at = |u: f64, v: f64| plane[0] * u + plane[1] * v + plane[2];
                if at(u_part, v_part) < NEAR_HORIZON * at(u + right, v + down) {
                    (u_part, v_part) = (u + right, v + down);
                }
            }
            let tone = self.sample(u_part, v_part, cover.seen).0;
            sum = [0, 1, 2].map(|channel| sum[channel] + cover.weight * tone[channel]);
            weight += cover.weight;
        }
        sum.map(|channel| channel / weight)
    }

    /// Depth along one ray; 0 for the sky.
    fn depth_m(&self, u: f64, v: f64, seen: u32) -> f32 {
        if seen == SKY {
            return 0.0;
        }
        let inverse = self.setups[seen as usize].inverse_depth();
        (1.0 / (inverse[0] * u + inverse[1] * v + inverse[2])) as f32
    }

    /// Light and depth along one ray.
    fn sample(&self, u: f64, v: f64, seen: u32) -> (Tone, f32) {
        let pinhole = &self.renderer.pinhole;
        let ray = Vector3::new(
            (u - pinhole.center_px.0) / pinhole.focal_px,
            (v - pinhole.center_px.1) / pinhole.focal_px,
            1.0,
        );
        let rotation = &self.scene.anchor_camera.rotation;
        let direction = (rotation * ray).map(|value| value as f32);
        let painter = self.renderer.painter;
        // The sky has no depth: 0.
        if seen == SKY {
            return (
                self.renderer.light.sky(
                    direction * (1.0 / direction.dot(&direction).sqrt()),
                    &painter.textures.broad,
                ),
                0.0,
            );
        }
        let setup = &self.setups[seen as usize];
        let object = &self.scene.objects[setup.object as usize];
        let mesh = &*object.mesh;
        let triangle = &mesh.triangles[setup.triangle as usize];
        let surface = &mesh.surfaces[triangle.surface as usize];
        let corners = triangle.corners.map(|corner| &mesh.vertices[corner as usize]);
        let (surface_point, depth) = surface_point(setup, corners, u, v);
        // Shadows are looked up relative to the anchor, where 32 bits are precise enough.
        let position = rotation * (ray * depth + Point::new(self.offset_m, 0.0, 0.0))
            + self.scene.anchor_camera.shift;
        let position = position.map(|value| value as f32);
        let own = Vector3::from(surface_point.own_normal);
        let normal = object.rotation * own;
        let mut normal = normal * (1.0 / normal.dot(&normal).sqrt());
        let to_eye = direction * (-1.0 / direction.dot(&direction).sqrt());
        let thin = surface.two_sided;
        // Thin surfaces have two lit sides; leaves keep their crown's normals.
        if thin && surface.kind != Kind::Leaves && normal.dot(&to_eye) < 0.0 {
            normal = -normal;
        }
        let painted = painter.paint(surface, &surface_point, object.coat);
        let open = self.openness(surface.kind, position);
        // A face turned away from the sun needs no look-up.
        let sunlit = if thin || normal.dot(&self.renderer.light.to_sun) > 0.0 {
            self.scene.sunlight.as_ref().map_or(1.0, |sun| sun.shadow.light(position, normal))
        } else {
            0.0
        };
        let thin = surface.kind == Kind::Leaves;
        let exposure = Exposure { normal, to_eye, sunlit, open, thin };
        let light = self.renderer.light.shade(&painted, &exposure);
        (self.renderer.light.through_air(light, depth as f32), depth as f32)
    }

    /// Share of the sky a point sees: little under cars, less at the foot of what stands.
    fn openness(&self, kind: Kind, position: Vector3<f32>) -> f32 {
        let height = -position.y;
        let ground = match &self.scene.sunlight {
            Some(sun) if height < 0.5 => sun.ground.open(position),
            _ => 1.0,
        };
        match kind {
            Kind::Road | Kind::Pavement | Kind::Kerb | Kind::Yard => ground,
            Kind::Car | Kind::Wheel => (0.35 + 0.8 * height).min(1.0),
            _ => 0.62 + 0.38 * (height * 0.4).clamp(0.0, 1.0),
        }
    }
}

/// The surface's own coordinates where a ray meets a triangle, and the depth there.
fn surface_point(setup: &Setup, corners: [&Vertex; 3], u: f64, v: f64) -> (SurfacePoint, f64) {
    let inverse = setup.inverse_depth();
    let depth = 1.0 / (inverse[0] * u + inverse[1] * v + inverse[2]);
    // Barycentric coordinates of the second and third corner, and how they change per column
    // and row.
    let share = |k: usize| {
        let plane = &setup.weights[k];
        let value = (plane[0] * u + plane[1] * v + plane[2]) * depth;
        (
            value as f32,
            ((plane[0] - value * inverse[0]) * depth) as f32,
            ((plane[1] - value * inverse[1]) * depth) as f32,
        )
    };
    let ((b, b_u, b_v), (c, c_u, c_v)) = (share(1), share(2));
    let mut surface_point =
        SurfacePoint { surface_m: [0.0; 3], footprint_m: [0.0; 3], own_normal: [0.0; 3] };
    for k in 0..3 {
        let [p, q, r] = [corners[0].surface_m[k], corners[1].surface_m[k], corners[2].surface_m[k]];
        surface_point.surface_m[k] = p + b * (q - p) + c * (r - p);
        let (du, dv) = (b_u * (q - p) + c_u * (r - p), b_v * (q - p) + c_v * (r - p));
        surface_point.footprint_m[k] = SPREAD as f32 * (du * du + dv * dv).sqrt();
        let [p, q, r] = [corners[0].normal[k], corners[1].normal[k], corners[2].normal[k]];
        surface_point.own_normal[k] = p + b * (q - p) + c * (r - p);
    }
    (surface_point, depth)
}
