//! Which right image belongs to which left one.
//!
//! By equal names; else by what is left of the names when each side's prefix and suffix are cut
//! away (`left_0008` and `right_0008`); else by the nearest time stamp within half a frame; else by
//! order where both sides have as many. What has no partner is skipped and counted.

use super::names::{stem_of, varying_parts};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The images of one camera, in order.
#[derive(Clone, Debug, Default)]
pub struct CameraFiles {
    /// The images.
    pub files: Vec<PathBuf>,
    /// The time stamp of each, ns; `None` where they have none.
    pub stamps_ns: Option<Vec<u64>>,
}

/// Reason why two images are taken as one pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairedBy {
    /// Equal names.
    Name,
    /// Equal names, apart from the part that all names of a side share.
    VaryingPart,
    /// Nearest time stamps.
    Stamp,
    /// They stand at the same place in their folders.
    Order,
}

/// Pairs, and what is left over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pairing {
    /// Positions of a left image and its right one, in the order of the left ones.
    pub pairs: Vec<(usize, usize)>,
    /// Left images without a partner.
    pub skipped_left: usize,
    /// Right images without a partner.
    pub skipped_right: usize,
    /// Rule by which the pairs were found.
    pub by: PairedBy,
}

impl Pairing {
    /// Pairs the images of two cameras; `None` where neither names nor time stamps pair them.
    pub fn of(left: &CameraFiles, right: &CameraFiles) -> Option<Self> {
        let counts = (left.files.len(), right.files.len());
        let stems = |camera: &CameraFiles| {
            camera.files.iter().map(|path| stem_of(path)).collect::<Vec<_>>()
        };
        let (left_stems, right_stems) = (stems(left), stems(right));
        // Where fewer than half find a partner, the rule does not hold for these names.
        let enough = |pairs: &Vec<(usize, usize)>| {
            !pairs.is_empty() && 2 * pairs.len() >= counts.0.min(counts.1)
        };
        let found = |pairs: Vec<(usize, usize)>, by| Self {
            skipped_left: counts.0 - pairs.len(),
            skipped_right: counts.1 - pairs.len(),
            pairs,
            by,
        };
        let by_name = equal_keys(&left_stems, &right_stems);
        if enough(&by_name) {
            return Some(found(by_name, PairedBy::Name));
        }
        let by_part = equal_keys(&varying_parts(&left_stems), &varying_parts(&right_stems));
        if enough(&by_part) {
            return Some(found(by_part, PairedBy::VaryingPart));
        }
        if let (Some(left_ns), Some(right_ns)) = (&left.stamps_ns, &right.stamps_ns) {
            let by_stamp = nearest_stamps(left_ns, right_ns);
            if enough(&by_stamp) {
                return Some(found(by_stamp, PairedBy::Stamp));
            }
        }
        (counts.0 == counts.1)
            .then(|| found((0..counts.0).map(|at| (at, at)).collect(), PairedBy::Order))
    }

    /// Returns a note for the user; `None` if every image has a partner of the same name.
    pub fn note(&self) -> Option<String> {
        let how = match self.by {
            PairedBy::Name => "",
            PairedBy::VaryingPart => {
                "left and right images are paired by what differs in their names"
            }
            PairedBy::Stamp => "left and right images are paired by the nearest time stamp",
            PairedBy::Order => {
                "left and right images are paired by their order: neither names nor time stamps \
                 tell more"
            }
        };
        let skipped = match (self.skipped_left, self.skipped_right) {
            (0, 0) => String::new(),
            (left, right) => {
                format!("{left} left and {right} right images have no partner: skipped")
            }
        };
        let parts: Vec<&str> =
            [how, &skipped].into_iter().filter(|part| !part.is_empty()).collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// Positions of equal keys, in the order of the left ones.
fn equal_keys(left: &[String], right: &[String]) -> Vec<(usize, usize)> {
    let positions: BTreeMap<&str, usize> =
        right.iter().enumerate().map(|(at, key)| (key.as_str(), at)).collect();
    // A key that stands for several images tells nothing.
    if positions.len() != right.len()
        || left.iter().collect::<std::collections::BTreeSet<_>>().len() != left.len()
    {
        return Vec::new();
    }
    left.iter()
        .enumerate()
        .filter_map(|(at, key)| Some((at, *positions.get(key.as_str())?)))
        .collect()
}

/// For each left stamp the nearest right one within half a frame, where it in turn is the nearest
/// of that.
pub fn nearest_stamps(left_ns: &[u64], right_ns: &[u64]) -> Vec<(usize, usize)> {
    let limit_ns = median_interval_ns(left_ns).max(median_interval_ns(right_ns)) / 2;
    let nearest = |stamp: u64, others: &[u64]| {
        let after = others.partition_point(|&other| other < stamp);
        [after.checked_sub(1), Some(after)]
            .into_iter()
            .flatten()
            .filter(|&at| at < others.len())
            .min_by_key(|&at| others[at].abs_diff(stamp))
    };
    let pairs = left_ns.iter().enumerate().filter_map(|(at, &stamp)| {
        let partner = nearest(stamp, right_ns)?;
        let mutual = nearest(right_ns[partner], left_ns) == Some(at);
        (mutual && right_ns[partner].abs_diff(stamp) <= limit_ns).then_some((at, partner))
    });
    pairs.collect()
}

/// The median time between two stamps, ns; 0 where there are not two.
pub fn median_interval_ns(stamps_ns: &[u64]) -> u64 {
    let mut intervals: Vec<u64> =
        stamps_ns.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    intervals.sort_unstable();
    intervals.get(intervals.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(names: &[&str]) -> CameraFiles {
        let files: Vec<PathBuf> =
            names.iter().map(|name| PathBuf::from(format!("{name}.png"))).collect();
        let stamps_ns =
            files.iter().map(|path| super::super::names::stamp_in_name(&stem_of(path))).collect();
        CameraFiles { files, stamps_ns }
    }

    #[test]
    fn three_frames_missing_on_one_side_are_skipped_and_counted() {
        let left: Vec<String> = (0..20).map(|at| at.to_string()).collect();
        let right: Vec<&str> = left
            .iter()
            .enumerate()
            .filter(|(at, _)| ![4, 5, 11].contains(at))
            .map(|(_, name)| name.as_str())
            .collect();
        let pairing = Pairing::of(
            &camera(&left.iter().map(String::as_str).collect::<Vec<_>>()),
            &camera(&right),
        )
        .unwrap();
        assert_eq!(
            (pairing.by, pairing.pairs.len(), pairing.skipped_left, pairing.skipped_right),
            (PairedBy::Name, 17, 3, 0)
        );
        assert!(pairing.pairs.iter().all(|&(l, r)| left[l] == right[r]));
        assert_eq!(pairing.note().unwrap(), "3 left and 0 right images have no partner: skipped");
    }

    #[test]
    fn prefixes_suffixes_and_padding_do_not_keep_pairs_apart() {
        for (left, right) in [
            (["left_8", "left_9", "left_10"], ["right_8", "right_9", "right_10"]),
            (["8_left", "9_left", "10_left"], ["008_right", "009_right", "010_right"]),
            (["0_008", "0_009", "0_010"], ["1_008", "1_009", "1_010"]),
            (["cam0_008", "cam0_009", "cam0_010"], ["cam1_008", "cam1_009", "cam1_010"]),
        ] {
            let pairing = Pairing::of(&camera(&left), &camera(&right)).unwrap();
            assert_eq!(
                (pairing.by, pairing.pairs.as_slice()),
                (PairedBy::VaryingPart, &[(0, 0), (1, 1), (2, 2)][..]),
                "{left:?}"
            );
        }
    }

    #[test]
    fn stamps_a_millisecond_apart_are_pairs_and_a_lost_frame_is_skipped() {
        let stamp = |at: u64, late_ms: u64| {
            (1_403_636_579_000_000_000 + at * 50_000_000 + late_ms * 1_000_000).to_string()
        };
        let left: Vec<String> = (0..10).map(|at| stamp(at, 0)).collect();
        let right: Vec<String> = (0..10).filter(|at| *at != 3).map(|at| stamp(at, 1)).collect();
        let names =
            |names: &[String]| camera(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let pairing = Pairing::of(&names(&left), &names(&right)).unwrap();
        assert_eq!(
            (pairing.by, pairing.pairs.len(), pairing.skipped_left, pairing.skipped_right),
            (PairedBy::Stamp, 9, 1, 0)
        );
        assert!(pairing.pairs.iter().all(|&(l, r)| if l < 3 { l == r } else { l == r + 1 }));
    }

    #[test]
    fn order_is_the_last_resort_and_needs_equal_counts() {
        let (left, right) = (camera(&["apple", "berry"]), camera(&["cat", "dog"]));
        let pairing = Pairing::of(&left, &right).unwrap();
        assert_eq!((pairing.by, pairing.pairs.len()), (PairedBy::Order, 2));
        assert!(pairing.note().unwrap().contains("by their order"));
        assert_eq!(Pairing::of(&left, &camera(&["cat", "dog", "emu"])), None);
    }
}
