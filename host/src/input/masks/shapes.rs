//! Masks of other shapes than pictures: run lengths down the columns, and polygons.

use crate::input::source::{InstanceMask, union};
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::Class;

/// The box of runs (first pixel and length, counted down the columns) in an image of `height` rows;
/// `None` without any.
pub(super) fn around_runs(runs: &[(usize, usize)], height: usize) -> Option<PixelBox> {
    let boxes =
        by_column(runs, height).map(|(left, top, height)| PixelBox { left, top, width: 1, height });
    boxes.reduce(|a, b| union(&a, &b))
}

/// The mask of runs within their box.
pub(super) fn mask_of_runs(
    class: Class,
    score: f32,
    pixels: PixelBox,
    runs: &[(usize, usize)],
    height: usize,
) -> InstanceMask {
    let mut mask = vec![0; pixels.area() as usize];
    for (u, top, rows) in by_column(runs, height) {
        for v in top..top + rows {
            mask[((v - pixels.top) * pixels.width + u - pixels.left) as usize] = 1;
        }
    }
    InstanceMask { class, score, pixels, mask }
}

/// The runs split by column: column, first row, rows.
fn by_column(runs: &[(usize, usize)], height: usize) -> impl Iterator<Item = (i32, i32, i32)> + '_ {
    runs.iter().flat_map(move |&(start, length)| {
        let end = start + length;
        (start / height..=(end - 1) / height).map(move |u| {
            let (top, bottom) =
                (start.max(u * height) - u * height, end.min((u + 1) * height) - u * height);
            (u as i32, top as i32, (bottom - top) as i32)
        })
    })
}

/// Polygons of one object in an image.
pub(super) struct Polygons<'p> {
    polygons: &'p [Vec<[f64; 2]>],
    /// The pixels their corners enclose.
    pub pixels: PixelBox,
}

impl<'p> Polygons<'p> {
    /// Corners in px from the outer corner of the upper left pixel.
    pub fn new(polygons: &'p [Vec<[f64; 2]>], (width, height): (usize, usize)) -> Self {
        let corners = || polygons.iter().flatten();
        let least = |axis: usize| {
            corners()
                .map(|corner| corner[axis])
                .fold(f64::INFINITY, f64::min)
                .floor()
                .clamp(-1e6, 1e6) as i32
        };
        let most = |axis: usize| {
            corners()
                .map(|corner| corner[axis])
                .fold(f64::NEG_INFINITY, f64::max)
                .ceil()
                .clamp(-1e6, 1e6) as i32
        };
        let (left, top) = (least(0), least(1));
        let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
        let pixels = PixelBox { left, top, width: most(0) - left, height: most(1) - top }
            .intersection(&image);
        Self { polygons, pixels }
    }

    /// The pixels whose centres lie in a polygon, by the rule of even and odd crossings; `None`
    /// without any.
    pub fn mask(&self, class: Class, score: f32) -> Option<InstanceMask> {
        let PixelBox { left, top, width, height } = self.pixels;
        let mut marks = vec![false; self.pixels.area() as usize];
        for (row, line) in
            marks.chunks_exact_mut(width.max(1) as usize).enumerate().take(height as usize)
        {
            let v = f64::from(top) + row as f64 + 0.5;
            for polygon in self.polygons {
                let mut crossings: Vec<f64> =
                    edges(polygon).filter_map(|edge| crossing(edge, v)).collect();
                crossings.sort_by(f64::total_cmp);
                for pair in crossings.as_chunks::<2>().0 {
                    let column = |u: f64| {
                        ((u - f64::from(left) - 0.5).ceil().max(0.0) as usize).min(width as usize)
                    };
                    line[column(pair[0])..column(pair[1])].fill(true);
                }
            }
        }
        let at = |u: i32, v: i32| ((v - top) * width + u - left) as usize;
        InstanceMask::from_predicate(class, score, self.pixels, |u, v| marks[at(u, v)])
    }
}

/// The sides of a polygon.
fn edges(polygon: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    polygon.iter().zip(polygon.iter().cycle().skip(1)).map(|(from, to)| [*from, *to])
}

/// Returns the column at which a side crosses a row.
fn crossing([[x1, y1], [x2, y2]]: [[f64; 2]; 2], v: f64) -> Option<f64> {
    ((y1 <= v) != (y2 <= v)).then(|| x1 + (v - y1) / (y2 - y1) * (x2 - x1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygons: &[Vec<[f64; 2]>]) -> Option<(PixelBox, usize)> {
        let mask = Polygons::new(polygons, (40, 30)).mask(Class::Car, 1.0)?;
        Some((mask.pixels, mask.mask.iter().filter(|pixel| **pixel > 0).count()))
    }

    #[test]
    fn polygons_hold_the_pixels_whose_centres_they_hold() {
        let square = |left: f64, side: f64| {
            vec![[left, 5.0], [left + side, 5.0], [left + side, 5.0 + side], [left, 5.0 + side]]
        };
        assert_eq!(
            area(&[square(10.0, 4.0)]),
            Some((PixelBox { left: 10, top: 5, width: 4, height: 4 }, 16))
        );
        assert_eq!(
            area(&[square(10.6, 4.0)]).unwrap().0.left,
            11,
            "the centre of column 10 is outside"
        );
        assert_eq!(
            area(&[square(10.0, 4.0), square(20.0, 2.0)]).unwrap().1,
            20,
            "parts of one object"
        );
        assert_eq!(area(&[square(38.0, 10.0)]).unwrap().1, 20, "cut by the image");
        assert_eq!(
            area(&[vec![[2.0, 2.0], [6.0, 2.0], [2.0, 6.0]]]).unwrap().1,
            6,
            "half of 4 x 4, less the diagonal"
        );
        for nothing in [vec![], vec![[1.0, 1.0]], vec![[f64::NAN; 2]; 3], square(-50.0, 4.0)] {
            assert_eq!(area(&[nothing]), None);
        }
    }
}
