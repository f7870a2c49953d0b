//! PNG by the decoder itself, which can pass over texts and profiles.

use super::plain;
use crate::formats::bounds::{check_decoding, check_sides};
use ::image::{DynamicImage, ImageBuffer};
use ::png::{BitDepth, ColorType, Decoder, InterlaceInfo, Limits, Reader, Transformations};
use std::io::{BufRead, Seek};

/// Memory of the decoder besides the pixels, bytes: rows, palette and ancillary chunks.
const RESERVE: usize = 4 << 20;
/// First column and row of each pass of an interlaced picture, and its steps.
const PASSES: [[u32; 4]; 7] = [
    [0, 0, 8, 8],
    [4, 0, 8, 8],
    [0, 4, 4, 8],
    [2, 0, 4, 4],
    [0, 2, 2, 4],
    [1, 0, 2, 2],
    [0, 1, 1, 2],
];

/// The width and height that the header says, px.
pub fn size(reader: impl BufRead + Seek) -> Result<(u32, u32), String> {
    let mut decoder = bounded(reader);
    let header = decoder.read_header_info().map_err(plain)?;
    Ok(header.size())
}

/// The pixels, of 8 or 16 bit; a palette becomes colours.
pub fn decode(reader: impl BufRead + Seek) -> Result<DynamicImage, String> {
    let mut decoder = bounded(reader);
    let (width, height) = decoder.read_header_info().map_err(plain)?.size();
    check_sides(width as usize, height as usize)?;
    let mut reader = decoder.read_info().map_err(plain)?;
    let frame = reader.info().frame_control;
    if frame.is_some_and(|frame| (frame.width, frame.height) != (width, height)) {
        return Err("its first frame does not fill it".to_owned());
    }
    let (color, depth) = reader.output_color_type();
    // Compared before memory is taken for the pixels.
    let bytes = reader.output_buffer_size().map_or(u64::MAX, |bytes| bytes as u64);
    check_decoding(width as usize, height as usize, bytes)?;
    let mut pixels = vec![0; bytes as usize];
    read_rows(&mut reader, &mut pixels)?;
    image_of((color, depth), (width, height), pixels)
        .ok_or_else(|| format!("its pixels are {color:?} of {depth:?} bit, which is not read"))
}

/// A decoder that passes over texts and colour profiles and takes little besides the pixels.
fn bounded<R: BufRead + Seek>(reader: R) -> Decoder<R> {
    let mut decoder = Decoder::new_with_limits(reader, Limits { bytes: RESERVE });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    decoder.set_transformations(Transformations::EXPAND);
    decoder
}

/// Reads as many rows as the header says and nothing of what is compressed behind them.
fn read_rows<R: BufRead + Seek>(reader: &mut Reader<R>, pixels: &mut [u8]) -> Result<(), String> {
    let (width, height) = reader.info().size();
    let (color, depth) = reader.output_color_type();
    let row_bytes = reader.output_line_size(width).ok_or("its rows are too long")?;
    if !reader.info().interlaced {
        for row in pixels.chunks_exact_mut(row_bytes).take(height as usize) {
            reader.read_row(row).map_err(plain)?;
        }
        return Ok(());
    }
    let bits = color.samples() as u8 * depth as u8;
    let mut row = vec![0; row_bytes];
    for _ in 0..pass_rows(width, height) {
        if let Some(InterlaceInfo::Adam7(pass)) = reader.read_row(&mut row).map_err(plain)? {
            ::png::expand_interlaced_row(pixels, row_bytes, &row, &pass, bits);
        }
    }
    Ok(())
}

/// Rows of all passes of an interlaced picture that have a pixel.
fn pass_rows(width: u32, height: u32) -> u32 {
    let rows = |&[column, row, step_u, step_v]: &[u32; 4]| {
        let columns = width.saturating_sub(column).div_ceil(step_u);
        if columns == 0 { 0 } else { height.saturating_sub(row).div_ceil(step_v) }
    };
    PASSES.iter().map(rows).sum()
}

fn image_of(
    (color, depth): (ColorType, BitDepth),
    (width, height): (u32, u32),
    pixels: Vec<u8>,
) -> Option<DynamicImage> {
    if depth == BitDepth::Sixteen {
        let samples = pixels.as_chunks().0.iter().map(|&bytes| u16::from_be_bytes(bytes)).collect();
        return match color {
            ColorType::Grayscale => {
                ImageBuffer::from_raw(width, height, samples).map(DynamicImage::ImageLuma16)
            }
            ColorType::GrayscaleAlpha => {
                ImageBuffer::from_raw(width, height, samples).map(DynamicImage::ImageLumaA16)
            }
            ColorType::Rgb => {
                ImageBuffer::from_raw(width, height, samples).map(DynamicImage::ImageRgb16)
            }
            ColorType::Rgba => {
                ImageBuffer::from_raw(width, height, samples).map(DynamicImage::ImageRgba16)
            }
            ColorType::Indexed => None,
        };
    }
    match color {
        ColorType::Grayscale => {
            ImageBuffer::from_raw(width, height, pixels).map(DynamicImage::ImageLuma8)
        }
        ColorType::GrayscaleAlpha => {
            ImageBuffer::from_raw(width, height, pixels).map(DynamicImage::ImageLumaA8)
        }
        ColorType::Rgb => ImageBuffer::from_raw(width, height, pixels).map(DynamicImage::ImageRgb8),
        ColorType::Rgba => {
            ImageBuffer::from_raw(width, height, pixels).map(DynamicImage::ImageRgba8)
        }
        ColorType::Indexed => None,
    }
}
