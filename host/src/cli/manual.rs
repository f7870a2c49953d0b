//! `dynvox completions` and `dynvox man`: the command line described for shells and for `man`.

use crate::owned::create_folder;
use anyhow::Context;
use clap::Command;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct CompletionsArgs {
    /// The shell: its completions are written to standard output
    shell: clap_complete::Shell,
}

#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// Folder for a page of dynvox and one of each command; without it the page of dynvox goes to
    /// standard output
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Writes the completions of a command line.
pub fn completions(args: &CompletionsArgs, mut command: Command) {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "dynvox", &mut script);
    out!("{}", String::from_utf8_lossy(&script));
}

/// Writes the manual of a command line.
pub fn man(args: &ManArgs, command: Command) -> anyhow::Result<()> {
    let Some(folder) = &args.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        out!("{}", String::from_utf8_lossy(&page));
        return Ok(());
    };
    let written = create_folder(folder).and_then(|()| clap_mangen::generate_to(command, folder));
    written.with_context(|| format!("{} cannot be written. Give another --out", folder.display()))
}
