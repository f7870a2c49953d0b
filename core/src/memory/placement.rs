//! Kinds of memory that regions belong in, on machines that have more than one.

/// Regions, and stages all of whose regions, are read now and then or in whole blocks.
///
/// Voxels and objects' volumes are the bulk of a slab, and a frame touches those of visible blocks
/// only, front to back. Pictures of the map are made on demand or after a loss. Places and
/// planners' maps are asked once a frame at most.
const COLD: [&str; 6] =
    ["objects.volumes", "places", "planning", "raycast", "volume.colour", "volume.voxels"];

/// Kind of memory that a region belongs in, where a machine has a fast and a large one.
///
/// ```
/// use dynvox_core::{Capacity, memory::Placement};
///
/// let footprint = Capacity::TINY.footprint();
/// let hot = footprint.regions().iter().filter(|region| region.placement() == Placement::Hot);
/// assert_eq!(hot.map(|region| region.bytes).sum::<usize>(), Capacity::TINY.hot_bytes());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Placement {
    /// Fast memory, on the chip: working images, features, descriptors, lists of blocks.
    Hot,
    /// Large memory, outside the chip: voxels, objects' volumes, pictures of the map, places,
    /// planners' maps.
    Cold,
}

impl Placement {
    /// Placement of a region by its name, `stage.what`.
    pub(super) fn from_name(name: &str) -> Self {
        let is_cold = COLD.iter().any(|cold| {
            let rest = name.as_bytes().strip_prefix(cold.as_bytes());
            rest.is_some_and(|rest| rest.first().is_none_or(|&next| next == b'.'))
        });
        if is_cold { Self::Cold } else { Self::Hot }
    }

    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hot => "hot",
            Self::Cold => "cold",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_names_and_whole_stages_are_cold() {
        for (name, placement) in [
            ("volume.voxels", Placement::Cold),
            ("raycast.depth", Placement::Cold),
            ("places", Placement::Cold),
            ("volume.visible", Placement::Hot),
            ("volume.voxels_of_another", Placement::Hot),
            ("raycaster.depth", Placement::Hot),
            ("rectify.maps", Placement::Hot),
            ("", Placement::Hot),
        ] {
            assert_eq!(Placement::from_name(name), placement, "{name}");
        }
    }
}
