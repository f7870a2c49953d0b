//! Dumps of MNC (Dai, He, Sun, *Instance-aware semantic segmentation via multi-task network
//! cascades*, CVPR 2016), as the original of this mapper reads them: for detection n of an image
//! `<image file>.<nnnn>.result.txt` with `[x1 y1 x2 y2 _], score, class`, the box inclusive and the
//! class 1 to 20 in PASCAL VOC's order, and `<image file>.<nnnn>.mask.txt`, a matrix of 0 and 1 as
//! large as the box. The first number without a file ends the list.

use super::format::{MaskFormat, OpenedMasks, all_if_any, frames_of};
use super::{Frames, MaskSource, read_text};
use crate::input::source::{FrameMasks, InputError, InstanceMask, StereoImages};
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::Class;
use std::path::{Path, PathBuf};

/// PASCAL VOC's classes from 1 on.
const VOC: [Class; 20] = [
    Class::Other,      // aeroplane
    Class::Bicycle,    // bicycle
    Class::Animal,     // bird
    Class::Other,      // boat
    Class::Other,      // bottle
    Class::Bus,        // bus
    Class::Car,        // car
    Class::Animal,     // cat
    Class::Other,      // chair
    Class::Animal,     // cow
    Class::Other,      // dining table
    Class::Animal,     // dog
    Class::Animal,     // horse
    Class::Motorcycle, // motorbike
    Class::Person,     // person
    Class::Other,      // potted plant
    Class::Animal,     // sheep
    Class::Other,      // sofa
    Class::Train,      // train
    Class::Other,      // monitor
];

/// Dumps of MNC.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "mnc",
    value: "DIR",
    summary: "",
    open: |path, dataset| {
        let (dumps, there) = Mnc::open(path, frames_of(dataset));
        Ok(OpenedMasks::masks(dumps, all_if_any(there, dataset)))
    },
};

/// A folder of dumps.
pub(super) struct Mnc {
    folder: PathBuf,
    frames: Frames,
}

impl Mnc {
    /// The folder, and how many of the frames it has detections for.
    pub fn open(folder: &Path, frames: Frames) -> (Self, usize) {
        let there =
            frames.stems.iter().filter(|stem| file(folder, stem, 0, "result").is_file()).count();
        (Self { folder: folder.to_path_buf(), frames }, there)
    }
}

fn file(folder: &Path, stem: &str, number: usize, what: &str) -> PathBuf {
    folder.join(format!("{stem}.png.{number:04}.{what}.txt"))
}

impl MaskSource for Mnc {
    fn masks(&self, index: usize, _: &StereoImages) -> Result<FrameMasks, InputError> {
        let Some(stem) = self.frames.stems.get(index) else { return Ok(FrameMasks::missing()) };
        let mut results = Vec::new();
        loop {
            let path = file(&self.folder, stem, results.len(), "result");
            let Some(text) = read_text(&path)? else { break };
            let result = result(&text).ok_or_else(|| {
                InputError::masks(&path, "it is not `[x1 y1 x2 y2 _], score, class`".to_owned())
            })?;
            let (width, height) = self.frames.size;
            let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
            if result.0.area() == 0 || result.0.intersection(&image) != result.0 {
                return Err(InputError::masks(
                    &path,
                    format!("its box does not lie within the images of {width} x {height} px"),
                ));
            }
            results.push((result, results.len()));
        }
        // Best first, so that of too many the lowest scores go.
        results.sort_by(|((_, a, _), _), ((_, b, _), _)| b.total_cmp(a));
        let mut masks = FrameMasks::default();
        for ((pixels, score, class), number) in results {
            if !masks.reserve(pixels.area() as usize) {
                continue;
            }
            let path = file(&self.folder, stem, number, "mask");
            let text = read_text(&path)?
                .ok_or_else(|| InputError::masks(&path, "it is missing".to_owned()))?;
            let mask = matrix(&text, &pixels).map_err(|reason| InputError::masks(&path, reason))?;
            let class = class.checked_sub(1).and_then(|at| VOC.get(at));
            masks.refusals.unknown_class += u32::from(class.is_none());
            let at = |u: i32, v: i32| ((v - pixels.top) * pixels.width + u - pixels.left) as usize;
            let class = class.copied().unwrap_or_default();
            masks.push(InstanceMask::from_predicate(class, score, pixels, |u, v| {
                mask.get(at(u, v)).is_some_and(|&pixel| pixel)
            }));
        }
        Ok(masks)
    }
}

/// Box, score and class of a detection.
fn result(text: &str) -> Option<(PixelBox, f32, usize)> {
    let (numbers, rest) = text.split_once('[')?.1.split_once(']')?;
    let words =
        numbers.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
    // The list is of integers, but numpy may have written them as 12.0 or 12.
    let numbers: Option<Vec<i32>> = words
        .map(|word| Some(word.parse::<f64>().ok().filter(|value| value.abs() < 1e6)? as i32))
        .collect();
    let [left, top, right, bottom, _] = numbers?[..] else { return None };
    let mut words = rest.split(',').map(str::trim).filter(|word| !word.is_empty());
    let (score, class) = (words.next()?.parse().ok()?, words.next()?.parse::<f64>().ok()?);
    let pixels = PixelBox { left, top, width: right - left + 1, height: bottom - top + 1 };
    words.next().is_none().then_some((pixels, score, class as usize))
}

fn matrix(text: &str, pixels: &PixelBox) -> Result<Vec<bool>, String> {
    let mut mask = Vec::with_capacity(pixels.area() as usize);
    let mut rows = 0;
    for (line, row) in (1..).zip(text.lines()).filter(|(_, row)| !row.trim().is_empty()) {
        let before = mask.len();
        for word in row.split_whitespace() {
            let value: f64 = word
                .parse()
                .map_err(|_| format!("line {line} holds `{word}`, which is no number"))?;
            mask.push(value >= 0.5);
        }
        if mask.len() - before != pixels.width as usize {
            return Err(format!(
                "line {line} has {} columns, but its box is {} px wide",
                mask.len() - before,
                pixels.width
            ));
        }
        rows += 1;
    }
    if rows == pixels.height {
        Ok(mask)
    } else {
        Err(format!("it has {rows} rows, but its box is {} px high", pixels.height))
    }
}
