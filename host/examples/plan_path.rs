//! How does a planner use the maps? A* over the distance field, around parked and moving cars, on
//! seeded streets.
//!
//! `cargo run --release -p dynvox --example plan_path -- [streets=100] [frames=16] [out=DIR] [planning.KEY=VALUE]`
//!
//! A robot of 0.4 m radius stands where the camera is after a second and a half and moves to a goal
//! 11 m ahead at 4 m/s, or to the nearest place beside it that is clear. The path is planned once,
//! on what stereo images alone showed until then, with moving cars where they are predicted to be
//! at the time the robot gets to a place. Then it is followed past the street's exact cars and
//! walls, and compared with the path that the same planner finds to the same goal on the exact
//! geometry.

use dynvox::observe::{WindowCamera, write_planning};
use dynvox::synth::{
    CAMERA_HEIGHT_M, CarKind, Lane, MovingTraffic, ScriptedCar, SpeedProfile, Street, StreetConfig,
    SynthFrame, Traffic,
};
use dynvox_core::memory::{Carver, SLAB_ALIGN};
use dynvox_core::planning::DistanceField;
use dynvox_core::random::Random;
use dynvox_core::{Capacity, Config, Mapper, Serial, StereoFrame, image::View};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

const SIDE: usize = 160;
const RADIUS_M: f64 = 0.4;
/// Distance that a planner keeps from obstacles, m: the radius, and a cell for the grid's
/// resolution.
const CLEAR_M: f64 = 0.65;
const SPEED_M_S: f64 = 4.0;
const HORIZON_S: usize = 8;
/// Fields a second.
const RATE: f64 = 2.0;
/// Sideways and ahead, m, from the camera.
const GOALS: [[f64; 2]; 4] = [[0.0, 11.0], [-3.0, 11.0], [-1.5, 11.0], [-3.5, 9.0]];

/// Distances to obstacles in metres, over the same columns at several times; columns by x, then y.
struct Fields {
    cell_m: f64,
    at: Vec<Vec<f32>>,
}

/// A* from cell to cell: the shortest way on which the robot keeps clear of everything at the time
/// it is there.
fn plan(fields: &Fields, start: [i32; 2], goal: [i32; 2]) -> Option<Vec<[i32; 2]>> {
    let to_goal = |[x, y]: [i32; 2]| f64::from(goal[0] - x).hypot(f64::from(goal[1] - y));
    // Lengths in thousandths of a cell, because a heap needs whole numbers.
    let mut open = BinaryHeap::from([(Reverse((to_goal(start) * 1e3) as u64), start)]);
    let mut best: HashMap<[i32; 2], (f64, [i32; 2])> = HashMap::from([(start, (0.0, start))]);
    while let Some((_, at)) = open.pop() {
        // Follow the best predecessors back.
        if at == goal {
            let mut way = vec![goal];
            while way[way.len() - 1] != start {
                way.push(best[&way[way.len() - 1]].1);
            }
            way.reverse();
            return Some(way);
        }
        let length = best[&at].0;
        // Steps in twelve directions make paths less angular than eight.
        for [dx, dy] in [
            [1, 0],
            [-1, 0],
            [0, 1],
            [0, -1],
            [1, 1],
            [1, -1],
            [-1, 1],
            [-1, -1],
            [1, 2],
            [-1, 2],
            [2, 1],
            [-2, 1],
        ] {
            let (to, further) =
                ([at[0] + dx, at[1] + dy], length + f64::from(dx).hypot(f64::from(dy)));
            // The cell must be clear at the time at which the robot comes there.
            if fields.clear_m(to, further * fields.cell_m / SPEED_M_S) >= CLEAR_M
                && best.get(&to).is_none_or(|(known, _)| further < *known)
            {
                best.insert(to, (further, at));
                open.push((Reverse(((further + to_goal(to)) * 1e3) as u64), to));
            }
        }
    }
    None
}

/// Largest distance by which a goal inside an obstacle is moved, cells: 1.5 m.
const GOAL_CELLS: i32 = 8;

impl Fields {
    /// The cell nearest to a goal at which the robot can stand when it gets there.
    fn reachable_goal(&self, start: [i32; 2], goal: [i32; 2]) -> [i32; 2] {
        let clear = |cell: &[i32; 2]| {
            let length = f64::from(cell[0] - start[0]).hypot(f64::from(cell[1] - start[1]));
            self.clear_m(*cell, length * self.cell_m / SPEED_M_S) >= CLEAR_M
        };
        let around = (-GOAL_CELLS..=GOAL_CELLS)
            .flat_map(|y| (-GOAL_CELLS..=GOAL_CELLS).map(move |x| [x, y]));
        let nearest = around
            .filter(|[x, y]| clear(&[goal[0] + x, goal[1] + y]))
            .min_by_key(|[x, y]| x * x + y * y);
        nearest.map_or(goal, |[x, y]| [goal[0] + x, goal[1] + y])
    }

    /// Returns the distance to the nearest obstacle at a time, m, from the two nearest grids.
    fn clear_m(&self, [x, y]: [i32; 2], time_s: f64) -> f64 {
        let inside = (0..SIDE as i32).contains(&x) && (0..SIDE as i32).contains(&y);
        let at = |time: usize| {
            if inside {
                f64::from(self.at[time.min(self.at.len() - 1)][y as usize * SIDE + x as usize])
            } else {
                -1.0
            }
        };
        at((time_s * RATE).floor() as usize).min(at((time_s * RATE).ceil() as usize))
    }
}

/// A car in the world: where, half its sides, its heading and speed, across the ground (x, z).
#[derive(Clone, Copy)]
struct Car {
    center: [f64; 2],
    half: [f64; 2],
    heading: [f64; 2],
    speed_m_s: f64,
}

impl Car {
    /// Distance of a point from the car, some seconds later, m; below 0 inside.
    fn distance_m(&self, [x, z]: [f64; 2], time_s: f64) -> f64 {
        // The car drives straight on at its speed.
        let way = self.speed_m_s * time_s;
        let [dx, dz] = [
            x - self.center[0] - self.heading[0] * way,
            z - self.center[1] - self.heading[1] * way,
        ];
        // The point in the car's axes: across and along.
        let [sin, cos] = self.heading;
        let outside = [
            (cos * dx - sin * dz).abs() - self.half[0],
            (sin * dx + cos * dz).abs() - self.half[1],
        ];
        let beyond = outside.map(|side| side.max(0.0));
        // Inside, the side that is nearest counts.
        if outside.iter().all(|side| *side < 0.0) {
            outside[0].max(outside[1])
        } else {
            beyond[0].hypot(beyond[1])
        }
    }
}

/// True scene when the robot starts.
struct Truth {
    cars: Vec<Car>,
    /// Points of what stands, higher than a kerb and lower than a van, across the ground.
    walls: Vec<[f64; 2]>,
}

impl Truth {
    fn distance_m(&self, at: [f64; 2], time_s: f64) -> f64 {
        let cars = self.cars.iter().map(|car| car.distance_m(at, time_s));
        cars.chain(self.walls.iter().map(|wall| (wall[0] - at[0]).hypot(wall[1] - at[1])))
            .fold(f64::INFINITY, f64::min)
    }
}

fn street(seed: u64) -> anyhow::Result<Street> {
    let mut random = Random::new(seed);
    let mut between =
        |low: f64, high: f64| low + (high - low) * f64::from(random.below(1_000)) / 1_000.0;
    let mut car = |lane, from: f64, to: f64, slow: f64, fast: f64| ScriptedCar {
        kind: CarKind::ALL[(seed % 5) as usize],
        lane,
        to_lane: None,
        start_m: between(from, to),
        profile: SpeedProfile::Constant { speed_m_s: between(slow, fast) },
    };
    // One car ahead in each lane that the robot may want to use.
    let cars = vec![
        car(Lane::Ego, 12.0, 18.0, 4.0, 6.0),
        car(Lane::Overtaking, 8.0, 18.0, 4.0, 7.0),
        car(Lane::Oncoming, 30.0, 50.0, 3.0, 6.0),
    ];
    let traffic = MovingTraffic { oncoming_gap_m: 0.0, overtaking_gap_m: 0.0, cars };
    Ok(Street::new(StreetConfig {
        seed,
        width: 828,
        height: 250,
        curvature: false,
        speed_m_s: 4.0,
        parked_density: 0.8,
        traffic: Traffic::Moving(traffic),
        ..StreetConfig::default()
    })?)
}

/// Takes in a frame's exact walls.
fn add_walls(walls: &mut HashMap<[i32; 2], [f64; 2]>, street: &Street, frame: &SynthFrame) {
    let (rig, ground_m) = (street.rig(), CAMERA_HEIGHT_M);
    for (at, depth) in frame
        .depth_m
        .iter()
        .enumerate()
        .filter(|(at, depth)| **depth > 0.0 && **depth < 25.0 && frame.instances[*at] == 0)
    {
        let (u, v, z) = ((at % frame.width) as f64, (at / frame.width) as f64, f64::from(*depth));
        let [x, y, z]: [f64; 3] = frame.t_world_camera.transform_point([
            (u - rig.center_u_px) * z / rig.focal_px,
            (v - rig.center_v_px) * z / rig.focal_px,
            z,
        ]);
        // What a robot can hit: above the ground, and not above its head.
        if (0.35..2.0).contains(&(ground_m - y)) {
            // A point for each 5 cm is enough.
            walls.entry([(x * 20.0) as i32, (z * 20.0) as i32]).or_insert([x, z]);
        }
    }
}

fn cars_of(frame: &SynthFrame) -> Vec<Car> {
    let car = |of: &dynvox::synth::ObjectTruth| {
        let heading: [f64; 3] = of.t_world_object.rotate([0.0, 0.0, 1.0]);
        let [x, _, z] = of.t_world_object.translation_m;
        let length = heading[0].hypot(heading[2]);
        Car {
            center: [x, z],
            half: [0.5 * of.dimensions_m[0], 0.5 * of.dimensions_m[2]],
            heading: [heading[0] / length, heading[2] / length],
            speed_m_s: of.speed_m_s,
        }
    };
    frame.objects.iter().map(car).collect()
}

/// Maps a street and returns the planner's fields, and the truth at that time.
fn map(
    street: &Street,
    frames: u32,
    slab: &mut [u8],
    capacity: &Capacity,
) -> anyhow::Result<(Fields, Truth, [f64; 2], [f64; 2])> {
    let mut config = Config::for_rig(street.rig());
    config.segmentation.enabled = true;
    // A planner that must not hit anything takes unknown space for occupied.
    config.planning.unknown_is_obstacle = true;
    for setting in std::env::args().filter(|argument| argument.starts_with("planning.")) {
        let (key, value) = setting.split_once('=').unwrap_or_default();
        config.set(key, value)?;
    }
    config.planning.camera_height_m = CAMERA_HEIGHT_M as f32;
    let mut mapper = Mapper::new(capacity, &config, slab)?;
    let (mut walls, mut cars) = (HashMap::new(), Vec::new());
    for index in 0..frames {
        let frame = street.frame(index);
        let view = |pixels| {
            View::new(pixels, frame.width, frame.height).ok_or(anyhow::anyhow!("an empty image"))
        };
        mapper
            .step(&StereoFrame::pair(view(&frame.left_grey)?, view(&frame.right_grey)?), &Serial)?;
        add_walls(&mut walls, street, &frame);
        cars = cars_of(&frame);
    }
    let report = mapper.update_planning_maps(0.0);
    if let Some(folder) = std::env::args()
        .find_map(|argument| Some(std::path::PathBuf::from(argument.strip_prefix("out=")?)))
    {
        let folder = folder.join(street.config().seed.to_string());
        write_planning(
            &folder,
            &WindowCamera {
                frame: frames as usize,
                segment: mapper.static_map().segment(),
                position_m: mapper.t_world_camera().translation_m,
            },
            report,
            mapper.planning(),
        )?;
    }
    let cell_m = mapper.planning().grid().cell_m();
    let mut at = Vec::new();
    // A field for each time step, with the cars where they will be.
    for step in 0..HORIZON_S {
        mapper.plan_ahead(step as f32 / RATE as f32);
        let planning = mapper.planning();
        let [x, y, z] = planning.origin();
        let cells = (0..SIDE as i32).flat_map(|v| (0..SIDE as i32).map(move |u| [x + u, y + v, z]));
        at.push(
            cells
                .map(|cell| {
                    planning.slice_distance(cell).map_or(f32::MAX, |distance| distance.distance_m)
                })
                .collect(),
        );
    }
    let planning = mapper.planning();
    let [x, y, _] = planning.origin().map(|c| f64::from(c) * cell_m);
    let camera = mapper.t_world_camera().translation_m;
    Ok((
        Fields { cell_m, at },
        Truth { cars, walls: walls.into_values().collect() },
        [x, y],
        [camera[0], camera[2]],
    ))
}

/// The fields of the exact geometry.
fn exact_fields(truth: &Truth, cell_m: f64, origin: [f64; 2]) -> anyhow::Result<Fields> {
    let bytes = DistanceField::bytes(SIDE * SIDE, SIDE);
    let mut slab = vec![0; bytes + SLAB_ALIGN];
    let mut field = DistanceField::new_in(SIDE * SIDE, SIDE, &mut Carver::new(&mut slab, bytes)?);
    let point_of = |at: usize| {
        [
            origin[0] + ((at % SIDE) as f64 + 0.5) * cell_m,
            origin[1] + ((at / SIDE) as f64 + 0.5) * cell_m,
        ]
    };
    // The window's columns that hold a true wall.
    let mut is_wall = vec![0u8; SIDE * SIDE];
    for wall in &truth.walls {
        let [x, y] = [(wall[0] - origin[0]) / cell_m, (wall[1] - origin[1]) / cell_m]
            .map(|c| c.floor() as i32);
        if (0..SIDE as i32).contains(&x) && (0..SIDE as i32).contains(&y) {
            is_wall[y as usize * SIDE + x as usize] = 1;
        }
    }
    let mut at_times = Vec::new();
    for step in 0..HORIZON_S {
        let time_s = step as f64 / RATE;
        // Cars by their true motion.
        let mut is_obstacle = is_wall.clone();
        for (at, obstacle) in is_obstacle.iter_mut().enumerate() {
            *obstacle |=
                u8::from(truth.cars.iter().any(|car| car.distance_m(point_of(at), time_s) < 0.0));
        }
        field.transform(&is_obstacle, [SIDE, SIDE, 1]);
        let distance = |at: usize| {
            field
                .get(at)
                .map_or(f32::MAX, |(squared, _)| f64::from(squared).sqrt() as f32 * cell_m as f32)
        };
        at_times.push(
            (0..SIDE * SIDE)
                .map(|at| if is_obstacle[at] != 0 { -distance(at) } else { distance(at) })
                .collect(),
        );
    }
    Ok(Fields { cell_m, at: at_times })
}

fn length_m(way: &[[i32; 2]], cell_m: f64) -> f64 {
    way.windows(2)
        .map(|pair| {
            f64::from(pair[1][0] - pair[0][0]).hypot(f64::from(pair[1][1] - pair[0][1])) * cell_m
        })
        .sum()
}

/// Follows a path in steps of a few centimetres: how near anything comes, m, and when, s; and the
/// path's length, m.
fn move_along(truth: &Truth, way: impl Iterator<Item = [f64; 2]>) -> ((f64, f64), f64) {
    let (mut length, mut nearest, mut last) = (0.0, (f64::INFINITY, 0.0), None);
    for to in way {
        let from = last.replace(to).unwrap_or(to);
        let leg = (to[0] - from[0]).hypot(to[1] - from[1]);
        // In ten steps a leg, since the car moves as well.
        for n in 1..=10 {
            let share = f64::from(n) / 10.0;
            let time_s = (length + share * leg) / SPEED_M_S;
            let distance = truth.distance_m(
                [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])],
                time_s,
            );
            nearest = if distance < nearest.0 { (distance, time_s) } else { nearest };
        }
        length += leg;
    }
    (nearest, length)
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str, default: u32| {
        arguments
            .iter()
            .find_map(|argument| argument.strip_prefix(name)?.parse().ok())
            .unwrap_or(default)
    };
    let (streets, frames) = (value("streets=", 100), value("frames=", 16));
    let capacity = Capacity {
        image_width: 828,
        image_height: 250,
        planning_width: SIDE,
        planning_length: SIDE,
        planning_height: 20,
        ..Capacity::ONBOARD
    };
    let mut slab = vec![0; capacity.bytes() + SLAB_ALIGN];
    let (mut collisions, mut without, mut neither, mut ratios) = (0, 0, 0, Vec::new());
    for seed in 1..=u64::from(streets) {
        let (fields, truth, origin, camera) = map(&street(seed)?, frames, &mut slab, &capacity)?;
        let cell = |at: [f64; 2]| {
            [0, 1].map(|axis| ((at[axis] - origin[axis]) / fields.cell_m).floor() as i32)
        };
        // Goals alternate: to both sides and straight ahead.
        let [side, ahead] = GOALS[seed as usize % GOALS.len()];
        let start = cell(camera);
        let goal = fields.reachable_goal(start, cell([camera[0] + side, camera[1] + ahead]));
        let exact = plan(&exact_fields(&truth, fields.cell_m, origin)?, start, goal);
        let point_of = |cell: [i32; 2]| {
            [0, 1].map(|axis| origin[axis] + (f64::from(cell[axis]) + 0.5) * fields.cell_m)
        };
        // No path is only a fault where exact geometry has one.
        let Some(way) = plan(&fields, start, goal) else {
            let possible = exact.is_some();
            without += u32::from(possible);
            neither += u32::from(!possible);
            println!(
                "street {seed}: no path{}; {:.2} m clear at the start, {:.2} m at the goal",
                if possible { "" } else { ", nor on exact geometry" },
                fields.clear_m(start, 0.0),
                fields.clear_m(goal, 3.0)
            );
            continue;
        };
        let (nearest, length) = move_along(&truth, way.iter().map(|cell| point_of(*cell)));
        let collides = nearest.0 < RADIUS_M;
        collisions += u32::from(collides);
        let ratio = exact
            .as_ref()
            .map(|exact| length_m(&way, fields.cell_m) / length_m(exact, fields.cell_m));
        ratios.extend(ratio);
        // Only what went wrong is printed.
        if collides || ratio.is_none_or(|ratio| ratio > 1.1) {
            println!(
                "street {seed}: nearest {:.2} m after {:.1} s, path {length:.1} m, {:?} times the \
                 exact one",
                nearest.0, nearest.1, ratio
            );
        }
    }
    ratios.sort_by(f64::total_cmp);
    let within = ratios.iter().filter(|ratio| **ratio <= 1.1).count();
    println!(
        "{streets} streets: {collisions} collisions, {without} without a path where there is one, \
         {neither} where exact geometry has none either"
    );
    println!(
        "{} paths compared: {within} at most 10 % longer than on exact geometry, median {:.3}, \
         longest {:.3}",
        ratios.len(),
        ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN),
        ratios.last().copied().unwrap_or(f64::NAN)
    );
    Ok(())
}
