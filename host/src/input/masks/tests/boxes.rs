//! Boxes and masks of other programs: COCO, YOLO, tables of boxes, numbers; and what boxes become
//! over a disparity image.

use super::*;
use crate::input::masks::boxes::{BoxMasks, DetectedBox, DetectionSource, Detections};
use crate::input::source::StereoImages;

/// Frame 0 of the folder with masks of a file that `write` fills.
fn of_file(name: &str, text: &str, format: &'static MaskFormat) -> Result<FrameMasks, InputError> {
    let root = rig();
    let path = root.path().join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, text).unwrap();
    first(root.path(), &MaskChoice::Files(format, path))
}

/// Makes a source from a folder with one file.
fn of_folder(
    name: &str,
    text: &str,
    format: &'static MaskFormat,
) -> Result<FrameMasks, InputError> {
    let root = rig();
    let folder = root.path().join("given");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join(name), text).unwrap();
    first(root.path(), &MaskChoice::Files(format, folder))
}

fn found(masks: &FrameMasks) -> Vec<(Class, f32, PixelBox)> {
    masks.instances.iter().map(|one| (one.class, one.score, one.pixels)).collect()
}

const CAR: PixelBox = PixelBox { left: 4, top: 10, width: 10, height: 20 };
/// Mask of [`CAR`] after it is shrunk to a small box.
const SHRUNK_CAR: PixelBox = PixelBox { left: 5, top: 11, width: 9, height: 18 };

#[test]
fn coco_has_polygons_runs_and_boxes() {
    let runs = rle::encoded(|u, v| (20..25).contains(&u) && v < 4, WIDTH as usize, HEIGHT as usize);
    let text = format!(
        r#"{{"images": [{{"id": 7, "file_name": "left/000000.png", "width": 40, "height": 36}}, {{"id": 8, "file_name": "000001.png"}}],
        "categories": [{{"id": 2, "name": "car"}}, {{"id": 3, "name": "kite"}}],
        "annotations": [
            {{"image_id": 7, "category_id": 2, "segmentation": [[4, 10, 14, 10, 14, 30, 4, 30]], "bbox": [0, 0, 1, 1]}},
            {{"image_id": 7, "category_id": 2, "score": 0.5, "segmentation": {{"size": [36, 40], "counts": "{}"}}}},
            {{"image_id": 7, "category_id": 3, "segmentation": {{"size": [36, 40], "counts": [0, 2, 1438]}}}},
            {{"image_id": 7, "category_id": 2, "segmentation": {{"size": [36, 40], "counts": [9, 1431]}}, "iscrowd": 1}},
            {{"image_id": 8, "category_id": 2, "bbox": [4, 10, 10, 20]}}]}}"#,
        runs.replace('\\', "\\\\")
    );
    let masks = of_file("coco.json", &text, &coco::FORMAT).unwrap();
    let runs_box = PixelBox { left: 20, top: 0, width: 5, height: 4 };
    assert_eq!(
        found(&masks),
        [
            (Class::Car, 1.0, CAR),
            (Class::Other, 1.0, PixelBox { left: 0, top: 0, width: 1, height: 2 }),
            (Class::Car, 0.5, runs_box)
        ]
    );
    assert_eq!(masks.refusals, MaskRefusals { unknown_class: 1, ..MaskRefusals::default() });
    let results = r#"[{"image_id": 0, "category_id": 8, "score": 0.75, "bbox": [4, 10, 10, 20]},
        {"image_id": 1, "category_id": 3, "bbox": [0, 0, 9, 9]}]"#;
    assert_eq!(
        found(&of_file("results.json", results, &coco::FORMAT).unwrap()),
        [(Class::Truck, 0.75, SHRUNK_CAR)]
    );
    for (text, reason) in [
        ("{}", "neither COCO's annotations nor a list"),
        (
            r#"[{"image_id": 0, "category_id": 3, "segmentation": {"size": [9, 9], "counts": [81]}}]"#,
            "a mask is 9 x 9 px",
        ),
        (
            r#"[{"image_id": 0, "category_id": 3, "segmentation": {"size": [36, 40], "counts": [81]}}]"#,
            "its runs hold 81",
        ),
        (
            r#"[{"image_id": "other.png", "category_id": 3, "bbox": [0, 0, 9, 9]}]"#,
            "nothing for any frame",
        ),
    ] {
        let message = refusal_of(of_file("coco.json", text, &coco::FORMAT));
        assert!(message.contains(reason) && message.contains("--instances"), "{message}");
    }
}

#[test]
fn yolo_text_has_boxes_and_polygons_of_cocos_or_its_own_classes() {
    // The same car as a box with a score, and as a polygon.
    let text = "2 0.225 0.5555556 0.25 0.5555556 0.5\n0 0.5 0 0.75 0 0.75 0.25 0.5 0.25\n";
    let masks = of_folder("000000.txt", text, &yolo::FORMAT).unwrap();
    let person = PixelBox { left: 20, top: 0, width: 10, height: 9 };
    assert_eq!(found(&masks), [(Class::Person, 1.0, person), (Class::Car, 0.5, SHRUNK_CAR)]);
    let root = rig();
    let folder = root.path().join("labels");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("000001.txt"), "").unwrap();
    fs::write(folder.join("000000.txt"), "1 0.5 0.5 0.2 0.2\n7 0.5 0.5 0.1 0.1\n").unwrap();
    fs::write(root.path().join("classes.txt"), "car\ntram\n").unwrap();
    let masks = first(root.path(), &MaskChoice::Files(&yolo::FORMAT, folder)).unwrap();
    assert_eq!((masks.instances[0].class, masks.refusals.unknown_class), (Class::Train, 1));
    for (wrong, reason) in [
        ("2 0.5 0.5 0.25", "line 1 is neither"),
        ("2 0.5 0.5 0.2 nan", "line 1 is neither"),
        ("2 0 0 1 0 1 1 7.5", "line 1 has a score of 7.5"),
    ] {
        let message = refusal_of(of_folder("000000.txt", wrong, &yolo::FORMAT));
        assert!(message.contains(reason), "{message}");
    }
}

#[test]
fn boxes_that_ultralytics_tracked_are_the_same_boxes() {
    let row = "2 0.225 0.5555556 0.25 0.5555556";
    for (end, score) in [("", 1.0), (" 7", 1.0), (" 0.5", 0.5), (" 0.5 7", 0.5), (" 0.5 1", 0.5)] {
        let masks = of_folder("000000.txt", &format!("{row}{end}\n"), &yolo::FORMAT).unwrap();
        assert_eq!(found(&masks), [(Class::Car, score, SHRUNK_CAR)], "{end}");
    }
}

#[test]
fn boxes_without_classes_are_of_moving_objects() {
    for text in ["1,-1,5,11,10,20,0.9\n", "1,-1,5,11,10,20,0.9,-1,-1,-1\n"] {
        let masks = of_file("mot.txt", text, &super::super::boxes::FORMAT).unwrap();
        assert_eq!(found(&masks), [(Class::MovingObject, 0.9, SHRUNK_CAR)]);
        assert_eq!(masks.refusals, MaskRefusals::default());
    }
    let none = of_file("mot.txt", "900,-1,5,11,10,20,0.9\n", &super::super::boxes::FORMAT);
    assert!(refusal_of(none).contains("nothing for any frame"));
}

#[test]
fn boxes_come_as_labels_of_kitti_as_mot_text_and_as_lists() {
    let label = "Car 0 1 -1.5 4.0 10.0 13.0 29.0 1.5 1.6 4.0 2.0 1.6 20.0 -1.57";
    let none = "0 -1 DontCare -1 -1 -10 0 0 9 9 -1 -1 -1 -1000 -1000 -1000 -10\n";
    let expected = [(Class::Car, 1.0, SHRUNK_CAR)];
    let tracking = format!("{none}0 7 {label}\n1 7 {label}\n1 8 {label}\n");
    assert_eq!(
        found(&of_file("labels.txt", &tracking, &super::super::boxes::FORMAT).unwrap()),
        expected
    );
    assert_eq!(
        found(
            &of_file(
                "mot.csv",
                "1,-1,5,11,10,20,1,3,1\n2,-1,1,1,9,9,1,3,1\n",
                &super::super::boxes::FORMAT
            )
            .unwrap()
        ),
        expected
    );
    assert_eq!(
        found(&of_folder("000000.txt", label, &super::super::boxes::FORMAT).unwrap()),
        expected
    );
    assert_eq!(
        found(
            &of_folder(
                "000000.txt",
                "# a list\n3 car 1.0 4 10 14 30\n",
                &super::super::boxes::FORMAT
            )
            .unwrap()
        ),
        expected
    );
    let missing = of_folder("000001.txt", label, &super::super::boxes::FORMAT).unwrap();
    assert_eq!((missing.instances.len(), missing.refusals.missing), (0, 1));
    assert!(
        refusal_of(of_file("mot.csv", "1,2,3\n", &super::super::boxes::FORMAT))
            .contains("line 1 is neither")
    );
    assert!(
        refusal_of(of_folder("000000.txt", "Car 0 1\n", &super::super::boxes::FORMAT))
            .contains("line 1 is neither")
    );
}

#[test]
fn numbers_without_a_list_are_cars_and_cityscapes_numbers_have_classes() {
    let root = rig();
    let folder = root.path().join("ids");
    fs::create_dir(&folder).unwrap();
    labels(&folder.join("000000.png"), &[1, 2], false);
    let masks = first(root.path(), &MaskChoice::Files(&ids::FORMAT, folder.clone())).unwrap();
    assert_eq!(found(&masks), [(Class::Car, 1.0, pixels_of(1)), (Class::Car, 1.0, pixels_of(2))]);
    fs::remove_file(folder.join("000000.png")).unwrap();
    labels(&folder.join("000000_gtFine_instanceIds.png"), &[7, 24_000, 33_002, 60_001], true);
    let masks = first(root.path(), &MaskChoice::Files(&ids::FORMAT, folder)).unwrap();
    assert_eq!(
        masks.instances.iter().map(|one| one.class).collect::<Vec<_>>(),
        [Class::Person, Class::Bicycle, Class::Other]
    );
    assert_eq!(masks.refusals.unknown_class, 1);
}

/// Gives the same boxes in every frame.
struct Given(Vec<DetectedBox>);

impl DetectionSource for Given {
    fn detections(&self, _: usize, _: &StereoImages) -> Result<Detections, InputError> {
        Ok(Detections { boxes: self.0.clone(), ..Detections::default() })
    }
}

/// Makes masks from the street's exact boxes, and returns the exact masks with them.
fn of_street() -> (FrameMasks, FrameMasks, usize) {
    let config = StreetConfig { width: 640, height: 192, frames: 2, ..StreetConfig::default() };
    let street =
        || -> Box<dyn FrameSource> { Box::new(StreetFrames::new(config.clone()).unwrap()) };
    let exact = attach(street(), &MaskChoice::Exact, EVERY).unwrap().frame(0).unwrap();
    let whole = |one: &InstanceMask| DetectedBox {
        class: one.class,
        score: one.score,
        edges: [
            one.pixels.left,
            one.pixels.top,
            one.pixels.left + one.pixels.width,
            one.pixels.top + one.pixels.height,
        ]
        .map(f64::from),
    };
    let boxes = exact.masks.instances.iter().map(whole).collect();
    let masks = BoxMasks::new(Given(boxes), street().as_ref()).unwrap().masks(0, &exact).unwrap();
    let (width, height) = street().size();
    (masks, exact.masks, width * height)
}

#[test]
fn boxes_over_the_streets_disparity_become_masks_close_to_the_exact_ones() {
    let (masks, exact, pixels) = of_street();
    let area = |one: &InstanceMask| one.mask.iter().filter(|pixel| **pixel > 0).count();
    let shared = |a: &InstanceMask, b: &InstanceMask| {
        (0..pixels as i32)
            .filter(|at| a.contains(at % 640, at / 640) && b.contains(at % 640, at / 640))
            .count()
    };
    let large: Vec<&InstanceMask> =
        exact.instances.iter().filter(|one| area(one) > 2_000).collect();
    assert!(large.len() > 1);
    for one in large {
        let both = |other: &&InstanceMask| shared(one, other);
        let best = masks.instances.iter().max_by_key(both).unwrap();
        let (both, either) = (shared(one, best), area(one) + area(best) - shared(one, best));
        assert!(both * 100 > either * 70, "{:?}: {both} of {either}", one.pixels);
    }
    // No pixel belongs to two, so that a picture of them holds them all.
    for (at, one) in masks.instances.iter().enumerate() {
        assert!(masks.instances.iter().skip(at + 1).all(|other| shared(one, other) == 0));
    }
}

#[test]
fn boxes_on_raw_images_are_refused() {
    let config = StreetConfig {
        lens: crate::synth::StreetLens::Bent(dynvox_core::rectify::LENS_MODELS[1].typical),
        ..StreetConfig::default()
    };
    let street: Box<dyn FrameSource> = Box::new(StreetFrames::new(config).unwrap());
    let refused = BoxMasks::new(Given(Vec::new()), street.as_ref()).map(|_| ());
    assert!(refusal_of(refused).contains("these are raw"));
}
