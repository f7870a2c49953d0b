//! Checks of bounds and settings against the images.

use super::RequestError;
use dynvox_core::{Capacity, Config};

/// Bytes the host may use in addition to the slab, by default: the synthetic street, objects'
/// meshes, the index of the block file.
const HOST_BYTES: u64 = 256 << 20;
/// Bytes the host may use for each pixel of an image: frames read ahead, their depth and masks,
/// pictures of the report.
const HOST_BYTES_PER_PIXEL: u64 = 64;

/// Bytes a run may take in all unless it is told otherwise.
pub fn resident_limit_bytes(capacity: &Capacity, (width, height): (usize, usize)) -> u64 {
    capacity.bytes() as u64 + HOST_BYTES + HOST_BYTES_PER_PIXEL * (width * height) as u64
}

/// Refuses bounds and settings that images of a size cannot be mapped with.
///
/// # Errors
/// Something does not fit; the message says what to change.
pub fn check_bounds(
    (width, height): (usize, usize),
    (profile, bounds): (&str, &Capacity),
    config: &Config,
) -> Result<(), RequestError> {
    let fits =
        |capacity: &Capacity| width <= capacity.image_width && height <= capacity.image_height;
    if !fits(bounds) {
        let scale = (bounds.image_width as f64 / width as f64)
            .min(bounds.image_height as f64 / height as f64);
        // Down, so that the scaled images fit.
        let scale = (scale * 100.0).floor() / 100.0;
        let larger = Capacity::PROFILES.iter().find(|(_, capacity)| fits(capacity));
        return Err(RequestError::ImageSize {
            width,
            height,
            profile: profile.to_owned(),
            fits_width: bounds.image_width,
            fits_height: bounds.image_height,
            action: match larger {
                Some((name, _)) => {
                    format!("Choose --profile {name}, or shrink the images with --scale {scale}")
                }
                None => format!("Shrink the images with --scale {scale}"),
            },
        });
    }
    let problems = config.validate();
    let (prune_lag, history_frames) = (config.volume.prune_lag, bounds.history_frames);
    // Pruning looks back through the history, which must reach so far.
    if problems.is_empty() && config.volume.prunes() && prune_lag as usize > history_frames {
        return Err(RequestError::Window {
            prune_lag,
            history_frames,
            profile: profile.to_owned(),
        });
    }
    if problems.is_empty() {
        return Ok(());
    }
    let problems: Vec<String> =
        problems.iter().map(|problem| format!("{} {}", problem.key, problem.rule)).collect();
    Err(RequestError::Config { problems: problems.join("; ") })
}
