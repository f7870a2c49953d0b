//! Writes the valid inputs of a fuzz target as files: `fuzz_seeds TARGET FOLDER`, what
//! `tests/fuzz/campaign` begins with.

use anyhow::Context;
use dynvox_tests::fuzz::TARGETS;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().context("fuzz_seeds TARGET FOLDER")?;
    let folder = std::path::PathBuf::from(arguments.next().context("fuzz_seeds TARGET FOLDER")?);
    let target = TARGETS
        .iter()
        .find(|target| target.name == name)
        .with_context(|| format!("no target is named {name}"))?;
    std::fs::create_dir_all(&folder)?;
    for (at, seed) in (target.seeds)().iter().enumerate() {
        std::fs::write(folder.join(format!("seed{at}")), seed)?;
    }
    Ok(())
}
