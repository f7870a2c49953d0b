//! One row of a trajectory, told by how many numbers it has.

use crate::formats::rows::{numbers_of, words_of};
use dynvox_core::geometry::Transform;
use nalgebra::Matrix3;

/// Largest error of a rotation matrix's products of columns: more than three printed digits lose.
const ROTATION_TOLERANCE: f64 = 1e-2;
/// Time stamps from here on are in ns: seconds reach it in the year 3 million.
const NANOSECONDS_FROM: f64 = 1e14;
/// Last row of a matrix of four rows.
const LAST_ROW: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Link from a row to its pose's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Key {
    /// Nothing: rows are numbered from 0.
    Row,
    /// Number of the frame.
    Number(usize),
    /// Time, in the file's unit.
    Time(f64),
    /// Time, ns, and the pose is that of the body the sensors are mounted on.
    BodyTime(f64),
}

/// Reads a row.
///
/// # Errors
/// It is not a pose. The reason completes a sentence that begins with the line's number.
pub(super) fn parse(row: &str) -> Result<(Key, Transform), String> {
    let numbers = numbers_of(row).ok_or_else(|| {
        let wrong = words_of(row).find(|word| !word.parse::<f64>().is_ok_and(f64::is_finite));
        format!("is not a pose: {} is not a number", wrong.as_deref().unwrap_or("it"))
    })?;
    let has_commas = row.contains([',', ';']);
    match numbers[..] {
        [_, _, _, _, _, _, _, _, _, _, _, _] => Ok((Key::Row, from_matrix(&numbers)?)),
        [frame, ref matrix @ ..] if matrix.len() == 12 => {
            Ok((number(frame)?, from_matrix(matrix)?))
        }
        [ref matrix @ .., a, b, c, d] if numbers.len() == 16 && [a, b, c, d] == LAST_ROW => {
            Ok((Key::Row, from_matrix(matrix)?))
        }
        [frame, ref matrix @ .., a, b, c, d] if numbers.len() == 17 && [a, b, c, d] == LAST_ROW => {
            Ok((number(frame)?, from_matrix(matrix)?))
        }
        // EuRoC: time, position, quaternion with its real part first, and velocity and biases.
        [time_ns, x, y, z, w, i, j, k, ..]
            if numbers.len() == 17 || (numbers.len() == 8 && has_commas && is_ns(time_ns)) =>
        {
            Ok((Key::BodyTime(time_ns), from_quaternion([i, j, k, w], [x, y, z])?))
        }
        [time, x, y, z, i, j, k, w] => {
            Ok((Key::Time(time), from_quaternion([i, j, k, w], [x, y, z])?))
        }
        _ => Err(format!("is not a pose: it has {} numbers", numbers.len())),
    }
}

fn is_ns(time: f64) -> bool {
    time >= NANOSECONDS_FROM
}

fn number(frame: f64) -> Result<Key, String> {
    if frame >= 0.0 && frame.fract() == 0.0 && frame < 1e9 {
        Ok(Key::Number(frame as usize))
    } else {
        Err(format!("begins with {frame}, which is not the number of a frame"))
    }
}

/// The twelve numbers of the rows of a rotation and a translation.
fn from_matrix(numbers: &[f64]) -> Result<Transform, String> {
    let &[r00, r01, r02, x, r10, r11, r12, y, r20, r21, r22, z] = numbers else {
        return Err("is not a pose".to_owned());
    };
    let rotation = Matrix3::new(r00, r01, r02, r10, r11, r12, r20, r21, r22);
    let error = (rotation.transpose() * rotation - Matrix3::identity()).amax();
    if error >= ROTATION_TOLERANCE || rotation.determinant() < 0.0 {
        let scale = rotation.determinant().abs().cbrt();
        let unscaled = rotation / scale;
        let is_scaled = scale > 0.0
            && (unscaled.transpose() * unscaled - Matrix3::identity()).amax() < ROTATION_TOLERANCE;
        let what = match rotation.determinant() {
            _ if rotation.amax() == 0.0 => "it is zero".to_owned(),
            of if is_scaled && of > 0.0 => format!("it is scaled by {scale:.3}"),
            of if of < 0.0 => "it mirrors: an axis points the wrong way".to_owned(),
            _ => "its columns are not of length 1 at right angles".to_owned(),
        };
        return Err(format!("has a 3x3 part that is not a rotation: {what}"));
    }
    let rows = [[r00, r01, r02], [r10, r11, r12], [r20, r21, r22]];
    Ok(Transform::from_rotation_matrix(&rows, [x, y, z]).normalized())
}

fn from_quaternion(rotation: [f64; 4], translation_m: [f64; 3]) -> Result<Transform, String> {
    let pose = Transform { rotation, translation_m };
    if pose.is_rotation() {
        return Ok(pose.normalized());
    }
    let length = rotation.iter().map(|part| part * part).sum::<f64>().sqrt();
    Err(format!("is not a pose: its quaternion has length {length:.3}, not 1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about y, at (1, 2, 3).
    const MATRIX: &str = "0 0 1 1 0 1 0 2 -1 0 0 3";
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

    #[test]
    fn rows_of_every_format_are_the_same_pose() {
        let pose = Transform { rotation: [0.0, HALF, 0.0, HALF], translation_m: [1.0, 2.0, 3.0] };
        let euroc = format!("1403636579763555584,1,2,3,{HALF},0,{HALF},0");
        for (row, key) in [
            (MATRIX.to_owned(), Key::Row),
            (MATRIX.replace(' ', ","), Key::Row),
            (MATRIX.replace(' ', ",0 ") + ",0", Key::Row),
            (format!("{MATRIX} 0 0 0 1"), Key::Row),
            (format!("7 {MATRIX}"), Key::Number(7)),
            (format!("7 {MATRIX} 0 0 0 1 "), Key::Number(7)),
            (format!("0.5 1 2 3 0 {HALF} 0 {HALF}"), Key::Time(0.5)),
            (
                format!("0,5\t1,0\t2,0\t3,0\t0,0\t{HALF}\t0,0\t{HALF}").replace("0.7", "0,7"),
                Key::Time(0.5),
            ),
            (euroc.clone(), Key::BodyTime(1_403_636_579_763_555_584.0)),
            (euroc + ",0.1,0,0,0,0,0,0.01,0.02,0.03", Key::BodyTime(1_403_636_579_763_555_584.0)),
        ] {
            let (found, read) = parse(&row).unwrap_or_else(|error| panic!("{row} {error}"));
            assert_eq!(found, key, "{row}");
            let apart = pose.inverse() * read;
            assert!(apart.distance_m() < 1e-12 && apart.angle_rad() < 1e-7, "{row}: {read:?}");
        }
    }

    #[test]
    fn matrices_that_are_no_rotation_are_named() {
        for (row, expected) in [
            ("1.1 0 0 0 0 1.1 0 0 0 0 1.1 0", "scaled by 1.100"),
            ("0.001 0 0 0 0 0.001 0 0 0 0 0.001 0", "scaled by 0.001"),
            ("1 0 0 0 0 -1 0 0 0 0 1 0", "mirrors"),
            ("-1.1 0 0 0 0 1.1 0 0 0 0 1.1 0", "mirrors"),
            ("0 0 0 0 0 0 0 0 0 0 0 0", "it is zero"),
            ("1 0.1 0 0 0 1 0 0 0 0 1 0", "right angles"),
            ("3 1.1 0 0 0 0 1.1 0 0 0 0 1.1 0", "scaled by 1.100"),
            ("0 1 2 3 0 0 0 0.5", "length 0.500"),
            ("0.5 1 0 0 0 0 1 0 0 0 0 1 0", "not the number of a frame"),
            ("1 2 3", "it has 3 numbers"),
            ("0 1 2 soon 0 0 0 1", "soon is not a number"),
        ] {
            let reason = parse(row).unwrap_err();
            assert!(reason.contains(expected), "{row}: {reason}");
        }
    }
}
