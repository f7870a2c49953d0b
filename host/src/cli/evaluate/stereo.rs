//! `dynvox evaluate stereo`.

use crate::evaluate::stereo::{
    BAD_PX, Estimate, Frontier, FrontierRow, PartFigures, StereoCounts, StereoFigures, StereoPair,
    filled, find_stereo_set,
};
use crate::formats::{
    Image, read_picture, read_png_deep, read_png_u16, write_png_bytes, write_png_deep,
};
use crate::observe::pictures;
use crate::owned::{self, create_folder};
use crate::request::Settings;
use crate::run::Threads;
use crate::slab::HostSlab;
use anyhow::{Context, bail};
use dynvox_core::Capacity;
use dynvox_core::memory::Carver;
use dynvox_core::stereo::{StereoConfig, StereoMatcher};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Names of the regions: what both cameras see and all, each whole, its background and its
/// foreground.
const REGIONS: [&str; 6] =
    ["noc", "noc_background", "noc_foreground", "occ", "occ_background", "occ_foreground"];

#[derive(Debug, clap::Args)]
pub struct StereoArgs {
    /// Folder of KITTI 2012 (image_0, image_1, disp_noc, disp_occ) or 2015 (image_2, image_3,
    /// disp_noc_0, disp_occ_0, obj_map), or the one with its training/
    folder: PathBuf,
    /// Evaluate another program's disparities instead: 16-bit PNG (value / 256 px, 0 none) of the
    /// images' names
    #[arg(long, value_name = "DIR")]
    disparity: Option<PathBuf>,
    /// Settings from a file; config.toml of a run is one
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One setting of the matcher, as in --set stereo.texture_min=10; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print coverage and error by least confidence, as stereo.min_confidence would leave them
    #[arg(long, conflicts_with = "disparity")]
    frontier: bool,
    /// Write the disparities (16-bit PNG, value / 256 px, 0 none; odd values were filled in),
    /// pictures of their errors and, with --frontier or stereo.min_confidence, their confidences
    /// (8-bit PNG, 0 none) into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads; the result does not depend on them
    #[arg(long, default_value_t = 2, value_name = "N")]
    threads: usize,
    /// Write the figures to standard output as JSON
    #[arg(long)]
    json: bool,
}

/// Figures of a benchmark.
#[derive(Serialize)]
struct Found {
    benchmark: &'static str,
    pairs: usize,
    regions: std::collections::BTreeMap<&'static str, StereoFigures>,
    /// Coverage and error by least confidence; of what both cameras see, where that is known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    frontier: Vec<FrontierRow>,
}

/// Disparities of a pair and, if they were asked for, their confidences.
struct Matched {
    disparity_q8: Image<u16>,
    confidence: Option<Image<u8>>,
}

pub fn run(args: &StereoArgs) -> anyhow::Result<()> {
    let set = find_stereo_set(&args.folder)?;
    let mut config = Settings::resolve(args.config.as_deref(), &args.set)?.stereo();
    if args.frontier {
        // Of 1, all are kept.
        config.min_confidence = config.min_confidence.max(1);
    }
    if args.threads == 0 {
        bail!("--threads begins at 1. Give a larger number");
    }
    let threads = Threads::new(args.threads)?;
    let mut counts = [StereoCounts::default(); REGIONS.len()];
    let mut frontier = Frontier::default();
    for pair in &set.pairs {
        let Matched { disparity_q8: given, confidence } = match &args.disparity {
            Some(folder) => Matched {
                disparity_q8: read_png_deep(&folder.join(format!("{}.png", pair.name)))?,
                confidence: None,
            },
            None => threads.run(|| matched(pair, &config, &threads))?,
        };
        let whole = filled(&given);
        count(
            pair,
            &Estimate { given: &given, filled: &whole, marked: args.disparity.is_none() },
            &mut counts,
        )?;
        if let Some(folder) = &args.out {
            write(folder, pair, &given, args.disparity.is_none())?;
            if let Some(confidence) = &confidence {
                write_png_bytes(&folder.join(format!("{}_confidence.png", pair.name)), confidence)?;
            }
        }
        if let (Some(confidence), Some(truth)) = (&confidence, pair.truth.iter().flatten().next()) {
            frontier.add(&read_png_deep(truth)?, &given, confidence);
        }
    }
    let regions = REGIONS
        .into_iter()
        .zip(counts)
        .filter_map(|(name, counts)| Some((name, counts.figures()?)))
        .collect();
    let frontier = if args.frontier { frontier.rows() } else { Vec::new() };
    let found = Found { benchmark: set.name, pairs: set.pairs.len(), regions, frontier };
    if args.json {
        outln!("{}", serde_json::to_string_pretty(&found)?);
    } else {
        print_figures(&found);
    }
    Ok(())
}

/// The core's own disparity of a pair.
fn matched(pair: &StereoPair, config: &StereoConfig, threads: &Threads) -> anyhow::Result<Matched> {
    let [left, right] = [
        read_picture(&pair.images[0])?.to_8_bit(None).grey,
        read_picture(&pair.images[1])?.to_8_bit(None).grey,
    ];
    let (width, height) = (left.width(), left.height());
    if (right.width(), right.height()) != (width, height) {
        bail!(
            "{} and {} differ in size. Fetch the pair anew",
            pair.images[0].display(),
            pair.images[1].display()
        );
    }
    let capacity = Capacity { image_width: width, image_height: height, ..Capacity::SMALL };
    let bytes = StereoMatcher::bytes(&capacity);
    let Some(mut slab) = HostSlab::map(bytes) else {
        bail!("this machine has no {bytes} bytes for an image of {width} x {height} px")
    };
    let refused = |reason: String| {
        anyhow::anyhow!("{} cannot be matched: {reason}", pair.images[0].display())
    };
    let mut carver =
        Carver::new(slab.bytes_mut(), bytes).map_err(|error| refused(format!("{error:?}")))?;
    let mut matcher = StereoMatcher::new_in(&capacity, &mut carver);
    carver.check().map_err(|error| refused(format!("{error:?}")))?;
    let (Some(left), Some(right)) = (left.view(), right.view()) else {
        return Err(refused("it has no pixels".into()));
    };
    // A pair that cannot be matched covers nothing: that shows in the figures.
    matcher.compute(config, left, right, threads);
    Ok(Matched {
        disparity_q8: Image::from_view(&matcher.disparity_q8()),
        confidence: matcher.confidence().as_ref().map(Image::from_view),
    })
}

/// Counts a pair in every region it has truth for.
fn count(
    pair: &StereoPair,
    estimate: &Estimate<'_>,
    counts: &mut [StereoCounts; REGIONS.len()],
) -> anyhow::Result<()> {
    let given = estimate.given;
    let same = |path: &Path, image: &Image<u16>| {
        if (image.width(), image.height()) == (given.width(), given.height()) {
            return Ok(());
        }
        let sizes =
            [image, given].map(|image| format!("{} x {} px", image.width(), image.height()));
        bail!(
            "{} is {}, but the disparity {}. Fetch one of them anew",
            path.display(),
            sizes[0],
            sizes[1]
        )
    };
    let objects = pair.objects.as_deref().map(read_png_u16).transpose()?;
    if let (Some(path), Some(objects)) = (&pair.objects, &objects) {
        same(path, objects)?;
    }
    for (path, counts) in pair.truth.iter().zip(counts.chunks_exact_mut(REGIONS.len() / 2)) {
        let (Some(path), [all, background, foreground]) = (path, counts) else { continue };
        let truth = read_png_deep(path)?;
        same(path, &truth)?;
        all.add(&truth, estimate, |_| true);
        if let Some(objects) = &objects {
            let is_object = |at: usize| objects.pixels().get(at).is_some_and(|&object| object > 0);
            background.add(&truth, estimate, |at| !is_object(at));
            foreground.add(&truth, estimate, is_object);
        }
    }
    Ok(())
}

/// Writes a pair's disparities, and its errors over the left image.
fn write(folder: &Path, pair: &StereoPair, given: &Image<u16>, marked: bool) -> anyhow::Result<()> {
    create_folder(folder)
        .with_context(|| format!("{} cannot be made. Check --out", folder.display()))?;
    let path = |ending: &str| folder.join(format!("{}{ending}.png", pair.name));
    write_png_deep(&path(""), given)?;
    let Some(truth) = pair.truth.iter().rev().flatten().next() else { return Ok(()) };
    let truth = read_png_deep(truth)?;
    let left = read_picture(&pair.images[0])?.to_8_bit(None).grey;
    if let (Some(left), Some(truth), Some(given)) = (left.view(), truth.view(), given.view()) {
        let path = path("_errors");
        owned::write(&path, &pictures::disparity_errors(&left, &truth, &given, marked))
            .with_context(|| format!("{} cannot be written. Check --out", path.display()))?;
    }
    Ok(())
}

fn print_figures(found: &Found) {
    outln!(
        "{}: {} pairs. Percent of the pixels with an estimate; after the bar of all, holes filled \
         as the benchmark does",
        found.benchmark,
        found.pairs
    );
    out!("{:<16}{:>11}{:>10}{:>18}", "region", "pixels", "coverage", "D1");
    BAD_PX.iter().for_each(|px| out!("{:>18}", format!("> {px} px")));
    outln!("{:>12}{:>10}", "mean |e|", "mean e");
    for (name, of) in REGIONS.iter().filter_map(|name| Some((name, found.regions.get(name)?))) {
        let both =
            |given: f64, filled: f64| format!("{:.2} | {:.2}", 100.0 * given, 100.0 * filled);
        out!(
            "{name:<16}{:>11}{:>9.2}%{:>18}",
            of.pixels,
            100.0 * of.coverage,
            both(of.d1, of.d1_filled)
        );
        of.bad
            .iter()
            .zip(of.bad_filled)
            .for_each(|(given, filled)| out!("{:>18}", both(*given, filled)));
        outln!("{:>9.3} px{:>7.3} px", of.mean_error_px, of.mean_signed_error_px);
        print_part("  measured", of.measured.as_ref().filter(|_| of.filled_in.is_some()));
        print_part("  filled in", of.filled_in.as_ref());
    }
    if !found.frontier.is_empty() {
        outln!("\n{:<16}{:>11}{:>10}{:>10}", "least confidence", "coverage", "D1", "> 3 px");
    }
    for row in &found.frontier {
        let [coverage, d1, bad] = [row.coverage, row.d1, row.bad].map(|share| 100.0 * share);
        outln!("{:<16}{coverage:>10.2}%{d1:>9.2}%{bad:>9.2}%", row.min_confidence);
    }
}

/// A line for a part of a region's estimates.
fn print_part(name: &str, part: Option<&PartFigures>) {
    let Some(part) = part else { return };
    out!(
        "{name:<16}{:>11}{:>9.2}%{:>18}",
        "",
        100.0 * part.coverage,
        format!("{:.2}       ", 100.0 * part.d1)
    );
    part.bad.iter().for_each(|bad| out!("{:>18}", format!("{:.2}        ", 100.0 * bad)));
    outln!("");
}
