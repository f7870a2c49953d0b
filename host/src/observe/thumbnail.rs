//! An object's mesh on three pictures, orthographic: from the camera that saw it first, from its
//! left side, from above.

use super::pictures;
use dynvox_core::view::Triangle;
use image::RgbImage;
use nalgebra::Vector3;

/// Size of one view, px.
const VIEW_PX: (usize, usize) = (380, 240);
/// Share of the vertices on either end of an axis that may lie outside the picture: stray triangles
/// should not shrink the object.
const STRAY: f64 = 0.005;
const EMPTY: [u8; 3] = [24, 26, 30];

/// The pictures side by side as a JPEG file; empty when there is nothing to show.
pub fn thumbnail(triangles: &[Triangle]) -> Vec<u8> {
    if triangles.is_empty() {
        return Vec::new();
    }
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    // Right, down and forward of each view, in the object's axes: x right, y down, z forward.
    let views = [[x, y, z], [-z, y, x], [x, -z, y]].map(|axes| view(triangles, axes));
    let rows = (0..VIEW_PX.1)
        .flat_map(|v| views.iter().flat_map(move |view| &view[v * VIEW_PX.0..(v + 1) * VIEW_PX.0]));
    let pixels: Vec<u8> = rows.flatten().copied().collect();
    let size = (3 * VIEW_PX.0 as u32, VIEW_PX.1 as u32);
    RgbImage::from_raw(size.0, size.1, pixels)
        .map(|picture| pictures::jpeg(&picture))
        .unwrap_or_default()
}

fn view(triangles: &[Triangle], axes: [Vector3<f32>; 3]) -> Vec<[u8; 3]> {
    let turned = |position_m: [f32; 3]| axes.map(|axis| axis.dot(&Vector3::from(position_m)));
    let range = |axis: usize| {
        let mut values: Vec<f32> =
            triangles.iter().map(|one| turned(one.vertices[0].position_m)[axis]).collect();
        // A few stray triangles would make the object small: they are left out of the frame.
        values.sort_by(f32::total_cmp);
        let stray = (values.len() as f64 * STRAY) as usize;
        (values[stray], values[values.len() - 1 - stray])
    };
    let ((left, right), (top, bottom)) = (range(0), range(1));
    let (width, height) = (VIEW_PX.0 as f32, VIEW_PX.1 as f32);
    // One scale for both axes, and at least half a metre across.
    let scale =
        (0.92 * width / (right - left).max(0.5)).min(0.92 * height / (bottom - top).max(0.5));
    let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
    let mut pixels = vec![EMPTY; VIEW_PX.0 * VIEW_PX.1];
    let mut nearest = vec![f32::MAX; pixels.len()];
    for Triangle { vertices } in triangles {
        let corners = vertices.map(|vertex| {
            let [u, v, depth] = turned(vertex.position_m);
            [0.5 * width + (u - middle[0]) * scale, 0.5 * height + (v - middle[1]) * scale, depth]
        });
        let shade = shade(&vertices.map(|vertex| turned(vertex.position_m)));
        fill(&corners, |at, [a, b, c], depth| {
            if depth < nearest[at] {
                nearest[at] = depth;
                // Uncoloured vertices are grey.
                let [p, q, r] = vertices
                    .map(|vertex| if vertex.colour == [0; 3] { [200; 3] } else { vertex.colour });
                pixels[at] = [0, 1, 2].map(|i| {
                    (shade * (a * f32::from(p[i]) + b * f32::from(q[i]) + c * f32::from(r[i])))
                        as u8
                });
            }
        });
    }
    pixels
}

/// Light from above and behind the viewer; the same from either side, so that holes do not show as
/// black.
fn shade(corners: &[[f32; 3]; 3]) -> f32 {
    let [a, b, c] = corners.map(Vector3::from);
    let normal = (b - a).cross(&(c - a));
    let to_light = Vector3::new(-0.3, -0.6, -0.742);
    if normal.norm() > 0.0 { 0.5 + 0.5 * (normal.normalize().dot(&to_light)).abs() } else { 0.5 }
}

/// Visits the pixels of a triangle with their weights and depth.
fn fill(corners: &[[f32; 3]; 3], mut visit: impl FnMut(usize, [f32; 3], f32)) {
    let [a, b, c] = corners;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let bounds = |axis: usize, most: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
        let high = (a[axis].max(b[axis]).max(c[axis]).ceil().max(0.0) as usize).min(most);
        low..high
    };
    // A triangle seen edge on has no pixels.
    if area.abs() < 1e-6 {
        return;
    }
    for v in bounds(1, VIEW_PX.1) {
        for u in bounds(0, VIEW_PX.0) {
            let (x, y) = (u as f32 + 0.5, v as f32 + 0.5);
            let at_b = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area;
            let at_c = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
            let at_a = 1.0 - at_b - at_c;
            // A hair of tolerance closes seams between triangles.
            if at_a >= -1e-4 && at_b >= -1e-4 && at_c >= -1e-4 {
                visit(
                    v * VIEW_PX.0 + u,
                    [at_a.max(0.0), at_b.max(0.0), at_c.max(0.0)],
                    at_a * a[2] + at_b * b[2] + at_c * c[2],
                );
            }
        }
    }
}
