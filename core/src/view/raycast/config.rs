//! Settings of the raycast.

use crate::settings::{
    Problems, Range, Relation, Rule, Setting,
    Value::{F32, U8},
    check, rules,
};

/// Parameters of the raycast.
///
/// ```
/// use dynvox_core::view::RaycastConfig;
///
/// let mut problems = dynvox_core::Problems::new();
/// RaycastConfig { near_m: 5.0, far_m: 2.0, ..RaycastConfig::default() }.validate(&mut problems);
/// assert_eq!(problems[0].to_string(), "raycast.far_m must be above raycast.near_m");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct RaycastConfig {
    /// Nearest depth looked at, m.
    pub near_m: f32,
    /// Farthest depth looked at, m.
    pub far_m: f32,
    /// Fewest observations with which a lattice point counts as seen.
    pub min_weight: u8,
}

impl Default for RaycastConfig {
    fn default() -> Self {
        Self { near_m: 0.3, far_m: 30.0, min_weight: 1 }
    }
}

type Row = Setting<RaycastConfig>;

impl RaycastConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::expert("raycast.near_m", "m", |c| F32(&mut c.near_m))
            .range(Range::POSITIVE)
            .text("Nearest depth looked at."),
        Row::user("raycast.far_m", "m", |c| F32(&mut c.far_m))
            .range(Range::POSITIVE)
            .relation(&Relation {
                holds: |c| c.far_m > c.near_m,
                rule: "must be above raycast.near_m",
            })
            .text("Farthest depth looked at."),
        Row::expert("raycast.min_weight", "", |c| U8(&mut c.min_weight))
            .range(Range::Within(1.0, 255.0))
            .text(
                "Fewest observations with which a lattice point counts as seen; the original looks \
                 at all it has.",
            ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the figures.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
