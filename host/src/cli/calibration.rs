//! `dynvox calibration`.

use super::rectified::RectifiedArgs;
use crate::formats::calibration::{RectifiedSize, StereoCalibration, lens_table, to_toml};
use crate::owned::write_whole;
use crate::request::ImageSize;
use anyhow::Context;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{RawCamera, Rectification, TurnedCamera};
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct CalibrationArgs {
    /// Files of the calibration: one with both cameras, or the left camera's and the right one's
    /// (camodocal: and extrinsics.yaml)
    #[arg(required = true, num_args = 1..=3)]
    files: Vec<PathBuf>,
    /// Size of the raw images, where the files do not say it
    #[arg(long, value_name = "WxH")]
    image: Option<ImageSize>,
    #[command(flatten)]
    rectified: RectifiedArgs,
    /// Write the calibration as dynvox's own TOML, as `--calibration` takes it
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
}

pub fn run(args: &CalibrationArgs) -> anyhow::Result<()> {
    let files: Vec<&Path> = args.files.iter().map(PathBuf::as_path).collect();
    let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
    let image = args.image.map(|ImageSize(width, height)| [width, height].map(side));
    let calibration = StereoCalibration::read(&files, image)?;
    let sizing = args.rectified.over(RectifiedSize::default()).sizing();
    let sizing = sizing.map_err(|reason| {
        anyhow::anyhow!("{reason}. Give --rectified WxH, and --rectified-focal PX with it")
    })?;
    let shown = args.files.first().map(|path| path.display().to_string()).unwrap_or_default();
    let (rectification, rig) = calibration.rectify(sizing).map_err(|problem| {
        anyhow::anyhow!(
            "{shown} cannot be rectified: {problem}. Give another --rectified size, or \
                         check the calibration's numbers"
        )
    })?;
    print(&calibration, &rectification, &rig);
    if let Some(out) = &args.out {
        write_new(out, &to_toml(&calibration))?;
        outln!("{:<22}{}", "written", out.display());
    }
    Ok(())
}

/// Writes a new file; one that is there is left alone.
fn write_new(path: &Path, text: &str) -> anyhow::Result<()> {
    let hint = || format!("{} cannot be written. Give another path with --out", path.display());
    write_whole(path, |file| file.write_all(text.as_bytes())).with_context(hint)
}

fn print(calibration: &StereoCalibration, rectification: &Rectification, rig: &StereoRig) {
    let line = |name: &str, value: String| outln!("{name:<22}{value}");
    line("format", calibration.format.to_owned());
    for (name, camera) in [("left camera", &calibration.left), ("right camera", &calibration.right)]
    {
        let [fx, fy] = camera.lens.focal_px();
        let [cx, cy] = camera.lens.center_px();
        line(
            name,
            format!("{}, {} x {} px", camera.lens.model().name(), camera.width, camera.height),
        );
        line("", format!("focal length {fx:.2}, {fy:.2} px, centre {cx:.2}, {cy:.2} px"));
        line("", lens_table::shown(camera.lens.model(), 6));
        line("", field_of_view(camera));
    }
    line("baseline", format!("{:.4} m", calibration.baseline_m()));
    line("between the cameras", format!("{:.3} degrees", calibration.angle_deg()));
    line(
        "rectified",
        format!(
            "{} x {} px, focal length {:.2} px",
            rectification.width, rectification.height, rig.focal_px
        ),
    );
    let wide = |side: u32| 2.0 * (0.5 * f64::from(side) / rig.focal_px).atan().to_degrees();
    line(
        "",
        format!(
            "centre {:.2}, {:.2} px, about {:.0} x {:.0} degrees",
            rig.center_u_px,
            rig.center_v_px,
            wide(rectification.width),
            wide(rectification.height)
        ),
    );
    let [left, right] = [&rectification.left, &rectification.right]
        .map(|camera| invalid_share(camera, rectification, rig));
    line(
        "without image",
        format!(
            "{:.2} % of the left pixels, {:.2} % of the right ones",
            100.0 * left,
            100.0 * right
        ),
    );
}

/// Angles between the rays of opposite sides' middles.
fn field_of_view(camera: &RawCamera) -> String {
    let [cx, cy] = camera.lens.center_px();
    let last = |side: u32| f64::from(side) - 1.0;
    let angle = |a: [f64; 2], b: [f64; 2]| {
        let ([ax, ay, az], [bx, by, bz]) = (camera.lens.unproject(a)?, camera.lens.unproject(b)?);
        Some((ax * bx + ay * by + az * bz).clamp(-1.0, 1.0).acos().to_degrees())
    };
    let shown = |angle: Option<f64>| {
        angle.map_or("more than the model tells".to_owned(), |angle| format!("{angle:.1}"))
    };
    let across = angle([0.0, cy], [cx, cy])
        .zip(angle([cx, cy], [last(camera.width), cy]))
        .map(|(a, b)| a + b);
    let down = angle([cx, 0.0], [cx, cy])
        .zip(angle([cx, cy], [cx, last(camera.height)]))
        .map(|(a, b)| a + b);
    format!("field of view {} x {} degrees", shown(across), shown(down))
}

/// Share of the rectified pixels that no raw pixel covers.
fn invalid_share(camera: &TurnedCamera, rectification: &Rectification, rig: &StereoRig) -> f64 {
    let (width, height) = (rectification.width, rectification.height);
    let covered = |[u, v]: [f64; 2]| {
        u >= -0.5
            && v >= -0.5
            && u <= f64::from(camera.raw.width) - 0.5
            && v <= f64::from(camera.raw.height) - 0.5
    };
    let pixels = (0..height).flat_map(|v| (0..width).map(move |u| [f64::from(u), f64::from(v)]));
    let invalid =
        pixels.filter(|&pixel| !camera.raw_pixel(rig, pixel).is_some_and(covered)).count();
    invalid as f64 / (f64::from(width) * f64::from(height))
}
