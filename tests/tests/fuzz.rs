//! Each fuzz target on mutations of valid inputs: a fixed number of them by seed, or for
//! `DYNVOX_FUZZ_SECONDS` a target.

use std::time::{Duration, Instant};

use dynvox_tests::fuzz::{Mutator, TARGETS, Target};

/// Mutations of a target in an ordinary run.
const MUTATIONS: u32 = 1_000;
/// Longest time one input may take. It is far above what any takes: it tells a hang from a slow
/// machine.
const MAX_INPUT: Duration = Duration::from_secs(20);
/// Most memory that all targets together may have taken, KiB. No input is longer than 1 MiB.
const MAX_RESIDENT_KIB: u64 = 1 << 20;

/// The peak of the resident memory so far, KiB, where the system tells it.
fn resident_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Runs a target on mutations, and prints how many there were and how many it took.
fn fuzz(target: &Target) {
    let seeds = (target.seeds)();
    let seconds = std::env::var("DYNVOX_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    let (begin, mut mutator) = (Instant::now(), Mutator::new(1));
    let (mut runs, mut taken) = (0_u32, 0_u32);
    // By time where it is asked for, else a fixed number of mutations.
    let go_on = |runs: u32| match seconds {
        Some(seconds) => begin.elapsed() < Duration::from_secs(seconds),
        None => runs < MUTATIONS,
    };
    while go_on(runs) {
        let bytes = mutator.mutate(&seeds);
        let at = Instant::now();
        // A panic is reported with the bytes that cause it.
        let run = || (target.run)(&bytes);
        match std::panic::catch_unwind(run) {
            Ok(took) => taken += u32::from(took),
            Err(_) => panic!(
                "{} panics at run {runs} on {} bytes: {:02x?}",
                target.name,
                bytes.len(),
                &bytes[..bytes.len().min(4_000)]
            ),
        }
        // No input may take much longer than its size suggests.
        assert!(at.elapsed() < MAX_INPUT, "{} takes {:?} at run {runs}", target.name, at.elapsed());
        let resident = resident_kib().unwrap_or(0);
        assert!(
            resident < MAX_RESIDENT_KIB,
            "{} or another target takes {} MiB at run {runs}",
            target.name,
            resident >> 10
        );
        runs += 1;
    }
    println!("{}: {runs} runs, {taken} taken, {:.0} s", target.name, begin.elapsed().as_secs_f64());
}

#[test]
fn valid_inputs_are_taken() {
    for target in TARGETS {
        for (at, seed) in (target.seeds)().iter().enumerate() {
            assert!(
                (target.run)(seed),
                "{} refuses input {at}: {:?}",
                target.name,
                String::from_utf8_lossy(seed)
            );
        }
    }
}

#[test]
fn mutations_are_made_by_their_seed() {
    let seeds = vec![b"one".to_vec(), b"another".to_vec()];
    let of = |seed| {
        let mut mutator = Mutator::new(seed);
        (0..20).map(|_| mutator.mutate(&seeds)).collect::<Vec<_>>()
    };
    assert_eq!(of(3), of(3));
    assert_ne!(of(3), of(4));
}

macro_rules! targets {
    ($($name:ident),*) => {
        $(#[test]
        fn $name() {
            fuzz(TARGETS.iter().find(|target| target.name == stringify!($name)).expect("the target is listed"));
        })*

        #[test]
        fn every_target_is_run() {
            assert_eq!(TARGETS.map(|target| target.name), [$(stringify!($name)),*]);
        }
    };
}
targets!(
    calibration,
    poses,
    times,
    inertial,
    recording,
    pictures,
    depth,
    masks,
    store,
    stream,
    clip,
    snapshot,
    sealed_snapshot,
    bag,
    mesh,
    plan,
    settings,
    calls
);
