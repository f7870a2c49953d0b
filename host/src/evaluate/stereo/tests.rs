use super::*;
use std::path::Path;

fn image(rows: &[&[u16]]) -> Image<u16> {
    Image::new(rows[0].len(), rows.len(), rows.concat()).unwrap()
}

#[test]
fn holes_take_the_farther_neighbour_and_empty_rows_the_row_above() {
    let holes = image(&[&[0, 0, 0, 0, 0], &[0, 9, 0, 0, 4], &[7, 0, 3, 0, 0], &[0, 0, 0, 0, 0]]);
    let expected = image(&[&[9, 9, 4, 4, 4], &[9, 9, 4, 4, 4], &[7, 3, 3, 3, 3], &[7, 3, 3, 3, 3]]);
    assert_eq!(filled(&holes), expected);
    let nothing = image(&[&[0, 0], &[0, 0]]);
    assert_eq!(filled(&nothing), nothing);
}

#[test]
fn pixels_count_given_and_filled_and_only_d1_forgives_five_percent() {
    let px = |value: f32| (value * 256.0) as u16;
    // Right; 3.5 px off at 90 px; 3.5 px off at 20 px; no estimate, filled by 16.5; no truth.
    let truth = image(&[&[px(10.0), px(90.0), px(20.0), px(18.0), 0]]);
    let given = image(&[&[px(10.0), px(93.5), px(16.5), 0, px(5.0)]]);
    let mut counts = StereoCounts::default();
    let whole = filled(&given);
    let estimate = Estimate { given: &given, filled: &whole, marked: false };
    counts.add(&truth, &estimate, |_| true);
    let found = counts.figures().unwrap();
    assert_eq!((found.pixels, found.coverage), (4, 0.75));
    // The hole takes the disparity of the pixel beside it without truth, the smaller one: off by 13
    // px.
    assert_eq!((found.d1, found.d1_filled), (1.0 / 3.0, 2.0 / 4.0));
    assert_eq!(
        (found.bad, found.bad_filled),
        ([2.0 / 3.0, 2.0 / 3.0, 0.0, 0.0], [0.75, 0.75, 0.25, 0.25])
    );
    assert!(
        (found.mean_error_px - 7.0 / 3.0).abs() < 1e-9 && found.mean_signed_error_px.abs() < 1e-9
    );
    let mut foreground = StereoCounts::default();
    foreground.add(&truth, &estimate, |at| at == 2);
    assert_eq!(foreground.figures().unwrap().d1, 1.0);
    // Odd disparities were filled in, where the matcher is the core's.
    let given = given.map(|&q8| if q8 == px(16.5) { q8 | 1 } else { q8 });
    let mut marked = StereoCounts::default();
    marked.add(&truth, &Estimate { given: &given, filled: &whole, marked: true }, |_| true);
    let found = marked.figures().unwrap();
    let parts = [found.measured.unwrap(), found.filled_in.unwrap()];
    assert_eq!(
        parts.map(|part| (part.coverage, part.d1, part.bad[1])),
        [(0.5, 0.0, 0.5), (0.25, 1.0, 1.0)]
    );
    assert!(StereoCounts::default().figures().is_none());
}

#[test]
fn both_layouts_are_found_and_a_folder_without_truth_is_told() {
    let root = tempfile::TempDir::new().unwrap();
    let touch = |path: &str| {
        let path = root.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    };
    assert!(
        find_stereo_set(root.path()).unwrap_err().to_string().contains("is not a stereo benchmark")
    );
    // Names are enough: nothing is read yet.
    touch("training/image_2/000000_10.png");
    // The second picture of a pair is for scene flow and no pair of its own.
    touch("training/image_2/000000_11.png");
    touch("training/image_3/000000_10.png");
    assert!(find_stereo_set(root.path()).unwrap_err().to_string().contains("disp_noc_0"));
    touch("training/disp_occ_0/000000_10.png");
    touch("training/obj_map/000000_10.png");
    let set = find_stereo_set(&root.path().join("training")).unwrap();
    assert_eq!((set.name, set.pairs.len()), ("kitti-2015", 1));
    assert!(
        set.pairs[0].truth[0].is_none()
            && set.pairs[0].truth[1].is_some()
            && set.pairs[0].objects.is_some()
    );
    // The folder above is taken as well.
    assert_eq!(find_stereo_set(root.path()).unwrap(), set);
    assert!(find_stereo_set(Path::new("/nowhere")).unwrap_err().to_string().contains("no folder"));
}
