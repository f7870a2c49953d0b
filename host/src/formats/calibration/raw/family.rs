//! A guess of the lens behind four coefficients without a name: `k1 k2 p1 p2` of
//! `cv2.calibrateCamera`, or `k1 k2 k3 k4` of `cv2.fisheye.calibrate`, which have the same keys.

use crate::formats::calibration::hints::LensFamily;

/// Largest tangential coefficient of a lens that is worth using.
const LARGEST_TANGENTIAL: f64 = 0.02;
/// First coefficient below which a pinhole's barrel distortion is likely.
const BARREL: f64 = -0.1;
/// Focal length as a share of the image's width, below which it shows more than 100 degrees.
const WIDE: f64 = 0.42;

/// The likelier family, and why; `None` where nothing is to be guessed. `column` tells that a
/// matrix has four rows and one column, as `cv2.fisheye` returns it.
pub fn guess(
    coefficients: &[Vec<f64>],
    column: bool,
    focal_share: f64,
) -> Option<(LensFamily, &'static str)> {
    let four = coefficients.iter().all(|of| of.len() == 4);
    let straight = coefficients.iter().flatten().all(|k| *k == 0.0);
    if coefficients.is_empty() || !four || straight {
        return None;
    }
    let largest = |at: &[usize]| {
        let values = coefficients.iter().flat_map(|of| at.iter().filter_map(|&at| of.get(at)));
        values.fold(0.0, |most: f64, k| if k.abs() > most { k.abs() } else { most })
    };
    if largest(&[2, 3]) > LARGEST_TANGENTIAL {
        return Some((LensFamily::Fisheye, "the last two coefficients are too large for p1 p2"));
    }
    if column {
        return Some((LensFamily::Fisheye, "a column of four coefficients, as cv2.fisheye writes"));
    }
    if coefficients.iter().all(|of| of.first().is_some_and(|k1| *k1 < BARREL)) {
        return Some((LensFamily::Pinhole, "k1 is that of a barrel, p1 and p2 are small"));
    }
    if focal_share < WIDE {
        return Some((LensFamily::Fisheye, "the focal length is that of a wide lens"));
    }
    Some((LensFamily::Pinhole, "four coefficients of an ordinary lens"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_of_coefficients_tells_a_fisheye() {
        let guessed = |k: [f64; 4], focal_share: f64| {
            guess(&[k.to_vec(), k.to_vec()], false, focal_share).map(|(family, _)| family)
        };
        assert_eq!(guessed([-0.28, 0.07, 2e-4, 2e-5], 0.6), Some(LensFamily::Pinhole));
        assert_eq!(guessed([-0.01, 0.05, -0.05, 0.01], 0.33), Some(LensFamily::Fisheye));
        assert_eq!(guessed([-0.01, 0.005, -0.005, 0.001], 0.33), Some(LensFamily::Fisheye));
        assert_eq!(guessed([0.0; 4], 0.33), None, "no distortion is no question");
        assert_eq!(guess(&[vec![0.1; 5]], false, 0.3), None, "five are a pinhole's");
        let column = guess(&[vec![0.01, 0.01, 0.0, 0.0]], true, 0.7);
        assert_eq!(column.map(|(family, _)| family), Some(LensFamily::Fisheye));
    }
}
