//! The binary part of a GLB file, and what describes it.

use serde_json::{Value, json};

/// A buffer that is used for vertices.
pub const VERTICES: u32 = 34_962;
/// A buffer that is used for indices.
pub const INDICES: u32 = 34_963;
/// Types of numbers.
pub const U16: u32 = 5_123;
pub const U32: u32 = 5_125;
pub const F32: u32 = 5_126;

/// Bytes with their views and accessors.
#[derive(Debug, Default)]
pub struct Binary {
    pub bytes: Vec<u8>,
    pub views: Vec<Value>,
    pub accessors: Vec<Value>,
}

/// Layout of the bytes of a view.
pub struct Values<'a> {
    /// Type of a component, as glTF numbers them.
    pub component: u32,
    /// Kind of a value: `SCALAR`, `VEC3`.
    pub kind: &'a str,
    /// Number of values.
    pub count: usize,
}

impl Binary {
    /// Appends bytes as a view of their own: of vertices `stride` bytes apart, of indices, or of
    /// neither. Returns its number.
    pub fn view(&mut self, bytes: &[u8], target: Option<u32>, stride: Option<usize>) -> usize {
        // glTF wants views to begin at multiples of four bytes.
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Describes a view. Returns its number.
    pub fn accessor(&mut self, view: usize, values: Values<'_>, more: &Value) -> usize {
        let Values { component, kind, count } = values;
        let mut accessor =
            json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        for (key, value) in more.as_object().into_iter().flatten() {
            accessor[key] = value.clone();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Vectors of floats for an animation.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> usize {
        let bytes: Vec<u8> =
            values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, None, None);
        let values = Values { component: F32, kind, count: values.len() };
        self.accessor(view, values, &Value::Null)
    }

    /// Times of an animation, ascending.
    pub fn times(&mut self, times_s: &[f32]) -> usize {
        let bytes: Vec<u8> = times_s.iter().flat_map(|time_s| time_s.to_le_bytes()).collect();
        let view = self.view(&bytes, None, None);
        self.accessor(
            view,
            Values { component: F32, kind: "SCALAR", count: times_s.len() },
            &json!({ "min": [times_s.first()], "max": [times_s.last()] }),
        )
    }
}
