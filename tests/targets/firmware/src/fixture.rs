//! The fixture, its bounds and its settings, as
//! `dynvox fixtures pack FIXTURE --out CLIP --rust CONSTANTS` writes them.

include!(env!("DYNVOX_CONSTANTS"));

/// The frames.
pub static CLIP: &[u8] = include_bytes!(env!("DYNVOX_CLIP"));
/// Digests that the clip must give.
pub static DIGESTS: &str = include_str!(env!("DYNVOX_DIGESTS"));
