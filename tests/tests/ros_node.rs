//! The ROS 2 node, compiled where no ROS is: headers written from the message definitions stand in
//! for ROS's own, and a bus within the process for its topics.
#![allow(missing_docs, clippy::expect_used, clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn node_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/capi/examples/ros2")
}

/// The static library that cargo built along with this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().expect("this test has a path");
    let deps = test.parent().expect("in a folder");
    let named = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        name.is_some_and(|name| name.starts_with("libdynvox_capi") && name.ends_with(".a"))
    };
    let entries = fs::read_dir(deps).expect("that can be read").filter_map(Result::ok);
    entries
        .map(|entry| entry.path())
        .filter(named)
        .max_by_key(|path| path.metadata().and_then(|about| about.modified()).ok())
        .expect("the library is there")
}

fn check(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Compiles a program of the node's tests into `folder`.
fn build(sources: &[&str], folder: &Path) -> PathBuf {
    let (node, messages) = (node_folder(), folder.join("messages"));
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let written = Command::new(python)
        .arg(node.join("test/ros/messages.py"))
        .arg(node.join("test/ros/messages.txt"))
        .arg(&messages)
        .output()
        .expect("there is Python 3: install it, or name it in PYTHON");
    check(&written);
    let program = folder.join("program");
    let mut compiler = Command::new(std::env::var_os("CXX").unwrap_or_else(|| "c++".into()));
    compiler.args(["-std=c++17", "-Wall", "-Wextra", "-Werror", "-O1"]);
    let capi = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/capi/include");
    let stubs = node.join("test/ros/include");
    for include in [&capi, &node.join("include"), &messages, &stubs] {
        compiler.arg("-I").arg(include);
    }
    compiler.args(sources.iter().map(|source| node.join(source))).arg(library());
    let built = compiler.args(["-lm", "-lpthread", "-ldl", "-o"]).arg(&program).output();
    check(&built.expect("there is a C++ compiler: install c++, or name one in CXX"));
    program
}

#[test]
fn the_ros_node_pairs_images_and_places_what_it_sees() {
    let folder = tempfile::TempDir::new().expect("a folder");
    check(&Command::new(build(&["test/seam.cpp"], folder.path())).output().expect("it runs"));
}

/// Plays the street's fixture to the node for some minutes at 10 Hz, and compares every digest
/// with that of a mapper without a node, whose bits are those on file.
fn play(minutes: &str) {
    let folder = tempfile::TempDir::new().expect("a folder");
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/street-320x96");
    let clip = folder.path().join("clip.bin");
    fs::write(&clip, dynvox::fixtures::pack(&fixture).expect("a clip")).expect("a file");
    let program = build(&["test/live.cpp", "src/mapper_node.cpp"], folder.path());
    check(&Command::new(program).arg(&clip).args([minutes, "0"]).output().expect("it runs"));
}

#[test]
fn the_ros_node_loses_no_frame_of_twelve_seconds() {
    play("0.2");
}

#[dynvox_needs::long]
#[test]
fn the_ros_node_loses_no_frame_of_two_minutes() {
    play("2");
}
