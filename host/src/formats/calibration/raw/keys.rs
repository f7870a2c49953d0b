//! Names of one value in files of many authors: letters and digits count, case, dashes and
//! dots do not.

use super::tree::Node;

/// Names of a camera matrix, without the mark of the camera.
pub const MATRICES: &[&str] = &[
    "m",
    "k",
    "cameramatrix",
    "cameramat",
    "cammatrix",
    "mtx",
    "intrinsics",
    "intrinsic",
    "intrinsicmatrix",
    "cameraintrinsics",
];
/// Names of distortion coefficients, without the mark of the camera.
pub const DISTORTIONS: &[&str] = &[
    "d",
    "distcoeffs",
    "distcoefs",
    "distcoeff",
    "distortioncoefficients",
    "distortioncoeffs",
    "distortion",
    "dist",
];
/// Marks of the left and the right camera.
const SIDES: [[&str; 2]; 6] =
    [["left", "right"], ["cam0", "cam1"], ["0", "1"], ["1", "2"], ["l", "r"], ["cam1", "cam2"]];

/// The letters and digits of a key, in lower case.
fn plain(key: &str) -> String {
    key.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The first value under one of some plain names, at the top of any file.
pub fn find<'t>(roots: &[Node<'t>], names: &[&str]) -> Option<Node<'t>> {
    let with = |name: &&str| {
        roots.iter().find_map(|root| root.entries().find(|entry| plain(entry.key()) == *name))
    };
    names.iter().find_map(with)
}

/// The values of the left and the right camera under one of some plain names with a mark of the
/// camera before or after it.
pub fn pair<'t>(roots: &[Node<'t>], names: &[&str]) -> Option<[Node<'t>; 2]> {
    names.iter().find_map(|name| {
        SIDES.iter().find_map(|[left, right]| {
            let after = [format!("{name}{left}"), format!("{name}{right}")];
            let before = [format!("{left}{name}"), format!("{right}{name}")];
            [after, before].iter().find_map(|[left, right]| {
                Some([find(roots, &[left.as_str()])?, find(roots, &[right.as_str()])?])
            })
        })
    })
}

/// Sections of one file that hold a camera each.
pub fn sections<'t>(roots: &[Node<'t>]) -> Option<[Node<'t>; 2]> {
    let sections = pair(roots, &["", "camera", "cam"])?;
    let has_matrix = |section: &Node<'t>| find(std::slice::from_ref(section), MATRICES).is_some();
    sections.iter().all(has_matrix).then_some(sections)
}
