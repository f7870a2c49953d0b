//! Motion of a fraction of a pixel, as a tracker finds it.

use super::*;

/// Half of the tracker's window, px.
const HALF_PX: usize = 4;

/// Grey level between pixels.
fn grey(image: &[u8], width: usize, [u, v]: [f64; 2]) -> f64 {
    let (column, row) = (u as usize, v as usize);
    let (right, down) = (u - column as f64, v - row as f64);
    let at = |x: usize, y: usize| f64::from(image[(row + y) * width + column + x]);
    (at(0, 0) * (1.0 - right) + at(1, 0) * right) * (1.0 - down)
        + (at(0, 1) * (1.0 - right) + at(1, 1) * right) * down
}

/// Displacement of a window by Lucas and Kanade's method, px; `None` where it has no corner.
fn track(from: &[u8], to: &[u8], width: usize, [u, v]: [usize; 2]) -> Option<[f64; 2]> {
    let window = || {
        (v - HALF_PX..=v + HALF_PX)
            .flat_map(move |y| (u - HALF_PX..=u + HALF_PX).map(move |x| (x, y)))
    };
    let slope = |x: usize, y: usize| {
        let at = |x: usize, y: usize| f64::from(from[y * width + x]);
        [0.5 * (at(x + 1, y) - at(x - 1, y)), 0.5 * (at(x, y + 1) - at(x, y - 1))]
    };
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for (x, y) in window() {
        let [across, down] = slope(x, y);
        (xx, xy, yy) = (xx + across * across, xy + across * down, yy + down * down);
    }
    let determinant = xx * yy - xy * xy;
    // The smaller eigenvalue is at least the determinant over the trace.
    if determinant < 4000.0 * (xx + yy) {
        return None;
    }
    let mut moved = [0.0; 2];
    for _ in 0..3 {
        let [mut right, mut down] = [0.0; 2];
        for (x, y) in window() {
            let there = grey(to, width, [x as f64 + moved[0], y as f64 + moved[1]]);
            let less = f64::from(from[y * width + x]) - there;
            let [across, along] = slope(x, y);
            (right, down) = (right + less * across, down + less * along);
        }
        moved[0] += (yy * right - xy * down) / determinant;
        moved[1] += (xx * down - xy * right) / determinant;
        // A window that runs away was no corner.
        if moved.iter().any(|part| part.abs() > 1.0) {
            return None;
        }
    }
    Some(moved)
}

/// Shares of the true motion that the tracker finds in windows of one depth, sorted.
fn shares(world: &dyn World, frames: [u32; 2]) -> Vec<f64> {
    let [from, to] = frames.map(|index| world.frame(index));
    let (width, rig) = (from.width, world.rig());
    let t_to_from = to.t_world_camera.inverse() * from.t_world_camera;
    let mut shares = Vec::new();
    for v in (HALF_PX + 2..from.height - HALF_PX - 2).step_by(2) {
        for u in (HALF_PX + 2..width - HALF_PX - 2).step_by(2) {
            let depth = |u: usize, v: usize| f64::from(from.depth_m[v * width + u]);
            let here = depth(u, v);
            let one_depth = (v - HALF_PX - 1..=v + HALF_PX + 1).all(|y| {
                (u - HALF_PX - 1..=u + HALF_PX + 1)
                    .all(|x| (depth(x, y) - here).abs() < 0.07 * here)
            });
            if here <= 0.0 || !one_depth {
                continue;
            }
            let pixel = |at: f64, center: f64| (at - center) / rig.focal_px * here;
            let point = t_to_from.transform_point([
                pixel(u as f64, rig.center_u_px),
                pixel(v as f64, rig.center_v_px),
                here,
            ]);
            let flow = [
                rig.focal_px * point[0] / point[2] + rig.center_u_px - u as f64,
                rig.focal_px * point[1] / point[2] + rig.center_v_px - v as f64,
            ];
            let square = flow[0] * flow[0] + flow[1] * flow[1];
            if !(0.0009..0.16).contains(&square) {
                continue;
            }
            if let Some(found) = track(&from.left_grey, &to.left_grey, width, [u, v]) {
                shares.push((found[0] * flow[0] + found[1] * flow[1]) / square);
            }
        }
    }
    shares.sort_by(f64::total_cmp);
    shares
}

#[test]
fn a_tracker_finds_motion_of_a_tenth_of_a_pixel() {
    let street = Street::new(StreetConfig {
        width: 400,
        height: 120,
        speed_m_s: 0.3,
        rate_hz: 30.0,
        shake: 0.0,
        noise_sigma: 0.0,
        ..StreetConfig::static_street()
    })
    .unwrap();
    // Walking pace: one frame, and two, move most of the picture by less than 0.2 px.
    for frames in [[0, 1], [2, 4]] {
        let shares = shares(&street, frames);
        let [low, middle, high] = [1, 2, 3].map(|part| shares[part * shares.len() / 4]);
        println!("{} windows: {low:.2}, {middle:.2}, {high:.2} of the motion", shares.len());
        assert!(shares.len() > 100);
        // The tracker's own bilinear picture makes it find a tenth too much.
        assert!((0.9..1.2).contains(&middle), "half of the windows find less than {middle}");
        assert!(high - low < 0.3, "a quarter finds less than {low}, another more than {high}");
    }
}

#[test]
fn a_tracker_finds_as_little_motion_in_rooms_and_yards() {
    for kind in [RoomKind::Room, RoomKind::Yard] {
        let config = RoomConfig {
            width: 320,
            height: 200,
            rate_hz: 600.0,
            turn_deg_s: 0.0,
            people: 0,
            noise_sigma: 0.0,
            bare_walls: 0.0,
            ..RoomConfig::default()
        };
        let room = Room::new(kind, config).unwrap();
        // A walk's turn and way in a six hundredth of a second are some tenths of a pixel.
        let shares = shares(&room, [0, 1]);
        let [low, middle, high] = [1, 2, 3].map(|part| shares[part * shares.len() / 4]);
        println!("{kind:?}, {} windows: {low:.2}, {middle:.2}, {high:.2}", shares.len());
        assert!(shares.len() > 40, "{kind:?}: {} windows", shares.len());
        assert!((0.9..1.2).contains(&middle), "{kind:?}: half of the windows find {middle}");
        assert!(high - low < 0.3, "{kind:?}: quarters find {low} and {high}");
    }
}
