//! The committed header is the one the source gives.
#![allow(missing_docs, clippy::expect_used)]

use std::{fs, path::Path};

#[test]
fn the_header_is_what_the_source_says() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(here.join("cbindgen.toml")).expect("the configuration can be read");
    let modules = ["status", "types", "callback", "handle", "step", "map"];
    let builder = modules.iter().fold(cbindgen::Builder::new().with_config(config), |builder, module| {
        builder.with_src(here.join("src").join(module).with_extension("rs"))
    });
    let mut bytes = Vec::new();
    builder.generate().expect("the source can be read").write(&mut bytes);
    let written = String::from_utf8(bytes).expect("text");
    let path = here.join("include/dynvox.h");
    if std::env::var_os("DYNVOX_BLESS").is_some() {
        fs::write(&path, &written).expect("the header can be written");
    }
    let committed = fs::read_to_string(&path).expect("the header is there");
    assert!(committed == written, "include/dynvox.h is old: DYNVOX_BLESS=1 cargo test -p dynvox-capi --test header");
}
