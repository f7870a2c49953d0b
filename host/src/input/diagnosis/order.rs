//! Whether frames follow each other: of consecutive left images each one's nearest must be a
//! neighbour.

use super::{Fault, Finding, finding};
use crate::formats::Image;

/// Consecutive frames looked at.
const WINDOW: usize = 24;
/// Fewest frames that allow a verdict.
const FEWEST: usize = 8;
/// Columns of a thumbnail.
const COLUMNS: usize = 64;
/// A neighbour that is at most so much further away than the nearest frame counts as nearest: a
/// standing camera's frames are all alike.
const NEAREST: f64 = 1.3;
/// Share of frames whose nearest is a neighbour, of frames in order.
const IN_ORDER: f64 = 0.6;
/// A step so much longer than the usual one is a jump.
const JUMP: f64 = 4.0;

/// Numbers of consecutive frames.
pub fn window(indices: &[usize]) -> &[usize] {
    indices.get(..indices.len().min(WINDOW)).unwrap_or(&[])
}

/// Means of squares of the image, less the mean of all.
pub fn thumbnail(image: &Image<u8>) -> Vec<f64> {
    let side = image.width().div_ceil(COLUMNS).max(1);
    let (columns, rows) = (image.width() / side, image.height() / side);
    let mean = |i: usize, j: usize| {
        let pixels =
            (0..side).flat_map(|dv| (0..side).map(move |du| (i * side + du, j * side + dv)));
        pixels.map(|(u, v)| f64::from(image.get(u, v).unwrap_or(0))).sum::<f64>()
            / (side * side) as f64
    };
    let means: Vec<f64> = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| (i, j)))
        .map(|(i, j)| mean(i, j))
        .collect();
    let all = means.iter().sum::<f64>() / means.len().max(1) as f64;
    means.iter().map(|one| one - all).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len().max(1) as f64
}

/// Checks the order of consecutive images, beginning with frame `first`.
pub fn check(thumbnails: &[Vec<f64>], first: usize) -> Option<Finding> {
    let count = thumbnails.len();
    if count < FEWEST {
        return None;
    }
    let between = |a: usize, b: usize| {
        thumbnails.get(a).zip(thumbnails.get(b)).map_or(f64::INFINITY, |(a, b)| distance(a, b))
    };
    let follows = |at: &usize| {
        let neighbour = between(*at, at.wrapping_sub(1)).min(between(*at, at + 1));
        let nearest = (0..count)
            .filter(|other| other != at)
            .map(|other| between(*at, other))
            .fold(f64::INFINITY, f64::min);
        neighbour <= NEAREST * nearest + 0.05
    };
    let share = (0..count).filter(follows).count() as f64 / count as f64;
    if share < IN_ORDER {
        let message =
            "the frames are out of order: images that follow each other show different places. Check the file names: their numbers \
                       need leading zeros, or times as names"
                .to_owned();
        return Some(finding(Fault::Order, true, message));
    }
    let steps: Vec<f64> = (1..count).map(|at| between(at - 1, at)).collect();
    let usual = super::median(steps.clone());
    let (at, longest) = steps.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    (*longest > JUMP * usual && usual > 0.2).then(|| {
        let message = format!(
            "the sequence jumps after frame {}: frames may be missing there. Map its parts one by \
             one with --start and --frames",
            first + at
        );
        finding(Fault::Jump, false, message)
    })
}
