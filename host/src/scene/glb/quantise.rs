//! A mesh in few bytes: positions of 16 bits, normals of 8, linear colours of 16.

use super::binary::{Binary, I8, INDICES, U16, U32, VERTICES, Values};
use crate::scene::IndexedMesh;
use serde_json::{Value, json};

/// Greatest value of 16 bits.
const MOST: f32 = 65_535.0;
/// Colour of vertices without one: light grey.
const CLAY: [u8; 3] = [205, 205, 200];
/// Bytes from one vertex's position, normal and colour to the next one's.
const STRIDES: [usize; 3] = [8, 4, 8];

/// Appends a mesh and returns its primitive, and the least corner and the longest side of its box,
/// m. Nothing for an empty mesh.
pub fn primitive(binary: &mut Binary, mesh: &IndexedMesh) -> Option<(Value, [f32; 3], f32)> {
    let [low_m, high_m] = mesh.bounds_m()?;
    // One scale for all axes, so that normals need no correction.
    let size_m = (0..3).map(|axis| high_m[axis] - low_m[axis]).fold(1e-3, f32::max);
    let step = |at: &[f32; 3]| {
        [0, 1, 2].map(|axis| ((at[axis] - low_m[axis]) / size_m * MOST).round() as u16)
    };
    let count = mesh.positions_m.len();
    let (mut positions, mut normals, mut colours) = (Vec::new(), Vec::new(), Vec::new());
    for at in &mesh.positions_m {
        // A fourth number pads each position to a multiple of four bytes.
        positions.extend(step(at).into_iter().chain([0]).flat_map(u16::to_le_bytes));
    }
    for normal in mesh.normals() {
        normals.extend(
            unit(normal).map(|value| (127.0 * value).round() as i8 as u8).into_iter().chain([0]),
        );
    }
    for &colour in &mesh.colours {
        // Points without colour are drawn like clay.
        let shown = if colour == [0; 3] { CLAY } else { colour };
        colours.extend(shown.map(linear).into_iter().chain([0]).flat_map(u16::to_le_bytes));
    }
    // Each attribute is a view of its own, with its stride padded to four bytes.
    let [position, normal, colour] = [&positions, &normals, &colours]
        .into_iter()
        .zip(STRIDES)
        .map(|(bytes, stride)| binary.view(bytes, Some(VERTICES), Some(stride)))
        .collect::<Vec<_>>()
        .try_into()
        .ok()?;
    let normalized = json!({ "normalized": true });
    let range = json!({ "normalized": true, "min": step(&low_m), "max": step(&high_m) });
    let of = |component| Values { component, kind: "VEC3", count };
    let attributes = json!({
        "POSITION": binary.accessor(position, of(U16), &range),
        "NORMAL": binary.accessor(normal, of(I8), &normalized),
        "COLOR_0": binary.accessor(colour, of(U16), &normalized),
    });
    Some((
        json!({ "attributes": attributes, "indices": indices(binary, mesh), "material": 0 }),
        low_m,
        size_m,
    ))
}

/// Appends the corners of the triangles, of 16 bits where that is enough.
fn indices(binary: &mut Binary, mesh: &IndexedMesh) -> usize {
    let corners = mesh.triangles.as_flattened();
    let short = mesh.positions_m.len() <= usize::from(u16::MAX);
    let bytes: Vec<u8> = if short {
        corners.iter().flat_map(|&corner| (corner as u16).to_le_bytes()).collect()
    } else {
        corners.iter().flat_map(|corner| corner.to_le_bytes()).collect()
    };
    let view = binary.view(&bytes, Some(INDICES), None);
    let component = if short { U16 } else { U32 };
    binary.accessor(view, Values { component, kind: "SCALAR", count: corners.len() }, &Value::Null)
}

/// The direction, upward for a length of 0, which glTF does not allow.
fn unit(normal: [f32; 3]) -> [f32; 3] {
    if normal == [0.0; 3] { [0.0, -1.0, 0.0] } else { normal }
}

/// The linear value of an sRGB channel, in 16 bits.
fn linear(channel: u8) -> u16 {
    let value = f32::from(channel) / 255.0;
    let linear =
        if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    (linear * MOST).round() as u16
}
