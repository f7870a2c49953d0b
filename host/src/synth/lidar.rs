//! A spinning LiDAR above the camera: 64 beams, 2000 directions, one revolution without the
//! camera's motion in it.
//!
//! Every beam is tested against every triangle that may cross it, so ranges are exact.
//! Axes are the sensor's: x forward, y left, z up. Time: a few tens of milliseconds a scan.

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::mesh::Point;
use super::paint::Painter;
use super::pattern::SurfacePoint;
use super::scene::Scene;
use super::street::Street;

const BEAMS: usize = 64;
const DIRECTIONS: usize = 2000;
/// Work is cut into this many sectors.
const SECTORS: usize = 10;
const TOP_DEG: f64 = 2.0;
const BOTTOM_DEG: f64 = -24.8;
const RANGE_M: (f64, f64) = (1.0, 80.0);
/// Place of the sensor in the left camera, m.
const POSITION_M: [f64; 3] = [0.0, -0.08, -0.27];
const TURN: f64 = 2.0 * core::f64::consts::PI;

/// A triangle as the beams see it.
struct Face {
    /// Barycentric weight of each corner over range, as a plane through the sensor.
    planes: [Point; 3],
    object: u32,
    triangle: u32,
    /// First direction and how many.
    directions: (i64, i64),
    beams: (usize, usize),
}

/// Sensor to left camera.
pub fn t_camera_lidar() -> Transform {
    Transform::from_rotation_matrix(
        &[[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]],
        POSITION_M,
    )
}

impl Street {
    /// Sensor to left camera.
    pub fn t_camera_lidar(&self) -> Transform {
        t_camera_lidar()
    }

    /// One scan at frame `index`: x forward, y left, z up in metres, and reflectance 0 to 1; beam
    /// by beam from the top, each from behind over the right side, the front and the left side.
    pub fn lidar(&self, index: u32) -> Vec<[f32; 4]> {
        Scanner { scene: &self.surroundings(index).scene, painter: self.painter() }.scan()
    }
}

/// A scanner in a scene.
pub struct Scanner<'a> {
    /// Everything around it.
    pub scene: &'a Scene,
    /// Painter, for reflectances.
    pub painter: &'a Painter,
}

impl Scanner<'_> {
    /// One revolution, as [`Street::lidar`] gives it.
    pub fn scan(&self) -> Vec<[f32; 4]> {
        let scene = self.scene;
        // Faces in the sensor's frame, those beyond its range left out.
        let faces: Vec<Face> = (0..scene.objects.len())
            .into_par_iter()
            .flat_map_iter(|number| self.faces(number))
            .collect();
        // Sectors are independent; joined in order, they do not depend on the number of threads.
        let sectors: Vec<Vec<(f64, u32)>> =
            (0..SECTORS).into_par_iter().map(|sector| scan(&faces, sector)).collect();
        let width = DIRECTIONS / SECTORS;
        let mut points = Vec::new();
        for beam in 0..BEAMS {
            for direction in 0..DIRECTIONS {
                let (nearness, face) = sectors[direction / width][beam * width + direction % width];
                // Echoes too near or too far are not reported.
                if nearness > 1.0 / RANGE_M.1 && nearness < 1.0 / RANGE_M.0 {
                    points.push(self.echo(
                        &faces[face as usize],
                        Shot { beam, direction },
                        1.0 / nearness,
                    ));
                }
            }
        }
        points
    }

    fn faces(&self, number: usize) -> Vec<Face> {
        let object = &self.scene.objects[number];
        let mesh = &*object.mesh;
        let to_sensor = |point: Point| {
            let camera = object.to_camera.point(point) - Vector3::from(POSITION_M);
            Point::new(camera.z, -camera.x, -camera.y)
        };
        if to_sensor(mesh.middle_m).norm() > RANGE_M.1 + mesh.radius_m {
            return Vec::new();
        }
        let positions: Vec<Point> =
            mesh.vertices.iter().map(|vertex| to_sensor(vertex.position_m)).collect();
        let face = |(triangle, face): (usize, &super::mesh::Triangle)| {
            let corners = face.corners.map(|corner| positions[corner as usize]);
            let [a, b, c] = corners;
            // The planes through the sensor and two corners: a ray within all three meets the
            // triangle.
            let planes = [b.cross(&c), c.cross(&a), a.cross(&b)];
            let volume = a.dot(&planes[0]);
            let hidden = volume > 0.0 && !mesh.surfaces[face.surface as usize].two_sided;
            // Faces seen from behind, or edge on, return nothing.
            if volume.abs() < 1e-14 || hidden {
                return None;
            }
            let (directions, beams) = reach(corners)?;
            Some(Face {
                planes: planes.map(|plane| plane / volume),
                object: number as u32,
                triangle: triangle as u32,
                directions,
                beams,
            })
        };
        mesh.triangles.iter().enumerate().filter_map(face).collect()
    }

    fn echo(&self, face: &Face, shot: Shot, range_m: f64) -> [f32; 4] {
        let ray = ray(shot.beam, shot.direction);
        let object = &self.scene.objects[face.object as usize];
        let mesh = &*object.mesh;
        let triangle = &mesh.triangles[face.triangle as usize];
        // The shares of the corners at the echo, for texture and normal.
        let shares = face.planes.map(|plane| (plane.dot(&ray) * range_m) as f32);
        let mix = |value: fn(&super::mesh::Vertex) -> [f32; 3]| {
            let [a, b, c] = triangle.corners.map(|corner| value(&mesh.vertices[corner as usize]));
            [0, 1, 2].map(|k| shares[0] * a[k] + shares[1] * b[k] + shares[2] * c[k])
        };
        // The beam widens by 3 mrad.
        let spread = (0.003 * range_m) as f32;
        let surface_point = SurfacePoint {
            surface_m: mix(|vertex| vertex.surface_m),
            footprint_m: [spread; 3],
            own_normal: mix(|vertex| vertex.normal),
        };
        let painted = self.painter.paint(
            &mesh.surfaces[triangle.surface as usize],
            &surface_point,
            object.coat,
        );
        let [red, green, blue] = painted.tone;
        let point = ray * range_m;
        [
            point.x as f32,
            point.y as f32,
            point.z as f32,
            (0.4 * red + 0.4 * green + 0.2 * blue).clamp(0.0, 1.0),
        ]
    }
}

/// One shot of the scanner: beam and direction.
#[derive(Clone, Copy)]
struct Shot {
    beam: usize,
    direction: usize,
}

fn elevation(beam: usize) -> f64 {
    (TOP_DEG + (BOTTOM_DEG - TOP_DEG) * beam as f64 / (BEAMS - 1) as f64) * (TURN / 360.0)
}

/// Azimuth of a direction: direction 0 looks backwards.
fn azimuth(direction: f64) -> f64 {
    TURN * ((direction + 0.5) / DIRECTIONS as f64 - 0.5)
}

fn ray(beam: usize, direction: usize) -> Point {
    let (up, around) = (elevation(beam), azimuth(direction as f64));
    Point::new(libm::cos(up) * libm::cos(around), libm::cos(up) * libm::sin(around), libm::sin(up))
}

/// Directions and beams a triangle may meet, a little more rather than less.
fn reach(corners: [Point; 3]) -> Option<((i64, i64), (usize, usize))> {
    let angles = corners.map(|corner| libm::atan2(corner.y, corner.x));
    // Differences of angles stay within half a turn, so that the seam at the back does not matter.
    let deltas_rad = angles.map(|angle| {
        let delta_rad = angle - angles[0];
        delta_rad - TURN * libm::round(delta_rad / TURN)
    });
    let (low, high) = deltas_rad.iter().fold((0.0_f64, 0.0_f64), |(low, high), &delta_rad| {
        (low.min(delta_rad), high.max(delta_rad))
    });
    // A triangle around the sensor's axis is met in every direction.
    let around = high - low >= 0.5 * TURN;
    let per_rad = DIRECTIONS as f64 / TURN;
    let directions = if around {
        (0, DIRECTIONS as i64)
    } else {
        let first = libm::floor((angles[0] + low + 0.5 * TURN) * per_rad - 0.5) as i64;
        let last = libm::ceil((angles[0] + high + 0.5 * TURN) * per_rad - 0.5) as i64;
        (first, last - first + 1)
    };
    let flat = |p: Point| libm::sqrt(p.x * p.x + p.y * p.y);
    // The nearest edge bounds the steepest beam.
    let near = if around {
        1e-6
    } else {
        (0..3).map(|k| segment_distance(corners[k], corners[(k + 1) % 3])).fold(f64::MAX, f64::min)
    };
    let far = corners.map(flat).into_iter().fold(0.0, f64::max);
    let (bottom, top) = corners
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), corner| (low.min(corner.z), high.max(corner.z)));
    // A corner above the horizon is steepest where it is nearest, one below where it is farthest.
    let angle = |height: f64, outward: bool| {
        libm::atan2(height, if (height > 0.0) == outward { near.max(1e-6) } else { far })
    };
    let step = (TOP_DEG - BOTTOM_DEG) * (TURN / 360.0) / (BEAMS - 1) as f64;
    let beam = |angle: f64| (elevation(0) - angle) / step;
    let (first, last) =
        (libm::floor(beam(angle(top, true))), libm::ceil(beam(angle(bottom, false))));
    if last < 0.0 || first > (BEAMS - 1) as f64 {
        return None;
    }
    Some((directions, (first.max(0.0) as usize, last.min((BEAMS - 1) as f64) as usize)))
}

/// Distance of a segment from the vertical axis.
fn segment_distance(a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = dx * dx + dy * dy;
    let along = if length > 0.0 { (-(a.x * dx + a.y * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    let (x, y) = (a.x + along * dx, a.y + along * dy);
    libm::sqrt(x * x + y * y)
}

/// Nearest face of every beam in one sector: (1 / range, face).
fn scan(faces: &[Face], sector: usize) -> Vec<(f64, u32)> {
    let width = DIRECTIONS / SECTORS;
    let start = (sector * width) as i64;
    let rays: Vec<Point> = (0..BEAMS)
        .flat_map(|beam| (0..width).map(move |k| ray(beam, sector * width + k)))
        .collect();
    let mut nearest = vec![(0.0, u32::MAX); BEAMS * width];
    for (number, face) in faces.iter().enumerate() {
        let (first, count) = face.directions;
        // The face's directions may pass the seam at the back: look one full turn to either side.
        for shift in [-(DIRECTIONS as i64), 0, DIRECTIONS as i64] {
            let from = (first + shift - start).max(0);
            let to = (first + shift + count - start).min(width as i64);
            if from >= to {
                continue;
            }
            for beam in face.beams.0..=face.beams.1 {
                for k in from as usize..to as usize {
                    let slot = beam * width + k;
                    // Inside of all three planes.
                    let shares = [0, 1, 2].map(|corner| face.planes[corner].dot(&rays[slot]));
                    if shares.iter().all(|&share| share >= 0.0) {
                        let nearness = shares[0] + shares[1] + shares[2];
                        if nearness > nearest[slot].0 {
                            nearest[slot] = (nearness, number as u32);
                        }
                    }
                }
            }
        }
    }
    nearest
}
