//! Files that ask for the machine: sides, chunks, counts, lines, nesting and streams without an
//! end. Each is refused in a sentence with the bound, within 128 MiB and 2 CPU seconds.
//!
//! A seed makes a bomb of each kind. An ordinary run makes one; all 200 and more are
//! `DYNVOX_LONG=1 cargo test --release -p dynvox --test command_line bombs:: -- --nocapture`, which
//! prints what each took.

mod measure;
mod pictures;
mod recordings;
mod runs;
mod texts;

use dynvox_core::random::Random;
use measure::{Usage, measured};
use std::path::Path;
use tempfile::TempDir;

/// Memory that a bomb may take, bytes.
const MAX_RSS: u64 = 128 << 20;
/// CPU time that a bomb may take, s, in an optimised program.
const MAX_CPU_S: f64 = 2.0;
/// CPU time of an unoptimised program compared with an optimised one.
const UNOPTIMISED: f64 = 10.0;
/// Seeds of the long form.
const SEEDS: u64 = 4;

/// A kind of bomb.
struct Bomb {
    name: &'static str,
    /// Words of the refusal that say which bound was met.
    bound: &'static str,
    /// Writes the files, and returns how the program reads them.
    make: fn(&Path, &mut Random) -> Call,
}

/// A call of the program.
struct Call {
    args: Vec<String>,
    /// Bytes on standard input, again and again until the program ends.
    stream: Option<Stream>,
}

/// Bytes of a stream: those of its beginning, then its rest without an end.
struct Stream {
    begin: Vec<u8>,
    rest: Vec<u8>,
}

impl Call {
    fn new(args: &[&str]) -> Self {
        Self { args: args.iter().map(|&arg| arg.to_owned()).collect(), stream: None }
    }
}

/// A number from `low` up to ten times as much.
fn above(low: u32, random: &mut Random) -> u32 {
    low + random.below(9 * low)
}

fn kinds() -> impl Iterator<Item = &'static Bomb> {
    [pictures::KINDS, recordings::KINDS, texts::KINDS, runs::KINDS].into_iter().flatten()
}

/// Sets off a bomb of each kind, and returns what is wrong with any.
fn failures(seed: u64) -> Vec<String> {
    let slower = if cfg!(debug_assertions) { UNOPTIMISED } else { 1.0 };
    let mut failures = Vec::new();
    for bomb in kinds() {
        let folder = TempDir::new().unwrap();
        let call = (bomb.make)(folder.path(), &mut Random::new(seed));
        let Usage { code, cpu_s, rss, text } = measured(folder.path(), call);
        println!("{:>6.2} s {:>5} MiB  {}: {}", cpu_s, rss >> 20, bomb.name, text.trim());
        // The sentence must name the bound: a crash would give an exit code as well.
        let faults = [
            (code.is_none_or(|code| code == 0), "its exit code is wrong"),
            (!text.contains(bomb.bound), "its sentence lacks the bound"),
            (cpu_s > MAX_CPU_S * slower, "it takes too much time"),
            (rss > MAX_RSS, "it takes too much memory"),
        ];
        let found = faults.iter().filter(|(is_there, _)| *is_there).map(|(_, fault)| fault);
        failures.extend(found.map(|fault| {
            format!(
                "{} (seed {seed}): {fault}: exit {code:?}, {cpu_s:.1} s, {} MiB: {text}",
                bomb.name,
                rss >> 20
            )
        }));
    }
    failures
}

#[test]
fn each_kind_of_bomb_is_refused_within_memory_and_time() {
    let failures = failures(1);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
#[dynvox_needs::long]
fn two_hundred_bombs_are_refused_within_memory_and_time() {
    let bombs = SEEDS as usize * kinds().count();
    let failures: Vec<String> = (2..2 + SEEDS).flat_map(failures).collect();
    println!("{bombs} bombs");
    assert!(bombs >= 200 && failures.is_empty(), "{bombs} bombs\n{}", failures.join("\n"));
}
