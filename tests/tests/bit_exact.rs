//! P2: the same frames give the same digests, however the work is spread.

use dynvox::fixtures::{self, Blessing, FixtureError, Verdict};
use dynvox::run::Threads;
use dynvox_core::{Capacity, Executor, Serial, parallel::Vectors};
use dynvox_tests::Clip;
use std::path::Path;

fn digests(clip: &Clip, executor: &impl Executor) -> Vec<(u64, u64)> {
    clip.with_mapper(&Capacity::SMALL, |mapper| {
        clip.stereo()
            .map(|frame| {
                mapper
                    .step(&frame, executor)
                    .map(|report| (report.digests.input, report.digest))
                    .expect("a good frame")
            })
            .collect()
    })
}

#[dynvox_needs::long]
#[test]
fn one_two_and_eight_threads_give_the_same_digests_in_every_frame() {
    let clip = Clip::street(416, 128, 15);
    let serial = digests(&clip, &Serial);
    for threads in [1, 2, 8] {
        assert_eq!(
            serial,
            digests(&clip, &Threads::new(threads).expect("a pool")),
            "{threads} threads"
        );
    }
    assert!(serial.windows(2).all(|pair| pair[0].1 != pair[1].1));
}

#[test]
fn one_pixel_changes_the_digest() {
    let clip = Clip::street(416, 128, 3);
    let clean = digests(&clip, &Serial);
    let mut dirty = Clip::street(416, 128, 3);
    dirty.flip_a_bit(1, 200 + 416 * 90);
    let dirty = digests(&dirty, &Serial);
    assert_eq!(clean[0], dirty[0]);
    assert_ne!(clean[1].0, dirty[1].0);
}

#[test]
fn the_fixtures_give_the_digests_on_file_on_one_two_and_eight_threads() {
    for fixture in fixtures::all(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures")))
        .expect("there are fixtures")
    {
        let verify = |executor: &dyn Fn() -> Result<Verdict, FixtureError>| {
            let verdict = executor().expect("the fixture is whole");
            assert_eq!(
                verdict.differences,
                [],
                "bits have changed: fixtures/README.md says what to do when that is meant"
            );
        };
        // Without threads, and with more than the core has bands.
        verify(&|| fixtures::verify(&fixture, &Serial));
        for threads in [1, 2, 8] {
            verify(&|| fixtures::verify(&fixture, &Threads::new(threads).expect("a pool")));
        }
    }
}

/// One thread with the vector instructions it is given.
struct Level(Vectors);

impl Executor for Level {
    fn vectors(&self) -> Vectors {
        self.0
    }
}

#[test]
fn the_fixtures_give_the_digests_on_file_at_every_vector_level() {
    for fixture in fixtures::all(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures")))
        .expect("there are fixtures")
    {
        for vectors in Vectors::available() {
            let verdict =
                fixtures::verify(&fixture, &Level(vectors)).expect("the fixture is whole");
            assert_eq!(
                verdict.differences,
                [],
                "{} with {} kernels",
                fixture.display(),
                vectors.name()
            );
        }
    }
}

#[test]
fn a_changed_pixel_is_named_and_a_blessing_keeps_its_reason() {
    let root = tempfile::TempDir::new().expect("a folder");
    // A copy, so that the fixture in the repository stays as it is.
    let copy = root.path().join("pairs");
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/pairs-317x93");
    for folder in ["left", "right"] {
        std::fs::create_dir_all(copy.join(folder)).expect("a folder");
        for index in 0..4 {
            let name = format!("{folder}/{index:06}.png");
            // The third pair's left image is shown twice.
            let source = if name == "left/000002.png" { "left/000001.png" } else { &name };
            std::fs::copy(from.join(source), copy.join(&name)).expect("a copy");
        }
    }
    for name in ["calib.txt", "fixture.toml", "digests.txt", "blessings.txt"] {
        std::fs::copy(from.join(name), copy.join(name)).expect("a copy");
    }
    let differences =
        |path: &Path| fixtures::verify(path, &Serial).expect("a whole fixture").differences;
    let found = differences(&copy);
    assert_eq!(
        found.iter().map(|one| one.frame).collect::<Vec<_>>(),
        [2],
        "pairs are matched each by itself"
    );
    assert_eq!(found[0].columns, ["input", "stereo", "digest"]);
    // A reason of white space is none.
    assert!(matches!(fixtures::bless(&copy, " \n ", &Serial), Err(FixtureError::NoReason)));
    assert_eq!(
        fixtures::bless(&copy, "The image is shown twice", &Serial).expect("a blessing"),
        Blessing::Written
    );
    // After a blessing nothing differs, and a second one changes nothing.
    assert_eq!(differences(&copy), []);
    assert_eq!(fixtures::bless(&copy, "Again", &Serial).expect("a blessing"), Blessing::Unchanged);
    let log =
        |fixture: &Path| std::fs::read_to_string(fixture.join("blessings.txt")).expect("a log");
    // The log is added to, never rewritten.
    let added =
        log(&copy).strip_prefix(&log(&from)).map(str::to_owned).expect("what stood there before");
    assert_eq!(added.split_once(' ').map(|(_, reason)| reason), Some("The image is shown twice\n"));
}
