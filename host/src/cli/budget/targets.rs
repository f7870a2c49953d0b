//! Everything a program takes on a target: slab, stack and code.

use crate::report::text::grouped;
use dynvox_core::Capacity;
use serde_json::json;

/// A machine that a script of `tests/targets` builds a program for, and what its machine code
/// takes.
struct Target {
    /// Name of the script.
    name: &'static str,
    /// Compiler of the program: each makes code of another size.
    compiler: &'static str,
    /// Instructions and constants of the entire program, without the pictures it replays, bytes.
    code_bytes: usize,
    /// Most stack of the entire program, bytes: proven from the machine code.
    stack_bytes: usize,
}

/// Upper bounds: the script fails if its program takes more.
const TARGETS: [Target; 2] = [
    Target {
        name: CORTEX_M7,
        compiler: "Debian",
        code_bytes: 856 << 10,
        stack_bytes: 32 << 10,
    },
    Target {
        name: CORTEX_M7,
        compiler: "rustup",
        code_bytes: 880 << 10,
        stack_bytes: 32 << 10,
    },
];
const CORTEX_M7: &str = "cortex-m7";

/// Prints the memory of an entire program, for each capacity and target.
pub fn show(capacities: &[(String, Capacity)], as_json: bool) -> anyhow::Result<()> {
    let rows = || {
        TARGETS.iter().flat_map(|target| {
            capacities.iter().map(move |(name, capacity)| (target, name, capacity.bytes()))
        })
    };
    if as_json {
        let row = |(target, name, slab): (&Target, &String, usize)| {
            json!({
                "target": target.name,
                "compiler": target.compiler,
                "capacity": name,
                "slab_bytes": slab,
                "stack_bytes": target.stack_bytes,
                "code_bytes": target.code_bytes,
                "sum_bytes": slab + target.stack_bytes + target.code_bytes,
            })
        };
        outln!("{}", serde_json::to_string_pretty(&rows().map(row).collect::<Vec<_>>())?);
        return Ok(());
    }
    outln!(
        "{:<12}{:<12}{:<12}{:>16}{:>12}{:>12}{:>16}",
        "target",
        "compiler",
        "capacity",
        "slab, bytes",
        "stack",
        "code",
        "sum"
    );
    for (target, name, slab) in rows() {
        let sum = slab + target.stack_bytes + target.code_bytes;
        let cells =
            [slab, target.stack_bytes, target.code_bytes, sum].map(|bytes| grouped(bytes as u64));
        outln!(
            "{:<12}{:<12}{name:<12}{:>16}{:>12}{:>12}{:>16}",
            target.name,
            target.compiler,
            cells[0],
            cells[1],
            cells[2],
            cells[3]
        );
    }
    outln!(
        "\nstack and code: the most that tests/targets/{CORTEX_M7} lets its program take; \
         your own code comes on top"
    );
    Ok(())
}
