//! One recording in every arrangement of a plain folder.

use super::*;
use crate::formats::BayerPattern;

/// Writes a frame's pair below a folder.
type Write = fn(&Path, u32, &[GrayImage; 2]);
/// Names of arrangements, and the writer of frame `at`.
const ARRANGEMENTS: [(&str, Write); 9] = [
    ("two folders, left and right", |root, at, [l, r]| {
        save(l, root.join(format!("left/{}.png", at + 8)));
        save(r, root.join(format!("right/{}.png", at + 8)));
    }),
    ("two folders, cam0 and cam1", |root, at, [l, r]| {
        save(l, root.join(format!("cam0/data/{at:06}.pgm")));
        save(r, root.join(format!("cam1/data/{at:06}.pgm")));
    }),
    ("two folders, infra1 and infra2", |root, at, [l, r]| {
        save(l, root.join(format!("infra1/a_{at}.tiff")));
        save(r, root.join(format!("infra2/b_{at:04}.bmp")));
    }),
    ("two folders, Left and Right", |root, at, [l, r]| {
        let deep = |image: &GrayImage, path: PathBuf| {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            ImageBuffer::from_fn(40, 32, |u, v| Luma([u16::from(image.get_pixel(u, v)[0]) << 8]))
                .save(path)
                .unwrap();
        };
        deep(l, root.join(format!("Left/{at}.png")));
        deep(r, root.join(format!("Right/{at}.png")));
    }),
    ("two folders, image_0 and image_1", |root, at, [l, r]| {
        // The right camera is a millisecond late.
        save(
            l,
            root.join(format!(
                "image_0/{}.png",
                1_403_636_579_000_000_000 + u64::from(at) * 50_000_000
            )),
        );
        save(
            r,
            root.join(format!(
                "image_1/{}.png",
                1_403_636_579_001_000_000 + u64::from(at) * 50_000_000
            )),
        );
    }),
    ("one folder, the camera in the files' names", |root, at, [l, r]| {
        save(l, root.join(format!("left_{}.png", at + 8)));
        save(r, root.join(format!("right_{}.png", at + 8)));
    }),
    ("one folder, the camera in the files' names", |root, at, [l, r]| {
        save(l, root.join(format!("{at:03}_0.ppm")));
        save(r, root.join(format!("{at:03}_1.ppm")));
    }),
    ("one folder, both images in one file", |root, at, [l, r]| {
        save(
            &GrayImage::from_fn(80, 32, |u, v| *if u < 40 { l } else { r }.get_pixel(u % 40, v)),
            root.join(format!("{at}.png")),
        );
    }),
    ("one folder, both images in one file", |root, at, [l, r]| {
        save(
            &GrayImage::from_fn(40, 64, |u, v| *if v < 32 { l } else { r }.get_pixel(u, v % 32)),
            root.join(format!("{at}.png")),
        );
    }),
];

#[test]
fn every_arrangement_and_format_gives_the_same_frames() {
    for (arrangement, write) in ARRANGEMENTS {
        let root = TempDir::new().unwrap();
        fs::write(root.path().join("calib.txt"), CALIB).unwrap();
        (0..4).for_each(|at| write(root.path(), at, &pair(at)));
        assert_eq!(folder::describe(root.path()), arrangement);
        let dataset = open(root.path(), &OpenOptions::default())
            .unwrap_or_else(|error| panic!("{arrangement}: {error}"));
        assert_eq!((dataset.len(), dataset.size()), (4, (40, 32)), "{arrangement}");
        for at in 0..4 {
            let frame = dataset.frame(at).unwrap();
            let expected = pair(at as u32).map(|image| image.into_raw());
            assert_eq!(
                [frame.left.pixels(), frame.right.pixels()],
                expected.each_ref().map(Vec::as_slice),
                "{arrangement} frame {at}"
            );
        }
    }
}

#[test]
fn images_of_one_camera_are_refused_without_an_option_that_they_hold_both() {
    let root = TempDir::new().unwrap();
    fs::write(root.path().join("calib.txt"), CALIB).unwrap();
    (0..2).for_each(|at| save(&pair(at)[0], root.path().join(format!("{at}.png"))));
    assert!(refusal(root.path(), None).contains("--side-by-side"));
    let options = OpenOptions { stacking: Some(Stacking::SideBySide), ..OpenOptions::default() };
    assert_eq!(open(root.path(), &options).unwrap().size(), (20, 32));
}

#[test]
fn a_broken_first_image_is_refused_at_its_turn_and_no_earlier() {
    let deep =
        |value: u16| ImageBuffer::from_fn(40, 32, move |u, v| Luma([value + (u * v) as u16]));
    let root = TempDir::new().unwrap();
    fs::write(root.path().join("calib.txt"), CALIB).unwrap();
    for side in ["left", "right"] {
        fs::create_dir_all(root.path().join(side)).unwrap();
        for at in 0..4 {
            deep(200 + 800 * at).save(root.path().join(format!("{side}/{at}.png"))).unwrap();
        }
    }
    for content in [&b""[..], b"\x89PNG\r\n", b"no picture"] {
        fs::write(root.path().join("left/0.png"), content).unwrap();
        let dataset = open(root.path(), &OpenOptions::default()).unwrap();
        assert_eq!((dataset.len(), dataset.size()), (4, (40, 32)));
        let refused = dataset.frame(0).err().unwrap().to_string();
        assert!(refused.contains("left/0.png cannot be read"), "{refused}");
        assert!(dataset.frame(1).is_ok());
        // The bits of 16-bit images are told by the others.
        let noted = |words: &str| dataset.notes().iter().any(|note| note.contains(words));
        assert!(noted("12 bits") && noted("of 3 images"), "{:?}", dataset.notes());
    }
    (0..4).for_each(|at| fs::write(root.path().join(format!("left/{at}.png")), "").unwrap());
    assert!(refusal(root.path(), None).contains("left/0.png cannot be read"));
}

#[test]
fn the_maximum_in_a_header_tells_the_bits() {
    let root = TempDir::new().unwrap();
    fs::write(root.path().join("calib.txt"), CALIB).unwrap();
    for (maximum, value, expected) in
        [(4_095u16, 800u16, 50), (1_000, 800, 200), (65_535, 800, 200)]
    {
        for side in ["left", "right"] {
            fs::create_dir_all(root.path().join(side)).unwrap();
            for at in 0..2 {
                let header = format!("P5 40 32 {maximum}\n").into_bytes();
                let pixels = value.to_be_bytes().repeat(40 * 32);
                let path = root.path().join(format!("{side}/{at}.pgm"));
                fs::write(path, [header, pixels].concat()).unwrap();
            }
        }
        let dataset = open(root.path(), &OpenOptions::default()).unwrap();
        assert_eq!(dataset.frame(0).unwrap().left.pixels()[0], expected, "{maximum}");
        let noted = dataset.notes().iter().any(|note| note.contains("that the first one says"));
        assert_eq!(noted, maximum < 65_535, "{:?}", dataset.notes());
    }
}

#[test]
fn mosaics_become_colours_by_option_and_are_named_without_it() {
    // Red 200, green 100, blue 20 over all of the image, as RGGB.
    let seen = |u: u32, v: u32| [200u16, 100, 100, 20][(u % 2 + 2 * (v % 2)) as usize];
    for ending in ["png", "tiff", "pgm"] {
        let root = TempDir::new().unwrap();
        fs::write(root.path().join("calib.txt"), CALIB).unwrap();
        for side in ["left", "right"] {
            fs::create_dir_all(root.path().join(side)).unwrap();
            for at in 0..2 {
                let path = root.path().join(format!("{side}/{at}.{ending}"));
                ImageBuffer::from_fn(40, 32, |u, v| Luma([16 * seen(u, v)])).save(path).unwrap();
            }
        }
        let plain = open(root.path(), &OpenOptions::default()).unwrap();
        assert!(plain.frame(0).unwrap().colour.is_none());
        let noted = |words: &str| plain.notes().iter().any(|note| note.contains(words));
        assert!(noted("--bayer rggb or bggr"), "{:?}", plain.notes());
        let bayer = Some(BayerPattern::Rggb);
        let options = OpenOptions { bayer, ..OpenOptions::default() };
        let colour = open(root.path(), &options).unwrap();
        let pixels = colour.frame(1).unwrap().colour.unwrap();
        assert!(pixels.pixels().iter().all(|rgb| *rgb == [200, 100, 20]), "{ending}");
        assert!(!colour.notes().iter().any(|note| note.contains("--bayer")));
    }
}

/// A folder of frames 0 to 11 without frame 5, with a row of times and poses for each of the 12.
fn without_the_sixth(times: impl Fn(u32) -> String) -> TempDir {
    let root = TempDir::new().unwrap();
    for at in (0..12).filter(|at| *at != 5) {
        for (side, image) in ["left", "right"].into_iter().zip(&pair(at)) {
            save(image, root.path().join(format!("{side}/{at:06}.png")));
        }
    }
    fs::write(root.path().join("calib.txt"), CALIB).unwrap();
    fs::write(root.path().join("times.txt"), (0..12).map(times).collect::<String>()).unwrap();
    let pose = |at: u32| format!("1 0 0 0 0 1 0 0 0 0 1 {at}\n");
    fs::write(root.path().join("poses.txt"), (0..12).map(pose).collect::<String>()).unwrap();
    root
}

#[test]
fn a_missing_image_does_not_move_the_rows_of_the_others() {
    for (times, unit) in [
        (&(|at| format!("{}\n", 0.1 * f64::from(at))) as &dyn Fn(u32) -> String, None),
        (&|at| format!("{}\r\n", 100 * at), Some("ms")),
        (&|at| format!("{}{}\n", if at == 0 { "\u{feff}" } else { "" }, 100_000 * at), Some("us")),
        (
            &|at| format!("{}\n", 1_403_636_579_763_555_584 + u64::from(at) * 100_000_000),
            Some("ns"),
        ),
    ] {
        let root = without_the_sixth(times);
        let dataset = open(root.path(), &OpenOptions::default()).unwrap();
        let truth = dataset.truth().unwrap();
        for (frame, number) in (0..12).filter(|at| *at != 5).enumerate() {
            let since_s = dataset.time_s(frame) - dataset.time_s(0);
            assert!((since_s - 0.1 * f64::from(number)).abs() < 1e-6, "{unit:?}: {since_s}");
            assert_eq!(truth[frame].translation_m[2], f64::from(number));
        }
        let noted = |words: &str| dataset.notes().iter().any(|note| note.contains(words));
        assert!(noted("12 rows for 11 images: matched by the numbers"), "{:?}", dataset.notes());
        assert!(unit.is_none_or(|unit| noted(&format!("times are in {unit}"))));
    }
}

#[test]
fn tables_that_fit_no_frames_are_refused_or_not_used() {
    let root = without_the_sixth(|at| format!("{}\n", 0.1 * f64::from(at)));
    fs::write(root.path().join("poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(7)).unwrap();
    let dataset = open(root.path(), &OpenOptions::default()).unwrap();
    assert!(dataset.truth().is_none());
    assert!(dataset.notes().iter().any(|note| note.contains("7 rows for 11 images")));
    fs::write(root.path().join("times.txt"), "0\n0.1\n0.2\n").unwrap();
    assert!(refusal(root.path(), None).contains("it has 3 rows for 11 images"));
}
