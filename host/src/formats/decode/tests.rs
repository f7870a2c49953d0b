//! Pictures that ask for more than the bounds are refused by their header, and what lies beside the
//! pixels is not unpacked.

use super::{decode, size};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{Cursor, Write};

const GREY_8: [u8; 5] = [8, 0, 0, 0, 0];
const INTERLACED: [u8; 5] = [8, 0, 0, 0, 1];

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::fast());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

/// A PNG of chunks, those of the header and the end added.
fn png(size: [u32; 2], kind: [u8; 5], chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut add = |name: &[u8; 4], data: &[u8]| {
        file.extend((data.len() as u32).to_be_bytes());
        let named = [name, data].concat();
        file.extend(&named);
        file.extend(crc32fast::hash(&named).to_be_bytes());
    };
    let header: Vec<u8> = size.iter().flat_map(|side| side.to_be_bytes()).chain(kind).collect();
    add(b"IHDR", &header);
    chunks.iter().for_each(|(name, data)| add(name, data));
    add(b"IEND", &[]);
    file
}

fn refusal(file: &[u8]) -> String {
    decode(Cursor::new(file)).map(|image| (image.width(), image.height())).unwrap_err()
}

#[test]
fn sides_beyond_the_bound_are_refused_by_the_header_of_every_format() {
    let tiff = |side: u32| {
        // Width, height, 8 bit, no compression, black is zero, one strip at 8 of one byte.
        let mut file = b"II*\0\x08\0\0\0".to_vec();
        let tags: [(u16, u32); 8] = [
            (256, side),
            (257, side),
            (258, 8),
            (259, 1),
            (262, 1),
            (273, 8),
            (278, side),
            (279, 1),
        ];
        file.extend((tags.len() as u16).to_le_bytes());
        for (tag, value) in tags {
            file.extend(tag.to_le_bytes());
            file.extend([4, 0, 1, 0, 0, 0]);
            file.extend(value.to_le_bytes());
        }
        file.extend([0; 4]);
        file
    };
    let bmp = |side: i32| {
        let mut file = b"BM".to_vec();
        file.extend([54u32, 0, 54, 40].iter().flat_map(|word| word.to_le_bytes()));
        file.extend([side, side].iter().flat_map(|word| word.to_le_bytes()));
        file.extend([1, 0, 24, 0]);
        file.extend([0; 24]);
        file
    };
    let mut jpeg = Vec::new();
    let pixels = vec![0; 16 * 16];
    ::image::codecs::jpeg::JpegEncoder::new(&mut jpeg)
        .encode(&pixels, 16, 16, ::image::ExtendedColorType::L8)
        .unwrap();
    let frame = jpeg.windows(2).position(|marker| marker == [0xFF, 0xC0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0x4E, 0x20, 0x4E, 0x20]);
    let packed_rows = packed(&[0; 64]);
    let files = [
        png([20_000, 20_000], GREY_8, &[(b"IDAT", packed_rows)]),
        b"P5\n20000 20000\n255\n".to_vec(),
        b"P2\n20000 20000\n255\n1 1".to_vec(),
        b"P7\nWIDTH 20000\nHEIGHT 20000\nDEPTH 1\nMAXVAL 255\nTUPLTYPE GRAYSCALE\nENDHDR\n"
            .to_vec(),
        tiff(20_000),
        bmp(20_000),
        jpeg,
    ];
    for file in files {
        let kind = &file[..2];
        let sentence = "it is 20000 x 20000 px; at most 8,192 px a side are read";
        assert_eq!(refusal(&file), sentence, "{kind:?}");
        assert_eq!(size(Cursor::new(&file)).unwrap_err(), sentence, "{kind:?}");
    }
}

#[test]
fn a_picture_that_takes_too_much_memory_is_refused_before_it_is_decoded() {
    let colour_16 = [16, 2, 0, 0, 0];
    let file = png([8_192, 8_192], colour_16, &[(b"IDAT", packed(&[0; 64]))]);
    let sentence =
        "its 8192 x 8192 px take 384 MiB to decode; at most 96 MiB are taken for a picture";
    assert_eq!(refusal(&file), sentence);
    assert_eq!(refusal(b"P6\n8192 8192\n65535\n"), sentence);
}

#[test]
fn texts_and_profiles_beside_the_pixels_are_passed_over() {
    // 32 MiB each unpacked, where a decoder may take 4.
    let bomb = packed(&vec![0; 32 << 20]);
    let with = |name: &'static [u8; 4], head: &[u8]| {
        let chunk = [head, &bomb].concat();
        png([2, 1], GREY_8, &[(name, chunk), (b"IDAT", packed(&[0, 7, 9]))])
    };
    for file in [with(b"zTXt", b"a\0\0"), with(b"iCCP", b"a\0\0"), with(b"iTXt", b"a\0\x01\0\0\0")]
    {
        assert_eq!(decode(Cursor::new(&file)).unwrap().into_luma8().as_raw(), &[7, 9]);
    }
}

#[test]
fn what_is_packed_behind_the_last_row_is_not_unpacked() {
    for kind in [GREY_8, INTERLACED] {
        // The rows of one pixel, then a stream that breaks off.
        let mut rows = packed(&[0, 7, 5, 5, 5, 5].repeat(400));
        rows.truncate(rows.len() - 6);
        let file = png([1, 1], kind, &[(b"IDAT", rows)]);
        assert_eq!(decode(Cursor::new(&file)).unwrap().into_luma8().as_raw(), &[7], "{kind:?}");
    }
}

#[test]
fn interlaced_pictures_have_the_pixels_of_plain_ones() {
    let value = |u: usize, v: usize| (u * 31 + v * 7) as u8;
    let passes: [[usize; 4]; 7] = [
        [0, 0, 8, 8],
        [4, 0, 8, 8],
        [0, 4, 4, 8],
        [2, 0, 4, 4],
        [0, 2, 2, 4],
        [1, 0, 2, 2],
        [0, 1, 1, 2],
    ];
    for (width, height) in [(1, 1), (3, 2), (8, 8), (13, 9)] {
        let mut rows = Vec::new();
        for [u0, v0, step_u, step_v] in passes {
            for v in (v0..height).step_by(step_v).filter(|_| u0 < width) {
                rows.push(0);
                rows.extend((u0..width).step_by(step_u).map(|u| value(u, v)));
            }
        }
        let chunks = [(b"IDAT", packed(&rows))];
        let file = png([width as u32, height as u32], INTERLACED, &chunks);
        let read = decode(Cursor::new(&file)).unwrap().into_luma8().into_raw();
        let plain: Vec<u8> =
            (0..height).flat_map(|v| (0..width).map(move |u| value(u, v))).collect();
        assert_eq!(read, plain, "{width} x {height}");
    }
}

#[test]
fn progressive_scans_are_counted_and_files_have_a_length() {
    let scan = [0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0];
    // SOI, a progressive frame of 16 x 16 px and one component, then scans.
    let mut file = vec![0xFF, 0xD8, 0xFF, 0xC2, 0, 11, 8, 0, 16, 0, 16, 1, 1, 0x11, 0];
    file.extend(scan.repeat(101));
    let refused = refusal(&file);
    assert!(refused.contains("101 scans; at most 100"), "{refused}");

    let folder = tempfile::TempDir::new().unwrap();
    let sparse = folder.path().join("long.jpg");
    std::fs::File::create(&sparse).unwrap().set_len(1 << 36).unwrap();
    let error = crate::formats::read_picture(&sparse).unwrap_err().to_string();
    assert!(error.contains("it has 65,536 MiB; at most 96 MiB of a picture are read"), "{error}");
}
