//! Networks that ask for the machine, and settings that leave nothing to be found: each ends in a
//! sentence, and a loop without an end at the first Ctrl-C.
#![cfg(feature = "onnx")]

use super::binary::{dynvox, output_text, rig};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const FLOAT: u64 = 1;
const INT64: u64 = 7;
const BOOL: u64 = 9;

fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value > 127 {
        bytes.push(value as u8 | 128);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field of a protocol buffer that holds bytes.
fn field(number: u64, bytes: impl AsRef<[u8]>) -> Vec<u8> {
    let bytes = bytes.as_ref();
    [varint(number << 3 | 2), varint(bytes.len() as u64), bytes.to_vec()].concat()
}

/// A field that holds a number.
fn number(field: u64, value: u64) -> Vec<u8> {
    [varint(field << 3), varint(value)].concat()
}

/// Name, type and shape of an array that a graph takes or gives.
fn array(name: &str, kind: u64, shape: &[u64]) -> Vec<u8> {
    let sides: Vec<u8> = shape.iter().flat_map(|side| field(1, number(1, *side))).collect();
    let tensor = [number(1, kind), field(2, sides)].concat();
    [field(1, name), field(2, field(1, tensor))].concat()
}

/// A constant.
fn constant(name: &str, kind: u64, shape: &[u64], bytes: &[u8]) -> Vec<u8> {
    let sides: Vec<u8> = shape.iter().flat_map(|side| number(1, *side)).collect();
    [sides, number(2, kind), field(8, name), field(9, bytes)].concat()
}

fn node(kind: &str, inputs: &[&str], outputs: &[&str], attributes: &[u8]) -> Vec<u8> {
    let inputs: Vec<u8> = inputs.iter().flat_map(|name| field(1, name)).collect();
    let outputs: Vec<u8> = outputs.iter().flat_map(|name| field(2, name)).collect();
    [inputs, outputs, field(4, kind), attributes.to_vec()].concat()
}

/// A network of nodes and constants: `x` of a size in, `y` out.
fn network(size: [u64; 2], nodes: &[Vec<u8>], constants: &[Vec<u8>]) -> Vec<u8> {
    let [height, width] = size;
    let graph = [
        nodes.iter().flat_map(|node| field(1, node)).collect(),
        field(2, "g"),
        constants.iter().flat_map(|constant| field(5, constant)).collect(),
        field(11, array("x", FLOAT, &[1, 3, height, width])),
        field(12, array("y", FLOAT, &[1, 84, 84])),
    ]
    .concat();
    [number(1, 8), field(7, graph), field(8, [field(1, ""), number(2, 13)].concat())].concat()
}

/// A network that gives one value 84 x 84 times.
fn constant_boxes(size: [u64; 2], value: f32) -> Vec<u8> {
    let values: Vec<u8> = (0..84 * 84).flat_map(|_| value.to_le_bytes()).collect();
    let boxes = constant("k", FLOAT, &[1, 84, 84], &values);
    network(size, &[node("Identity", &["k"], &["y"], &[])], &[boxes])
}

/// A network that counts up to 2^62 before it answers.
fn endless() -> Vec<u8> {
    // The loop's body hands on its state and its condition, so that only the count ends it.
    let body = [
        field(1, node("Identity", &["cin"], &["cout"], &[])),
        field(1, node("Identity", &["v"], &["vout"], &[])),
        field(2, "b"),
        field(11, array("i", INT64, &[])),
        field(11, array("cin", BOOL, &[])),
        field(11, array("v", FLOAT, &[1])),
        field(12, array("cout", BOOL, &[])),
        field(12, array("vout", FLOAT, &[1])),
    ]
    .concat();
    let body = field(5, [field(1, "body"), field(6, body), number(20, 5)].concat());
    let constants = [
        constant("n", INT64, &[], &(1u64 << 62).to_le_bytes()),
        constant("t", BOOL, &[], &[1]),
        constant("v0", FLOAT, &[1], &[0; 4]),
        constant("k", FLOAT, &[1, 84, 84], &[0; 4 * 84 * 84]),
    ];
    let nodes =
        [node("Loop", &["n", "t", "v0"], &["vo"], &body), node("Add", &["k", "vo"], &["y"], &[])];
    network([64, 64], &nodes, &constants)
}

/// A network that widens one number to 256 GiB.
fn widening() -> Vec<u8> {
    let sides: Vec<u8> = [1u64 << 18, 1 << 18].iter().flat_map(|side| side.to_le_bytes()).collect();
    let constants =
        [constant("one", FLOAT, &[1], &1f32.to_le_bytes()), constant("shape", INT64, &[2], &sides)];
    network([64, 64], &[node("Expand", &["one", "shape"], &["y"], &[])], &constants)
}

const ARGS: [&str; 7] =
    ["run", "rig", "--quiet", "--profile", "tiny", "--instances", "onnx:net.onnx"];

/// A rig with a network and its settings.
fn folder(network: &[u8], settings: &str) -> TempDir {
    let root = TempDir::new().unwrap();
    rig(root.path(), 2);
    fs::write(root.path().join("net.onnx"), network).unwrap();
    fs::write(root.path().join("net.toml"), settings).unwrap();
    root
}

/// The sentence of a run that a network or its settings end.
fn refusal(network: &[u8], settings: &str) -> String {
    let root = folder(network, settings);
    let run = dynvox(root.path(), &ARGS);
    let text = output_text(&run);
    assert_eq!(run.status.code(), Some(1), "{text}");
    text
}

#[test]
fn networks_of_large_inputs_and_outputs_end_in_a_sentence() {
    for side in [40_000, 1_000_000, 1 << 62] {
        let text = refusal(&constant_boxes([side, side], 0.0), "");
        assert!(text.contains("at most 4,194,304 px are given to a network"), "{text}");
    }
    let text = refusal(&widening(), "");
    let memory = text.contains("it may take at most 2,048 MiB of memory");
    assert!(memory || text.contains("at most 33,554,432 values"), "{text}");
    let text = refusal(&constant_boxes([64, 64], f32::NAN), "");
    assert!(text.contains("values that are no numbers (nan)"), "{text}");
}

#[test]
fn settings_that_leave_nothing_to_be_found_are_refused_with_what_is_known() {
    let net = constant_boxes([64, 64], 0.0);
    // 80 names, all of them misspelt alike.
    let names = |first: &str| format!("names = [{}]", vec![format!("\"{first}\""); 80].join(", "));
    for (settings, sentence) in [
        ("score_min = 5", "score_min = 5 is not within 0 and 1"),
        ("score_min = nan", "score_min = NaN is not within 0 and 1"),
        ("score_min = inf", "score_min = inf is not within 0 and 1"),
        ("scale = [1.0, 0.0, 1.0]", "a scale of 0"),
        ("mean = [1.0, inf, 1.0]", "not a finite number"),
        ("keep = [\"kar\"]", "`kar`, which is no class; the nearest that is known is `car`"),
        (&names("perzon"), "`perzon`, which is no class; the nearest that is known is `person`"),
    ] {
        let text = refusal(&net, settings);
        assert!(text.contains(sentence), "{settings}: {text}");
    }
    // The limit itself is allowed, although nothing reaches it.
    let root = folder(&net, "keep = [\"car\"]\nscore_min = 1.0");
    let run = dynvox(root.path(), &[&ARGS[..], &["--force"]].concat());
    assert!(run.status.success(), "{}", output_text(&run));
}

/// Processes that serve a network below a folder.
fn workers(root: &Path) -> usize {
    let serves = |entry: fs::DirEntry| {
        let line = fs::read(entry.path().join("cmdline")).unwrap_or_default();
        let folder = fs::read_link(entry.path().join("cwd")).unwrap_or_default();
        folder == root && String::from_utf8_lossy(&line).contains("network-worker")
    };
    fs::read_dir("/proc").unwrap().flatten().map(serves).filter(|serves| *serves).count()
}

fn waited(limit: Duration, mut is_so: impl FnMut() -> bool) -> bool {
    let begin = Instant::now();
    while begin.elapsed() < limit {
        if is_so() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    false
}

#[test]
fn the_first_ctrl_c_ends_a_network_that_loops_without_an_end() {
    let root = folder(&endless(), "");
    let at = root.path().canonicalize().unwrap();
    // A signal to end, and one that cannot be caught: the worker ends either way.
    for signal in ["-INT", "-KILL"] {
        let mut run = Command::new(env!("CARGO_BIN_EXE_dynvox"))
            .args(ARGS)
            .current_dir(&at)
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        assert!(waited(Duration::from_secs(60), || workers(&at) == 1), "no worker");
        // Well within the endless loop.
        std::thread::sleep(Duration::from_millis(500));
        let sent = Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let ended = waited(Duration::from_secs(60), || run.try_wait().unwrap().is_some());
        assert!(ended, "{signal} did not end it");
        assert!(waited(Duration::from_secs(60), || workers(&at) == 0), "{signal} left a worker");
    }
}

#[test]
#[dynvox_needs::long]
fn a_network_without_an_end_is_given_thirty_seconds() {
    let text = refusal(&endless(), "");
    assert!(text.contains("more than the 30 s that it may take for a picture"), "{text}");
}
