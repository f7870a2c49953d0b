//! Pictures of every format, and streams of them.

use super::super::binary::CALIB;
use super::{Bomb, Call, Stream, above};
use dynvox_core::random::Random;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

const SIDES: &str = "at most 8,192 px a side are read";
const MEMORY: &str = "at most 96 MiB are taken for a picture";
/// Arguments that decode pictures; an inspection may stop before.
const RUN: [&str; 5] = ["run", ".", "--quiet", "--memory", "48MiB"];
const LENGTH: &str = "at most 96 MiB of a picture are read";

pub const KINDS: &[Bomb] = &[
    Bomb { name: "PNG of large sides", bound: SIDES, make: png_sides },
    Bomb { name: "interlaced PNG of large sides", bound: SIDES, make: png_interlaced },
    Bomb { name: "PNG of much memory", bound: MEMORY, make: png_memory },
    Bomb { name: "PNG with a long text before large sides", bound: "black", make: png_text },
    Bomb { name: "PNG with data behind its rows", bound: "black", make: png_behind },
    Bomb { name: "PNG of a few rows for many", bound: "image", make: png_short },
    Bomb { name: "JPEG of large sides", bound: SIDES, make: jpeg_sides },
    Bomb { name: "progressive JPEG of much memory", bound: MEMORY, make: jpeg_memory },
    Bomb {
        name: "JPEG of many scans",
        bound: "scans; at most 100 are read",
        make: jpeg_scans,
    },
    Bomb { name: "PGM of large sides", bound: SIDES, make: |to, r| pnm(to, r, "P5") },
    Bomb { name: "PGM as text of large sides", bound: SIDES, make: |to, r| pnm(to, r, "P2") },
    Bomb { name: "PPM of large sides", bound: SIDES, make: |to, r| pnm(to, r, "P6") },
    Bomb { name: "PAM of much memory", bound: MEMORY, make: pam_memory },
    Bomb { name: "PAM of large sides", bound: SIDES, make: pam },
    Bomb { name: "PGM with an endless comment", bound: LENGTH, make: pgm_comment },
    Bomb { name: "TIFF of large sides", bound: SIDES, make: |to, r| tiff(to, r, [1, 8]) },
    Bomb { name: "TIFF of JPEG files", bound: "compressed as JPEG", make: tiff_jpeg },
    Bomb { name: "BigTIFF of endless tags", bound: LENGTH, make: big_tiff },
    Bomb { name: "BMP of large sides", bound: SIDES, make: bmp },
    Bomb { name: "sparse file", bound: LENGTH, make: sparse },
    Bomb { name: "stream of large sides", bound: SIDES, make: stream_sides },
    Bomb { name: "stream of much memory", bound: MEMORY, make: stream_memory },
    Bomb {
        name: "stream of a header without an end",
        bound: "does not end",
        make: stream_header,
    },
    Bomb { name: "stream of zeros", bound: "P5", make: stream_zeros },
];

/// Sides that the mapper takes, in their largest.
fn large(random: &mut Random) -> [u32; 2] {
    [4_096 - random.below(99), 4_096 - random.below(99)]
}

/// A folder of two pairs of a picture that is decoded: its calibration is of its size, and the
/// mapper's images are small.
fn run(root: &Path, name: &str, bytes: &[u8], [width, height]: [u32; 2]) -> Call {
    pairs(root, name, bytes, &mut Random::new(0));
    let center = [width, height].map(|side| f64::from(side - 1) / 2.0);
    let calib = format!(
        "focal_px {width}\ncenter_u_px {}\ncenter_v_px {}\nbaseline_m 0.5\n",
        center[0], center[1]
    );
    fs::write(root.join("calib.txt"), calib).unwrap();
    let mut call = Call::new(&RUN);
    // Results may not lie within the pictures' folder. None are made: the pictures are refused.
    let name = root.file_name().unwrap_or_default().to_string_lossy();
    call.args.extend(["--out".to_owned(), format!("../{name}-result")]);
    if width > 1_000 {
        call.args.extend(["--scale".to_owned(), "0.1".to_owned()]);
    }
    call
}

/// A folder of two pairs of a picture, inspected or run.
pub fn pairs(root: &Path, name: &str, bytes: &[u8], random: &mut Random) -> Call {
    fs::write(root.join("calib.txt"), CALIB).unwrap();
    for side in ["left", "right"] {
        fs::create_dir(root.join(side)).unwrap();
        for frame in ["000", "001"] {
            fs::write(root.join(side).join(format!("{frame}.{name}")), bytes).unwrap();
        }
    }
    // An inspection names what it cannot use, and fails for it.
    Call::new(if random.below(2) == 0 { &["inspect", "."] } else { &RUN })
}

/// Zeros, packed.
fn packed(bytes: usize) -> Vec<u8> {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::fast());
    std::io::copy(&mut std::io::repeat(0).take(bytes as u64), &mut packer).unwrap();
    packer.finish().unwrap()
}

/// A PNG of chunks, those of the header and the end added.
pub fn png(size: [u32; 2], kind: [u8; 5], chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut add = |name: &[u8; 4], data: &[u8]| {
        file.extend((data.len() as u32).to_be_bytes());
        let named = [name, data].concat();
        file.extend(&named);
        file.extend(crc32fast::hash(&named).to_be_bytes());
    };
    let header: Vec<u8> = size.iter().flat_map(|side| side.to_be_bytes()).chain(kind).collect();
    add(b"IHDR", &header);
    chunks.iter().for_each(|(name, data)| add(name, data));
    add(b"IEND", &[]);
    file
}

fn sides(random: &mut Random) -> [u32; 2] {
    [above(8_193, random), above(8_193, random)]
}

fn png_sides(root: &Path, random: &mut Random) -> Call {
    let rows = packed(1 << 24);
    pairs(root, "png", &png(sides(random), [8, 0, 0, 0, 0], &[(b"IDAT", rows)]), random)
}

fn png_interlaced(root: &Path, random: &mut Random) -> Call {
    let rows = packed(1 << 20);
    pairs(root, "png", &png(sides(random), [8, 0, 0, 0, 1], &[(b"IDAT", rows)]), random)
}

fn png_memory(root: &Path, random: &mut Random) -> Call {
    let rows = packed(1 << 20);
    let size = large(random);
    run(root, "png", &png(size, [16, 6, 0, 0, 0], &[(b"IDAT", rows)]), size)
}

/// A black picture of the size of [`CALIB`]'s, after 400 MB of text and profile.
fn png_text(root: &Path, _: &mut Random) -> Call {
    let long = packed(200 << 20);
    let chunks = [
        (b"zTXt", [b"a\0\0".as_slice(), &long].concat()),
        (b"iCCP", [b"a\0\0".as_slice(), &long].concat()),
        (b"IDAT", packed(161 * 64)),
    ];
    run(root, "png", &png([160, 64], [8, 0, 0, 0, 0], &chunks), [160, 64])
}

/// A black picture of a few rows, with two hundred megabytes packed behind them.
fn png_behind(root: &Path, random: &mut Random) -> Call {
    let kind = [8, 0, 0, 0, random.below(2) as u8];
    let rows = packed(200 << 20);
    run(root, "png", &png([160, 64], kind, &[(b"IDAT", rows)]), [160, 64])
}

fn png_short(root: &Path, random: &mut Random) -> Call {
    let rows = packed(1 << 16);
    let size = large(random);
    run(root, "png", &png(size, [8, 0, 0, 0, 0], &[(b"IDAT", rows)]), size)
}

/// The header of a JPEG with a frame of a kind.
fn jpeg(marker: u8, [width, height]: [u32; 2]) -> Vec<u8> {
    let mut file = vec![0xFF, 0xD8, 0xFF, marker, 0, 17, 8];
    file.extend((height as u16).to_be_bytes());
    file.extend((width as u16).to_be_bytes());
    file.extend([3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0]);
    file
}

const SCAN: [u8; 14] = [0xFF, 0xDA, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, 63, 0];

fn jpeg_sides(root: &Path, random: &mut Random) -> Call {
    let sides = sides(random).map(|side| side.min(65_500));
    pairs(root, "jpg", &[jpeg(0xC0, sides), SCAN.to_vec()].concat(), random)
}

fn jpeg_memory(root: &Path, random: &mut Random) -> Call {
    let size = large(random);
    run(root, "jpg", &[jpeg(0xC2, size), SCAN.to_vec()].concat(), size)
}

fn jpeg_scans(root: &Path, random: &mut Random) -> Call {
    let scans = SCAN.repeat(above(101, random) as usize);
    run(root, "jpg", &[jpeg(0xC2, [640, 480]), scans].concat(), [640, 480])
}

fn pnm(root: &Path, random: &mut Random, kind: &str) -> Call {
    let [width, height] = sides(random);
    let file = format!("{kind}\n{width} {height}\n255\n{}", "0 ".repeat(1_000));
    pairs(root, "pgm", file.as_bytes(), random)
}

fn pam_memory(root: &Path, random: &mut Random) -> Call {
    let [width, height] = large(random);
    let file = format!(
        "P7\nWIDTH {width}\nHEIGHT {height}\nDEPTH 4\nMAXVAL 65535\nTUPLTYPE RGB_ALPHA\nENDHDR\n"
    );
    run(root, "pnm", file.as_bytes(), [width, height])
}

fn pam(root: &Path, random: &mut Random) -> Call {
    let [width, height] = sides(random);
    let file =
        format!("P7\nWIDTH {width}\nHEIGHT {height}\nDEPTH 3\nMAXVAL 255\nTUPLTYPE RGB\nENDHDR\n");
    pairs(root, "pnm", file.as_bytes(), random)
}

/// A file that a header begins and nothing ends: most of it is a hole.
fn hole(root: &Path, name: &str, header: &[u8], random: &mut Random) -> Call {
    let call = pairs(root, name, header, random);
    for side in ["left", "right"] {
        let file = File::options().write(true).open(root.join(side).join(format!("000.{name}")));
        file.unwrap().set_len((1 << 33) + u64::from(random.next_u32())).unwrap();
    }
    call
}

fn pgm_comment(root: &Path, random: &mut Random) -> Call {
    hole(root, "pgm", b"P5\n# a comment", random)
}

fn sparse(root: &Path, random: &mut Random) -> Call {
    hole(root, "jpg", &jpeg(0xC0, [64, 64]), random)
}

/// A TIFF of one strip with a compression and bits of a sample.
fn tiff_file([width, height]: [u32; 2], [compression, bits]: [u32; 2]) -> Vec<u8> {
    let mut file = b"II*\0\x08\0\0\0".to_vec();
    // Width, height, bits, compression, black is 0, the strip's place, samples, rows, and its
    // bytes.
    let tags: [(u16, u32); 9] = [
        (256, width),
        (257, height),
        (258, bits),
        (259, compression),
        (262, 1),
        (273, 8),
        (277, 1),
        (278, height),
        (279, 100),
    ];
    file.extend((tags.len() as u16).to_le_bytes());
    for (tag, value) in tags {
        file.extend(tag.to_le_bytes());
        // Of type LONG, one value each.
        file.extend([4, 0, 1, 0, 0, 0]);
        file.extend(value.to_le_bytes());
    }
    file.extend([0; 200]);
    file
}

fn tiff(root: &Path, random: &mut Random, kind: [u32; 2]) -> Call {
    pairs(root, "tif", &tiff_file(sides(random), kind), random)
}

fn tiff_jpeg(root: &Path, random: &mut Random) -> Call {
    let size = 64 + random.below(64);
    pairs(root, "tif", &tiff_file([size, size], [7, 8]), random)
}

fn big_tiff(root: &Path, random: &mut Random) -> Call {
    let header = [b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0".as_slice(), &[255, 255, 255, 255, 255, 0]];
    hole(root, "tif", &header.concat(), random)
}

fn bmp(root: &Path, random: &mut Random) -> Call {
    let mut file = b"BM".to_vec();
    file.extend([54u32, 0, 54, 40].iter().flat_map(|word| word.to_le_bytes()));
    // Beyond 65,535 px the decoder refuses a side before our bound is looked at.
    let sides = sides(random).map(|side| side.min(65_535));
    file.extend(sides.iter().flat_map(|word| word.to_le_bytes()));
    file.extend([1, 0, 24, 0]);
    file.extend([0; 24]);
    pairs(root, "bmp", &file, random)
}

fn stream(root: &Path, begin: String, rest: &[u8]) -> Call {
    fs::write(root.join("calib.txt"), CALIB).unwrap();
    let stream = Stream { begin: begin.into_bytes(), rest: rest.to_vec() };
    Call {
        stream: Some(stream),
        ..Call::new(&["run", "-", "--calibration", "calib.txt", "--quiet"])
    }
}

fn stream_sides(root: &Path, random: &mut Random) -> Call {
    let [width, height] = sides(random);
    stream(root, format!("P5\n{width} {height}\n255\n"), &[7; 1 << 16])
}

fn stream_memory(root: &Path, random: &mut Random) -> Call {
    let side = 8_192 - random.below(500);
    stream(root, format!("P6\n{side} {side}\n65535\n"), &[7; 1 << 16])
}

fn stream_header(root: &Path, random: &mut Random) -> Call {
    let begin = ["P5\n#", "P5\n7", "P5 "][random.below(3) as usize];
    let rest = if begin.ends_with(' ') { b' ' } else { b'7' };
    stream(root, begin.to_owned(), &[rest; 1 << 16])
}

fn stream_zeros(root: &Path, random: &mut Random) -> Call {
    stream(root, "\0".repeat(random.below(9) as usize), &[0; 1 << 16])
}
