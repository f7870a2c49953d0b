//! Inputs that the readers take, as small as they may be.

use dynvox::formats::{Image, write_png_deep};
use dynvox::run::store::BlockFile;
use dynvox_core::geometry::MapSegment;
use dynvox_core::volume::{BLOCK_VOXELS, BlockCoord, BlockKey, BlockStore, EvictedBlock};

use super::files::{SIZE, TRUNCATION_M, VOXEL_M, written};

/// A calibration of rectified images, as P0 and P1 lines.
pub const RIG: &[u8] = b"P0: 40 0 24 0 0 40 16 0 0 0 1 0\nP1: 40 0 24 -20 0 40 16 0 0 0 1 0\n";
/// A calibration of the tracking benchmark.
pub const KITTI: &[u8] = b"P0: 40 0 24 0 0 40 16 0 0 0 1 0\nP1: 40 0 24 -20 0 40 16 0 0 0 1 0\nP2: 40 0 24 1 0 40 16 0 0 0 1 0\n\
P3: 40 0 24 -20 0 40 16 0 0 0 1 0\nR_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam 0 -1 0 0 0 0 -1 0 1 0 0 \
-0.1\n";
/// A pose in KITTI's format.
pub const POSE: &[u8] = b"1 0 0 0 0 1 0 0 0 0 1 0.5\n";
/// A label of the tracking benchmark.
pub const LABEL: &[u8] = b"0 1 Car 0 0 -1.5 10 12 30 28 1.5 1.6 4.0 -3.0 1.2 9.0 1.6\n";

/// A grey image with texture.
pub fn pgm([width, height]: [u32; 2]) -> Vec<u8> {
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    bytes.extend((0..width * height).map(|at| (at * 37 % 251) as u8));
    bytes
}

/// Inputs whose first byte says what the others are.
fn chosen(inputs: &[(u8, &[u8])]) -> Vec<Vec<u8>> {
    inputs.iter().map(|&(choice, content)| [&[choice], content].concat()).collect()
}

pub fn calibrations() -> Vec<Vec<u8>> {
    let euroc: &[u8] =
        b"sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 20\n\
resolution: [48, 32]\ncamera_model: pinhole\nintrinsics: [40, 40, 24, 16]\ndistortion_model: \
radial-tangential\n\
distortion_coefficients: [-0.28, 0.07, 0.0, 0.0]\n";
    let kalibr: &[u8] = b"cam0:\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0, 0.0]\n  distortion_model: radtan\n\
  intrinsics: [40.0, 40.0, 24.0, 16.0]\n  resolution: [48, 32]\ncam1:\n  T_cn_cnm1:\n  - [1.0, \
  0.0, 0.0, -0.5]\n  - [0.0, 1.0, 0.0, 0.0]\n\
  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n  distortion_coeffs: \
  [-0.28, 0.07, 0.0, 0.0]\n\
  distortion_model: radtan\n  intrinsics: [40.0, 40.0, 24.0, 16.0]\n  resolution: [48, 32]\n";
    let opencv: &[u8] = b"%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: \
        d\n   data: [ 40., 0., 24., 0., 40., 16., 0., 0., 1. ]\n\
D1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ -0.28, 0.07, 0., 0., 0. ]\nM2: \
!!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n\
   data: [ 40., 0., 24., 0., 40., 16., 0., 0., 1. ]\nD2: !!opencv-matrix\n   rows: 1\n   cols: \
   5\n   dt: d\n   data: [ -0.28, 0.07, 0., 0., 0. ]\n\
R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., 0., 0., 1., 0., 0., 0., \
1. ]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n\
   dt: d\n   data: [ -0.5, 0., 0. ]\n";
    let xml: &[u8] = b"<?xml version=\"1.0\"?>\n<opencv_storage>\n<M1 type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\
<data>40. 0. 24. 0. 40. 16. 0. 0. 1.</data></M1>\n<M2 \
type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\
<data>40. 0. 24. 0. 40. 16. 0. 0. 1.</data></M2>\n<D1 \
type_id=\"opencv-matrix\"><rows>1</rows><cols>4</cols><dt>d</dt><data>0. 0. 0. 0.</data></D1>\n\
<D2 type_id=\"opencv-matrix\"><rows>1</rows><cols>4</cols><dt>d</dt><data>0. 0. 0. 0.</data></D2>\n\
<R type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>1. 0. 0. 0. 1. 0. 0. 0. \
1.</data></R>\n\
<T type_id=\"opencv-matrix\"><rows>3</rows><cols>1</cols><dt>d</dt><data>-0.5 0. \
0.</data></T>\n</opencv_storage>\n";
    chosen(&[
        (0, euroc),
        (0, kalibr),
        (0, opencv),
        (1, xml),
        (2, RIG),
        (2, KITTI),
        (3, b"focal_px = 40\ncenter_u_px = 24\ncenter_v_px = 16\nbaseline_m = 0.5\n"),
    ])
}

pub fn poses() -> Vec<Vec<u8>> {
    let tum: &[u8] = b"# time x y z qx qy qz qw\n0.0 0 0 0 0 0 0 1\n0.1 0 0 0.5 0 0 0 1\n";
    let numbered = [b"3 ", POSE].concat();
    vec![POSE.repeat(3), tum.to_vec(), numbered]
}

pub fn times() -> Vec<Vec<u8>> {
    let dates: &[u8] = b"2011-09-26 14:05:01.123456789\n2011-09-26 14:05:01.223456789\n";
    let table: &[u8] = b"#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n";
    let nmea: &[u8] = b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n\
$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\r\n\
$GPGST,123519,1.2,2.1,1.4,30.0,0.8,0.6,1.9*44\r\n";
    let fixes: &[u8] = b"49 8.4 110\n-\n49 8.4 110 0.1 0.2 0.3\n";
    let plain: &[u8] = b"0.0\n0.1\n0.2\n";
    [plain, dates, table, nmea, fixes].map(<[u8]>::to_vec).to_vec()
}

pub fn inertial() -> Vec<Vec<u8>> {
    let table: &[u8] =
        b"time_s,wx,wy [deg/s],wz,ax,ay,az [g]\n0.00,0.1,0,0,0,0,1\n0.01,0.1,0,0,0,0,1\n";
    let euroc: &[u8] = b"#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad \
s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n\
1403636579758555392,0,0.1,0,9.8,0,0\n1403636579763555584,0,0.1,0,9.8,0,0\n";
    let plain: &[u8] = b"0;0,1;0;0;0;0;9,8\n5000000;0,1;0;0;0;0;9,8\n";
    let mounting: &[u8] = b"cam0:\n  T_cam_imu: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]\n";
    let matrix: &[u8] = b"1 0 0 0\n0 1 0 0\n0 0 1 0\n";
    chosen(&[(0, table), (0, euroc), (0, plain), (1, mounting), (2, matrix)])
}

pub fn recording() -> Vec<Vec<u8>> {
    chosen(&[(0, LABEL), (1, &[0; 64]), (2, KITTI), (3, POSE)])
}

pub fn pictures() -> Vec<Vec<u8>> {
    let png = written("deep.png", |path| {
        let pixels = Image::new(2, 2, vec![1, 256, 40_000, 65_535]).expect("four pixels");
        write_png_deep(path, &pixels).expect("the temporary folder can be written to");
    });
    let ppm: &[u8] = b"P6\n2 1\n255\nabcdef";
    chosen(&[(0, &png), (1, &pgm([3, 2])), (1, ppm), (1, b"P2\n2 1\n255\n1 2\n")])
}

pub fn depth() -> Vec<Vec<u8>> {
    let pfm = [b"Pf\n4 3\n-1.0\n".as_slice(), &[0; 48]].concat();
    let xml: &[u8] =
        b"<?xml version=\"1.0\"?>\n<opencv_storage>\n<depth-frame type_id=\"opencv-matrix\">\n<rows>3</rows><cols>4</cols><dt>s</dt>\n\
<data>1 2 3 4 5 6 7 8 9 10 11 12</data></depth-frame>\n</opencv_storage>\n";
    chosen(&[(0, &pfm), (1, xml)])
}

pub fn masks() -> Vec<Vec<u8>> {
    let coco: &[u8] = b"{\"images\": [{\"id\": 1, \"file_name\": \"000000.pgm\", \"width\": 48, \
        \"height\": 32}], \"categories\": [{\"id\": 3, \"name\": \"car\"}], \
\"annotations\": [{\"id\": 1, \"image_id\": 1, \"category_id\": 3, \"segmentation\": [[10, 10, \
30, 10, 30, 24, 10, 24]], \"bbox\": [10, 10, 20, 14], \
\"score\": 0.9, \"iscrowd\": 0}, {\"id\": 2, \"image_id\": 1, \"category_id\": 3, \
\"segmentation\": {\"size\": [32, 48], \"counts\": [300, 20, 12, 20, 1184]}, \
\"bbox\": [9, 8, 3, 20], \"score\": 0.5}]}";
    let yolo: &[u8] = b"2 0.2 0.3 0.7 0.3 0.7 0.8 0.2 0.8\n2 0.5 0.5 0.4 0.4\n";
    let mot: &[u8] = b"1,1,10,10,20,14,0.9,-1,-1,-1\n";
    chosen(&[
        (1, coco),
        (2, yolo),
        (3, LABEL),
        (3, mot),
        (5, b"# id class score x1 y1 x2 y2\n1 car 0.9 10 10 30 24\n"),
    ])
}

pub fn store() -> Vec<Vec<u8>> {
    let store = |blocks: i16| {
        written("map.blocks", |path| {
            let (mut file, _) = BlockFile::open(path, VOXEL_M, TRUNCATION_M)
                .expect("the temporary folder can be written to");
            for x in 0..blocks {
                let block = EvictedBlock {
                    key: BlockKey {
                        segment: MapSegment::new(x as u16 & 1),
                        coord: BlockCoord { x, y: 0, z: 9 },
                    },
                    sdf: &[x; BLOCK_VOXELS],
                    weight: &[3; BLOCK_VOXELS],
                    colour: None,
                };
                assert!(file.store(block));
            }
        })
    };
    vec![store(1), store(3)]
}

pub fn stream() -> Vec<Vec<u8>> {
    let pair = pgm(SIZE).repeat(2);
    chosen(&[
        (0, &pair),
        (1, &pgm(SIZE)),
        (2, &pgm(SIZE)),
        (0, &[b"P6\n2 2\n255\n".as_slice(), &[9; 12]].concat().repeat(2)),
    ])
}

pub fn clip() -> Vec<Vec<u8>> {
    let rig = [40.0_f64, 24.0, 16.0, 0.5].map(f64::to_le_bytes);
    let head = |kind: u32, frames: u32| {
        let numbers = [kind, 96, 64, frames].map(u32::to_le_bytes);
        [b"DVXCLIP1".as_slice(), numbers.as_flattened(), rig.as_flattened()].concat()
    };
    vec![head(0, 0), head(1, 0), head(2, 0)]
}

pub fn settings() -> Vec<Vec<u8>> {
    [
        "volume.voxel_size_m=0.1\nmapper.egomotion=icp\nvolume.prune_lag=3\n",
        "stereo.support_ratio=0.9\nvolume.class_weight=1,2,3\nrig.self_calibration=off\n",
        "egomotion.samples=10\ntracking.motion.matches_min=6\nmesh.min_weight=1\n",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}
