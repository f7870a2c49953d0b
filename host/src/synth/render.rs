//! Pictures of a scene: visibility first, then every visible surface is shaded once per pixel.
//!
//! The picture is cut into bands of fixed height; each is rasterized and shaded by itself, so that
//! the number of threads cannot matter. A pixel's depth and instance are those of the ray through
//! its centre; its colour is the mean of five samples where they see different surfaces.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::light::{Exposure, Light, develop};
use super::mesh::{Mesh, Point, Vertex};
use super::paint::{Painter, SurfacePoint};
use super::raster::{Band, OFFSETS_PX, Pinhole, SAMPLES, SKY, Setup};
use super::scene::{Scene, SceneObject};
use super::sensor::Sensor;
use super::surface::{Kind, Tone};

const BAND_ROWS: usize = 16;
/// Slight parts are left out where they are thinner than a third of a pixel: depth over focal
/// length, m/px.
const SLIGHT_PER_PX: f64 = 0.25;
/// Group of the sky.
const NO_GROUP: u32 = u32::MAX;

/// Scene, cameras and light from which pictures are rendered.
pub struct Renderer<'a> {
    /// Painter.
    pub painter: &'a Painter,
    /// Sun and sky.
    pub light: &'a Light,
    /// Car bodies.
    pub bodies: &'a [Mesh; 5],
    /// Camera.
    pub pinhole: Pinhole,
}

/// One camera's picture.
pub struct Picture {
    /// Colour, row by row.
    pub rgb: Vec<[u8; 3]>,
    /// Depth of the centre's ray, m; 0 for the sky.
    pub depth_m: Vec<f32>,
    /// Instance at the centre, 0 for none.
    pub instances: Vec<u8>,
}

impl Renderer<'_> {
    /// Draws the scene `offset_m` to the right of the left camera, with so much light let in.
    pub fn picture(&self, scene: &Scene, offset_m: f64, gain: f32, sensor: &Sensor) -> Picture {
        let parts: Vec<Vec<Setup>> = scene
            .objects
            .par_iter()
            .enumerate()
            .map(|(number, object)| self.set_up(object, number as u32, offset_m))
            .collect();
        let setups: Vec<Setup> = parts.into_iter().flatten().collect();
        let (width, height) = (self.pinhole.width, self.pinhole.height);
        let bands = height.div_ceil(BAND_ROWS);
        // Each band lists the triangles that reach it, so that bands are independent.
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); bands];
        for (number, setup) in setups.iter().enumerate() {
            let (first, last) =
                (setup.rows.0 as usize / BAND_ROWS, setup.rows.1 as usize / BAND_ROWS);
            lists[first..=last].iter_mut().for_each(|list| list.push(number as u32));
        }
        let bands: Vec<Picture> = lists
            .par_iter()
            .enumerate()
            .map(|(index, list)| {
                let first_row = index * BAND_ROWS;
                let mut band = Band::new(width, first_row, BAND_ROWS.min(height - first_row));
                for &number in list {
                    band.rasterize(number, &setups[number as usize]);
                }
                Shading { renderer: self, scene, setups: &setups, offset_m, gain, sensor }
                    .band(&band)
            })
            .collect();
        // Bands come back in order.
        let mut picture = Picture { rgb: Vec::new(), depth_m: Vec::new(), instances: Vec::new() };
        for part in bands {
            picture.rgb.extend(part.rgb);
            picture.depth_m.extend(part.depth_m);
            picture.instances.extend(part.instances);
        }
        picture
    }

    fn set_up(&self, object: &SceneObject, number: u32, offset_m: f64) -> Vec<Setup> {
        let mesh = object.mesh(self.bodies);
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
                // Triangles of one surface of one object form a group: samples of one group share
                // their shade.
                let group = number << 12 | u32::from(triangle.surface);
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

struct Shading<'a> {
    renderer: &'a Renderer<'a>,
    scene: &'a Scene,
    setups: &'a [Setup],
    offset_m: f64,
    gain: f32,
    sensor: &'a Sensor,
}

impl Shading<'_> {
    fn object(&self, seen: u32) -> &SceneObject {
        &self.scene.objects[self.setups[seen as usize].object as usize]
    }

    fn group(&self, seen: u32) -> u32 {
        if seen == SKY { NO_GROUP } else { self.setups[seen as usize].group }
    }

    fn band(&self, band: &Band) -> Picture {
        let width = self.renderer.pinhole.width;
        let count = band.rows * width;
        let mut picture = Picture {
            rgb: Vec::with_capacity(count),
            depth_m: Vec::with_capacity(count),
            instances: Vec::with_capacity(count),
        };
        for row in 0..band.rows {
            let seen: [&[u32]; SAMPLES] = core::array::from_fn(|sample| band.row(sample, row));
            let v = (band.first_row + row) as f64;
            for (column, &centre) in seen[0].iter().enumerate() {
                let samples = core::array::from_fn(|sample| seen[sample][column]);
                let (light, depth_m) = self.pixel(column as f64, v, samples);
                // The exposure: light to grey levels.
                let levels = light.map(|value| develop(value * self.gain));
                picture.rgb.push(self.sensor.read((band.first_row + row) * width + column, levels));
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

    /// Colour and centre depth of one pixel.
    fn pixel(&self, u: f64, v: f64, samples: [u32; SAMPLES]) -> (Tone, f32) {
        let (centre, depth_m) = self.sample(u, v, samples[0]);
        // All samples see one triangle: its tone varies little within a pixel.
        if samples.iter().all(|&seen| seen == samples[0]) {
            return (centre, depth_m);
        }
        let groups = samples.map(|seen| self.group(seen));
        let mut tones = [centre; SAMPLES];
        let mut sum = centre;
        for k in 1..SAMPLES {
            // Samples of one group share a tone: only edges between groups are worth another look.
            tones[k] = match groups[..k].iter().position(|&group| group == groups[k]) {
                Some(known) => tones[known],
                None => self.sample(u + OFFSETS_PX[k].0, v + OFFSETS_PX[k].1, samples[k]).0,
            };
            sum = [0, 1, 2].map(|channel| sum[channel] + tones[k][channel]);
        }
        (sum.map(|value| value * (1.0 / SAMPLES as f32)), depth_m)
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
        let mesh = object.mesh(self.renderer.bodies);
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
            self.scene.shadow.light(position, normal)
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
        let ground = if height < 0.5 { self.scene.ground.open(position) } else { 1.0 };
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
        surface_point.footprint_m[k] = (du * du + dv * dv).sqrt();
        let [p, q, r] = [corners[0].normal[k], corners[1].normal[k], corners[2].normal[k]];
        surface_point.own_normal[k] = p + b * (q - p) + c * (r - p);
    }
    (surface_point, depth)
}
