//! Settings of matches.

/// Assignment of matches to instances.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct MatchesConfig {
    /// Share of the image beyond which an object of unknown state is kept out of the camera's
    /// egomotion; 0 to 1; 0.05. The original: 1.
    pub large_share: f32,
}

impl Default for MatchesConfig {
    fn default() -> Self {
        Self { large_share: 0.05 }
    }
}
