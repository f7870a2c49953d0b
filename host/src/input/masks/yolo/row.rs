//! A row of YOLO text: a class, a box or a polygon in shares of the image, and what programs
//! append.
//!
//! Ultralytics appends the score (`save_conf`), then the number of a track (`track`): `class cx cy
//! w h [score] [track]`, or `class x1 y1 x2 y2 x3 y3 ... [score] [track]`. Six numbers are
//! therefore a triangle, or a box with both; what a folder's rows end in tells the two apart
//! ([`ends_in_tracks`]).

/// Shares may exceed 0 to 1 by rounding.
const SLACK: f64 = 1e-3;
/// Polygons may leave the image by this share of it: some programs do not clip.
const OUTSIDE: f64 = 0.1;
/// Boxes may leave the image by this share of it.
const BOX_OUTSIDE: f64 = 0.03;
/// Fewest key points of a pose.
const KEY_POINTS_MIN: usize = 3;

/// An object's shape, in shares of the image's width and height.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// Centre, width and height.
    Box([f64; 4]),
    /// Corners.
    Polygon(Vec<[f64; 2]>),
}

/// An object.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Number of its class.
    pub class: usize,
    /// Outline.
    pub shape: Shape,
    /// Confidence, 0 to 1; 1 where the row has none.
    pub score: f32,
}

/// Returns true if the rows of a text that could be triangles, boxes with score and track, or
/// polygons end in whole numbers from 1 on, so that these are tracks; `None` without such rows.
pub(super) fn ends_in_tracks(text: &str) -> Option<bool> {
    let rows = text.lines().map(|row| row.split_whitespace().collect::<Vec<_>>());
    let doubtful = rows.filter(|words| words.len() >= 7 && words.len() % 2 == 1);
    doubtful.map(|words| words.last().is_some_and(|word| is_track(word))).reduce(|a, b| a && b)
}

fn is_track(word: &str) -> bool {
    word.bytes().all(|byte| byte.is_ascii_digit())
        && word.parse().is_ok_and(|number: u64| number > 0)
}

/// Reads a row; `has_tracks` as [`ends_in_tracks`] found it for the folder.
///
/// # Errors
/// The row is none. The reason completes a sentence that begins with the line's number.
pub(super) fn parse(row: &str, has_tracks: bool) -> Result<Row, String> {
    let words: Vec<&str> = row.split_whitespace().collect();
    let values =
        words.iter().skip(1).map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()));
    let class = words.first().and_then(|word| word.parse().ok());
    let (Some(class), Some(values)) = (class, values.collect::<Option<Vec<f64>>>()) else {
        return Err(neither());
    };
    let last_is_track = words.last().is_some_and(|word| is_track(word));
    // What follows the shape: nothing, a score or a track, or both.
    let (shape, score) = match values[..] {
        [_, _, _, _] => (&values[..], None),
        [.., last] if values.len() >= 5 && values.len() % 2 == 1 => {
            // A lone 1 is a score of 1 or the first track: both mean the same here.
            let is_score = !last_is_track || last <= 1.0;
            (&values[..values.len() - 1], is_score.then_some(last))
        }
        [.., score, _] if values.len() >= 6 && has_tracks && last_is_track => {
            (&values[..values.len() - 2], Some(score))
        }
        [..] if values.len() >= 6 => (&values[..], None),
        _ => return Err(neither()),
    };
    let score = score.unwrap_or(1.0);
    if !(0.0..=1.0).contains(&score) {
        return Err(format!(
            "has a score of {score}: scores lie between 0 and 1. It may be a percentage, a logit, \
             or a track's number that is not whole"
        ));
    }
    if is_pose(&values) {
        return Err("may hold key points of a pose: write boxes or polygons without them".into());
    }
    let shape = match *shape {
        [u, v, width, height] => Shape::Box(checked_box([u, v, width, height])?),
        _ => Shape::Polygon(checked_polygon(shape)?),
    };
    Ok(Row { class, shape, score: score as f32 })
}

fn neither() -> String {
    "is neither `class cx cy w h [score] [track]` nor `class x1 y1 x2 y2 x3 y3 ... [score] \
     [track]`, in shares of the image's size"
        .into()
}

/// Returns true if a box is followed by triples whose first two numbers lie within it.
fn is_pose(values: &[f64]) -> bool {
    let &[u, v, width, height, ref more @ ..] = values else { return false };
    let (points, rest) = more.as_chunks::<3>();
    let inside = |[x, y, _]: &[f64; 3]| {
        (x - u).abs() <= width && (y - v).abs() <= height || (*x == 0.0 && *y == 0.0)
    };
    points.len() >= KEY_POINTS_MIN
        && rest.len() <= 2
        && width * height > 0.0
        && points.iter().all(inside)
        && points.iter().any(|[x, y, _]| *x != 0.0 || *y != 0.0)
}

fn checked_box([u, v, width, height]: [f64; 4]) -> Result<[f64; 4], String> {
    for value in [u, v, width, height] {
        checked_share(value, SLACK)?;
    }
    let leaves = |middle: f64, side: f64| {
        middle - side / 2.0 < -BOX_OUTSIDE || middle + side / 2.0 > 1.0 + BOX_OUTSIDE
    };
    if leaves(u, width) || leaves(v, height) {
        return Err(format!(
            "is a box that leaves the image: its centre is at {u} {v}, its size {width} x \
             {height}. The numbers may be corners, x1 y1 x2 y2: write centre, width and height"
        ));
    }
    Ok([u, v, width, height])
}

fn checked_polygon(corners: &[f64]) -> Result<Vec<[f64; 2]>, String> {
    for &value in corners {
        checked_share(value, OUTSIDE)?;
    }
    Ok(corners.as_chunks::<2>().0.to_vec())
}

fn checked_share(value: f64, slack: f64) -> Result<(), String> {
    if (-slack..=1.0 + slack).contains(&value) {
        return Ok(());
    }
    let may_be = if value < 0.0 || value <= 1.0 + 2.0 * OUTSIDE {
        "The shape may leave the image: clip it"
    } else if value.fract() == 0.0 {
        "It may be in pixels (divide by the image's width and height), or a track's number after \
         a score that is missing in other rows"
    } else {
        "It may be in pixels: divide by the image's width and height"
    };
    Err(format!("has {value}, which is not a share of the image's size from 0 to 1. {may_be}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxed(text: &str, has_tracks: bool) -> ([f64; 4], f32) {
        match parse(text, has_tracks).unwrap() {
            Row { shape: Shape::Box(values), score, .. } => (values, score),
            row => panic!("{text}: {row:?}"),
        }
    }

    fn corners(text: &str, has_tracks: bool) -> (usize, f32) {
        match parse(text, has_tracks).unwrap() {
            Row { shape: Shape::Polygon(corners), score, .. } => (corners.len(), score),
            row => panic!("{text}: {row:?}"),
        }
    }

    #[test]
    fn boxes_and_polygons_may_have_scores_and_tracks() {
        let car = [0.4, 0.5, 0.2, 0.1];
        assert_eq!(boxed("2 0.4 0.5 0.2 0.1", false), (car, 1.0));
        assert_eq!(boxed("2 0.4 0.5 0.2 0.1 0.87", false), (car, 0.87));
        assert_eq!(boxed("2 0.4 0.5 0.2 0.1 5", false), (car, 1.0), "track 5");
        assert_eq!(boxed("2 0.4 0.5 0.2 0.1 0.87 17", true), (car, 0.87));
        let triangle = "2 0.4 0.5 0.6 0.5 0.5 0.7";
        assert_eq!(corners(triangle, false), (3, 1.0));
        assert_eq!(corners(&format!("{triangle} 0.5"), false), (3, 0.5));
        assert_eq!(corners(&format!("{triangle} 12"), false), (3, 1.0));
        assert_eq!(corners(&format!("{triangle} 0.25 1"), true), (3, 0.25));
        assert_eq!(corners("2 -0.05 0.5 0.6 1.02 0.5 0.7", false).0, 3, "a little outside");
    }

    #[test]
    fn the_ends_of_a_folders_rows_tell_tracks_from_corners() {
        let tracks = "2 0.4 0.5 0.2 0.1 0.87 1\n2 0.4 0.5 0.2 0.1 0.87 2\n";
        assert_eq!(ends_in_tracks(tracks), Some(true));
        assert_eq!(
            ends_in_tracks("2 0.4 0.5 0.6 0.5 0.5 1\n2 0.4 0.5 0.6 0.5 0.5 0.7"),
            Some(false)
        );
        assert_eq!(ends_in_tracks("2 0.4 0.5 0.2 0.1 0.87\n2 0.4 0.5 0.2 0.1"), None);
    }

    #[test]
    fn what_no_share_or_score_can_be_is_refused_with_what_it_may_be() {
        for (row, expected) in [
            ("2 0.4 0.5 0.2 0.1 7.5", "a score of 7.5"),
            ("2 0.4 0.5 0.2 0.1 -1.2", "a score of -1.2"),
            ("2 0.4 0.5 0.6 0.5 0.5 0.7 87.5", "a score of 87.5"),
            ("2 142.5 0.5 0.2 0.1", "may be in pixels"),
            ("2 278 95 18 13", "may be in pixels"),
            ("2 278 95 300 95 290 120", "may be in pixels"),
            ("2 0.4 0.5 0.2 0.1 0.87 3", "a track's number"),
            ("2 0.4 0.5 0.6 1.15 0.5 0.7", "leave the image"),
            ("2 -0.4 0.5 0.6 0.5 0.5 0.7", "leave the image"),
            ("2 0.6 0.5 0.9 0.9", "may be corners"),
            ("0 0.5 0.5 0.2 0.4 0.5 0.4 1 0.45 0.45 1 0.55 0.6 0.9", "key points"),
            ("2 0.5 0.5 0.25", "is neither"),
            ("car 0.5 0.5 0.2 0.2", "is neither"),
            ("2 0.5 0.5 0.2 nan", "is neither"),
        ] {
            let reason = parse(row, false).unwrap_err();
            assert!(reason.contains(expected), "{row}: {reason}");
        }
    }
}
