//! OpenCV's XML: a matrix `depth-frame` of signed 16-bit millimetres, as the original's ELAS tool
//! wrote it.

use super::bounds::{MAX_VALUE_TEXT_BYTES, TABLE_TEXT, TextBound};
use super::xml::xml;
use super::{FormatError, Image, read_text_within};
use std::path::Path;

/// Name of the matrix.
const MATRIX: &str = "depth-frame";
const MM: f32 = 1e-3;

/// Next action for a file that is not of this format.
const ACTION: &str = "Write it anew with OpenCV's FileStorage, of the images' size";

/// Reads the depth in m.
///
/// # Errors
/// The file cannot be read, is not XML, lacks the matrix, or has another size or type.
pub fn read_opencv_depth(path: &Path, size: (usize, usize)) -> Result<Image<f32>, FormatError> {
    let pixels = (size.0 * size.1) as u64;
    let bytes = TABLE_TEXT.bytes.max(MAX_VALUE_TEXT_BYTES * pixels);
    let bound =
        TextBound { what: "a depth image", bytes, line_bytes: bytes as usize, ..TABLE_TEXT };
    let text = read_text_within(path, &bound)?;
    let refuse = |reason: String| FormatError::content(path, reason, ACTION);
    let document = xml(&text).map_err(refuse)?;
    let matrix = document.root_element().children().find(|node| node.has_tag_name(MATRIX));
    let matrix = matrix.ok_or_else(|| refuse(format!("it holds no matrix {MATRIX}")))?;
    let part = |name: &str| {
        matrix
            .children()
            .find(|node| node.has_tag_name(name))
            .and_then(|node| node.text())
            .unwrap_or_default()
            .trim()
    };
    let (Ok(height), Ok(width)) = (part("rows").parse::<usize>(), part("cols").parse::<usize>())
    else {
        return Err(refuse(format!("{MATRIX} lacks its rows or cols")));
    };
    if (width, height) != size {
        return Err(FormatError::other_size(path, (width, height), size));
    }
    if part("dt") != "s" {
        return Err(refuse(format!(
            "{MATRIX} has the type {:?}; signed 16-bit millimetres (s) are read",
            part("dt")
        )));
    }
    let depth_m: Result<Vec<f32>, _> = part("data")
        .split_ascii_whitespace()
        .map(|word| word.parse::<i16>().map(|mm| f32::from(mm) * MM))
        .collect();
    let depth_m = depth_m.map_err(|error| {
        refuse(format!("{MATRIX} holds a value that is not a 16-bit number: {error}"))
    })?;
    let found = depth_m.len();
    Image::new(width, height, depth_m)
        .ok_or_else(|| refuse(format!("{MATRIX} holds {found} values, not {}", width * height)))
}
