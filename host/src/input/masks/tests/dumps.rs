//! KITTI-MOTS and the dumps of MNC.

use super::*;

#[test]
fn mots_pictures_give_classes_and_leave_out_what_is_to_be_ignored() {
    let root = rig();
    let folder = TempDir::new().unwrap();
    labels(&folder.path().join("000000.png"), &[1005, 2001, 10_000, 7_000], true);
    let masks =
        first(root.path(), &MaskChoice::Files(&mots::FORMAT, folder.path().to_path_buf())).unwrap();
    let of: Vec<_> = masks.instances.iter().map(|one| (one.class, one.pixels)).collect();
    assert_eq!(
        of,
        [(Class::Car, pixels_of(1)), (Class::Person, pixels_of(2)), (Class::Other, pixels_of(4))]
    );
    assert_eq!(masks.refusals, MaskRefusals { unknown_class: 1, ..MaskRefusals::default() });
}

fn ring(u: usize, v: usize) -> bool {
    let from = (u as i32 - 20).pow(2) + (v as i32 - 18).pow(2);
    (40..150).contains(&from)
}

fn mots_text(rows: &str) -> Result<FrameMasks, InputError> {
    let root = rig();
    let path = root.path().join("mots.txt");
    fs::write(&path, rows).unwrap();
    first(root.path(), &MaskChoice::Files(&mots::FORMAT, path))
}

#[test]
fn mots_text_gives_the_masks_that_were_written() {
    let (w, h) = (WIDTH as usize, HEIGHT as usize);
    let runs = rle::encoded(ring, w, h);
    let ignored = rle::encoded(|u, _| u < 3, w, h);
    let masks = mots_text(&format!(
        "0 1001 1 {h} {w} {runs}\n1 2001 2 {h} {w} {ignored}\n0 10000 10 {h} {w} {ignored}\n"
    ))
    .unwrap();
    assert_eq!(
        masks.instances.len(),
        1,
        "one of this frame; one is of the next, one to be ignored"
    );
    let one = &masks.instances[0];
    assert_eq!((one.class, one.score), (Class::Car, 1.0));
    assert!((0..h).all(|v| (0..w).all(|u| one.contains(u as i32, v as i32) == ring(u, v))));
    assert!(one.pixels.width < WIDTH as i32 && one.pixels.height < HEIGHT as i32);
}

#[test]
fn run_lengths_are_those_of_the_published_tools() {
    assert_eq!(rle::runs("54", 3, 3).unwrap(), [(5, 4)]);
    // The example of COCO's documentation: 6, 1, 40, 4, 5, 4, 5, 4, 21.
    assert_eq!(rle::runs("61X13mN000`0", 10, 9).unwrap(), [(6, 1), (47, 4), (56, 4), (65, 4)]);
    for (width, height) in [(1, 1), (7, 5), (200, 90)] {
        let mask =
            |u: usize, v: usize| (u * 31 + v * 17) % 7 < 3 || (u / 9 + v / 5).is_multiple_of(2);
        let mut pixels = vec![false; width * height];
        for (start, length) in rle::runs(&rle::encoded(mask, width, height), width, height).unwrap()
        {
            pixels[start..start + length].fill(true);
        }
        assert!((0..width).all(|u| (0..height).all(|v| pixels[u * height + v] == mask(u, v))));
    }
}

#[test]
fn mots_text_that_is_none_is_refused_with_its_line() {
    let (w, h) = (WIDTH as usize, HEIGHT as usize);
    let whole = rle::encoded(|_, _| true, w, h);
    for (rows, reason) in [
        ("0 1001 1 36 40\n".to_owned(), "line 1 is not"),
        (format!("0 1001 car 36 40 {whole}\n"), "line 1 is not"),
        (format!("0 1001 1 40 36 {whole}\n"), "36 x 40 px, but the images are 40 x 36 px"),
        ("0 1001 1 36 40 11\n".to_owned(), "hold 2 of the 1440 pixels"),
        (format!("0 1001 1 36 40 {whole}{whole}\n"), "more than the 1440 pixels"),
        ("0 1001 1 36 40 0P\n".to_owned(), "cut off"),
        ("0 1001 1 36 40 0\u{7f}\n".to_owned(), "no run length"),
        ("0 1001 1 36 40 ooooooooooooo0\n".to_owned(), "35 bits"),
        ("0 1001 1 36 40 O1\n".to_owned(), "below 0"),
    ] {
        let message = refusal_of(mots_text(&rows));
        assert!(
            message.contains(reason) && message.contains("line 1") | message.contains("mots.txt"),
            "{rows}: {message}"
        );
    }
    let empty = rle::encoded(|_, _| false, w, h);
    assert_eq!(mots_text(&format!("0 1001 1 {h} {w} {empty}\n")).unwrap().refusals.empty, 1);
}

#[test]
fn ten_thousand_masks_are_kept_within_the_ceiling_and_the_rest_counted() {
    let (w, h) = (WIDTH as usize, HEIGHT as usize);
    let row = format!("0 1001 1 {h} {w} {}\n", rle::encoded(ring, w, h));
    let masks = mots_text(&row.repeat(10_000)).unwrap();
    assert_eq!((masks.instances.len(), masks.refusals.beyond), (MAX_MASKS, 9_000));
    let mut large = FrameMasks::default();
    let kept = (0..200).filter(|_| {
        let fits = large.reserve(1 << 20);
        if fits {
            large.push(Some(InstanceMask {
                class: Class::Car,
                score: 1.0,
                pixels: PixelBox::default(),
                mask: vec![1; 1 << 20],
            }));
        }
        fits
    });
    assert_eq!(kept.count(), MAX_BYTES >> 20);
}

fn mnc(results: &[(&str, &str)]) -> Result<FrameMasks, InputError> {
    let root = rig();
    let folder = root.path().join("mnc");
    fs::create_dir(&folder).unwrap();
    for (number, (result, mask)) in results.iter().enumerate() {
        fs::write(folder.join(format!("000000.png.{number:04}.result.txt")), result).unwrap();
        if !mask.is_empty() {
            fs::write(folder.join(format!("000000.png.{number:04}.mask.txt")), mask).unwrap();
        }
    }
    first(root.path(), &MaskChoice::Files(&mnc::FORMAT, folder))
}

const FULL: &str =
    "1.000000000000000000e+00 0.000000000000000000e+00 1.000000000000000000e+00\n1 1 1\n";

#[test]
fn mnc_dumps_are_read_best_first_with_boxes_inclusive() {
    let masks = mnc(&[
        ("[4 6 6 7 0], 0.61, 7", FULL),
        ("[10, 2, 12, 3, 1], 0.93, 15\n", "0 1 1\n0 1 1\n"),
        ("[1. 1. 3. 2. 0.],0.7,99", FULL),
    ])
    .unwrap();
    let of: Vec<_> = masks
        .instances
        .iter()
        .map(|one| (one.class, one.score, one.pixels, one.mask.clone()))
        .collect();
    let pixels = |left, top, width, height| PixelBox { left, top, width, height };
    assert_eq!(
        of,
        [
            (Class::Person, 0.93, pixels(11, 2, 2, 2), vec![1; 4]),
            (Class::Other, 0.7, pixels(1, 1, 3, 2), vec![1, 0, 1, 1, 1, 1]),
            (Class::Car, 0.61, pixels(4, 6, 3, 2), vec![1, 0, 1, 1, 1, 1]),
        ]
    );
    assert_eq!(masks.refusals, MaskRefusals { unknown_class: 1, ..MaskRefusals::default() });
    assert_eq!(mnc(&[("[4 6 6 7 0], 0.61, 7", "0 0 0\n0 0 0\n")]).unwrap().refusals.empty, 1);
}

#[test]
fn mnc_dumps_that_are_none_are_refused() {
    for (result, mask, reason) in [
        ("4 6 6 7 0, 0.61, 7", FULL, "is not `[x1"),
        ("[4 6 6 7], 0.61, 7", FULL, "is not `[x1"),
        ("[4 6 6 7 0], high, 7", FULL, "is not `[x1"),
        ("[4 6 6 7 0], 0.61", FULL, "is not `[x1"),
        ("[38 6 40 7 0], 0.61, 7", FULL, "does not lie within"),
        ("[6 6 4 7 0], 0.61, 7", FULL, "does not lie within"),
        ("[4 6 6 7 0], 0.61, 7", "", "is missing"),
        ("[4 6 7 7 0], 0.61, 7", FULL, "3 columns, but its box is 4 px wide"),
        ("[4 6 6 8 0], 0.61, 7", FULL, "2 rows, but its box is 3 px high"),
        ("[4 6 6 7 0], 0.61, 7", "1 1 x\n1 1 1\n", "which is no number"),
    ] {
        let message = refusal_of(mnc(&[(result, mask)]));
        assert!(message.contains(reason), "{result}: {message}");
    }
}
