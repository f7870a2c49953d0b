//! The C example, built by the system's C compiler, gives the digests on file.
#![allow(missing_docs, clippy::expect_used)]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The static library cargo built along with this test.
fn library() -> PathBuf {
    let deps = std::env::current_exe().expect("this test has a path");
    let deps = deps.parent().expect("in a folder");
    let libraries = fs::read_dir(deps).expect("that can be read").filter_map(Result::ok).map(|entry| entry.path());
    let named = |path: &PathBuf| {
        path.extension().is_some_and(|end| end == "a")
            && path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("libdynvox_capi"))
    };
    libraries.filter(named).max_by_key(|path| path.metadata().and_then(|about| about.modified()).ok()).expect("the library is there")
}

#[test]
fn the_c_example_maps_the_fixture_to_the_digests_on_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (fixture, capi) = (root.join("fixtures/street-320x96"), root.join("core/capi"));
    let folder = tempfile::TempDir::new().expect("a folder");
    let [clip, program] = ["clip.bin", "map_fixture"].map(|name| folder.path().join(name));
    let bytes = dynvox::fixtures::pack(&fixture).expect("the fixture can be packed");
    let replayed = dynvox_clip::config(&dynvox_clip::Clip::new(&bytes).expect("what was packed is a clip")).volume;
    fs::write(&clip, &bytes).expect("the clip can be written");
    let built = Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(capi.join("include"))
        .arg(capi.join("examples/map_fixture.c"))
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program)
        .output()
        .expect("there is a C compiler: install cc, or name one in CC");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let given = [replayed.voxel_size_m.to_string(), replayed.prune_lag.to_string()];
    let ran = Command::new(&program).arg(&clip).args(given).output().expect("the program can be run");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let digests = fs::read_to_string(fixture.join("digests.txt")).expect("the digests are there");
    let lines = digests.lines().filter(|line| !line.starts_with('#'));
    let expected: String = lines.map(|line| line.split(' ').take(2).collect::<Vec<_>>().join(" ") + "\n").collect();
    assert_eq!(String::from_utf8_lossy(&ran.stdout), expected);
    assert_eq!(expected.lines().count(), 24);
}
