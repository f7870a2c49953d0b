//! A mesh as glTF reads it without extensions: positions and normals of floats, linear colours of
//! 16 bits.

use super::binary::{Binary, F32, INDICES, U16, U32, VERTICES, Values};
use crate::scene::IndexedMesh;
use serde_json::{Value, json};

/// Greatest value of 16 bits.
const MOST: f32 = 65_535.0;
/// Colour of vertices without one: light grey.
const CLAY: [u8; 3] = [205, 205, 200];
/// Bytes from one vertex's position, normal and colour to the next one's.
const STRIDES: [usize; 3] = [12, 12, 8];

/// Appends a mesh, in m, and returns its primitive; nothing for an empty mesh.
pub fn primitive(binary: &mut Binary, mesh: &IndexedMesh) -> Option<Value> {
    let [low_m, high_m] = mesh.bounds_m()?;
    let count = mesh.positions_m.len();
    let floats = |values: &[[f32; 3]]| -> Vec<u8> {
        values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect()
    };
    let normals: Vec<[f32; 3]> = mesh.normals().into_iter().map(unit).collect();
    let mut colours = Vec::new();
    for &colour in &mesh.colours {
        // Points without colour are drawn like clay.
        let shown = if colour == [0; 3] { CLAY } else { colour };
        // A fourth number pads each colour to a multiple of four bytes.
        colours.extend(shown.map(linear).into_iter().chain([0]).flat_map(u16::to_le_bytes));
    }
    // Each attribute is a view of its own.
    let [position, normal, colour] = [floats(&mesh.positions_m), floats(&normals), colours]
        .into_iter()
        .zip(STRIDES)
        .map(|(bytes, stride)| binary.view(&bytes, Some(VERTICES), Some(stride)))
        .collect::<Vec<_>>()
        .try_into()
        .ok()?;
    let of = |component| Values { component, kind: "VEC3", count };
    let attributes = json!({
        "POSITION": binary.accessor(position, of(F32), &json!({ "min": low_m, "max": high_m })),
        "NORMAL": binary.accessor(normal, of(F32), &Value::Null),
        "COLOR_0": binary.accessor(colour, of(U16), &json!({ "normalized": true })),
    });
    Some(json!({ "attributes": attributes, "indices": indices(binary, mesh), "material": 0 }))
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
