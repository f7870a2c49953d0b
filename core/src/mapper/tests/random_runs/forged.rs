//! Snapshots whose checksums are right and whose numbers are none that a run makes.

use super::*;
use crate::{inertial::InertialUnit, state::Visitor};

/// Frames before the snapshot, and frames that follow it.
const SEEN: usize = 6;
const FOLLOWING: usize = 3;
/// Largest values, and the first ones that are negative with a sign.
const VALUES: [u64; 4] = [u64::MAX, i64::MAX as u64, i32::MAX as u64, 1 << 63 | 1 << 31];

/// Makes number `at` of what it visits `value`, and counts them.
#[derive(Default)]
struct Forger {
    at: Option<usize>,
    value: u64,
    visited: usize,
}

impl Forger {
    fn is_here(&mut self) -> bool {
        self.visited += 1;
        self.at == Some(self.visited - 1)
    }
}

impl Visitor for Forger {
    // Voxels and pixels may have any value.
    fn bytes(&mut self, _: &mut [u8]) {}

    fn u32(&mut self, value: &mut u32) {
        if self.is_here() {
            *value = self.value as u32;
        }
    }

    fn u64(&mut self, value: &mut u64) {
        if self.is_here() {
            *value = self.value;
        }
    }
}

/// Forges each `every`th number of snapshots of runs 1, 2 and 6, which have tracks: they are
/// refused, or the next frames are taken.
fn forge(every: usize) {
    let (mut taken, mut refused) = (0, 0);
    std::thread::scope(|scope| {
        let runs = [1, 2, 6].map(|seed| scope.spawn(move || forge_run(seed, every)));
        for run in runs {
            let counts = run.join().unwrap();
            (taken, refused) = (taken + counts[0], refused + counts[1]);
        }
    });
    println!("{taken} taken, {refused} refused");
    assert!(taken > 0 && refused > 0, "each happens");
}

/// Counts the forged snapshots of a run that are taken and refused.
fn forge_run(seed: u64, every: usize) -> [u32; 2] {
    let mut counts = [0; 2];
    let frames = run(seed);
    let unit = Some(InertialUnit::new(Transform::IDENTITY));
    let config = Config { inertial: unit, ..config(seed) };
    let mut slab = vec![0u8; SMALL.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&SMALL, &config, &mut slab).unwrap();
    for frame in &frames[..SEEN] {
        step(&mut mapper, frame);
    }
    assert!(mapper.tracks().count() > 0);
    let (bytes, mut counter) = (saved(&mut mapper), Forger::default());
    mapper.visit(&mut counter);
    for at in (0..counter.visited).step_by(every) {
        for value in VALUES {
            let forged = restored(&SMALL, &config, &bytes, |mapper| {
                mapper.visit(&mut Forger { at: Some(at), value, visited: 0 });
                saved(mapper)
            });
            let is_taken = restored(&SMALL, &config, &forged.unwrap(), |mapper| {
                for frame in &frames[SEEN..SEEN + FOLLOWING] {
                    step(mapper, frame);
                }
            });
            counts[usize::from(is_taken.is_err())] += 1;
        }
    }
    counts
}

#[test]
fn some_numbers_of_a_snapshot_may_be_forged() {
    forge(401);
}

#[dynvox_needs::long]
#[test]
fn each_number_of_a_snapshot_may_be_forged() {
    forge(1);
}
