//! One description, three uses: what is written is read back, and hashed before and after alike.

use super::*;
use std::vec::Vec;

/// A struct with a field of every kind.
#[derive(Clone, Debug, PartialEq)]
struct Everything {
    byte: u8,
    numbers: [u32; 2],
    signed: i32,
    wide: u64,
    single: f32,
    double: f64,
    row: [i16; 70],
    column: [u16; 3],
    used: usize,
    kind: bool,
    maybe: Option<u32>,
    pose: Transform,
    digested: u32,
}

impl Everything {
    fn blank() -> Self {
        Self {
            byte: 0,
            numbers: [0; 2],
            signed: 0,
            wide: 0,
            single: 0.0,
            double: 0.0,
            row: [0; 70],
            column: [0; 3],
            used: 0,
            kind: false,
            maybe: None,
            pose: Transform::IDENTITY,
            digested: 0,
        }
    }

    fn some() -> Self {
        Self {
            byte: 3,
            numbers: [7, u32::MAX],
            signed: -5,
            wide: 1 << 60,
            // -0 has other bits than 0, and must come back as it is.
            single: -0.0,
            double: 1e-300,
            row: core::array::from_fn(|at| -(at as i16)),
            column: [1, 2, 65_535],
            used: 9,
            kind: true,
            maybe: Some(4),
            pose: Transform { translation_m: [1.0, 2.0, 3.0], ..Transform::IDENTITY },
            digested: 6,
        }
    }

    fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self {
            byte,
            numbers,
            signed,
            wide,
            single,
            double,
            row,
            column,
            used,
            kind,
            maybe,
            pose,
            digested,
        } = self;
        visitor.u8(byte);
        visitor.u32s(numbers);
        visitor.i32(signed);
        visitor.u64(wide);
        visitor.f32(single);
        visitor.f64(double);
        visitor.i16s(row);
        visitor.u16s(column);
        // A number of entries that may be at most ten.
        visitor.count(used, 10);
        visitor.code(kind, u32::from, |code| code == 1);
        visitor.option(maybe, || 0, Visitor::u32);
        visitor.transform(pose);
        // The digest has the content's digest, a snapshot the content.
        visitor.content(u64::from(*digested), |visitor| visitor.u32(digested));
    }
}

fn written(value: &mut Everything) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut sink = |piece: &[u8]| -> Result<(), ()> {
        bytes.extend_from_slice(piece);
        Ok(())
    };
    let mut writer = Writer::new(&mut sink);
    value.visit(&mut writer);
    writer.finish().unwrap();
    bytes
}

fn read(mut bytes: &[u8], into: &mut Everything) -> Result<(), ReadError<&'static str>> {
    let mut source = |piece: &mut [u8]| super::in_memory::take(&mut bytes, piece).ok_or("ended");
    let mut reader = Reader::new(&mut source);
    into.visit(&mut reader);
    reader.finish()
}

#[test]
fn what_is_written_is_read_back_and_hashes_alike() {
    let (mut value, mut copy) = (Everything::some(), Everything::blank());
    let bytes = written(&mut value);
    assert_eq!(value, Everything::some(), "writing changes nothing");
    read(&bytes, &mut copy).unwrap();
    assert_eq!(copy, value);
    let digest = |value: &mut Everything| Hasher::digest(|hasher| value.visit(hasher));
    assert_eq!(digest(&mut copy), digest(&mut value));
    assert_eq!(copy, value, "nor does hashing");
}

#[test]
fn every_field_is_in_the_digest() {
    let digest = |mut value: Everything| Hasher::digest(|hasher| value.visit(hasher));
    let change: [fn(&mut Everything); 13] = [
        |value| value.byte ^= 1,
        |value| value.numbers[1] ^= 1,
        |value| value.signed ^= 1,
        |value| value.wide ^= 1,
        |value| value.single = 0.0,
        |value| value.double = 0.0,
        |value| value.row[69] ^= 1,
        |value| value.column[2] ^= 1,
        |value| value.used += 1,
        |value| value.kind = false,
        |value| value.maybe = None,
        |value| value.pose.translation_m[0] = 0.0,
        |value| value.digested ^= 1,
    ];
    for (at, change) in change.iter().enumerate() {
        let mut changed = Everything::some();
        change(&mut changed);
        assert_ne!(digest(changed), digest(Everything::some()), "field {at}");
    }
}

#[test]
fn a_count_beyond_its_bound_an_early_end_and_a_flipped_bit_are_refused() {
    let mut bytes = written(&mut Everything { used: 11, ..Everything::some() });
    assert_eq!(read(&bytes, &mut Everything::blank()), Err(ReadError::Damaged));
    bytes = written(&mut Everything::some());
    assert_eq!(
        read(&bytes[..bytes.len() - 1], &mut Everything::blank()),
        Err(ReadError::Source("ended"))
    );
    bytes[2] ^= 1;
    assert_eq!(read(&bytes, &mut Everything::blank()), Err(ReadError::Damaged));
}

#[test]
fn content_with_a_digest_of_its_own_is_not_hashed_again() {
    let hash = |digest: u64, mut value: u32| {
        Hasher::digest(|hasher| hasher.content(digest, |hasher| hasher.u32(&mut value)))
    };
    assert_eq!(hash(1, 7), hash(1, 8));
    assert_ne!(hash(1, 7), hash(2, 7));
}
