//! Layouts and their boxes and masks by hand, a network of one node, and the clips' networks.

use super::model::Output;
use super::*;
use crate::input::masks::boxes::{BoxMasks, FrameDisparity};
use crate::input::{self, OpenOptions};
use dynvox_core::masks::PixelBox;
use dynvox_core::random::Random;
use tempfile::TempDir;

/// An output of zeros.
fn zeros(shape: &[usize], integers: bool) -> Output {
    Output { shape: shape.to_vec(), values: vec![0.0; shape.iter().product()], integers }
}

/// Names the layout of some outputs of a network with an input of 64 x 64 px.
fn layout(shapes: &[&[usize]], integers: bool, settings: &Settings) -> Result<Layout, String> {
    Layout::of(
        &shapes.iter().map(|shape| zeros(shape, integers)).collect::<Vec<_>>(),
        (64, 64),
        settings,
    )
}

#[test]
fn layouts_are_told_from_shapes() {
    let settings = Settings::default();
    let boxes = |shape: &[usize], settings: &Settings| match layout(&[shape], false, settings) {
        Ok(Layout::Boxes(format)) => {
            (format.transposed, format.objectness, format.in_grid, format.classes)
        }
        other => panic!("{other:?}"),
    };
    // Grids of 8 x 8, 4 x 4 and 2 x 2 cells.
    assert_eq!(
        boxes(&[1, 84, 84], &settings),
        (true, false, false, 80),
        "one box a cell, attributes in rows: YOLOv8"
    );
    assert_eq!(
        boxes(&[1, 84, 8], &settings),
        (false, true, true, 3),
        "in the cells of a grid: YOLOX"
    );
    assert_eq!(
        boxes(&[1, 84, 8], &Settings { decoded: true, ..Settings::default() }),
        (false, true, false, 3)
    );
    assert_eq!(
        boxes(&[1, 252, 85], &settings),
        (false, true, false, 80),
        "three boxes a cell: YOLOv5"
    );
    assert_eq!(layout(&[&[1, 64, 64]], true, &settings), Ok(Layout::Semantic));
    assert_eq!(layout(&[&[1, 19, 16, 16]], false, &settings), Ok(Layout::Semantic));
    let Ok(Layout::Prototypes(format)) =
        layout(&[&[1, 46, 84], &[1, 32, 16, 16]], false, &settings)
    else {
        panic!("prototypes")
    };
    assert_eq!((format.prototypes, format.boxes.classes, format.output), (32, 10, 1));
    let objects = layout(&[&[1, 100, 5], &[1, 100], &[1, 100, 64, 64]], false, &settings);
    assert_eq!(
        objects,
        Ok(Layout::EndToEnd(layout::EndToEndFormat { boxes: 0, labels: 1, masks: Some(2) }))
    );
    for unknown in
        [&[&[1usize, 7, 7][..]][..], &[&[1, 1000]], &[], &[&[1, 84, 4]], &[&[1, 100, 5], &[1, 99]]]
    {
        let reason = layout(unknown, false, &settings).unwrap_err();
        assert!(
            reason.contains("fit none that is known") && reason.contains("MODEL.toml"),
            "{reason}"
        );
    }
    assert!(layout(&[&[1, 7, 7]], false, &settings).unwrap_err().contains("[1, 7, 7]"));
}

/// A part of a picture of 128 x 64 px in an input of 64 x 64 px: its right half.
fn part<'a>(fit: &'a Fit, classes: &'a [Option<Class>], settings: &'a Settings) -> PicturePart<'a> {
    PicturePart { fit, input: (64, 64), picture: (128, 64), classes, settings }
}

#[test]
fn boxes_of_every_format_are_where_the_network_means() {
    let settings = Settings::default();
    let fit = Fit::new([64, 0, 64, 64], (64, 64), false);
    let classes = [None, Some(Class::Car), Some(Class::Person)];
    let decoded = |shape: &[usize], cell: usize, values: &[f32]| {
        let mut output = zeros(shape, false);
        let attributes = shape[1..].iter().copied().min().unwrap();
        let transposed = shape[1] == attributes;
        for (attribute, value) in values.iter().enumerate() {
            let at = if transposed {
                attribute * shape[2] + cell
            } else {
                cell * attributes + attribute
            };
            output.values[at] = *value;
        }
        let Ok(Layout::Boxes(format)) = Layout::of(&[output.clone()], (64, 64), &settings) else {
            panic!("boxes")
        };
        boxes::rows(&output, &format, &part(&fit, &classes, &settings))
            .map(|(_, one)| one)
            .collect::<Vec<_>>()
    };
    let car = |score: f32| {
        vec![DetectedBox { class: Class::Car, score, edges: [80.0, 16.0, 96.0, 32.0] }]
    };
    // The cell of column 1, row 1 of the second grid, of 16 px: 64 cells before it, 4 a row.
    assert_eq!(decoded(&[1, 84, 8], 64 + 5, &[0.5, 0.5, 0.0, 0.0, 0.5, 0.1, 0.8, 0.2]), car(0.4));
    assert_eq!(decoded(&[1, 252, 8], 100, &[24.0, 24.0, 16.0, 16.0, 0.5, 0.1, 0.8, 0.2]), car(0.4));
    assert_eq!(decoded(&[1, 7, 84], 9, &[24.0, 24.0, 16.0, 16.0, 0.1, 0.8, 0.2]), car(0.8));
    assert_eq!(
        decoded(&[1, 7, 84], 9, &[24.0, 24.0, 16.0, 16.0, 0.9, 0.8, 0.2]),
        [],
        "a class that is not kept"
    );
    assert_eq!(
        decoded(&[1, 7, 84], 9, &[24.0, 24.0, 16.0, 16.0, 0.1, 0.2, 0.2]),
        [],
        "a low score"
    );
}

#[test]
fn of_boxes_on_one_object_the_best_stays() {
    let at = |left: f64, class: Class, score: f32| DetectedBox {
        class,
        score,
        edges: [left, 0.0, left + 10.0, 10.0],
    };
    let kept = without_doubles(vec![
        at(1.0, Class::Truck, 0.5),
        at(0.0, Class::Car, 0.9),
        at(0.0, Class::Person, 0.4),
        at(8.0, Class::Car, 0.3),
    ]);
    assert_eq!(
        kept,
        [at(0.0, Class::Car, 0.9), at(0.0, Class::Person, 0.4), at(8.0, Class::Car, 0.3)]
    );
}

#[test]
fn prototypes_and_masks_of_objects_lie_within_their_boxes() {
    let settings = Settings::default();
    let fit = Fit::new([64, 0, 64, 64], (64, 64), false);
    let classes = [Some(Class::Car)];
    let (mut boxes, mut maps) = (zeros(&[1, 7, 84], false), zeros(&[1, 2, 16, 16], false));
    // One box of 16 x 8 px at (24, 24) whose mask is where the first prototype exceeds the second:
    // the input's left half.
    for (attribute, value) in [24.0, 24.0, 32.0, 8.0, 0.5, 1.0, -1.0].into_iter().enumerate() {
        boxes.values[attribute * 84] = value;
    }
    (0..256).for_each(|at| maps.values[256 * usize::from(at % 16 >= 8) + at] = 1.0);
    let outputs = [boxes, maps];
    let Ok(Layout::Prototypes(format)) = Layout::of(&outputs, (64, 64), &settings) else {
        panic!("prototypes")
    };
    let mut masks = crate::input::FrameMasks::default();
    prototypes::decode(&outputs, &format, &part(&fit, &classes, &settings), &mut masks);
    assert_eq!(masks.instances[0].pixels, PixelBox { left: 72, top: 20, width: 24, height: 8 });
    let (mut boxes, mut shares) = (zeros(&[1, 2, 5], false), zeros(&[1, 2, 64, 64], false));
    boxes.values = vec![8.0, 20.0, 40.0, 28.0, 0.9, 0.0, 0.0, 9.0, 9.0, 0.1];
    (0..64 * 64).for_each(|at| shares.values[at] = if at % 64 < 16 { 0.9 } else { 0.1 });
    let outputs = [boxes, zeros(&[1, 2], true), shares];
    let Ok(Layout::EndToEnd(format)) = Layout::of(&outputs, (64, 64), &settings) else {
        panic!("objects")
    };
    let mut found = Detections::default();
    end_to_end::decode(&outputs, &format, &part(&fit, &classes, &settings), &mut found);
    assert_eq!(
        found.masks.instances.iter().map(|one| one.pixels).collect::<Vec<_>>(),
        [PixelBox { left: 72, top: 20, width: 8, height: 8 }]
    );
    end_to_end::decode(
        &outputs[..2],
        &layout::EndToEndFormat { masks: None, ..format },
        &part(&fit, &classes, &settings),
        &mut found,
    );
    assert_eq!(
        found.boxes,
        [DetectedBox { class: Class::Car, score: 0.9, edges: [72.0, 20.0, 104.0, 28.0] }]
    );
}

#[test]
fn wide_pictures_have_tiles_that_overlap() {
    assert_eq!(picture::tiles((640, 480), (416, 416), None), Vec::<[usize; 4]>::new());
    let tiles = picture::tiles((1242, 375), (416, 416), None);
    assert!(
        tiles.len() == 2
            && tiles[0][0] == 0
            && tiles[1][0] < tiles[0][2]
            && tiles[1][0] + tiles[1][2] == 1242,
        "{tiles:?}"
    );
    assert_eq!(picture::tiles((1242, 375), (416, 416), Some(0)).len(), 0);
    assert_eq!(picture::tiles((300, 300), (416, 416), Some(3)).len(), 3);
}

/// A field of a protocol buffer that holds bytes.
fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
    [&[number << 3 | 2, bytes.len() as u8], bytes].concat()
}

/// A field that holds a small number.
fn number(field: u8, value: u8) -> Vec<u8> {
    vec![field << 3, value]
}

/// An array of a type and a shape, for a graph.
fn array(name: &str, kind: u8, shape: &[u8]) -> Vec<u8> {
    let sides: Vec<u8> = shape.iter().flat_map(|side| field(1, &number(1, *side))).collect();
    let tensor = [number(1, kind), field(2, &sides)].concat();
    [field(1, name.as_bytes()), field(2, &field(1, &tensor))].concat()
}

/// A network that says which channel of each pixel is largest: `ArgMax` of [1, 3, 32, 64].
fn largest_channel(channels: u8) -> Vec<u8> {
    let axis = field(5, &[field(1, b"axis"), number(3, 1), vec![0xA0, 1, 2]].concat());
    let keep = field(5, &[field(1, b"keepdims"), number(3, 0), vec![0xA0, 1, 2]].concat());
    let node = [field(1, b"x"), field(2, b"y"), field(4, b"ArgMax"), axis, keep].concat();
    let graph = [
        field(1, &node),
        field(2, b"g"),
        field(11, &array("x", 1, &[1, channels, 32, 64])),
        field(12, &array("y", 7, &[1, 32, 64])),
    ]
    .concat();
    // The graph is longer than a byte can say.
    let length = [graph.len() as u8 & 127 | 128, (graph.len() >> 7) as u8];
    [
        number(1, 8),
        vec![7 << 3 | 2],
        length.to_vec(),
        graph,
        field(8, &[field(1, b""), number(2, 13)].concat()),
    ]
    .concat()
}

/// A folder of stereo pairs, grey at the left and green at the right, and a network with settings.
fn folder(network: &[u8], settings: &str) -> TempDir {
    let root = TempDir::new().unwrap();
    let picture = image::RgbImage::from_fn(64, 32, |u, _| {
        image::Rgb(if u < 40 { [90, 80, 80] } else { [10, 200, 20] })
    });
    for side in ["left", "right"] {
        std::fs::create_dir(root.path().join(side)).unwrap();
        picture.save(root.path().join(side).join("000000.png")).unwrap();
    }
    std::fs::write(
        root.path().join("calib.txt"),
        "focal_px 90\ncenter_u_px 32\ncenter_v_px 16\nbaseline_m 0.5\n",
    )
    .unwrap();
    std::fs::write(root.path().join("net.onnx"), network).unwrap();
    std::fs::write(root.path().join("net.toml"), settings).unwrap();
    root
}

fn refusal(root: &TempDir, name: &str) -> String {
    Networks::open(&[root.path().join(name)], &StopRequest::default())
        .err()
        .map(|error| error.to_string())
        .unwrap_or_default()
}

#[test]
fn settings_of_any_bytes_are_taken_or_refused() {
    let valid = b"names = [\"road\", \"car\"]\nkeep = [\"car\"]\nscore_min = 0.5\nwidth = 640\n\
        mean = [0.0, 1.0, 2.0]\nscale = [1.0, 1.0, 1.0]\ntiles = 2\nchannels = \"bgr\"\n";
    let root = folder(&largest_channel(3), "");
    let (mut random, mut taken) = (Random::new(5), 0);
    for _ in 0..500 {
        let mut bytes = valid.to_vec();
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len() as u32) as usize;
            bytes[at] = b"0-.e9nai]\"\n\xff"[random.below(12) as usize];
        }
        std::fs::write(root.path().join("net.toml"), bytes).unwrap();
        if let Ok((_, settings)) = Settings::beside(&root.path().join("net.onnx")) {
            taken += 1;
            assert!((0.0..=1.0).contains(&settings.score_min));
            let _ = settings.classes(Some(2));
        }
    }
    assert!((20..480).contains(&taken), "{taken}");
}

#[test]
fn a_network_runs_and_its_map_has_the_classes_of_its_settings() {
    let root = folder(&largest_channel(3), "names = [\"road\", \"car\", \"person\"]\n");
    let dataset = input::open(root.path(), &OpenOptions::default()).unwrap();
    let images = dataset.frame(0).unwrap();
    for name in ["net.onnx", "net.toml"] {
        std::fs::write(
            root.path().join("net.toml"),
            "model = \"net.onnx\"\nnames = [\"road\", \"car\", \"person\"]\n",
        )
        .unwrap();
        let networks = Networks::open(&[root.path().join(name)], &StopRequest::default()).unwrap();
        let regions = networks.detections(0, &images).unwrap().regions.unwrap();
        let car = Class::Car.code() as u8;
        assert!((0..64).all(|u| regions.get(u, 9) == Some(if u < 40 { 0 } else { car })));
    }
    std::fs::write(
        root.path().join("net.toml"),
        "names = [\"road\", \"car\", \"person\"]\nkeep = [\"person\"]\n",
    )
    .unwrap();
    let regions = Networks::open(&[root.path().join("net.onnx")], &StopRequest::default())
        .unwrap()
        .detections(0, &images)
        .unwrap()
        .regions
        .unwrap();
    assert!(regions.pixels().iter().all(|code| *code == 0), "cars are not kept");
    assert!(FrameDisparity::new(dataset.as_ref()).is_ok());
}

#[test]
fn what_is_no_network_is_refused_with_what_to_do() {
    let root = folder(&largest_channel(3), "");
    assert!(refusal(&root, "no.onnx").contains("there is no such file"));
    std::fs::write(root.path().join("no.onnx"), "not a network").unwrap();
    assert!(refusal(&root, "no.onnx").contains("the runtime does not take it"));
    std::fs::write(root.path().join("four.onnx"), largest_channel(4)).unwrap();
    assert!(
        refusal(&root, "four.onnx").contains("has the shape [1, 4, 32, 64], not that of a picture")
    );
    for (settings, reason) in [
        ("width = 32\n", "leave width and height out"),
        ("colour = 1\n", "unknown field `colour`"),
        ("names = 3\n", "docs/inputs.md"),
    ] {
        std::fs::write(root.path().join("net.toml"), settings).unwrap();
        let message = refusal(&root, "net.onnx");
        assert!(message.contains(reason) && message.contains("net."), "{message}");
    }
    std::fs::write(root.path().join("net.toml"), "").unwrap();
    assert!(refusal(&root, "net.toml").contains("does not name its network"));
}

#[dynvox_needs::clips(
    "models/yolox_nano.onnx",
    "models/deeplab_cityscapes_513x161.onnx",
    "kitti-tracking/training/image_02/0003"
)]
#[test]
fn the_clips_networks_find_the_overtaking_car_in_the_same_pixels_twice() {
    let data = Path::new(dynvox_needs::data_folder!());
    let options = OpenOptions { sequence: Some("0003".to_owned()), ..OpenOptions::default() };
    let dataset = input::open(&data.join("kitti-tracking"), &options).unwrap();
    for model in ["yolox_nano.onnx", "deeplab_cityscapes_513x161.onnx"] {
        let path = data.join("models").join(model);
        let images = dataset.frame(10).unwrap();
        let masks = || {
            let source = BoxMasks::of_pictures(
                Networks::open(std::slice::from_ref(&path), &StopRequest::default()).unwrap(),
                dataset.as_ref(),
            )
            .unwrap();
            crate::input::masks::MaskSource::masks(&source, 10, &images).unwrap()
        };
        let first = masks();
        assert!(
            first.instances.iter().any(|one| one.class == Class::Car
                && one.mask.iter().filter(|pixel| **pixel > 0).count() > 4_000),
            "{model}"
        );
        assert_eq!(first, masks(), "{model}");
    }
}
