//! Boxes as text: KITTI's labels and MOTChallenge's tables of a sequence, KITTI's labels and
//! dynvox's own lists of a frame.

use super::{DetectedBox, DetectionSource, Detections};
use crate::input::masks::format::{MaskFormat, OpenedMasks, all_if_any, frames_of};
use crate::input::masks::{Frames, class_of, read_text};
use crate::input::source::{FrameMasks, InputError, StereoImages};
use dynvox_core::tracking::Class;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// MOTChallenge's classes from 1 on.
const MOT: [Class; 13] = [
    Class::Person,     // pedestrian
    Class::Rider,      // person on vehicle
    Class::Car,        // car
    Class::Bicycle,    // bicycle
    Class::Motorcycle, // motorbike
    Class::Other,      // non motorized vehicle
    Class::Person,     // static person
    Class::Other,      // distractor
    Class::Other,      // occluder
    Class::Other,      // occluder on the ground
    Class::Other,      // occluder full
    Class::Other,      // reflection
    Class::Other,      // crowd
];

/// A row: its frame where the table names it, the class or `None` for an unknown one, score and
/// edges. A region to ignore is `None`.
type Row = Option<(Option<usize>, Option<Class>, f32, [f64; 4])>;

/// Boxes of a sequence or of each frame.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "boxes",
    value: "FILE",
    summary: "KITTI labels, MOT",
    open: |path, dataset| {
        let frames = frames_of(dataset);
        if path.is_file() {
            let (table, there) = BoxTable::open(path, frames)?;
            return OpenedMasks::boxes(table, all_if_any(there, dataset), dataset);
        }
        let (lists, there) = BoxFiles::open(path, frames);
        OpenedMasks::boxes(lists, there, dataset)
    },
};

/// A table of a sequence: KITTI tracking labels or MOTChallenge text.
pub(in super::super) struct BoxTable {
    frames: Frames,
    rows: BTreeMap<usize, Detections>,
}

impl BoxTable {
    /// Reads the file, and counts the frames it has boxes for. Nothing is seen in frames that it
    /// does not name.
    pub fn open(path: &Path, frames: Frames) -> Result<(Self, usize), InputError> {
        let text = read_text(path)?.unwrap_or_default();
        let mut rows = BTreeMap::<usize, Detections>::new();
        for (line, row) in numbered(&text) {
            let parsed = if row.contains(',') { mot(row) } else { kitti_tracking(row) };
            let parsed = parsed.ok_or_else(|| {
                let formats = "`frame track type truncated occluded alpha x1 y1 x2 y2 ...` (KITTI) \
                               nor `frame,id,left,top,width,height,score,...` (MOT)";
                InputError::masks(path, format!("line {line} is neither {formats}"))
            })?;
            let Some((Some(frame), ..)) = parsed else { continue };
            add(rows.entry(frame).or_default(), parsed)
                .map_err(|reason| InputError::masks(path, format!("line {line} {reason}")))?;
        }
        let is_named = |index: &usize| rows.contains_key(&frames.number(*index));
        let there = (0..frames.stems.len()).filter(is_named).count();
        Ok((Self { frames, rows }, there))
    }
}

impl DetectionSource for BoxTable {
    fn detections(&self, index: usize, _: &StereoImages) -> Result<Detections, InputError> {
        Ok(self.rows.get(&self.frames.number(index)).cloned().unwrap_or_default())
    }
}

/// A folder with a table for each frame: KITTI object labels, or dynvox's own lists.
pub(in super::super) struct BoxFiles {
    folder: PathBuf,
    frames: Frames,
}

impl BoxFiles {
    /// The folder, and how many of the frames it has boxes for.
    pub fn open(folder: &Path, frames: Frames) -> (Self, usize) {
        let there = frames.files(folder, "txt");
        (Self { folder: folder.to_path_buf(), frames }, there)
    }
}

impl DetectionSource for BoxFiles {
    fn detections(&self, index: usize, _: &StereoImages) -> Result<Detections, InputError> {
        let path = self.frames.stems.get(index).map(|stem| self.folder.join(format!("{stem}.txt")));
        let Some((path, text)) =
            path.and_then(|path| read_text(&path).transpose().map(|text| (path, text)))
        else {
            return Ok(Detections { masks: FrameMasks::missing(), ..Detections::default() });
        };
        let mut found = Detections::default();
        for (line, row) in numbered(&text?) {
            let parsed = own(row).or_else(|| kitti_object(row)).ok_or_else(|| {
                let formats = "`id class score x1 y1 x2 y2` nor `type truncated occluded alpha x1 \
                               y1 x2 y2 ...` (KITTI)";
                InputError::masks(&path, format!("line {line} is neither {formats}"))
            })?;
            add(&mut found, parsed)
                .map_err(|reason| InputError::masks(&path, format!("line {line} {reason}")))?;
        }
        Ok(found)
    }
}

/// Lines that are neither empty nor comments, with their numbers.
fn numbered(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..)
        .zip(text.lines().map(str::trim))
        .filter(|(_, row)| !row.is_empty() && !row.starts_with('#'))
}

/// Adds a row's box.
///
/// # Errors
/// Its edges cannot be px from the image's corner. The reason completes a sentence that begins with
/// the line's number.
fn add(found: &mut Detections, row: Row) -> Result<(), String> {
    let Some((_, class, score, edges)) = row else { return Ok(()) };
    let [left, top, right, bottom] = edges;
    if right <= left || bottom <= top {
        return Err(format!(
            "has a box without area, from {left} {top} to {right} {bottom} px. The last numbers \
             may be width and height, or the order another: see docs/inputs.md"
        ));
    }
    if edges.iter().all(|edge| (-1.0..=2.0).contains(edge)) && right - left < 1.0 {
        return Err(format!(
            "has a box from {left} {top} to {right} {bottom} px. The numbers may be shares of the \
             image's size: multiply by width and height, or give them as yolo:DIR"
        ));
    }
    found.masks.refusals.unknown_class += u32::from(class.is_none());
    found.boxes.push(DetectedBox { class: class.unwrap_or_default(), score, edges });
    Ok(())
}

/// Numbers, all finite.
fn numbers(words: &[&str]) -> Option<Vec<f64>> {
    words
        .iter()
        .map(|word| word.trim().parse().ok().filter(|value: &f64| value.is_finite()))
        .collect()
}

/// A score in 0..=1: detectors that give others (KITTI's labels without one, logits) are believed.
fn score(value: Option<f64>) -> f32 {
    value.filter(|value| (0.0..=1.0).contains(value)).unwrap_or(1.0) as f32
}

/// `frame track type truncated occluded alpha x1 y1 x2 y2 height width length x y z rotation [score]`.
fn kitti_tracking(row: &str) -> Option<Row> {
    let words: Vec<&str> = row.split_whitespace().collect();
    let (frame, rest) = (words.first()?.parse().ok()?, words.get(2..)?);
    Some(kitti(rest)?.map(|(_, class, score, edges)| (Some(frame), class, score, edges)))
}

/// `type truncated occluded alpha x1 y1 x2 y2 height width length x y z rotation [score]`.
fn kitti_object(row: &str) -> Option<Row> {
    kitti(&row.split_whitespace().collect::<Vec<_>>())
}

fn kitti(words: &[&str]) -> Option<Row> {
    let name = words.first().filter(|name| name.starts_with(|char: char| char.is_alphabetic()))?;
    let values = numbers(words.get(1..)?)?;
    let &[x1, y1, x2, y2] = values.get(3..7)? else { return None };
    // KITTI's edges are columns and rows that belong to the box.
    Some((*name != "DontCare").then(|| {
        (None, class_of(name), score(values.get(14).copied()), [x1, y1, x2 + 1.0, y2 + 1.0])
    }))
}

/// `id class score x1 y1 x2 y2`; a class may have spaces.
fn own(row: &str) -> Option<Row> {
    let words: Vec<&str> = row.split_whitespace().collect();
    let name_words = words.len().checked_sub(6).filter(|&count| count > 0)?;
    let _: u16 = words.first()?.parse().ok()?;
    let (name, rest) = words.get(1..)?.split_at(name_words);
    let &[given, x1, y1, x2, y2] = &numbers(rest)?[..] else { return None };
    Some(Some((None, class_of(&name.join(" ")), score(Some(given)), [x1, y1, x2, y2])))
}

/// `frame,id,left,top,width,height,score[,class,...]`, frames and pixels counted from 1. A score of
/// 0 marks a region to ignore. A box without a class (7 columns, or -1) is a moving object's.
fn mot(row: &str) -> Option<Row> {
    let values = numbers(&row.split(',').collect::<Vec<_>>())?;
    let &[frame, _, left, top, width, height] = values.get(..6)? else { return None };
    let frame = (frame as usize).checked_sub(1)?;
    let given = values.get(6).copied();
    let class = match values.get(7) {
        None | Some(-1.0) => Some(Class::MovingObject),
        Some(&class) => (class as usize).checked_sub(1).and_then(|at| MOT.get(at)).copied(),
    };
    let [left, top] = [left - 1.0, top - 1.0];
    Some(
        (given != Some(0.0))
            .then(|| (Some(frame), class, score(given), [left, top, left + width, top + height])),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_every_format_are_told_apart() {
        let label = "3 7 Van 0 1 -1.5 10.0 20.0 29.0 59.0 1.5 1.6 4.0 2.0 1.6 20.0 -1.57";
        assert_eq!(
            kitti_tracking(label),
            Some(Some((Some(3), Some(Class::Van), 1.0, [10.0, 20.0, 30.0, 60.0])))
        );
        assert_eq!(
            kitti_tracking("3 -1 DontCare -1 -1 -10 0 0 9 9 -1 -1 -1 -1000 -1000 -1000 -10"),
            Some(None)
        );
        let object = "Pedestrian 0.00 0 -0.20 712.4 143.0 810.7 307.9 1.89 0.48 1.20 1.84 1.47 \
                      8.41 0.01 0.5";
        assert_eq!(
            kitti_object(object).flatten().map(|row| (row.1, row.2)),
            Some((Some(Class::Person), 0.5))
        );
        assert_eq!(
            mot("1,-1,11,21,5,6,0.9,3,1"),
            Some(Some((Some(0), Some(Class::Car), 0.9, [10.0, 20.0, 15.0, 26.0])))
        );
        assert_eq!(mot("1,-1,11,21,5,6,0,3,1"), Some(None), "a region to ignore");
        assert_eq!(
            mot("2,-1,11,21,5,6,57.3,-1,-1,-1").flatten().map(|row| (row.1, row.2)),
            Some((Some(Class::MovingObject), 1.0)),
            "detections without classes are of what may move"
        );
        assert_eq!(
            ["1,1,268,91,19,15,0.9", "1,1,268,91,19,15,0.9,2", "1,1,268,91,19,15,0.9,99"]
                .map(|row| mot(row).flatten().map(|row| row.1)),
            [Some(Some(Class::MovingObject)), Some(Some(Class::Rider)), Some(None)]
        );
        assert_eq!(
            own("2 traffic light 0.7 1 2 3.5 4"),
            Some(Some((None, Some(Class::Other), 0.7, [1.0, 2.0, 3.5, 4.0])))
        );
        for wrong in ["", "1 2 3", "frame,id,left,top,width,height", "0,1,2,3,4,5"] {
            assert!(
                kitti_tracking(wrong).is_none() && mot(wrong).is_none() && own(wrong).is_none(),
                "{wrong}"
            );
        }
        assert!(kitti_tracking("3 7 Van 0 1 -1.5 10.0 20.0").is_none(), "a label cut off");
        for (row, expected) in [
            ("1 car 0.9 0.2 0.3 0.4 0.5", "shares of the image's size"),
            ("1 car 0.9 200 300 40 50", "width and height"),
        ] {
            let reason = add(&mut Detections::default(), own(row).unwrap()).unwrap_err();
            assert!(reason.contains(expected), "{row}: {reason}");
        }
    }
}
