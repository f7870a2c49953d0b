//! `lidar.csv`: three rows for each evaluated frame, one by what the points belong to.

use crate::evaluate::lidar::{EvaluatedFrame, Layer, RULES};
use std::io::{self, Write};

/// Writes the table. `points = error + missing + correct` for input and map and every rule; columns `alone` count each by itself.
pub fn write_lidar(out: &mut impl Write, frames: &[EvaluatedFrame]) -> io::Result<()> {
    write!(out, "frame,layer,points,missing,input_missing_alone,map_missing_alone,scan_points,out_of_range,outside,epipolar")?;
    for (at, rule) in RULES.iter().enumerate() {
        let name = if at == 0 { "kitti".to_owned() } else { format!("{}px", rule.px) };
        write!(out, ",input_error_{name},map_error_{name},input_error_alone_{name},map_error_alone_{name}")?;
    }
    writeln!(out)?;
    for frame in frames {
        for (layer, tally) in Layer::ALL.iter().zip(&frame.layers) {
            let ([input, map], count) = (&tally.sources, &frame.count);
            write!(out, "{},{},{},{}", frame.frame, layer.name(), tally.total, tally.missing)?;
            write!(out, ",{},{}", input.missing_alone, map.missing_alone)?;
            write!(out, ",{},{},{},{}", count.points, count.out_of_range, count.outside, count.epipolar)?;
            for rule in 0..RULES.len() {
                write!(out, ",{},{}", input.errors[rule], map.errors[rule])?;
                write!(out, ",{},{}", input.errors_alone[rule], map.errors_alone[rule])?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}
