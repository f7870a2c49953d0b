//! Car bodies: a hull lofted over cross-sections, wheels and mirrors. In a car's frame x runs
//! right, y down from the road, z forward; the origin is the middle of its footprint.

use super::config::CarKind;
use super::mesh::{BarEnd, Mesh, Point, Triangle, Vertex};
use super::surface::{Kind, Surface, tone};

/// Cross-section: position along the car, height of the roof or bonnet, of the belt line, half
/// widths there, height of the sill; m.
type Section = (f64, f64, f64, f64, f64, f64);

/// Measures that a body's painter needs: positions of glass, lamps and wheels, m in the car's
/// frame, heights upwards.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Half length and half width of the hull.
    pub half_m: [f32; 2],
    /// Axle positions: front, rear.
    pub axles_m: [f32; 2],
    /// Wheel radius.
    pub wheel_m: f32,
    /// Side windows: front and rear ends at the belt, front and rear ends at the roof.
    pub side_glass_m: [f32; 4],
    /// Belt and roof heights of the side windows.
    pub side_height_m: [f32; 2],
    /// Pillars between side windows.
    pub pillars_m: [f32; 2],
    /// Windscreen: bottom and top height, half widths there.
    pub windscreen_m: [f32; 4],
    /// Rear window: the same; zero without one.
    pub rear_glass_m: [f32; 4],
    /// Middle height of head lamps and tail lamps.
    pub lamps_m: [f32; 2],
}

const HATCHBACK: &[Section] = &[
    (1.98, 0.58, 0.50, 0.70, 0.62, 0.26),
    (1.93, 0.72, 0.62, 0.78, 0.68, 0.22),
    (1.70, 0.83, 0.70, 0.84, 0.70, 0.20),
    (1.20, 0.93, 0.80, 0.86, 0.72, 0.20),
    (0.88, 1.00, 0.88, 0.87, 0.72, 0.20),
    (0.15, 1.42, 0.93, 0.87, 0.58, 0.20),
    (-0.50, 1.49, 0.95, 0.87, 0.58, 0.20),
    (-1.25, 1.44, 0.98, 0.87, 0.56, 0.20),
    (-1.72, 1.05, 0.98, 0.84, 0.66, 0.22),
    (-1.90, 0.94, 0.86, 0.80, 0.68, 0.24),
    (-1.98, 0.62, 0.54, 0.74, 0.66, 0.28),
];
const SALOON: &[Section] = &[
    (2.28, 0.58, 0.50, 0.72, 0.64, 0.26),
    (2.22, 0.70, 0.60, 0.81, 0.70, 0.22),
    (1.95, 0.79, 0.67, 0.87, 0.72, 0.19),
    (1.40, 0.88, 0.76, 0.90, 0.74, 0.18),
    (0.90, 0.96, 0.86, 0.91, 0.74, 0.18),
    (0.18, 1.36, 0.90, 0.91, 0.59, 0.18),
    (-0.45, 1.43, 0.92, 0.91, 0.59, 0.18),
    (-1.00, 1.38, 0.94, 0.91, 0.57, 0.18),
    (-1.60, 1.06, 0.96, 0.90, 0.70, 0.18),
    (-2.10, 1.00, 0.93, 0.86, 0.70, 0.21),
    (-2.24, 0.90, 0.82, 0.82, 0.68, 0.24),
    (-2.28, 0.60, 0.52, 0.76, 0.66, 0.28),
];
const ESTATE: &[Section] = &[
    (2.32, 0.58, 0.50, 0.72, 0.64, 0.26),
    (2.26, 0.71, 0.61, 0.81, 0.70, 0.22),
    (1.95, 0.81, 0.69, 0.87, 0.72, 0.20),
    (1.40, 0.90, 0.78, 0.90, 0.74, 0.19),
    (0.92, 0.98, 0.88, 0.91, 0.74, 0.19),
    (0.20, 1.40, 0.92, 0.91, 0.60, 0.19),
    (-0.45, 1.47, 0.94, 0.91, 0.60, 0.19),
    (-1.20, 1.46, 0.95, 0.91, 0.59, 0.19),
    (-1.78, 1.40, 0.97, 0.90, 0.57, 0.20),
    (-2.18, 1.02, 0.96, 0.87, 0.68, 0.22),
    (-2.28, 0.90, 0.82, 0.83, 0.68, 0.24),
    (-2.32, 0.60, 0.52, 0.76, 0.66, 0.28),
];
const OFFROAD: &[Section] = &[
    (2.20, 0.70, 0.60, 0.76, 0.68, 0.32),
    (2.14, 0.88, 0.76, 0.86, 0.76, 0.28),
    (1.85, 0.98, 0.86, 0.92, 0.78, 0.26),
    (1.30, 1.06, 0.94, 0.94, 0.79, 0.25),
    (0.95, 1.12, 1.02, 0.94, 0.79, 0.25),
    (0.30, 1.62, 1.06, 0.94, 0.66, 0.25),
    (-0.40, 1.69, 1.07, 0.94, 0.66, 0.25),
    (-1.30, 1.68, 1.09, 0.94, 0.65, 0.25),
    (-1.80, 1.60, 1.10, 0.93, 0.64, 0.26),
    (-2.06, 1.12, 1.06, 0.91, 0.74, 0.28),
    (-2.16, 1.00, 0.92, 0.87, 0.74, 0.30),
    (-2.20, 0.70, 0.62, 0.82, 0.72, 0.34),
];
const VAN: &[Section] = &[
    (2.55, 0.70, 0.60, 0.80, 0.72, 0.28),
    (2.48, 0.98, 0.84, 0.90, 0.80, 0.24),
    (2.15, 1.14, 1.00, 0.96, 0.82, 0.22),
    (1.80, 1.24, 1.10, 0.98, 0.82, 0.22),
    (1.10, 2.02, 1.16, 0.98, 0.80, 0.22),
    (0.60, 2.14, 1.20, 0.98, 0.84, 0.22),
    (-0.80, 2.16, 1.20, 0.98, 0.84, 0.22),
    (-2.30, 2.14, 1.20, 0.98, 0.84, 0.24),
    (-2.50, 2.06, 1.20, 0.96, 0.82, 0.26),
    (-2.55, 0.80, 0.66, 0.92, 0.84, 0.30),
];

fn sections(kind: CarKind) -> &'static [Section] {
    match kind {
        CarKind::Hatchback => HATCHBACK,
        CarKind::Saloon => SALOON,
        CarKind::Estate => ESTATE,
        CarKind::Offroad => OFFROAD,
        CarKind::Van => VAN,
    }
}

const HATCHBACK_SHAPE: Shape = Shape {
    half_m: [1.98, 0.87],
    axles_m: [1.27, -1.22],
    wheel_m: 0.30,
    side_glass_m: [0.80, -1.52, 0.12, -1.22],
    side_height_m: [0.98, 1.36],
    pillars_m: [-0.36, -1.05],
    windscreen_m: [1.04, 1.38, 0.66, 0.52],
    rear_glass_m: [1.08, 1.38, 0.60, 0.48],
    lamps_m: [0.68, 0.90],
};
const SALOON_SHAPE: Shape = Shape {
    half_m: [2.28, 0.91],
    axles_m: [1.38, -1.36],
    wheel_m: 0.32,
    side_glass_m: [0.82, -1.46, 0.14, -0.98],
    side_height_m: [0.95, 1.31],
    pillars_m: [-0.34, -1.22],
    windscreen_m: [1.00, 1.33, 0.68, 0.53],
    rear_glass_m: [1.08, 1.34, 0.62, 0.50],
    lamps_m: [0.66, 0.82],
};
const ESTATE_SHAPE: Shape = Shape {
    half_m: [2.32, 0.91],
    axles_m: [1.40, -1.36],
    wheel_m: 0.32,
    side_glass_m: [0.84, -1.98, 0.16, -1.74],
    side_height_m: [0.97, 1.36],
    pillars_m: [-0.34, -1.16],
    windscreen_m: [1.02, 1.37, 0.68, 0.54],
    rear_glass_m: [1.06, 1.34, 0.58, 0.50],
    lamps_m: [0.67, 0.86],
};
const OFFROAD_SHAPE: Shape = Shape {
    half_m: [2.20, 0.94],
    axles_m: [1.36, -1.32],
    wheel_m: 0.37,
    side_glass_m: [0.88, -1.90, 0.26, -1.72],
    side_height_m: [1.12, 1.56],
    pillars_m: [-0.32, -1.16],
    windscreen_m: [1.16, 1.57, 0.72, 0.60],
    rear_glass_m: [1.18, 1.52, 0.62, 0.56],
    lamps_m: [0.84, 0.98],
};
const VAN_SHAPE: Shape = Shape {
    half_m: [2.55, 0.98],
    axles_m: [1.72, -1.60],
    wheel_m: 0.34,
    side_glass_m: [1.62, 0.52, 1.12, 0.52],
    side_height_m: [1.24, 1.78],
    pillars_m: [9.0, 9.0],
    windscreen_m: [1.30, 1.94, 0.76, 0.72],
    rear_glass_m: [1.30, 1.80, 0.68, 0.66],
    lamps_m: [0.90, 1.00],
};

/// The painter's figures of a body.
pub fn shape(kind: CarKind) -> Shape {
    match kind {
        CarKind::Hatchback => HATCHBACK_SHAPE,
        CarKind::Saloon => SALOON_SHAPE,
        CarKind::Estate => ESTATE_SHAPE,
        CarKind::Offroad => OFFROAD_SHAPE,
        CarKind::Van => VAN_SHAPE,
    }
}

/// Points of the right half of a cross-section, from the sill to the top: (x, height).
fn half_ring(section: &Section) -> [(f64, f64); 8] {
    let &(_, top, belt, wide, narrow, sill) = section;
    let edge = top - 0.05 * (top - sill).min(1.0);
    let waist = sill + 0.45 * (belt - sill);
    // Widths of the body at each height, from the sill over the waist to the roof.
    [
        (0.88 * wide, sill),
        (0.97 * wide, sill + 0.3 * (waist - sill)),
        (wide, waist),
        (0.985 * wide, belt - 0.04),
        (0.96 * wide, belt),
        (narrow, edge - 0.02),
        (0.86 * narrow, edge + 0.025),
        (0.0, top),
    ]
}

/// Builds a body.
pub fn body(kind: CarKind) -> Mesh {
    let mut mesh = Mesh::default();
    // The kind rides along in the surface, so that the painter finds the body's shape.
    let shell = mesh.surface(Surface {
        size_m: [kind as u32 as f32, 0.0],
        ..Surface::new(Kind::Car, tone(255, 255, 255), 0)
    });
    hull(&mut mesh, shell, sections(kind));
    let figures = shape(kind);
    let tyre = mesh.surface(Surface::new(Kind::Plain, tone(30, 30, 32), 0));
    let rim = mesh.surface(Surface::new(Kind::Wheel, tone(160, 162, 166), 0));
    let (radius, half_width) = (f64::from(figures.wheel_m), f64::from(figures.half_m[1]));
    // Wheels: a tyre is a bar across, its rim a disc on the outer side.
    for axle in figures.axles_m {
        for side in [-1.0, 1.0] {
            let outer = Point::new(side * (half_width + 0.012), -radius, f64::from(axle));
            let inner = Point::new(side * (half_width - 0.2), -radius, f64::from(axle));
            mesh.bar(tyre, BarEnd::new(inner, radius), BarEnd::new(outer, radius), 18);
            disc(&mut mesh, rim, outer, side, radius);
        }
    }
    // Door mirrors, at the front end of the side windows.
    let black = mesh.surface(Surface::new(Kind::Plain, tone(36, 36, 38), 0));
    let height = f64::from(figures.side_height_m[0]);
    let along = f64::from(figures.side_glass_m[0]) - 0.12;
    for side in [-1.0, 1.0] {
        let (a, b) = (side * (half_width - 0.06), side * (half_width + 0.11));
        let low = Point::new(a.min(b), -height - 0.08, along - 0.035);
        mesh.cuboid(black, low, Point::new(a.max(b), -height + 0.03, along + 0.045), &[]);
    }
    mesh.finish()
}

fn disc(mesh: &mut Mesh, surface: u16, middle: Point, side: f64, radius: f64) {
    let rim = |angle: f64| {
        let point = middle + Point::new(0.0, libm::sin(angle), libm::cos(angle)) * radius;
        (point, [libm::cos(angle) as f32, libm::sin(angle) as f32, 0.0])
    };
    let step = 2.0 * core::f64::consts::PI / 18.0;
    let corners: Vec<_> = (0..18).map(|k| rim(step * f64::from(k))).collect();
    mesh.polygon(surface, Point::new(side, 0.0, 0.0), &corners);
}

/// Lofts the cross-sections, closes both ends, and smooths the normals.
fn hull(mesh: &mut Mesh, surface: u16, sections: &[Section]) {
    let rings: Vec<Vec<Point>> = sections
        .iter()
        .map(|section| {
            let half = half_ring(section);
            let right = half.iter().map(|&(x, height)| Point::new(x, -height, section.0));
            let left =
                half.iter().rev().skip(1).map(|&(x, height)| Point::new(-x, -height, section.0));
            right.chain(left).collect()
        })
        .collect();
    let (rows, columns) = (rings.len(), rings[0].len());
    let at = |row: usize, column: usize| rings[row][column];
    let first = mesh.vertices.len() as u32;
    for row in 0..rows {
        for column in 0..columns {
            let point = at(row, column);
            let along = at((row + 1).min(rows - 1), column) - at(row.saturating_sub(1), column);
            let around = at(row, (column + 1).min(columns - 1)) - at(row, column.saturating_sub(1));
            // Rings run from the right sill over the roof, rows from front to rear.
            let normal = around.cross(&along).normalize();
            mesh.vertices.push(vertex(point, normal));
        }
    }
    // Two triangles for each patch between neighbouring rings.
    let index = |row: usize, column: usize| first + (row * columns + column) as u32;
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let (a, b, c, d) = (
                index(row, column),
                index(row, column + 1),
                index(row + 1, column),
                index(row + 1, column + 1),
            );
            mesh.triangles.push(Triangle { corners: [a, b, c], surface, slight: false });
            mesh.triangles.push(Triangle { corners: [b, d, c], surface, slight: false });
        }
    }
    // Front and rear are closed by flat polygons.
    for (row, direction) in [(0, 1.0), (rows - 1, -1.0)] {
        let corners: Vec<_> = rings[row].iter().map(|&point| (point, as_surface(point))).collect();
        mesh.polygon(surface, Point::new(0.0, 0.0, direction), &corners);
    }
}

fn as_surface(point: Point) -> [f32; 3] {
    [point.x as f32, point.y as f32, point.z as f32]
}

fn vertex(position_m: Point, normal: Point) -> Vertex {
    Vertex { position_m, surface_m: as_surface(position_m), normal: as_surface(normal) }
}
