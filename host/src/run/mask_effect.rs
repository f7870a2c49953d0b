//! Masks that are given and have no effect.

use crate::input::masks::MaskChoice;
use crate::observe::FrameRow;

/// Frames with masks due after which their effect is reported.
const AFTER_FRAMES: usize = 10;

/// Counts what became of the masks of the first frames.
#[derive(Debug, Default)]
pub(super) struct MaskEffect {
    /// Frames to go; 0 where nothing is counted any more.
    frames_left: usize,
    given: u32,
    refused: u32,
    unknown: u32,
    ignored: u32,
}

impl MaskEffect {
    /// Counts masks of files and networks, given in every `every`-th frame.
    pub fn new(choice: &MaskChoice, every: usize) -> Self {
        let is_counted = matches!(choice, MaskChoice::Files(..) | MaskChoice::Networks(_));
        let frames_left = if is_counted { AFTER_FRAMES.saturating_mul(every) } else { 0 };
        Self { frames_left, ..Self::default() }
    }

    /// Adds a frame whose source gave `given` masks. Returns a warning if none of the first frames'
    /// had an effect.
    pub fn add(&mut self, row: &FrameRow, given: usize, choice: &MaskChoice) -> Option<String> {
        if self.frames_left == 0 {
            return None;
        }
        let report = &row.report.tracking.detections;
        if report.accepted + report.tracked_only > 0 {
            self.frames_left = 0;
            return None;
        }
        self.frames_left -= 1;
        self.given += u32::try_from(given).unwrap_or(u32::MAX);
        self.refused += report.refused() + row.mask_refusals.empty;
        self.ignored += report.ignored;
        self.unknown += row.mask_refusals.unknown_class;
        (self.frames_left == 0).then(|| self.warning(choice))
    }

    fn warning(&self, choice: &MaskChoice) -> String {
        let Self { given, refused, unknown, ignored, .. } = self;
        let why = if *given == 0 {
            "gave none: compare the numbers or names of its frames with those of the images".into()
        } else {
            format!(
                "gave {given}: {refused} were refused, {ignored} have a class that does not move \
                 ({unknown} an unknown one), the others are too small. docs/inputs.md has the classes"
            )
        };
        format!("no mask had an effect in the first frames: --instances {choice} {why}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(accepted: u32) -> FrameRow {
        let mut row = FrameRow::default();
        row.report.tracking.detections.accepted = accepted;
        row.mask_refusals.unknown_class = 2;
        row
    }

    #[test]
    fn masks_without_an_effect_in_ten_frames_are_reported_once() {
        let choice: MaskChoice = "yolo:labels".parse().unwrap();
        let mut effect = MaskEffect::new(&choice, 1);
        let warnings: Vec<_> =
            (0..20).filter_map(|frame| Some((frame, effect.add(&row(0), 2, &choice)?))).collect();
        let [(9, warning)] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(
            warning.contains("gave 20") && warning.contains("(20 an unknown one)"),
            "{warning}"
        );
        let mut effect = MaskEffect::new(&choice, 1);
        let warning = (0..10).find_map(|_| effect.add(&row(0), 0, &choice)).unwrap();
        assert!(warning.contains("yolo:labels gave none"), "{warning}");
    }

    #[test]
    fn masks_that_are_used_or_not_asked_for_are_not_reported() {
        let choice: MaskChoice = "yolo:labels".parse().unwrap();
        let mut effect = MaskEffect::new(&choice, 1);
        assert!((0..30).all(|frame| effect.add(&row(u32::from(frame == 7)), 2, &choice).is_none()));
        let motion = MaskChoice::Motion;
        let mut effect = MaskEffect::new(&motion, 1);
        assert!((0..30).all(|_| effect.add(&row(0), 0, &motion).is_none()));
        let mut slow = MaskEffect::new(&choice, 5);
        assert!((0..49).all(|_| slow.add(&row(0), 0, &choice).is_none()));
        assert!(slow.add(&row(0), 0, &choice).is_some());
    }
}
