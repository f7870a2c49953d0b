//! Calibrations, tables, masks and depth.

use super::super::binary::{CALIB, rig};
use super::pictures::png;
use super::{Bomb, Call, above};
use dynvox_core::random::Random;
use std::fs::{self, File};
use std::path::Path;

pub const KINDS: &[Bomb] = &[
    Bomb {
        name: "XML of many attributes",
        bound: "attributes; at most 64",
        make: attributes,
    },
    Bomb { name: "XML of many elements", bound: "the 10,000 that are read", make: elements },
    Bomb { name: "XML of nested entities", bound: "not XML", make: entities },
    Bomb { name: "YAML of deep nesting", bound: "not YAML", make: yaml_nesting },
    Bomb { name: "YAML of nested aliases", bound: "not YAML", make: yaml_aliases },
    Bomb { name: "YAML of many values", bound: "not YAML", make: yaml_values },
    Bomb { name: "TOML of deep nesting", bound: "calibration.toml", make: toml_nesting },
    Bomb {
        name: "sparse calibration",
        bound: "at most 1 MiB of a calibration",
        make: sparse_yaml,
    },
    Bomb {
        name: "calibration of one long line",
        bound: "of a line are read",
        make: long_line,
    },
    Bomb {
        name: "sparse calib.txt",
        bound: "at most 1 MiB of a calibration",
        make: sparse_calib,
    },
    Bomb {
        name: "sparse poses",
        bound: "at most 64 MiB of a table",
        make: |to, r| sparse(to, r, "poses.txt"),
    },
    Bomb {
        name: "sparse times",
        bound: "at most 64 MiB of a table",
        make: |to, r| sparse(to, r, "times.txt"),
    },
    Bomb { name: "poses on many lines", bound: "the 500,000 that are read", make: poses },
    Bomb { name: "times on one line", bound: "at most 1 MiB of a line", make: times },
    Bomb {
        name: "sparse inertial samples",
        bound: "at most 192 MiB of a table",
        make: inertial,
    },
    Bomb { name: "sparse COCO", bound: "at most 16 MiB of COCO's JSON", make: sparse_coco },
    Bomb { name: "COCO of deep nesting", bound: "COCO's annotations", make: deep_coco },
    Bomb { name: "COCO of many numbers", bound: "COCO's annotations", make: wide_coco },
    Bomb { name: "masks of large sides", bound: "at most 8,192 px a side", make: masks },
    Bomb { name: "labels on one line", bound: "at most 1 MiB of a line", make: labels },
    Bomb { name: "sparse YOLO labels", bound: "at most 64 MiB of a table", make: yolo },
    Bomb { name: "sparse LiDAR scan", bound: "at most 32 MiB of a LiDAR scan", make: scan },
    Bomb { name: "PFM of large sides", bound: "px", make: pfm_sides },
    Bomb { name: "sparse PFM", bound: "at most 41 KiB", make: sparse_pfm },
    Bomb {
        name: "depth PNG of large sides",
        bound: "at most 8,192 px a side",
        make: depth_png,
    },
    Bomb {
        name: "depth XML of many attributes",
        bound: "at most 64 are read",
        make: depth_xml,
    },
];

fn calibration(root: &Path, name: &str, text: &str) -> Call {
    fs::write(root.join(name), text).unwrap();
    Call::new(&["calibration", name])
}

/// Makes a file longer, with nothing in it.
pub fn widened(path: &Path, random: &mut Random) {
    let file = File::options().append(true).create(true).open(path).unwrap();
    file.set_len((1 << 34) + u64::from(random.next_u32())).unwrap();
}

fn attributes(root: &Path, random: &mut Random) -> Call {
    let many: String = (0..60_000 + random.below(20_000))
        .map(|at| format!("{}a{at}=''", if at % 10 == 0 { "\n" } else { " " }))
        .collect();
    let text = format!("<?xml version='1.0'?><opencv_storage><M1{many}/></opencv_storage>");
    calibration(root, "c.xml", &text)
}

fn elements(root: &Path, random: &mut Random) -> Call {
    let many = "<a/><a/><a/><a/><a/>\n".repeat(above(2_001, random) as usize);
    let text = format!("<?xml version='1.0'?><opencv_storage>{many}</opencv_storage>");
    calibration(root, "c.xml", &text)
}

fn entities(root: &Path, random: &mut Random) -> Call {
    let mut text = "<?xml version='1.0'?><!DOCTYPE r [<!ENTITY e0 'x'>".to_owned();
    for at in 1..20 + random.below(20) {
        text += &format!("<!ENTITY e{at} '{}'>", format!("&e{};", at - 1).repeat(10));
    }
    calibration(root, "c.xml", &(text + "]><opencv_storage>&e19;</opencv_storage>"))
}

fn yaml_nesting(root: &Path, random: &mut Random) -> Call {
    let depth = above(1_000, random) as usize;
    let text = match random.below(3) {
        0 => format!("a: {}", "[".repeat(depth)),
        1 => format!("a: {}", "{a: ".repeat(depth)),
        _ => (0..depth.min(1_400)).map(|at| format!("{}a:\n", " ".repeat(at))).collect(),
    };
    calibration(root, "c.yaml", &text)
}

fn yaml_aliases(root: &Path, random: &mut Random) -> Call {
    let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n".to_owned();
    for at in 1..12 + random.below(8) {
        let before = vec![format!("*a{}", at - 1); 9].join(", ");
        text += &format!("a{at}: &a{at} [{before}]\n");
    }
    calibration(root, "c.yaml", &text)
}

fn yaml_values(root: &Path, random: &mut Random) -> Call {
    let count = 100_001 + random.below(20_000) as usize;
    calibration(
        root,
        "c.yaml",
        &format!("a: [\n{}0]\n", "0,0,0,0,0,0,0,0,0,0,\n".repeat(count / 10 + 1)),
    )
}

fn toml_nesting(root: &Path, random: &mut Random) -> Call {
    let depth = above(10_000, random) as usize;
    calibration(root, "calibration.toml", &format!("a = {}", "[".repeat(depth)))
}

fn sparse_yaml(root: &Path, random: &mut Random) -> Call {
    let name = ["c.yaml", "c.xml", "c.toml", "calib_cam_to_cam.txt"][random.below(4) as usize];
    fs::write(root.join(name), "M1: 1\n").unwrap();
    widened(&root.join(name), random);
    Call::new(&["calibration", name])
}

fn long_line(root: &Path, random: &mut Random) -> Call {
    let line = "1 ".repeat(150_000 + random.below(200_000) as usize);
    calibration(root, "c.yaml", &format!("a: {line}\n"))
}

fn sparse_calib(root: &Path, random: &mut Random) -> Call {
    rig(root, 2);
    widened(&root.join("rig/calib.txt"), random);
    Call::new(&["inspect", "rig"])
}

fn sparse(root: &Path, random: &mut Random, name: &str) -> Call {
    rig(root, 2);
    fs::write(root.join("rig").join(name), "0\n").unwrap();
    widened(&root.join("rig").join(name), random);
    Call::new(&["inspect", "rig"])
}

fn poses(root: &Path, random: &mut Random) -> Call {
    rig(root, 2);
    let count = 500_002 + random.below(100_000) as usize;
    fs::write(root.join("rig/poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(count)).unwrap();
    Call::new(&["inspect", "rig"])
}

fn times(root: &Path, random: &mut Random) -> Call {
    rig(root, 2);
    let count = 600_000 + random.below(1_000_000) as usize;
    fs::write(root.join("rig/times.txt"), "0.1 ".repeat(count)).unwrap();
    Call::new(&["run", "rig", "--quiet"])
}

/// A run of two pairs with an option about a file.
fn with(root: &Path, option: &str, value: &str) -> Call {
    rig(root, 2);
    Call::new(&["run", "rig", "--quiet", "--profile", "tiny", option, value])
}

fn inertial(root: &Path, random: &mut Random) -> Call {
    fs::write(root.join("imu.csv"), "time,wx,wy,wz,ax,ay,az\n").unwrap();
    widened(&root.join("imu.csv"), random);
    with(root, "--inertial", "imu.csv")
}

fn sparse_coco(root: &Path, random: &mut Random) -> Call {
    fs::write(root.join("c.json"), "[").unwrap();
    widened(&root.join("c.json"), random);
    with(root, "--instances", "coco:c.json")
}

fn deep_coco(root: &Path, random: &mut Random) -> Call {
    let depth = above(1_000, random) as usize;
    let text = format!("[{{\"image_id\": 1, \"segmentation\": {}", "[".repeat(depth));
    fs::write(root.join("c.json"), text).unwrap();
    with(root, "--instances", "coco:c.json")
}

/// Numbers up to the length that a file may have, and then a fault.
fn wide_coco(root: &Path, random: &mut Random) -> Call {
    let many = ["0,", "[],", "[0],"][random.below(3) as usize];
    let numbers = many.repeat((16 << 20) / many.len() - 40);
    let open = if many == "0," { "[[" } else { "[" };
    let text = format!("[{{\"image_id\":1,\"category_id\":1,\"segmentation\":{open}{numbers}");
    fs::write(root.join("c.json"), text).unwrap();
    with(root, "--instances", "coco:c.json")
}

fn masks(root: &Path, random: &mut Random) -> Call {
    fs::create_dir(root.join("masks")).unwrap();
    let size = [above(8_193, random), above(8_193, random)];
    let file = png(size, [16, 0, 0, 0, 0], &[(b"IDAT", vec![0; 100])]);
    for name in ["000.png", "001.png"] {
        fs::write(root.join("masks").join(name), &file).unwrap();
    }
    with(root, "--instances", "files:masks")
}

fn labels(root: &Path, random: &mut Random) -> Call {
    let line = "1,".repeat(600_000 + random.below(1_000_000) as usize);
    fs::write(root.join("det.txt"), line).unwrap();
    with(root, "--instances", "boxes:det.txt")
}

fn yolo(root: &Path, random: &mut Random) -> Call {
    fs::create_dir(root.join("labels")).unwrap();
    for stem in ["000", "001"] {
        fs::write(root.join("labels").join(format!("{stem}.txt")), "2 0.5 0.5 0.1 0.1\n").unwrap();
    }
    widened(&root.join("labels/000.txt"), random);
    with(root, "--instances", "yolo:labels")
}

/// The rig in KITTI's layout, with a scan of the first frame.
fn scan(root: &Path, random: &mut Random) -> Call {
    rig(root, 2);
    let sequence = root.join("kitti/sequences/00");
    fs::create_dir_all(sequence.join("velodyne")).unwrap();
    for (side, to) in [("left", "image_0"), ("right", "image_1")] {
        fs::create_dir(sequence.join(to)).unwrap();
        for frame in 0..2 {
            let from = root.join("rig").join(side).join(format!("{frame:03}.png"));
            fs::rename(from, sequence.join(to).join(format!("{frame:06}.png"))).unwrap();
        }
    }
    fs::write(
        sequence.join("calib.txt"),
        "P0: 90 0 79.5 0 0 90 31.5 0 0 0 1 0\nP1: 90 0 79.5 -45 0 90 31.5 0 0 0 1 0\n\
         Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n",
    )
    .unwrap();
    fs::write(sequence.join("times.txt"), "0\n0.1\n").unwrap();
    widened(&sequence.join("velodyne/000000.bin"), random);
    Call::new(&["run", "kitti", "--quiet", "--profile", "tiny", "--evaluate", "lidar"])
}

fn depth(root: &Path, name: &str, file: &[u8]) -> Call {
    fs::create_dir(root.join("depth")).unwrap();
    for stem in ["000", "001"] {
        fs::write(root.join("depth").join(format!("{stem}.{name}")), file).unwrap();
    }
    with(root, "--depth", "files:depth")
}

fn pfm_sides(root: &Path, random: &mut Random) -> Call {
    let [width, height] = [above(100_000, random), above(100_000, random)];
    depth(root, "pfm", format!("Pf\n{width} {height}\n-1\n").as_bytes())
}

fn sparse_pfm(root: &Path, random: &mut Random) -> Call {
    let call = depth(root, "pfm", b"Pf\n160 64\n-1\n");
    widened(&root.join("depth/000.pfm"), random);
    call
}

fn depth_png(root: &Path, random: &mut Random) -> Call {
    let size = [above(8_193, random), above(8_193, random)];
    depth(root, "png", &png(size, [16, 0, 0, 0, 0], &[(b"IDAT", vec![0; 100])]))
}

fn depth_xml(root: &Path, random: &mut Random) -> Call {
    let many: String = (0..60_000 + random.below(20_000))
        .map(|at| format!("{}a{at}=''", if at % 10 == 0 { "\n" } else { " " }))
        .collect();
    let text =
        format!("<?xml version='1.0'?><opencv_storage><depth-frame{many}/></opencv_storage>");
    fs::write(root.join("calib.txt"), CALIB).unwrap();
    depth(root, "xml", text.as_bytes())
}
