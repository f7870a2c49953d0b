//! Values that the surface can be coloured by besides its photo: a byte of each value for each
//! vertex, and what the bytes mean.

use crate::scene::tiles::{VALUES, ValueBytes};
use crate::scene::{BlockHistory, IndexedMesh, Scene, SceneObject, SurfaceErrorMap};
use serde::Serialize;

/// A value for the page's script.
#[derive(Clone, Debug, Serialize)]
pub struct ValueHead {
    /// Name of the value.
    name: &'static str,
    /// The least, with its unit.
    low: String,
    /// The greatest, with its unit.
    high: String,
}

/// The least and the greatest value that are told apart.
#[derive(Clone, Copy, Debug)]
struct Scale {
    low: f32,
    high: f32,
}

impl Scale {
    fn byte(self, value: f32) -> u8 {
        let share = (value - self.low) / (self.high - self.low).max(1e-6);
        1 + (254.0 * share.clamp(0.0, 1.0)).round() as u8
    }
}

/// The values of a scene.
pub struct SurfaceValues<'s> {
    blocks: &'s BlockHistory,
    errors: &'s SurfaceErrorMap,
    /// From one observation to what nearly all of the static map is below; `None` where no weight
    /// is known.
    weight: Option<Scale>,
    /// From the first frame to the last; `None` where it is not known when a place was seen.
    last_seen: Option<Scale>,
    /// From none to what most are below, m; `None` where the map was compared with nothing.
    error_m: Option<Scale>,
}

impl<'s> SurfaceValues<'s> {
    /// Finds the scales of a scene's values.
    pub fn new(scene: &'s Scene) -> Self {
        let mut weights = scene.static_map.weights.clone();
        weights.sort_unstable();
        // The 95th percentile: a few voxels seen very often would leave no colours for the others.
        let most = weights.get(weights.len() * 19 / 20).copied().unwrap_or_default();
        let frames =
            scene.frames.first().zip(scene.frames.last()).filter(|_| !scene.blocks.is_empty());
        Self {
            blocks: &scene.blocks,
            errors: &scene.errors,
            weight: (most > 0).then(|| Scale { low: 1.0, high: most.into() }),
            last_seen: frames.map(|(first, last)| Scale {
                low: first.row.frame as f32,
                high: last.row.frame as f32,
            }),
            error_m: scene.errors.max_m().map(|high| Scale { low: 0.0, high }),
        }
    }

    /// Describes what the bytes of each value mean; `None` where no vertex has the value.
    pub fn heads(&self) -> [Option<ValueHead>; VALUES] {
        let weight = self.weight.map(|Scale { high, .. }| ValueHead {
            name: "weight",
            low: "1 observation".to_owned(),
            high: format!("{high} observations and more"),
        });
        let last_seen = self.last_seen.map(|Scale { low, high }| ValueHead {
            name: "last seen",
            low: format!("frame {low}"),
            high: format!("frame {high}"),
        });
        let error = self.error_m.map(|Scale { high, .. }| ValueHead {
            name: "error",
            low: "0 m from the reference".to_owned(),
            high: format!("{high:.2} m and more"),
        });
        [weight, last_seen, error]
    }

    /// The bytes of the static map's vertices.
    pub fn of_static(&self, mesh: &IndexedMesh) -> Vec<ValueBytes> {
        let at = |vertex: usize| mesh.positions_m[vertex];
        self.bytes(
            mesh,
            |vertex| self.blocks.last_frame(at(vertex)),
            |vertex| self.errors.error_m(at(vertex)),
        )
    }

    /// The bytes of the vertices of an object, which was last seen as a whole. No reference is kept
    /// for it.
    pub fn of_object(
        &self,
        SceneObject { mesh, t_world_object, .. }: &SceneObject,
    ) -> Vec<ValueBytes> {
        let last = t_world_object.last().map(|(frame, _)| *frame);
        self.bytes(mesh, |_| last, |_| None)
    }

    fn bytes(
        &self,
        mesh: &IndexedMesh,
        last_frame: impl Fn(usize) -> Option<usize>,
        error_m: impl Fn(usize) -> Option<f32>,
    ) -> Vec<ValueBytes> {
        // Zero means that the value is not known.
        let byte = |scale: Option<Scale>, value: Option<f32>| {
            scale.zip(value).map_or(0, |(scale, value)| scale.byte(value))
        };
        let weight = |at: usize| Some(mesh.weights[at]).filter(|&weight| weight > 0).map(f32::from);
        let last_seen = |at: usize| last_frame(at).map(|frame| frame as f32);
        let values = |at: usize| {
            [
                byte(self.weight, weight(at)),
                byte(self.last_seen, last_seen(at)),
                byte(self.error_m, error_m(at)),
            ]
        };
        (0..mesh.positions_m.len()).map(values).collect()
    }
}
