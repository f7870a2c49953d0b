//! `dynvox calibration`.

mod describe;
mod picture;

use super::rectified::RectifiedArgs;
use crate::formats::calibration::{
    CalibrationFiles, CalibrationHints, CalibrationRead, RectifiedSize, to_toml,
};
use crate::input::{self, FrameSource, OpenOptions, diagnosis};
use crate::owned::write_whole;
use crate::request::ImageSize;
use anyhow::Context;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct CalibrationArgs {
    /// Files of the calibration: one with both cameras, or the left camera's and the right one's,
    /// and how they stand in a third
    #[arg(required = true, num_args = 1..=4)]
    files: Vec<PathBuf>,
    /// Size of the raw images, where the files do not say it
    #[arg(long, value_name = "WxH", conflicts_with = "images")]
    image: Option<ImageSize>,
    /// Images of these cameras: tells how well their rows agree, and draws a rectified pair
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// File of that picture, which must be new [default: rectified_pair.png, or with a number]
    #[arg(long, value_name = "FILE.png", requires = "images")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    hints: CalibrationHints,
    #[command(flatten)]
    rectified: RectifiedArgs,
    /// Write the calibration as dynvox's own TOML, as `--calibration` takes it
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
}

pub fn run(args: &CalibrationArgs) -> anyhow::Result<()> {
    let size = args.rectified.over(RectifiedSize::default());
    let sizing = size.sizing().map_err(|reason| {
        anyhow::anyhow!("{reason}. Give --rectified WxH, and --rectified-focal PX with it")
    })?;
    let source = args.images.as_deref().map(|images| opened(args, images, size)).transpose()?;
    let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let image = match &source {
        Some(source) => Some(raw_size(source.as_ref())),
        None => args.image.map(|ImageSize(width, height)| [width, height].map(side)),
    };
    let files = CalibrationFiles::read(&args.files, args.hints)?;
    let read = files.cameras(image)?;
    outln!("{}", read.sentence());
    let guesses = match &source {
        Some(source) => source.notes().to_vec(),
        None => read.guesses.clone(),
    };
    guesses.iter().filter(|note| note.starts_with("guess")).for_each(|note| outln!("{note}"));
    describe::print(&read, image, sizing)?;
    if let Some(source) = &source {
        print_images(source.as_ref(), args.picture.as_deref())?;
    }
    if let Some(out) = &args.out {
        write_new(out, &own_format(&read, image)?)?;
        outln!("{:<22}{}", "written", out.display());
    }
    Ok(())
}

/// Images with the calibration that is explained.
fn opened(
    args: &CalibrationArgs,
    images: &Path,
    rectified: RectifiedSize,
) -> anyhow::Result<Box<dyn FrameSource>> {
    let options = OpenOptions {
        calibration: args.files.clone(),
        hints: args.hints,
        rectified,
        ..OpenOptions::default()
    };
    Ok(input::open(images, &options)?)
}

/// Size of the images in the files, px.
fn raw_size(source: &dyn FrameSource) -> [u32; 2] {
    let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let (width, height) = source.size();
    source
        .rectification()
        .map_or([side(width), side(height)], |raw| [raw.left.raw.width, raw.left.raw.height])
}

/// Prints how well the rows of images agree, what is wrong with them, and where a picture of a
/// rectified pair is.
fn print_images(source: &dyn FrameSource, picture: Option<&Path>) -> anyhow::Result<()> {
    let all: Vec<usize> = (0..source.len()).collect();
    let rows = diagnosis::row_error(source, &all)?;
    let rows = rows.map_or("too few matches to tell".to_owned(), |rows| {
        format!(
            "rows agree to {:.2} px (median); right images {:+.2} px low, turned {:+.3} degrees",
            rows.median_px, rows.shift_px, rows.roll_deg
        )
    });
    outln!("{:<22}{rows}", "images");
    for finding in diagnosis::examine(source, &all)? {
        outln!("{:<22}{}", if finding.refused { "refused" } else { "warning" }, finding.message);
    }
    let drawn = picture::draw(source)?;
    let path = picture::write(&drawn, picture)?;
    outln!("{:<22}{}", "picture", path.display());
    Ok(())
}

/// The calibration as a file of dynvox's own.
fn own_format(read: &CalibrationRead, image: Option<[u32; 2]>) -> anyhow::Result<String> {
    Ok(to_toml(&read.raw(image)?))
}

/// Writes a new file; one that is there is left alone.
fn write_new(path: &Path, text: &str) -> anyhow::Result<()> {
    let hint = || format!("{} cannot be written. Give another path with --out", path.display());
    write_whole(path, |file| file.write_all(text.as_bytes())).with_context(hint)
}
