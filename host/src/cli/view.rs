//! `dynvox view`: the viewer of a finished run.

use crate::formats::{SUMMARY_FILE, read_text};
use crate::report::{html::page, viewer};
use crate::run::replace_whole;
use crate::scene::{MAX_TRIANGLES, Scene};
use anyhow::{Context, bail};
use maud::html;
use std::path::{Path, PathBuf};

/// Name of the file in the run folder.
const VIEWER_FILE: &str = "viewer.html";

#[derive(Debug, clap::Args)]
pub struct ViewArgs {
    /// A run folder
    run: PathBuf,
    /// File to write [default: viewer.html in the run folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Triangles at most; the mesh is simplified to as many
    #[arg(long, value_name = "N", default_value_t = MAX_TRIANGLES)]
    triangles: usize,
    /// Write the file and leave the browser closed
    #[arg(long)]
    no_open: bool,
}

pub fn run(args: &ViewArgs) -> anyhow::Result<()> {
    let folder = &args.run;
    let Ok(summary) = read_text(&folder.join(SUMMARY_FILE)) else {
        bail!(
            "{} is not a run folder (it has no summary.json). Give the folder that `dynvox run` \
             printed as its results",
            folder.display()
        );
    };
    let summary: serde_json::Value =
        serde_json::from_str(&summary).context("summary.json is damaged")?;
    let name = summary.get("dataset").and_then(serde_json::Value::as_str).unwrap_or("run");
    let viewer = viewer::fragment(folder, name, &Scene::read(folder, args.triangles)?)?;
    let page = page(&format!("dynvox: {name}"), &html! { h1 { (name) } (viewer) }).into_string();
    let out = args.out.clone().unwrap_or_else(|| folder.join(VIEWER_FILE));
    replace_whole(&out, |file| std::io::Write::write_all(file, page.as_bytes()))?;
    outln!("{}", out.display());
    if args.no_open { Ok(()) } else { show(&out) }
}

/// Opens a page in the browser.
///
/// # Errors
/// No browser can be started.
pub fn show(page: &Path) -> anyhow::Result<()> {
    open::that_detached(page).with_context(|| {
        format!("no browser can be started: open {} in one yourself", page.display())
    })
}
