//! Two folders of instance PNGs, picture by picture.

use super::read_labels;
use crate::formats::{Image, read_png_u16};
use crate::input::source::InputError;
use std::path::Path;

/// Two pictures of instances of one name: the name without its ending, and the pictures.
pub type LabelPair = (String, [Image<u16>; 2]);

/// The pictures of instances that two folders have under one name, by name.
///
/// # Errors
/// A folder cannot be read, or they share no picture. An item is an error where a picture cannot be
/// read, or two differ in size.
pub fn label_pairs<'f>(
    found: &'f Path,
    truth: &'f Path,
) -> Result<impl Iterator<Item = Result<LabelPair, InputError>> + use<'f>, InputError> {
    let list = |folder: &Path| {
        folder
            .read_dir()
            .map_err(|source| InputError::masks(folder, format!("it cannot be read ({source})")))
    };
    let _ = list(truth)?;
    let names = list(found)?
        .filter_map(Result::ok)
        .filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> =
        names.filter(|name| name.ends_with(".png") && truth.join(name).is_file()).collect();
    names.sort();
    if names.is_empty() {
        return Err(InputError::masks(
            found,
            format!("it shares no picture's name with {}", truth.display()),
        ));
    }
    Ok(names.into_iter().map(move |name| {
        let found = read_png_u16(&found.join(&name)).map_err(InputError::masks_format)?;
        let truth = read_labels(&truth.join(&name), (found.width(), found.height()))?;
        Ok((name.trim_end_matches(".png").to_owned(), [found, truth]))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Luma};
    use tempfile::TempDir;

    #[test]
    fn pictures_of_one_name_are_pairs() {
        let folders = [TempDir::new().unwrap(), TempDir::new().unwrap()];
        let [found, truth] = folders.each_ref().map(|folder| folder.path());
        let save = |folder: &Path, name: &str, value: u16| {
            ImageBuffer::from_pixel(4, 3, Luma([value])).save(folder.join(name)).unwrap();
        };
        save(found, "1.png", 1_001);
        let message = label_pairs(found, truth).err().unwrap().to_string();
        assert!(message.contains("it shares no picture's name with"), "{message}");
        save(truth, "1.png", 1_002);
        save(truth, "2.png", 1_003);
        let pairs: Vec<LabelPair> =
            label_pairs(found, truth).unwrap().map(Result::unwrap).collect();
        let [(name, [of_found, of_truth])] = pairs.as_slice() else { panic!("one pair") };
        assert_eq!((&**name, of_found.get(0, 0)), ("1", Some(1_001)));
        assert_eq!(of_truth.get(3, 2), Some(1_002));
        assert!(label_pairs(found, Path::new("nowhere")).is_err());
    }
}
