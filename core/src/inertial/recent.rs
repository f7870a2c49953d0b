//! The last samples before a frame: turns of the interval before are compared once all of it is
//! covered, which a clock offset delays.

use super::{InertialSample, integral::Reading};
use crate::state::Visitor;
use nalgebra::Vector3;

/// Entries; 48 of at least 5 ms each reach back over 0.24 s.
const ENTRIES: usize = 48;
/// Samples closer together than this share an entry, ns.
const ENTRY_NS: u64 = 5_000_000;

/// Mean of the samples of one entry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Entry {
    /// Time of the first sample, ns.
    first_ns: u64,
    /// Mean time after it, ns.
    after_ns: u32,
    samples: u32,
    turn_rate: [f32; 3],
    force: [f32; 3],
}

/// Ring of entries, the oldest first.
#[derive(Clone, Debug)]
pub(super) struct RecentSamples {
    entries: [Entry; ENTRIES],
    /// Entries in use.
    len: u32,
    /// Position of the oldest one.
    oldest: u32,
}

impl RecentSamples {
    pub fn new() -> Self {
        Self { entries: [Entry::default(); ENTRIES], len: 0, oldest: 0 }
    }

    fn newest_mut(&mut self) -> Option<&mut Entry> {
        let at = (self.oldest as usize + (self.len as usize).checked_sub(1)?) % ENTRIES;
        self.entries.get_mut(at)
    }

    /// Adds a sample later than all before.
    pub fn push(&mut self, sample: &InertialSample) {
        if let Some(newest) = self.newest_mut() {
            let after_ns = sample.time_ns.wrapping_sub(newest.first_ns);
            if after_ns < ENTRY_NS {
                newest.samples = newest.samples.saturating_add(1);
                let share = 1.0 / newest.samples as f32;
                let mean = |old: f32, new: f64| old + (new as f32 - old) * share;
                newest.after_ns = mean(newest.after_ns as f32, after_ns as f64) as u32;
                let pairs = newest.turn_rate.iter_mut().zip(sample.turn_rate);
                pairs
                    .chain(newest.force.iter_mut().zip(sample.force))
                    .for_each(|(old, new)| *old = mean(*old, new));
                return;
            }
        }
        if (self.len as usize) < ENTRIES {
            self.len += 1;
        } else {
            self.oldest = (self.oldest + 1) % ENTRIES as u32;
        }
        if let Some(newest) = self.newest_mut() {
            *newest = Entry {
                first_ns: sample.time_ns,
                after_ns: 0,
                samples: 1,
                turn_rate: sample.turn_rate.map(|rate| rate as f32),
                force: sample.force.map(|force| force as f32),
            };
        }
    }

    /// Readings on the clock of an interval that starts at `start_ns`, with `offset_s` added.
    pub fn readings(&self, start_ns: u64, offset_s: f64) -> impl Iterator<Item = Reading> + '_ {
        let positions = (0..self.len as usize).map(|at| (self.oldest as usize + at) % ENTRIES);
        positions.filter_map(|at| self.entries.get(at)).map(move |entry| {
            let time_ns = entry.first_ns.wrapping_add(u64::from(entry.after_ns));
            Reading {
                at_s: seconds_after(start_ns, time_ns) + offset_s,
                turn_rate: Vector3::from(entry.turn_rate.map(f64::from)),
                force: Vector3::from(entry.force.map(f64::from)),
            }
        })
    }

    /// Visits every field.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { entries, len, oldest } = self;
        visitor.u32s([&mut *len, &mut *oldest]);
        if *len as usize > ENTRIES || *oldest as usize >= ENTRIES {
            visitor.refuse();
            (*len, *oldest) = (0, 0);
        }
        for entry in entries {
            let Entry { first_ns, after_ns, samples, turn_rate, force } = entry;
            visitor.u64(first_ns);
            visitor.u32s([after_ns, samples]);
            turn_rate.iter_mut().chain(force).for_each(|value| visitor.f32(value));
        }
    }
}

/// Time from one moment to another, s.
pub(super) fn seconds_after(start_ns: u64, time_ns: u64) -> f64 {
    // Differences of clocks that are centuries apart wrap, and are then refused as too far.
    time_ns.wrapping_sub(start_ns) as i64 as f64 * 1e-9
}
