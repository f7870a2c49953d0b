//! Settings of the mesh.

use crate::settings::{Problems, Range, Rule, Setting, Value::U8, check, rules};

/// Parameters of the mesh.
///
/// ```
/// use dynvox_core::{Problems, view::MeshConfig};
///
/// let mut problems = Problems::new();
/// MeshConfig { min_weight: 0, ..MeshConfig::default() }.validate(&mut problems);
/// assert_eq!(problems[0].key, "mesh.min_weight");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct MeshConfig {
    /// Fewest observations with which a lattice point counts as seen.
    pub min_weight: u8,
}

impl Default for MeshConfig {
    fn default() -> Self {
        Self { min_weight: 1 }
    }
}

type Row = Setting<MeshConfig>;

impl MeshConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] =
        &[Row::user("mesh.min_weight", "", |c| U8(&mut c.min_weight))
            .range(Range::Within(1.0, 255.0))
            .text(
                "Fewest observations with which a lattice point counts as seen; the original \
                 meshes all it has.",
            )];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
