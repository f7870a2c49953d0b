//! How is a run asked for by a program? A request is plain data: made here, or read from a file
//! that another program wrote.
//!
//! `cargo run -p dynvox --example run_request -- street` maps the street;
//! `cargo run -p dynvox --example run_request -- street request.json` does what the file says.

use anyhow::Context;
use dynvox::Request;
use dynvox::request::Memory;
use dynvox::run::{RunFolder, run};

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().context("run_request FOLDER [REQUEST.json]")?;
    let request = match arguments.next() {
        Some(path) => serde_json::from_str(&std::fs::read_to_string(path)?)?,
        None => street(),
    };
    println!("{}", serde_json::to_string_pretty(&request)?);

    let plan = request.absolute()?.resolve()?;
    let folder = RunFolder::begin(folder.as_ref(), true)?;
    let record = run(plan, &folder, None)?;
    println!("{} frames, digest {:016x}", record.frames.len(), record.digest());
    // Without this the folder is gone when the program ends.
    println!("{}", folder.commit(&[])?.display());
    Ok(())
}

/// Ten frames of the synthetic street at half size, in little memory.
fn street() -> Request {
    let mut request = Request::default();
    request.frames.most = Some(10);
    request.frames.scale = 0.5;
    request.bounds.memory = Memory::Profile("small".to_owned());
    request.settings.volume.voxel_size_m = 0.1;
    request
}
