//! A scene as binary glTF 2.0 (GLB): the static map, and each object as a node that moves along its
//! trajectory.
//!
//! Positions and normals are floats, in m: of `KHR_mesh_quantization`, which halves the bytes, many
//! readers make maps of thousands of kilometres. glTF's axes are x right, y up, z backward: the root node turns the first
//! camera's axes into them. Colours are linear, as glTF demands. Time 0 is the first frame's.

mod binary;
mod primitive;

use super::{Scene, SceneObject};
use binary::{Binary, F32, VERTICES, Values};
use dynvox_core::geometry::Transform;
use primitive::primitive;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// Half a turn about x: from camera axes to glTF's.
const HALF_TURN: [f32; 4] = [1.0, 0.0, 0.0, 0.0];

/// The parts of a document.
#[derive(Default)]
struct Document {
    binary: Binary,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

/// Writes the file.
///
/// # Errors
/// The disk refuses, or the file would be larger than 4 GiB.
pub fn write(out: &mut impl Write, scene: &Scene) -> io::Result<()> {
    let mut document = Document::default();
    let mut children = Vec::new();
    children.extend(document.mesh_node("static map", &scene.static_map));
    children.extend(document.path_node(
        "camera path",
        scene.frames.iter().map(|frame| frame.t_world_camera.translation_m),
    ));
    children.extend(
        document.path_node("ground truth", scene.truth.iter().map(|pose| pose.translation_m)),
    );
    // Animations begin at zero, whenever the recording did.
    let began_s = scene.frames.first().map_or(0.0, |frame| frame.row.time_s);
    let times_s: BTreeMap<usize, f32> = scene
        .frames
        .iter()
        .map(|frame| (frame.row.frame, (frame.row.time_s - began_s) as f32))
        .collect();
    children
        .extend(scene.objects.iter().filter_map(|object| document.object_node(object, &times_s)));
    document.nodes.push(json!({ "name": "world", "rotation": HALF_TURN, "children": children }));
    // A node may not name an empty list of children.
    if children.is_empty() {
        document.nodes = vec![json!({ "name": "world", "rotation": HALF_TURN })];
    }
    document.write(out)
}

impl Document {
    /// A node with a mesh, in m; nothing for an empty mesh.
    fn mesh_node(&mut self, name: &str, mesh: &super::IndexedMesh) -> Option<usize> {
        let primitive = primitive(&mut self.binary, mesh)?;
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
        Some(self.node(json!({ "name": name, "mesh": self.meshes.len() - 1 })))
    }

    /// A node with a line through points; nothing for fewer than two.
    fn path_node(
        &mut self,
        name: &str,
        positions_m: impl Iterator<Item = [f64; 3]>,
    ) -> Option<usize> {
        let points: Vec<[f32; 3]> = positions_m.map(|at| at.map(|metres| metres as f32)).collect();
        let first = *points.get(1).and(points.first())?;
        // The format demands the bounds of all positions.
        let bound = |pick: fn(f32, f32) -> f32| {
            points.iter().fold(first, |bound, at| [0, 1, 2].map(|axis| pick(bound[axis], at[axis])))
        };
        let bytes: Vec<u8> =
            points.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.binary.view(&bytes, Some(VERTICES), None);
        let range = json!({ "min": bound(f32::min), "max": bound(f32::max) });
        let position = self.binary.accessor(
            view,
            Values { component: F32, kind: "VEC3", count: points.len() },
            &range,
        );
        self.meshes.push(json!({ "name": name, "primitives": [{ "attributes": { "POSITION": position }, "mode": 3, "material": 1 }] }));
        Some(self.node(json!({ "name": name, "mesh": self.meshes.len() - 1 })))
    }

    /// A node that moves as an object does, with its mesh below it.
    fn object_node(
        &mut self,
        object: &SceneObject,
        times_s: &BTreeMap<usize, f32>,
    ) -> Option<usize> {
        let name = format!("object {}", object.name);
        let mesh = self.mesh_node(&format!("{name} mesh"), &object.mesh)?;
        let (_, last) = object.t_world_object.last()?;
        let (translation, rotation) = numbers(last);
        let node = self.node(json!({ "name": name, "translation": translation, "rotation": rotation, "children": [mesh] }));
        let mut moments: Vec<(f32, &Transform)> = object
            .t_world_object
            .iter()
            .filter_map(|(frame, pose)| Some((*times_s.get(frame)?, pose)))
            .collect();
        // Times must ascend.
        moments.dedup_by(|later, earlier| later.0 <= earlier.0);
        if moments.len() > 1 {
            self.animate(node, &moments);
        }
        Some(node)
    }

    fn animate(&mut self, node: usize, moments: &[(f32, &Transform)]) {
        let input =
            self.binary.times(&moments.iter().map(|(time_s, _)| *time_s).collect::<Vec<_>>());
        let (translations, rotations): (Vec<_>, Vec<_>) =
            moments.iter().map(|(_, pose)| numbers(pose)).unzip();
        let outputs =
            [self.binary.floats(&translations, "VEC3"), self.binary.floats(&rotations, "VEC4")];
        for (output, path) in outputs.into_iter().zip(["translation", "rotation"]) {
            self.samplers
                .push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
            self.channels.push(json!({ "sampler": self.samplers.len() - 1, "target": { "node": node, "path": path } }));
        }
    }

    fn node(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Header, JSON and bytes, each padded to four bytes.
    fn write(mut self, out: &mut impl Write) -> io::Result<()> {
        let binary = &mut self.binary;
        binary.bytes.resize(binary.bytes.len().next_multiple_of(4), 0);
        let mut root = json!({
            "asset": { "version": "2.0", "generator": concat!("dynvox ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "nodes": [self.nodes.len() - 1] }],
            "nodes": self.nodes,
        });
        // Empty lists are not allowed: what is not there is not named.
        if !self.meshes.is_empty() {
            root["meshes"] = self.meshes.into();
            root["materials"] =
                json!([material("surface", [1.0; 4]), material("path", [0.03, 0.16, 0.74, 1.0])]);
            root["buffers"] = json!([{ "byteLength": binary.bytes.len() }]);
            root["bufferViews"] = std::mem::take(&mut binary.views).into();
            root["accessors"] = std::mem::take(&mut binary.accessors).into();
        }
        if !self.channels.is_empty() {
            root["animations"] =
                json!([{ "name": "run", "samplers": self.samplers, "channels": self.channels }]);
        }
        // Chunks are padded to four bytes, as the format demands.
        let mut json = serde_json::to_vec(&root)?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let chunks: Vec<(&[u8; 4], &[u8])> = [(b"JSON", &json[..]), (b"BIN\0", &binary.bytes[..])]
            .into_iter()
            .filter(|(_, bytes)| !bytes.is_empty())
            .collect();
        let length = |bytes: usize| {
            u32::try_from(bytes).map_err(|_| io::Error::other("a GLB holds at most 4 GiB"))
        };
        // Magic, version, length of the whole file; then each chunk with its length.
        out.write_all(b"glTF")?;
        out.write_all(&2u32.to_le_bytes())?;
        out.write_all(
            &length(12 + chunks.iter().map(|(_, bytes)| 8 + bytes.len()).sum::<usize>())?
                .to_le_bytes(),
        )?;
        for (kind, bytes) in chunks {
            out.write_all(&length(bytes.len())?.to_le_bytes())?;
            out.write_all(kind)?;
            out.write_all(bytes)?;
        }
        Ok(())
    }
}

/// A rough surface seen from both sides.
fn material(name: &str, colour: [f64; 4]) -> Value {
    let surface =
        json!({ "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 1.0 });
    json!({ "name": name, "pbrMetallicRoughness": surface, "doubleSided": true })
}

/// Translation and rotation.
fn numbers(pose: &Transform) -> ([f32; 3], [f32; 4]) {
    let pose = pose.normalized();
    (pose.translation_m.map(|metres| metres as f32), pose.rotation.map(|part| part as f32))
}

#[cfg(test)]
mod tests;
