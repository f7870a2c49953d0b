//! The C examples, built by the system's C compiler, give the digests on file.
#![allow(missing_docs, unsafe_code, clippy::expect_used)]

use dynvox_core::{BudgetOptions, Capacity};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The static library cargo built along with this test.
fn library() -> PathBuf {
    let deps = std::env::current_exe().expect("this test has a path");
    let deps = deps.parent().expect("in a folder");
    let libraries = fs::read_dir(deps)
        .expect("that can be read")
        .filter_map(Result::ok)
        .map(|entry| entry.path());
    let named = |path: &PathBuf| {
        path.extension().is_some_and(|end| end == "a")
            && path
                .file_name()
                .is_some_and(|name| name.to_string_lossy().starts_with("libdynvox_capi"))
    };
    libraries
        .filter(named)
        .max_by_key(|path| path.metadata().and_then(|about| about.modified()).ok())
        .expect("the library is there")
}

/// Builds an example with the system's compiler.
fn build(name: &str, folder: &Path) -> PathBuf {
    let capi = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/capi");
    build_source(&capi.join("examples").join(name).with_extension("c"), folder)
}

/// Builds a C file with the system's compiler, into `folder`.
fn build_source(source: &Path, folder: &Path) -> PathBuf {
    let capi = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/capi");
    let program = folder.join(source.file_stem().expect("a file"));
    let built = Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(capi.join("include"))
        .arg(source)
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program)
        .output()
        .expect("there is a C compiler: install cc, or name one in CC");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    program
}

#[test]
fn the_program_of_the_page_about_c_maps_a_pair() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/c.md");
    let page = fs::read_to_string(page).expect("the page is there");
    let (_, block) = page.split_once("```c\n").expect("a block of C");
    let (program, _) = block.split_once("```").expect("that ends");
    let folder = tempfile::TempDir::new().expect("a folder");
    let source = folder.path().join("page.c");
    fs::write(&source, program).expect("a source");
    let ran = Command::new(build_source(&source, folder.path())).output().expect("it runs");
    let output = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && output.starts_with("frame 2:"), "{output}");
}

/// Numbers and digests of the frames that the C example gives for a fixture.
fn mapped_by_c(fixture: &Path, bytes: usize, settings: &[String]) -> String {
    let folder = tempfile::TempDir::new().expect("a folder");
    let clip = folder.path().join("clip.bin");
    fs::write(&clip, dynvox::fixtures::pack(fixture).expect("the fixture can be packed"))
        .expect("the clip can be written");
    let program = build("map_fixture", folder.path());
    let ran = Command::new(&program)
        .arg(&clip)
        .arg(bytes.to_string())
        .args(settings)
        .output()
        .expect("the program can be run");
    let output_text = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert!(
        ran.status.success()
            && !output_text.contains(" 0 objects")
            && !output_text.contains("of 0 triangles"),
        "objects leave: {output_text}"
    );
    String::from_utf8_lossy(&ran.stdout).into_owned()
}

/// Returns the digests as they are on file.
fn on_file(fixture: &Path) -> String {
    let digests = fs::read_to_string(fixture.join("digests.txt")).expect("the digests are there");
    let lines = digests.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.split(' ').take(2).collect::<Vec<_>>().join(" ") + "\n").collect()
}

#[test]
fn the_c_example_maps_the_fixture_to_the_digests_on_file() {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/street-320x96");
    let bytes = dynvox::fixtures::pack(&fixture).expect("the fixture can be packed");
    let volume =
        dynvox_clip::config(&dynvox_clip::Clip::new(&bytes).expect("what was packed is a clip"))
            .volume;
    let settings = [
        format!("volume.voxel_size_m={}", volume.voxel_size_m),
        format!("volume.prune_lag={}", volume.prune_lag),
    ];
    assert_eq!(mapped_by_c(&fixture, 0, &settings), on_file(&fixture));
    assert_eq!(on_file(&fixture).lines().count(), 24);
}

#[test]
fn a_fixture_with_its_own_settings_has_the_same_digests_in_c() {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/street-320x96");
    let root = tempfile::TempDir::new().expect("a folder");
    let fixture = root.path().join("own");
    for name in ["left", "right", "instances"] {
        fs::create_dir_all(fixture.join(name)).expect("a folder");
        for entry in
            fs::read_dir(from.join(name)).expect("the fixture is there").filter_map(Result::ok)
        {
            fs::copy(entry.path(), fixture.join(name).join(entry.file_name())).expect("a copy");
        }
    }
    fs::copy(from.join("calib.txt"), fixture.join("calib.txt")).expect("a copy");
    // Bounds and settings that no profile has.
    let budget = 24 << 20;
    let options = BudgetOptions { voxel_size_m: Some(0.1), ..BudgetOptions::default() };
    let capacity = Capacity::for_budget(budget, 320, 96, &options).expect("enough");
    fs::write(fixture.join("fixture.toml"), description(&capacity)).expect("a file");
    fs::write(
        fixture.join("settings.toml"),
        "[volume]\nvoxel_size_m = 0.1\nprune_lag = 6\n\n[tracking.motion]\nsamples = 77\n",
    )
    .expect("a file");
    dynvox::fixtures::bless(&fixture, "Made of the street", &dynvox_core::Serial)
        .expect("a blessing");
    // Other settings, other bits: else the test would prove nothing.
    assert_ne!(on_file(&fixture), on_file(&from));
    // A buffer of C holds the mapper's own fields, too.
    let mut tiny = 0;
    let head = {
        let mut of_profile = std::mem::MaybeUninit::uninit();
        // SAFETY: both pointers are to values of the test's own.
        unsafe {
            dynvox_capi::dynvox_capacity_of_profile(
                dynvox_capi::DYNVOX_PROFILE_TINY,
                of_profile.as_mut_ptr(),
            );
            dynvox_capi::dynvox_bytes(of_profile.as_ptr(), &raw mut tiny);
        }
        tiny - Capacity::TINY.bytes()
    };
    let settings = ["volume.voxel_size_m=0.1", "volume.prune_lag=6", "tracking.motion.samples=77"]
        .map(str::to_owned);
    assert_eq!(mapped_by_c(&fixture, budget + head, &settings), on_file(&fixture));
}

/// `fixture.toml` with bounds.
fn description(of: &Capacity) -> String {
    let numbers = [
        ("image_width", of.image_width),
        ("image_height", of.image_height),
        ("features", of.features),
        ("matches", of.matches),
        ("blocks", of.blocks),
        ("visible_blocks", of.visible_blocks),
        ("history_frames", of.history_frames),
        ("detections", of.detections),
        ("mask_words", of.mask_words),
        ("tracks", of.tracks),
        ("objects", of.objects),
        ("object_blocks", of.object_blocks),
        ("crop_pixels", of.crop_pixels),
    ];
    let lines: String =
        numbers.iter().map(|(name, number)| format!("{name} = {number}\n")).collect();
    format!("kind = \"mapper\"\n\n[capacity]\n{lines}colour = {}\n", of.colour)
}

#[test]
fn the_short_example_maps_a_pair() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let ran =
        Command::new(build("map_pair", folder.path())).output().expect("the program can be run");
    let text = String::from_utf8_lossy(&ran.stdout).into_owned();
    assert!(
        ran.status.success() && text.starts_with("frame 2: "),
        "{text}{}",
        String::from_utf8_lossy(&ran.stderr)
    );
}
