//! How good are the maps for planners on the synthetic street? Occupancy, heights, slopes and kerbs
//! against exact geometry.
//!
//! `cargo run --release -p dynvox --example evaluate_planning -- WORDS`, where WORDS are any of
//! `exact`, `frames=40`, `hills=0.15`, `width=1242`, `seed=1`, `parked=0.6` and
//! `planning.KEY=VALUE`.
//!
//! The street has no traffic; poses are the true ones, so that the figures are those of the map and
//! not of the trajectory. Disparity is ELAS's, or the exact one with `exact`. Truth is what exact
//! depth shows within 15 m over all frames: a cell with three or more surface points is occupied, a
//! cell seen through and without any is free; the lowest 5 cm of surface points of a column are its
//! ground.

use dynvox::synth::{Street, StreetConfig};
use dynvox_core::planning::{Cell, CellState};
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame, image::View, memory::SLAB_ALIGN};
use std::collections::HashMap;

/// Farthest surface that counts, m.
const FAR_M: f64 = 15.0;
/// Surface points that make a cell occupied in truth.
const POINTS_MIN: u32 = 3;
/// A kerb of the street, m, less what its own columns average away.
const KERB_FOUND_M: f32 = 0.06;

#[derive(Default)]
struct Truth {
    points: HashMap<Cell, u32>,
    free: HashMap<Cell, ()>,
    /// Heights of surface points by column.
    columns: HashMap<[i32; 2], Vec<f32>>,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| {
        arguments
            .iter()
            .find_map(|argument| argument.strip_prefix(&format!("{name}="))?.parse::<f64>().ok())
    };
    let exact = arguments.iter().any(|argument| argument == "exact");
    let width = value("width").unwrap_or(1242.0) as u32;
    // A static street: the figures are those of the map, not of moving cars.
    let street = Street::new(StreetConfig {
        width,
        height: width * 375 / 1242,
        hills: value("hills").unwrap_or(0.0),
        seed: value("seed").unwrap_or(1.0) as u64,
        speed_m_s: 5.0,
        parked_density: value("parked").unwrap_or(0.6),
        ..StreetConfig::static_street()
    })?;
    let frames = value("frames").unwrap_or(40.0) as u32;
    let capacity = Capacity {
        image_width: street.config().width as usize,
        image_height: street.config().height as usize,
        blocks: 120_000,
        visible_blocks: 60_000,
        planning_width: 200,
        planning_length: 200,
        planning_height: 40,
        ..Capacity::ONBOARD
    };
    let mut config = Config::for_rig(street.rig());
    (config.planning.below_m, config.planning.far_m) = (4.5, FAR_M as f32);
    config.segmentation.enabled = false;
    // Settings on the command line, to see what each is worth.
    for setting in
        arguments.iter().filter(|argument| argument.contains('.') && argument.contains('='))
    {
        let (key, value) = setting.split_once('=').unwrap_or_default();
        if key.contains('.') {
            config.set(key, value)?;
        }
    }
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&capacity, &config, &mut slab)?;
    let mut truth = Truth::default();
    for index in 0..frames {
        let frame = street.frame(index);
        let (width, height) = (frame.width, frame.height);
        let focal_baseline = street.rig().focal_baseline_px_m();
        let disparity: Vec<u16> = frame
            .depth_m
            .iter()
            .map(|depth| {
                if *depth > 0.0 {
                    (256.0 * focal_baseline / f64::from(*depth) + 0.5).min(65_535.0) as u16
                } else {
                    0
                }
            })
            .collect();
        let view =
            |pixels| View::new(pixels, width, height).ok_or(anyhow::anyhow!("an empty image"));
        let pair = StereoFrame::pair(view(&frame.left_grey)?, view(&frame.right_grey)?);
        let disparity_q8 = if exact { View::new(&disparity, width, height) } else { None };
        mapper.step(
            &StereoFrame { t_world_camera: Some(frame.t_world_camera), disparity_q8, ..pair },
            &Serial,
        )?;
        truth.add(&mapper, &street, &frame);
    }
    // Only the update is timed.
    let begin = std::time::Instant::now();
    let report = mapper.update_planning_maps(0.0);
    println!(
        "{report:?}, {:.1} ms, digest {:016x}",
        begin.elapsed().as_secs_f64() * 1e3,
        mapper.planning().digest()
    );
    truth.occupancy(&mapper);
    truth.heights(&mapper);
    Ok(())
}

impl Truth {
    /// Takes in what a frame's exact depth shows.
    fn add(&mut self, mapper: &Mapper<'_>, street: &Street, frame: &dynvox::synth::SynthFrame) {
        let (rig, planning) = (street.rig(), mapper.planning());
        let grid = planning.grid();
        for (at, depth) in frame
            .depth_m
            .iter()
            .enumerate()
            .filter(|(_, depth)| **depth > 0.0 && f64::from(**depth) < FAR_M)
        {
            let (u, v, z) =
                ((at % frame.width) as f64, (at / frame.width) as f64, f64::from(*depth));
            let point = [
                (u - rig.center_u_px) * z / rig.focal_px,
                (v - rig.center_v_px) * z / rig.focal_px,
                z,
            ];
            let at = grid.of_world(frame.t_world_camera.transform_point(point));
            let Some(cell) = grid.cell_at(at) else { continue };
            *self.points.entry(cell).or_default() += 1;
            self.columns
                .entry([cell[0], cell[1]])
                .or_default()
                .push((at[2] * grid.cell_m()) as f32);
        }
        // Cells of the window that this frame sees through.
        let (origin, size, half_m) =
            (planning.origin(), planning.size().map(|side| side as i32), 0.87 * grid.cell_m());
        let t_camera_world = frame.t_world_camera.inverse();
        for cell in (0..size[1])
            .flat_map(|y| (0..size[0]).flat_map(move |x| (0..size[2]).map(move |z| [x, y, z])))
        {
            let cell = [0, 1, 2].map(|axis| origin[axis] + cell[axis]);
            let [x, y, z]: [f64; 3] =
                t_camera_world.transform_point(grid.to_world(cell.map(|c| f64::from(c) + 0.5)));
            // Beyond this range the planner is not asked.
            if !(0.5..=FAR_M).contains(&z) {
                continue;
            }
            let (u, v) = (
                x * rig.focal_px / z + rig.center_u_px + 0.5,
                y * rig.focal_px / z + rig.center_v_px + 0.5,
            );
            let inside =
                u >= 0.0 && v >= 0.0 && (u as usize) < frame.width && (v as usize) < frame.height;
            if inside
                && f64::from(frame.depth_m[v as usize * frame.width + u as usize]) > z + half_m
            {
                self.free.insert(cell, ());
            }
        }
    }

    fn occupancy(&self, mapper: &Mapper<'_>) {
        let planning = mapper.planning();
        let (origin, size) = (planning.origin(), planning.size().map(|side| side as i32));
        let within =
            |cell: &Cell| (0..3).all(|axis| (0..size[axis]).contains(&(cell[axis] - origin[axis])));
        let is_occupied = |cell: Cell| planning.cell(cell).0 == CellState::Occupied;
        let beside = |cell: Cell| {
            (-1..=1).flat_map(move |x| {
                (-1..=1).flat_map(move |y| {
                    (-1..=1).map(move |z| [cell[0] + x, cell[1] + y, cell[2] + z])
                })
            })
        };
        // A few stray points do not make a cell occupied.
        let occupied: Vec<Cell> = self
            .points
            .iter()
            .filter(|(cell, points)| **points >= POINTS_MIN && within(cell))
            .map(|(cell, _)| *cell)
            .collect();
        let found = occupied.iter().filter(|cell| is_occupied(**cell)).count();
        let near = occupied.iter().filter(|cell| beside(**cell).any(is_occupied)).count();
        let free: Vec<Cell> = self
            .free
            .keys()
            .filter(|cell| !self.points.contains_key(*cell) && within(cell))
            .copied()
            .collect();
        let wrong = free.iter().filter(|cell| is_occupied(**cell)).count();
        // Not beside a surface, where a few centimetres make the difference.
        let apart: Vec<Cell> = free
            .iter()
            .copied()
            .filter(|cell| !beside(*cell).any(|other| self.points.contains_key(&other)))
            .collect();
        let wrong_apart = apart.iter().filter(|cell| is_occupied(**cell)).count();
        let free_found =
            free.iter().filter(|cell| planning.cell(**cell).0 == CellState::Free).count();
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        println!(
            "occupied cells {}: found {:.4}, within one cell {:.4}",
            occupied.len(),
            share(found, occupied.len()),
            share(near, occupied.len())
        );
        println!(
            "free cells {}: called occupied {:.4}, called free {:.4}",
            free.len(),
            share(wrong, free.len()),
            share(free_found, free.len())
        );
        println!(
            "free cells apart from surfaces {}: called occupied {:.4}",
            apart.len(),
            share(wrong_apart, apart.len())
        );
        // Cells that no frame saw at any distance: left and right behind the camera, below the
        // ground.
        let all = (0..size[0])
            .flat_map(|x| (0..size[1]).flat_map(move |y| (0..size[2]).map(move |z| [x, y, z])));
        let all = all.map(|cell| [0, 1, 2].map(|axis| origin[axis] + cell[axis]));
        let unseen: Vec<Cell> = all
            .filter(|cell| {
                !self.free.contains_key(cell)
                    && !beside(*cell).any(|near| {
                        self.points.contains_key(&near) || self.free.contains_key(&near)
                    })
            })
            .collect();
        let unknown =
            unseen.iter().filter(|cell| planning.cell(**cell).0 == CellState::Unknown).count();
        println!(
            "cells that nothing within {FAR_M} m was seen of {}: called unknown {:.4}",
            unseen.len(),
            share(unknown, unseen.len())
        );
    }

    /// Ground of a column in truth: the mean of its lowest surface points, if it has some.
    fn ground(&self, column: [i32; 2]) -> Option<f32> {
        let heights = self.columns.get(&column).filter(|heights| heights.len() >= 20)?;
        let lowest = heights.iter().copied().fold(f32::INFINITY, f32::min);
        let low: Vec<f32> =
            heights.iter().copied().filter(|height| *height < lowest + 0.05).collect();
        Some(low.iter().sum::<f32>() / low.len() as f32)
    }

    fn heights(&self, mapper: &Mapper<'_>) {
        let planning = mapper.planning();
        let (origin, size) = (planning.origin(), planning.size().map(|side| side as i32));
        let cell_m = planning.grid().cell_m() as f32;
        let (mut errors, mut slopes, mut kerbs, mut found, mut flat, mut wrong) =
            (Vec::new(), Vec::new(), 0, 0, 0, 0);
        let mut missed = 0;
        for (x, y) in (3..size[1] - 3)
            .flat_map(|y| (3..size[0] - 3).map(move |x| (x + origin[0], y + origin[1])))
        {
            let Some(truth) = self.ground([x, y]) else { continue };
            let Some(column) = planning.column([x, y, 0]) else { continue };
            let beside = |dx: i32, dy: i32| self.ground([x + dx, y + dy]);
            let around: Vec<(f32, f32, f32)> = (-2..=2)
                .flat_map(|dy| (-2..=2).map(move |dx| (dx, dy)))
                .filter_map(|(dx, dy)| Some((dx as f32, dy as f32, beside(dx, dy)?)))
                .collect();
            // A plane needs its whole surroundings.
            if around.len() < 25 {
                continue;
            }
            let plane = plane(&around);
            let spread = around
                .iter()
                .map(|(dx, dy, height)| (height - plane[0] - plane[1] * dx - plane[2] * dy).abs())
                .fold(0.0, f32::max);
            let sides = |dx: i32, dy: i32| Some((beside(dx, dy)? - beside(-dx, -dy)?).abs());
            let step = sides(1, 0).unwrap_or(0.0).max(sides(0, 1).unwrap_or(0.0));
            let Some(height) = column.ground_m() else {
                missed += 1;
                continue;
            };
            // A step of 10 to 20 cm on otherwise even ground is a kerb.
            if (0.1..0.2).contains(&step) && spread < 0.2 {
                // A kerb runs through this column or the one beside it.
                kerbs += 1;
                let near = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]
                    .map(|[dx, dy]| planning.column([x + dx, y + dy, 0]));
                found +=
                    usize::from(near.iter().flatten().any(|column| column.step_m >= KERB_FOUND_M));
            } else if spread < 0.03 {
                errors.push(height - truth);
                flat += 1;
                wrong += usize::from(column.step_m >= KERB_FOUND_M);
                if column.slope().is_some() {
                    let degrees = |rise: [f32; 2]| rise.map(|rise| rise.atan().to_degrees());
                    let (own, true_one) =
                        (degrees(column.slope), degrees([plane[1] / cell_m, plane[2] / cell_m]));
                    slopes.push((own[0] - true_one[0]).hypot(own[1] - true_one[1]));
                }
            }
        }
        print_heights(errors, slopes, missed);
        println!(
            "kerb columns {kerbs}: found {:.3}; of {flat} even columns called kerb {:.4}",
            f64::from(found as u32) / f64::from(kerbs.max(1)),
            wrong as f64 / flat.max(1) as f64
        );
    }
}

/// Errors of heights, m, and of slopes, degrees.
fn print_heights(mut errors: Vec<f32>, mut slopes: Vec<f32>, missed: usize) {
    // The mean keeps its sign: a bias shows in it alone.
    let bias = errors.iter().sum::<f32>() / errors.len().max(1) as f32;
    errors.iter_mut().for_each(|error| *error = error.abs());
    for values in [&mut errors, &mut slopes] {
        values.sort_by(f32::total_cmp);
    }
    let at = |values: &[f32], share: f64| {
        values.get((values.len() as f64 * share) as usize).copied().unwrap_or(f32::NAN)
    };
    println!(
        "ground columns {}: height error median {:.3} m, 95 % {:.3} m, mean {bias:.3} m; {missed} \
         without ground",
        errors.len(),
        at(&errors, 0.5),
        at(&errors, 0.95)
    );
    let within =
        slopes.iter().filter(|error| **error <= 2.0).count() as f64 / slopes.len().max(1) as f64;
    println!(
        "slopes {}: error median {:.2} degrees, 95 % {:.2}, within 2 degrees {within:.3}",
        slopes.len(),
        at(&slopes, 0.5),
        at(&slopes, 0.95)
    );
}

/// Height in the middle and rise per column to the right and ahead of a plane through points of a
/// whole square.
fn plane(around: &[(f32, f32, f32)]) -> [f32; 3] {
    let n = around.len() as f32;
    let sum = |of: &dyn Fn(&(f32, f32, f32)) -> f32| around.iter().map(of).sum::<f32>();
    let (xx, yy) = (sum(&|(x, ..)| x * x), sum(&|(_, y, _)| y * y));
    [sum(&|(.., z)| *z) / n, sum(&|(x, _, z)| x * z) / xx, sum(&|(_, y, z)| y * z) / yy]
}
