//! The committed header is the one the source gives.
#![allow(missing_docs, clippy::expect_used)]

use std::{env, fs, path::Path, process::Command};

#[test]
fn the_header_is_what_the_source_says() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(here.join("cbindgen.toml"))
        .expect("the configuration can be read");
    // In the order in which the header has them: types before the functions that take them.
    let modules = [
        "status",
        "types",
        "inertial",
        "work",
        "config",
        "capacity",
        "callback",
        "handle",
        "step",
        "disparity",
        "map",
        "loops",
        "tracks",
        "plan",
        "raw",
        "retired",
        "snapshot",
        "two_buffers",
    ];
    let builder =
        modules.iter().fold(cbindgen::Builder::new().with_config(config), |builder, module| {
            builder.with_src(here.join("src").join(module).with_extension("rs"))
        });
    let mut bytes = Vec::new();
    builder.generate().expect("the source can be read").write(&mut bytes);
    let written = String::from_utf8(bytes).expect("text");
    let path = here.join("include/dynvox.h");
    // As with other generated files: written on request, compared otherwise.
    if std::env::var_os("DYNVOX_BLESS").is_some() {
        fs::write(&path, &written).expect("the header can be written");
    }
    let committed = fs::read_to_string(&path).expect("the header is there");
    assert!(
        committed == written,
        "include/dynvox.h is old: DYNVOX_BLESS=1 cargo test -p dynvox-capi --test header"
    );
}

/// Returns true if a compiler accepts the header by itself, with all warnings as errors.
fn compiles(variable: &str, default: &str, language: &str, standard: &str) {
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let folder = env::temp_dir().join(format!("dynvox-header-{}-{language}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    let source = folder.join("alone");
    let text = "#include \"dynvox.h\"\nint main(void) \
                { DynvoxConfig config; return config.settings_len == 0 ? 0 : (int)sizeof(DynvoxTrack); }\n";
    fs::write(
        &source,
        // C and C++ zero a struct in two ways.
        text.replace("DynvoxConfig config;", "DynvoxConfig config = {0};")
            .replace("{0}", if language == "c" { "{0}" } else { "{}" }),
    )
    .expect("a source");
    let compiler = env::var_os(variable).unwrap_or_else(|| default.into());
    let built = Command::new(compiler)
        .args([
            "-x",
            language,
            standard,
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-fsyntax-only",
            "-I",
        ])
        .args([&include, &source])
        .output()
        .expect("there is a compiler: install cc and c++, or name them in CC and CXX");
    fs::remove_dir_all(&folder).expect("a folder that goes");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
}

#[test]
fn the_header_is_c11_and_cpp17() {
    compiles("CC", "cc", "c", "-std=c11");
    compiles("CXX", "c++", "c++", "-std=c++17");
}
