//! How far is the nearest obstacle from every cell of a map? The exact distance transform alone, on
//! a PGM file.
//!
//! `cargo run --release -p dynvox-core --example distance_transform -- out/run/planning/map.pgm > squared.bin`
//!
//! Pixels below 100 are obstacles. Writes the squared distance of each pixel to the nearest one of
//! the other kind, in pixels, as little-endian 32-bit numbers; 4,294,967,295 where all are of one
//! kind. Tells on standard error how long a transform takes.

use cpu_time::ThreadTime;
use dynvox_core::memory::{Carver, SLAB_ALIGN};
use dynvox_core::planning::{DistanceField, MAX_SIDE_CELLS, NO_OBSTACLE};
use std::io::Write;

/// Transforms that the time is a mean of.
const ROUNDS: u32 = 50;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("give a PGM file")?;
    let bytes = std::fs::read(&path)?;
    let (size, pixels) = pgm(&bytes).ok_or("not a binary PGM of 8 bits")?;
    let [width, height] = size;
    // The field counts squared distances in cells, which bounds its sides.
    if width.max(height) > MAX_SIDE_CELLS || pixels.len() != width * height {
        return Err("the map is too large, or its file too short".into());
    }
    // Grey levels of map servers: black is occupied, white free.
    let is_obstacle: Vec<u8> = pixels.iter().map(|grey| u8::from(*grey < 100)).collect();
    // One longest side is enough for both passes.
    let bytes = DistanceField::bytes(pixels.len(), width);
    let mut slab = vec![0; bytes + SLAB_ALIGN];
    let mut field = DistanceField::new_in(pixels.len(), width, &mut Carver::new(&mut slab, bytes)?);
    // Processor time: other programs do not count.
    let begin = ThreadTime::now();
    for _ in 0..ROUNDS {
        field.transform(&is_obstacle, [width, height, 1]);
    }
    eprintln!(
        "{width} x {height}: {:.3} ms of CPU",
        begin.elapsed().as_secs_f64() * 1e3 / f64::from(ROUNDS)
    );
    // As little-endian numbers, for comparison with other programs.
    let squared = (0..pixels.len())
        .flat_map(|at| field.get(at).map_or(NO_OBSTACLE, |(squared, _)| squared).to_le_bytes());
    std::io::stdout().write_all(&squared.collect::<Vec<u8>>())?;
    Ok(())
}

/// Width, height and pixels of a binary PGM.
fn pgm(bytes: &[u8]) -> Option<([usize; 2], &[u8])> {
    let mut fields = bytes.splitn(4, |byte| *byte == b'\n');
    let (magic, size, greatest, pixels) =
        (fields.next()?, fields.next()?, fields.next()?, fields.next()?);
    let mut sides = std::str::from_utf8(size).ok()?.split(' ').map(str::parse);
    let (width, height) = (sides.next()?.ok()?, sides.next()?.ok()?);
    (magic == b"P5" && greatest == b"255").then_some(([width, height], pixels))
}
