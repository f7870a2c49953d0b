//! What the outputs of a network are, told from their shapes.

use super::model::Output;
use super::settings::Settings;

/// Strides of a detector's three grids, px.
pub const STRIDES: [usize; 3] = [8, 16, 32];

/// Meaning of a network's outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Boxes.
    Boxes(BoxFormat),
    /// One class a pixel: `[1, H, W]` integers, `[1, C, H, W]` logits.
    Semantic,
    /// Boxes with coefficients of mask prototypes: `[1, 4 + C + P, N]` and `[1, P, H, W]`.
    Prototypes(PrototypeFormat),
    /// Boxes with scores, labels, and masks: `[1, N, 5]`, `[1, N]`, `[1, N, H, W]`.
    EndToEnd(EndToEndFormat),
}

/// Boxes of one output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxFormat {
    /// Number of the output.
    pub output: usize,
    pub count: usize,
    /// True if an attribute's values lie together: `[1, A, N]`.
    pub transposed: bool,
    /// True if an objectness follows the box.
    pub objectness: bool,
    /// True if boxes are offsets in the cells of grids: YOLOX.
    pub in_grid: bool,
    pub classes: usize,
}

/// Outputs of a network with prototypes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrototypeFormat {
    /// The boxes, whose classes are followed by `prototypes` coefficients.
    pub boxes: BoxFormat,
    /// Number of the output with the prototypes.
    pub output: usize,
    pub prototypes: usize,
}

/// Outputs of a network that is trained end to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EndToEndFormat {
    pub boxes: usize,
    pub labels: usize,
    pub masks: Option<usize>,
}

impl Layout {
    /// Tells the layout of a network with an input of `size`.
    ///
    /// # Errors
    /// The shapes fit none; the sentence prints them.
    pub fn of(
        outputs: &[Output],
        size: (usize, usize),
        settings: &Settings,
    ) -> Result<Self, String> {
        let of = |rank: usize| {
            outputs
                .iter()
                .enumerate()
                .filter(move |(_, output)| output.shape.len() == rank && output.shape[0] == 1)
        };
        let layout = match outputs.len() {
            1 if is_map(&outputs[0], size) => Some(Self::Semantic),
            1 => of(3)
                .next()
                .and_then(|(at, output)| box_format(at, &output.shape, 0, size, settings))
                .map(Self::Boxes),
            2 | 3 => prototypes(of(3).next(), of(4).next(), size, settings)
                .or_else(|| end_to_end(outputs)),
            _ => None,
        };
        layout.ok_or_else(|| {
            let shapes: Vec<String> =
                outputs.iter().map(|output| format!("{:?}", output.shape)).collect();
            format!(
                "its outputs have the shapes {}, which fit none that is known: boxes [1, N, 5 + C] \
                 or [1, 4 + C, N]; a map [1, H, W] or [1, C, H, W] of \
                 the input's size, or a whole part of it; boxes and prototypes [1, 4 + C + P, N], \
                 [1, P, H, W]; boxes, labels and masks [1, N, 5], [1, N], \
                 [1, N, H, W]. Export it with one of these; what shapes cannot tell (names, \
                 channels, boxes that are decoded) stands in MODEL.toml \
                 beside MODEL.onnx, see docs/inputs.md",
                shapes.join(", ")
            )
        })
    }

    /// Returns true if the network yields boxes only.
    pub fn is_boxes(&self) -> bool {
        matches!(self, Self::Boxes(_))
    }

    /// Returns true if boxes lie in the cells of grids: YOLOX's, whose input has another form than
    /// that of others.
    pub fn is_in_grid(&self) -> bool {
        matches!(self, Self::Boxes(format) if format.in_grid)
    }

    /// Returns the number of classes, if shapes tell.
    pub fn class_count(&self, outputs: &[Output]) -> Option<usize> {
        match self {
            Self::Boxes(format) => Some(format.classes),
            Self::Prototypes(format) => Some(format.boxes.classes),
            Self::Semantic => outputs
                .first()
                .filter(|output| output.shape.len() == 4 && output.shape[1] > 1)
                .map(|output| output.shape[1]),
            // Labels are numbers of any list: COCO's unless the settings name others.
            Self::EndToEnd(_) => Some(80),
        }
    }
}

/// Returns true if an output is an image of the input's size, or of a whole fraction of it.
fn is_map(output: &Output, (width, height): (usize, usize)) -> bool {
    let is_part = |side: usize, whole: usize| {
        [1, 2, 4, 8, 16].iter().any(|part| side == whole / part || side == whole.div_ceil(*part))
    };
    match output.shape[..] {
        [1, h, w] => output.integers && is_part(h, height) && is_part(w, width),
        [1, _, h, w] => is_part(h, height) && is_part(w, width),
        _ => false,
    }
}

/// The format of boxes with `more` attributes after their classes.
fn box_format(
    output: usize,
    shape: &[usize],
    more: usize,
    (width, height): (usize, usize),
    settings: &Settings,
) -> Option<BoxFormat> {
    let &[1, rows, columns] = shape else { return None };
    let cells: usize = STRIDES.iter().map(|stride| (width / stride) * (height / stride)).sum();
    // One box a cell of the grids, with attributes in rows: YOLOX. Three a cell: YOLOv5. One a cell
    // in columns: YOLOv8 and later.
    let (count, attributes, transposed) =
        if rows > columns { (rows, columns, false) } else { (columns, rows, true) };
    let objectness = !transposed && more == 0;
    let classes = attributes
        .checked_sub(4 + usize::from(objectness) + more)
        .filter(|classes| *classes > 0)?;
    if count != cells && count != 3 * cells {
        return None;
    }
    let in_grid = objectness && count == cells && !settings.decoded;
    Some(BoxFormat { output, count, transposed, objectness, in_grid, classes })
}

fn prototypes(
    boxes: Option<(usize, &Output)>,
    masks: Option<(usize, &Output)>,
    size: (usize, usize),
    settings: &Settings,
) -> Option<Layout> {
    let ((at, boxes), (output, masks)) = (boxes?, masks?);
    let prototypes = *masks.shape.get(1)?;
    let is_quarter = masks.shape.get(2..4)? == [size.1 / 4, size.0 / 4];
    let boxes = box_format(at, &boxes.shape, prototypes, size, settings).filter(|_| is_quarter)?;
    Some(Layout::Prototypes(PrototypeFormat { boxes, output, prototypes }))
}

fn end_to_end(outputs: &[Output]) -> Option<Layout> {
    let find =
        |fits: &dyn Fn(&[usize]) -> bool| outputs.iter().position(|output| fits(&output.shape));
    let boxes = find(&|shape| matches!(shape, [1, _, 5]))?;
    let count = outputs[boxes].shape[1];
    let labels = find(&|shape| *shape == [1, count])?;
    let masks = find(&|shape| matches!(shape, [1, n, _, _] if *n == count));
    (outputs.len() == 2 || masks.is_some()).then_some(Layout::EndToEnd(EndToEndFormat {
        boxes,
        labels,
        masks,
    }))
}
