//! Decoding of pictures within bounds: PNG, JPEG, PGM, PPM, TIFF and BMP.
//!
//! The header is looked at first. Sides, and the memory that decoding takes, are compared with the
//! table of [`super::bounds`] before a pixel is decoded. Texts and profiles in PNG files are passed
//! over without being unpacked, a PNG is inflated up to its last row, and a JPEG's scans are
//! counted.
//!
//! Memory: the samples once, twice of a TIFF; a JPEG's file and the coefficients of a progressive
//! one besides.

mod jpeg;
mod png;
#[cfg(test)]
mod tests;

use super::bounds::{MAX_DECODE_BYTES, MAX_SIDE_PX, check_bytes, check_decoding, check_sides};
use ::image::codecs::bmp::BmpDecoder;
use ::image::codecs::jpeg::JpegDecoder;
use ::image::codecs::pnm::{PnmDecoder, PnmHeader};
use ::image::codecs::tiff::TiffDecoder;
use ::image::{DynamicImage, ImageDecoder, ImageFormat, Limits, guess_format};
use std::fmt::Display;
use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};
use tiff::tags::Tag;

/// First bytes of a file, by which its format is told.
const MAGIC_BYTES: u64 = 16;
/// Memory for strips and tables of a TIFF, bytes.
const TIFF_RESERVE: u64 = 16 << 20;
/// TIFF's tag value of strips that are JPEG files.
const TIFF_JPEG: u16 = 7;

/// The pixels of a picture, whose format its first bytes tell.
///
/// # Errors
/// Names the fault, as the rest of a sentence.
pub fn decode(mut reader: impl BufRead + Seek) -> Result<DynamicImage, String> {
    match format(&mut reader)? {
        ImageFormat::Png => png::decode(reader),
        ImageFormat::Jpeg => {
            let file = whole(reader)?;
            let decoder = JpegDecoder::new(Cursor::new(&file)).map_err(plain)?;
            jpeg::check(&file, &decoder)?;
            drawn(decoder, MAX_DECODE_BYTES)
        }
        ImageFormat::Tiff => {
            let decoder = tiff(reader)?;
            let bytes = decoder.total_bytes();
            check(&decoder, 2 * bytes)?;
            drawn(decoder, bytes + TIFF_RESERVE)
        }
        ImageFormat::Pnm => netpbm(reader),
        _ => simple(BmpDecoder::new(reader).map_err(plain)?),
    }
}

/// The pixels of a picture that must be a PNG.
///
/// # Errors
/// Names the fault, as the rest of a sentence.
pub fn decode_png(mut reader: impl BufRead + Seek) -> Result<DynamicImage, String> {
    check_length(&mut reader)?;
    png::decode(reader)
}

/// Width and height of a picture, px; its pixels are not decoded.
///
/// # Errors
/// Names the fault, as the rest of a sentence.
pub fn size(mut reader: impl BufRead + Seek) -> Result<(usize, usize), String> {
    let (width, height) = match format(&mut reader)? {
        ImageFormat::Png => png::size(reader)?,
        ImageFormat::Jpeg => JpegDecoder::new(reader).map_err(plain)?.dimensions(),
        ImageFormat::Tiff => tiff(reader)?.dimensions(),
        ImageFormat::Pnm => PnmDecoder::new(reader).map_err(plain)?.dimensions(),
        _ => BmpDecoder::new(reader).map_err(plain)?.dimensions(),
    };
    let (width, height) = (width as usize, height as usize);
    check_sides(width, height)?;
    Ok((width, height))
}

/// Largest sample that a PGM or PPM of 16 bit says it can have; `None` where it says all of them,
/// as programs write that know of no smaller one, and of other pictures.
pub fn declared_maximum(mut reader: impl BufRead + Seek) -> Option<u16> {
    if format(&mut reader).ok()? != ImageFormat::Pnm {
        return None;
    }
    maximum_of(PnmDecoder::new(reader).ok()?.header())
}

fn maximum_of(header: &PnmHeader) -> Option<u16> {
    let maximum = u16::try_from(header.maximal_sample()).ok()?;
    (u16::from(u8::MAX) < maximum && maximum < u16::MAX).then_some(maximum)
}

/// Decodes a PGM or PPM. Its decoder stretches samples to 16 bit; they are given as they stand in
/// the file, so that the same bits are significant as in other formats.
fn netpbm(reader: impl BufRead) -> Result<DynamicImage, String> {
    let decoder = PnmDecoder::new(reader).map_err(plain)?;
    let maximum = maximum_of(decoder.header());
    let mut image = simple(decoder)?;
    let Some(maximum) = maximum.map(u32::from) else { return Ok(image) };
    let all = u32::from(u16::MAX);
    let stored = |sample: &mut u16| {
        *sample = ((u32::from(*sample) * maximum + all / 2) / all) as u16;
    };
    match &mut image {
        DynamicImage::ImageLuma16(pixels) => pixels.iter_mut().for_each(stored),
        DynamicImage::ImageRgb16(pixels) => pixels.iter_mut().for_each(stored),
        _ => {}
    }
    Ok(image)
}

/// Tells the format of a file that is not too long. The reader stands at its beginning again.
fn format(reader: &mut (impl BufRead + Seek)) -> Result<ImageFormat, String> {
    check_length(reader)?;
    let mut magic = Vec::new();
    reader.by_ref().take(MAGIC_BYTES).read_to_end(&mut magic).map_err(plain)?;
    reader.rewind().map_err(plain)?;
    match guess_format(&magic).map_err(plain)? {
        format @ (ImageFormat::Png
        | ImageFormat::Jpeg
        | ImageFormat::Tiff
        | ImageFormat::Pnm
        | ImageFormat::Bmp) => Ok(format),
        other => Err(format!(
            "it is {}; PNG, JPEG, PGM, PPM, TIFF and BMP are read",
            other.extensions_str().first().unwrap_or(&"of another format").to_uppercase()
        )),
    }
}

/// Refuses a file that is too long. The reader stands at its beginning again.
fn check_length(reader: &mut (impl BufRead + Seek)) -> Result<(), String> {
    let len = reader.seek(SeekFrom::End(0)).map_err(plain)?;
    check_bytes("a picture", len, MAX_DECODE_BYTES)?;
    reader.rewind().map_err(plain)
}

fn whole(mut reader: impl BufRead) -> Result<Vec<u8>, String> {
    let mut file = Vec::new();
    reader.read_to_end(&mut file).map_err(plain)?;
    Ok(file)
}

/// Opens a TIFF. Strips that are JPEG files are refused: their own headers say how much memory they
/// take, and no bound can be set.
fn tiff<R: BufRead + Seek>(mut reader: R) -> Result<TiffDecoder<R>, String> {
    let mut directory = tiff::decoder::Decoder::new(&mut reader).map_err(plain)?;
    let compression = directory.find_tag_unsigned::<u16>(Tag::Compression).map_err(plain)?;
    if compression == Some(TIFF_JPEG) {
        return Err("it is a TIFF compressed as JPEG; write it without, or with LZW".to_owned());
    }
    reader.rewind().map_err(plain)?;
    TiffDecoder::new(reader).map_err(plain)
}

/// Decodes a picture whose decoder takes no memory besides its samples.
fn simple(decoder: impl ImageDecoder) -> Result<DynamicImage, String> {
    check(&decoder, decoder.total_bytes())?;
    drawn(decoder, MAX_DECODE_BYTES)
}

/// Refuses a picture beyond the bounds, before its pixels are decoded.
fn check(decoder: &impl ImageDecoder, bytes: u64) -> Result<(), String> {
    let (width, height) = decoder.dimensions();
    check_decoding(width as usize, height as usize, bytes)
}

/// Decodes the pixels; the decoder may take `max_bytes`.
fn drawn(mut decoder: impl ImageDecoder, max_bytes: u64) -> Result<DynamicImage, String> {
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE_PX as u32);
    limits.max_image_height = Some(MAX_SIDE_PX as u32);
    limits.max_alloc = Some(max_bytes);
    decoder.set_limits(limits).map_err(plain)?;
    DynamicImage::from_decoder(decoder).map_err(plain)
}

/// The decoder's words without a full stop, to stand inside a sentence.
pub fn plain(error: impl Display) -> String {
    error.to_string().trim_end_matches(['.', '\n']).replace('\n', " ")
}
