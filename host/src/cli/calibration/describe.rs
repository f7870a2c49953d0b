//! A calibration in words.

use crate::formats::calibration::{CalibrationRead, Cameras, StereoCalibration, lens_table};
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{RawCamera, Rectification, Sizing, TurnedCamera};

/// Largest disparity that the matcher looks for by default, px.
const NEAREST_PX: f64 = 255.0;

/// Prints the cameras, what they show after rectification, and at which depths.
pub fn print(
    read: &CalibrationRead,
    image: Option<[u32; 2]>,
    sizing: Sizing,
) -> anyhow::Result<()> {
    line("format", read.format.to_owned());
    if let Cameras::Rectified(cameras) = &read.cameras
        && cameras.offset_px == 0.0
    {
        print_rectified(&cameras.rig, cameras.size.or(image));
        return Ok(());
    }
    let calibration = read.raw(image)?;
    let (rectification, rig) = calibration.rectify(sizing).map_err(|problem| {
        anyhow::anyhow!(
            "{} cannot be rectified: {problem}. Give another --rectified size, or check the \
             calibration's numbers",
            read.path.display()
        )
    })?;
    print_raw(&calibration, &rectification, &rig);
    Ok(())
}

fn line(name: &str, value: String) {
    outln!("{name:<22}{value}");
}

/// Angle that so many pixels show, degrees.
fn angle_deg(side: u32, focal_px: f64) -> f64 {
    2.0 * (0.5 * f64::from(side) / focal_px).atan().to_degrees()
}

/// Prints cameras whose images come rectified.
fn print_rectified(rig: &StereoRig, size: Option<[u32; 2]>) {
    line("baseline", format!("{:.4} m", rig.baseline_m));
    let size_shown = size.map_or(String::new(), |[w, h]| format!("{w} x {h} px, "));
    line("rectified", format!("{size_shown}focal length {:.2} px", rig.focal_px));
    let (u, v) = (rig.center_u_px, rig.center_v_px);
    let angles = size.map_or(String::new(), |[w, h]| {
        let (across, down) = (angle_deg(w, rig.focal_px), angle_deg(h, rig.focal_px));
        format!(", about {across:.0} x {down:.0} degrees")
    });
    line("", format!("centre {u:.2}, {v:.2} px{angles}"));
    print_depth(rig);
}

/// Prints the depths that a rig measures well.
fn print_depth(rig: &StereoRig) {
    let product = rig.focal_px * rig.baseline_m;
    line(
        "useful depth",
        format!(
            "{:.2} m (a disparity of {NEAREST_PX:.0} px) to {:.1} m (a quarter of a pixel is 5 % \
             of it)",
            product / NEAREST_PX,
            product * 0.05 / 0.25
        ),
    );
}

fn print_raw(calibration: &StereoCalibration, rectification: &Rectification, rig: &StereoRig) {
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
    line(
        "",
        format!(
            "centre {:.2}, {:.2} px, about {:.0} x {:.0} degrees",
            rig.center_u_px,
            rig.center_v_px,
            angle_deg(rectification.width, rig.focal_px),
            angle_deg(rectification.height, rig.focal_px)
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
    print_depth(rig);
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
