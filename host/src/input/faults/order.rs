//! Which frame is delivered when.

use super::spec::{FaultKind, Faults};
use dynvox_core::random::Random;

/// A delivery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Delivery {
    /// The frame of the source that is delivered.
    pub frame: usize,
    /// The frame whose time stamp it bears.
    pub stamp: usize,
}

/// Deliveries of a recording of `len` frames.
pub(super) fn deliveries(len: usize, faults: &Faults) -> Vec<Delivery> {
    let mut order: Vec<Delivery> = (0..len).map(|at| Delivery { frame: at, stamp: at }).collect();
    for (number, fault) in faults.list.iter().enumerate() {
        let mut random = Random::new(faults.seed ^ ((number as u64 + 1) << 32));
        let affected: Vec<bool> = (0..order.len())
            .map(|at| fault.covers(at) && random.below(100) < fault.percent)
            .collect();
        match fault.kind {
            FaultKind::Drop => {
                let mut lost = affected.iter();
                order.retain(|_| !lost.next().copied().unwrap_or_default());
            }
            FaultKind::Duplicate => {
                for at in (1..order.len()).filter(|&at| affected[at]) {
                    order[at].frame = order[at - 1].frame;
                }
            }
            FaultKind::Swap => {
                let mut at = 0;
                while at + 1 < order.len() {
                    if affected[at] {
                        order.swap(at, at + 1);
                        at += 1;
                    }
                    at += 1;
                }
            }
            FaultKind::Jump(frames) => {
                for at in (0..order.len())
                    .filter(|&at| affected[at] && (at == fault.first || fault.percent < 100))
                {
                    order[at..].iter_mut().for_each(|one| one.frame += frames);
                }
                order.retain(|one| one.frame < len);
            }
            _ => {}
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(len: usize, faults: &str) -> (Vec<usize>, Vec<usize>) {
        deliveries(len, &faults.parse().unwrap())
            .into_iter()
            .map(|one| (one.frame, one.stamp))
            .unzip()
    }

    #[test]
    fn frames_are_lost_repeated_swapped_and_skipped() {
        assert_eq!(order(6, "drop@2..4"), (vec![0, 1, 4, 5], vec![0, 1, 4, 5]));
        assert_eq!(order(5, "duplicate@2"), (vec![0, 1, 1, 3, 4], vec![0, 1, 2, 3, 4]));
        assert_eq!(order(5, "duplicate@2..4").0, [0, 1, 1, 1, 4]);
        assert_eq!(order(5, "swap@2").0, [0, 1, 3, 2, 4]);
        assert_eq!(order(8, "jump=3@2"), (vec![0, 1, 5, 6, 7], vec![0, 1, 2, 3, 4]));
        let (some, all) = (order(1_000, "drop%10").0.len(), 1_000);
        assert!((850..950).contains(&some), "{some} of {all} remain");
        assert_ne!(order(1_000, "drop%10").0, order(1_000, "drop%10,seed=2").0);
    }
}
