//! Stereo pairs from a stream of netpbm images: binary PGM (P5) and PPM (P6), 8 and 16 bit, one
//! behind the other.
//!
//! The header of an image says where it ends, and nothing is read beyond: a frame is there as soon
//! as its last byte is.

use super::Pair;
use crate::formats::bounds::{check_decoding, check_sides};
use crate::formats::{
    BayerPattern, Decoded, Picture, RANGE_PICTURES, SampleRange, decode_picture, significant_bits,
};
use crate::input::source::{InputError, Stacking};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read};

/// Longest header, bytes: comments included.
const LONGEST_HEADER: usize = 4_096;

/// Pairs from the bytes of a stream.
pub struct NetpbmPairs<R> {
    bytes: R,
    stacking: Option<Stacking>,
    bits: Option<u32>,
    bayer: Option<BayerPattern>,
    /// Images read.
    images: usize,
    /// Images that came before the significant bits were known, and what ended them.
    waiting: VecDeque<Result<Picture, InputError>>,
    ended: bool,
}

/// Header of an image.
struct Header {
    bytes: Vec<u8>,
    /// Bytes of pixels that follow.
    len: usize,
    /// Largest sample that an image can have.
    maximum: usize,
}

impl<R: Read> NetpbmPairs<R> {
    /// Images of both cameras in turn, the left one first, or both in one where `stacking` says
    /// how. `bits` are the significant bits of 16-bit samples. Where they are not given the first
    /// header's maximum tells them, unless it is 65535: then the first [`RANGE_PICTURES`] images
    /// do, which are read before the first pair is handed out.
    pub fn new(bytes: R, stacking: Option<Stacking>, bits: Option<u32>) -> Self {
        let waiting = VecDeque::new();
        Self { bytes, stacking, bits, bayer: None, images: 0, waiting, ended: false }
    }

    /// Takes grey images for mosaics of a pattern.
    pub fn with_bayer(self, bayer: Option<BayerPattern>) -> Self {
        Self { bayer, ..self }
    }

    fn error(&self, reason: impl Into<String>) -> InputError {
        InputError::Stream { image: self.images, reason: reason.into() }
    }

    /// The next pair; `None` where the stream ends between two pairs.
    fn pair(&mut self) -> Result<Option<Pair>, InputError> {
        let Some(first) = self.image()? else { return Ok(None) };
        let Some(stacking) = self.stacking else {
            let alone = "the stream ended after the left image of a pair";
            let second = self.image()?.ok_or_else(|| self.error(alone))?;
            return Ok(Some([first, second]));
        };
        let uneven = || {
            self.error(format!("the image cannot be cut into two equal images {}", stacking.name()))
        };
        stacking.split(&first).map(Some).ok_or_else(uneven)
    }

    /// The next image as the mapper takes it.
    fn image(&mut self) -> Result<Option<Decoded>, InputError> {
        let picture = match self.waiting.pop_front() {
            Some(waiting) => waiting?,
            None => match self.picture()? {
                Some(picture) => picture,
                None => return Ok(None),
            },
        };
        if self.bits.is_none() && picture.largest_sample().is_some() {
            self.detect_bits(&picture);
        }
        Ok(Some(picture.to_8_bit(self.bits)))
    }

    /// Tells the significant bits by the first images, which then wait for their turn.
    fn detect_bits(&mut self, first: &Picture) {
        let mut range = SampleRange::default();
        range.add(first);
        while self.waiting.len() + 1 < RANGE_PICTURES
            && let Some(picture) = self.picture().transpose()
        {
            let ended = picture.is_err();
            picture.iter().for_each(|picture| range.add(picture));
            self.waiting.push_back(picture);
            if ended {
                break;
            }
        }
        self.bits = range.bits();
    }

    /// The next picture of the stream.
    fn picture(&mut self) -> Result<Option<Picture>, InputError> {
        let Some(Header { mut bytes, len, maximum }) = self.header()? else { return Ok(None) };
        // Memory is taken as bytes come, not as the header promises.
        let read = self
            .bytes
            .by_ref()
            .take(len as u64)
            .read_to_end(&mut bytes)
            .map_err(|error| self.error(error.to_string()))?;
        if read < len {
            return Err(self.error("the stream stopped inside it"));
        }
        let picture = decode_picture(&bytes).and_then(|picture| match self.bayer {
            Some(pattern) => picture.demosaiced(pattern),
            None => Ok(picture),
        });
        let picture = picture.map_err(|reason| self.error(reason))?;
        if self.bits.is_none() && (256..65_535).contains(&maximum) {
            self.bits = u16::try_from(maximum).ok().map(significant_bits);
        }
        self.images += 1;
        Ok(Some(picture))
    }

    /// The next header; `None` at the end.
    fn header(&mut self) -> Result<Option<Header>, InputError> {
        let mut header = Vec::with_capacity(32);
        let Some(first) = self.byte()? else { return Ok(None) };
        header.push(first);
        header.push(self.byte_within()?);
        let channels = match header.as_slice() {
            b"P5" => 1,
            b"P6" => 3,
            _ => return Err(self.error("there is no image: binary PGM (P5) and PPM (P6) are read")),
        };
        let mut numbers = [0; 3];
        for number in &mut numbers {
            *number = self.number(&mut header)?;
        }
        let [width, height, largest] = numbers;
        check_sides(width, height).map_err(|reason| self.error(reason))?;
        if width == 0 || height == 0 || !(1..=65_535).contains(&largest) {
            return Err(self.error(format!(
                "its header says {width} x {height} px with values up to {largest}"
            )));
        }
        let sample = if largest > 255 { 2 } else { 1 };
        let len = width * height * channels * sample;
        // The image is held as it came, and decoded.
        check_decoding(width, height, 2 * len as u64).map_err(|reason| self.error(reason))?;
        Ok(Some(Header { bytes: header, len, maximum: largest }))
    }

    /// The next number of a header, and the one blank behind it.
    fn number(&mut self, header: &mut Vec<u8>) -> Result<usize, InputError> {
        let mut number: Option<usize> = None;
        loop {
            let byte = self.byte_within()?;
            header.push(byte);
            if header.len() > LONGEST_HEADER {
                return Err(self.error("its header does not end"));
            }
            match (byte, number) {
                (b'0'..=b'9', _) => {
                    number = Some(
                        number
                            .unwrap_or(0)
                            .saturating_mul(10)
                            .saturating_add(usize::from(byte - b'0')),
                    )
                }
                (b'#', None) => while self.push_byte(header)? != b'\n' {},
                (byte, Some(number)) if byte.is_ascii_whitespace() => return Ok(number),
                (byte, None) if byte.is_ascii_whitespace() => {}
                _ => return Err(self.error("its header is not that of a PGM or PPM")),
            }
        }
    }

    fn push_byte(&mut self, header: &mut Vec<u8>) -> Result<u8, InputError> {
        let byte = self.byte_within()?;
        header.push(byte);
        if header.len() > LONGEST_HEADER {
            Err(self.error("its header does not end"))
        } else {
            Ok(byte)
        }
    }

    /// The next byte inside an image.
    fn byte_within(&mut self) -> Result<u8, InputError> {
        self.byte()?.ok_or_else(|| self.error("the stream stopped inside it"))
    }

    /// The next byte; `None` at the end.
    fn byte(&mut self) -> Result<Option<u8>, InputError> {
        let mut byte = [0];
        match self.bytes.read_exact(&mut byte) {
            Ok(()) => Ok(Some(byte[0])),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(self.error(error.to_string())),
        }
    }
}

impl<R: Read> Iterator for NetpbmPairs<R> {
    type Item = Result<Pair, InputError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let next = self.pair().transpose();
        self.ended = !matches!(next, Some(Ok(_)));
        next
    }
}
