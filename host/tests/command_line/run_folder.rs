//! Run folders as `dynvox run` writes them, of any size, without a run.

use dynvox::formats::PlyWriter;
use dynvox_core::geometry::Transform;
use dynvox_core::view::Vertex;
use image::{GrayImage, ImageBuffer, Luma, Rgb, RgbImage};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A camera that moves forward over a floor, past boxes.
pub struct FakeRun {
    /// Frames: every second one of the data set.
    pub frames: usize,
    /// Objects: the first is seen in the first half alone, the others to the end.
    pub objects: usize,
    /// Squares along each side of the floor.
    pub squares: usize,
    /// True if there are pictures.
    pub pictures: bool,
}

/// Side of a square, m.
const SIDE_M: f32 = 0.2;
/// Frames with pictures at most.
const PICTURES: usize = 6;

impl FakeRun {
    pub fn write(&self, folder: &Path) {
        fs::write(folder.join("summary.json"), "{\"dataset\": \"floor\"}").unwrap();
        let (mut frames, mut poses, mut tracks) =
            (String::from("frame,time_s,step_ms,blocks_used\n"), String::new(), track_header());
        for at in 0..self.frames {
            // Every second frame, so that numbers of frames and rows differ.
            writeln!(frames, "{},{},{},{}", 2 * at, 0.2 * at as f64, 9 + at % 3, 100 + at).unwrap();
            writeln!(poses, "{}", row(&Transform::from_translation([0.0, 0.0, self.z_m(at)])))
                .unwrap();
            for id in (1..=self.objects.min(8)).filter(|&id| self.is_seen(id, at)) {
                // Static and dynamic tracks in turns.
                let state = ["static", "dynamic"][id % 2];
                writeln!(
                    tracks,
                    "{},{id},car,{state},1.5,0.1,{},10,{},30,0.9,20,18,1,5",
                    2 * at,
                    4 * id,
                    4 * id + 20
                )
                .unwrap();
            }
        }
        fs::write(folder.join("frames.csv"), frames).unwrap();
        fs::write(folder.join("trajectory_kitti.txt"), &poses).unwrap();
        fs::write(folder.join("trajectory_truth_kitti.txt"), &poses).unwrap();
        fs::write(folder.join("tracks.csv"), tracks).unwrap();
        self.write_blocks(folder);
        self.write_floor(&folder.join("map.ply"));
        (1..=self.objects).for_each(|id| self.write_object(&folder.join("objects"), id));
        if self.pictures {
            self.write_pictures(&folder.join("pictures"));
        }
    }

    /// Returns the camera's position along the street in a frame, m.
    fn z_m(&self, at: usize) -> f64 {
        6.0 * at as f64 / self.frames as f64
    }

    fn is_seen(&self, id: usize, at: usize) -> bool {
        id > 1 || 2 * at < self.frames
    }

    fn write_floor(&self, path: &Path) {
        let mut ply = PlyWriter::begin(path).unwrap();
        let corner = |x: usize, z: usize| {
            // A plane at the camera's height, 1.6 m below it.
            let at = [SIDE_M * (x as f32 - 0.5 * self.squares as f32), 1.6, SIDE_M * z as f32];
            Vertex {
                position_m: at,
                colour: [60 + (x % 4 * 40) as u8, 90, 60 + (z % 4 * 40) as u8],
                weight: 1 + (z % 50) as u8,
            }
        };
        for (x, z) in
            (0..self.squares * self.squares).map(|at| (at % self.squares, at / self.squares))
        {
            ply.triangle([corner(x, z), corner(x, z + 1), corner(x + 1, z)]);
            ply.triangle([corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1)]);
        }
        ply.finish().unwrap();
    }

    /// The blocks of the floor, two more that pruning took, and two places that were compared with
    /// a reference, and a planner's window.
    fn write_blocks(&self, folder: &Path) {
        fs::write(folder.join("config.toml"), "[volume]\nvoxel_size_m = 0.1\n").unwrap();
        let mut rows = String::from("x,y,z,last_frame,fate\n");
        // Blocks of 8 voxels of 0.1 m.
        let blocks = (self.squares as f32 * SIDE_M / 0.8).ceil() as i32;
        for (x, z) in (0..blocks * blocks).map(|at| (at % blocks - blocks / 2 - 1, at / blocks)) {
            writeln!(rows, "{x},2,{z},{},map", 2 * self.frames as i32 * z / blocks.max(1)).unwrap();
        }
        if blocks > 0 {
            rows.push_str("0,0,3,4,pruned\n1,0,3,4,pruned\n");
        }
        fs::write(folder.join("blocks.csv"), rows).unwrap();
        if blocks > 0 {
            let errors = "x_m,y_m,z_m,points,error_m\n0.1,1.6,3.1,9,0.1\n0.5,1.6,3.1,2,0.3\n";
            fs::write(folder.join("surface_errors.csv"), errors).unwrap();
            write_planning(&folder.join("planning"));
        }
    }

    /// A box of 12 triangles, 1 m wide.
    fn write_object(&self, folder: &Path, id: usize) {
        fs::create_dir_all(folder).unwrap();
        let mut ply = PlyWriter::begin(&folder.join(format!("{id}.ply"))).unwrap();
        // The corners of a cube by the bits of their number.
        let corner = |bits: usize| {
            let position_m = [0, 1, 2].map(|axis| (bits >> axis & 1) as f32);
            Vertex { position_m, colour: [200, 200, 40], weight: 0 }
        };
        for side in
            [[0, 2, 1, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 6, 3, 7], [0, 4, 2, 6], [1, 3, 5, 7]]
        {
            let [a, b, c, d] = side.map(corner);
            ply.triangle([a, b, c]);
            ply.triangle([b, d, c]);
        }
        ply.finish().unwrap();
        let x = (id % 8) as f64 - 3.0;
        // In rows of eight, side by side.
        let pose =
            |at: usize| Transform::from_translation([x, 0.6, 4.0 + (id / 8) as f64 + self.z_m(at)]);
        let rows = (0..self.frames)
            .filter(|&at| self.is_seen(id, at))
            .map(|at| format!("{} {}\n", 2 * at, row(&pose(at))));
        fs::write(folder.join(format!("{id}_kitti.txt")), rows.collect::<String>()).unwrap();
    }

    fn write_pictures(&self, folder: &Path) {
        fs::create_dir_all(folder).unwrap();
        let every = self.frames.div_ceil(PICTURES);
        let mut numbers: Vec<usize> =
            // The last frame has a picture, wherever the steps end.
            (0..self.frames).step_by(every).chain([self.frames - 1]).map(|at| 2 * at).collect();
        numbers.dedup();
        let picture = |shade: usize| {
            RgbImage::from_fn(64, 32, |u, v| Rgb([u as u8 * 3, v as u8 * 7, shade as u8]))
        };
        for &number in &numbers {
            ["left", "disparity", "map"].iter().for_each(|name| {
                picture(number).save(folder.join(format!("{number:06}_{name}.jpg"))).unwrap()
            });
        }
        picture(99).save(folder.join("overview.jpg")).unwrap();
        let index = serde_json::json!({ "width": 128, "height": 64, "frames": numbers });
        fs::write(folder.join("index.json"), index.to_string()).unwrap();
    }
}

/// A planner's window of 8 x 8 cells on the floor, obstacles along its left side.
fn write_planning(folder: &Path) {
    fs::create_dir(folder).unwrap();
    let window = serde_json::json!({
        "cell_m": 0.2, "origin_m": [-0.8, 2.0, -1.8], "height_zero_m": -1.6, "height_unit_m": 0.001,
        "right_world": [1.0, 0.0, 0.0], "ahead_world": [0.0, 0.0, 1.0], "up_world": [0.0, -1.0, 0.0],
        "distance_zero": 32768, "distance_unit_m": 0.01,
    });
    fs::write(folder.join("window.json"), window.to_string()).unwrap();
    GrayImage::from_fn(8, 8, |u, _| Luma([if u == 0 { 0 } else { 254 }]))
        .save(folder.join("map.pgm"))
        .unwrap();
    let numbers = |of: fn(u32) -> u16| ImageBuffer::from_fn(8, 8, |u, _| Luma([of(u)]));
    numbers(|_| 0).save(folder.join("height.png")).unwrap();
    numbers(|u| (32_758 + 20 * u) as u16).save(folder.join("distance.png")).unwrap();
}

fn track_header() -> String {
    "frame,id,class,state,speed_m_s,speed_sigma_m_s,x1,y1,x2,y2,score,matches,inliers,measured,blocks\n".to_owned()
}

/// The twelve numbers of KITTI's row.
fn row(pose: &Transform) -> String {
    pose.matrix_3x4().as_flattened().iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
