//! `dynvox evaluate masks`.

use crate::evaluate::masks::{AreaFigures, FOUND_IOU, FileFigures, compare};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct MasksArgs {
    /// Folder of instance PNGs, as `dynvox run --save-instances` writes them
    found: PathBuf,
    /// Folder of true ones of the same names
    truth: PathBuf,
    /// Write the figures to standard output as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &MasksArgs) -> anyhow::Result<()> {
    let figures = compare(&args.found, &args.truth)?;
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&figures)?);
    } else {
        print_figures(&figures);
    }
    Ok(())
}

fn print_figures(figures: &FileFigures) {
    outln!("{:<16}{:>6}{:>10}{:>8}{:>8}", "frame", "mask", "pixels", "truth", "IoU");
    for one in &figures.found {
        let (truth, iou) =
            one.best.map_or(("-".to_owned(), 0.0), |(truth, iou)| (truth.to_string(), iou));
        outln!("{:<16}{:>6}{:>10}{truth:>8}{iou:>8.3}", one.frame, one.id, one.pixels);
    }
    outln!(
        "{} frames; {} masks, {} of them with an IoU below {FOUND_IOU}",
        figures.frames,
        figures.found.len(),
        figures.false_masks
    );
    for area in &figures.truth {
        outln!("{}", area_line(area));
    }
}

fn area_line(area: &AreaFigures) -> String {
    let AreaFigures { pixels_min, masks, found, mean_iou, mean_iou_found } = area;
    let number = |iou: &Option<f64>| iou.map_or_else(|| "-".to_owned(), |iou| format!("{iou:.3}"));
    format!(
        "true masks over {pixels_min} px: {found} of {masks} found; mean IoU {}, of those found {}",
        number(mean_iou),
        number(mean_iou_found)
    )
}
