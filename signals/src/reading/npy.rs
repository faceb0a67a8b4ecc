//! Arrays in NumPy's format: a header in Python's notation, and the numbers.

use crate::reading_error::SignalFault;

/// Longest header that is read.
const HEADER_MAX: usize = 1 << 16;
/// Most axes of an array.
const AXES_MAX: usize = 8;

/// Type of an array's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NumberType {
    kind: NumberKind,
    /// Bytes of each.
    pub(crate) size: usize,
    is_big_endian: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NumberKind {
    Floating,
    Signed,
    Unsigned,
}

/// What the header of an array says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ArrayHeader {
    pub(crate) numbers: NumberType,
    /// Lengths of the axes, in the order in which the description names them.
    pub(crate) shape: Vec<usize>,
    /// Whether the first axis is the fastest in the file.
    pub(crate) is_by_columns: bool,
    /// Where the numbers begin.
    pub(crate) data: usize,
}

impl ArrayHeader {
    /// Returns the number of numbers; `None` if it is absurd.
    pub(crate) fn count(&self) -> Option<usize> {
        self.shape.iter().try_fold(1_usize, |count, &length| count.checked_mul(length))
    }
}

/// Reads the header from the first bytes of a file.
pub(crate) fn header(bytes: &[u8]) -> Result<ArrayHeader, SignalFault> {
    let cut = || SignalFault::damaged("it ends within its header");
    let rest = bytes
        .strip_prefix(b"\x93NUMPY")
        .ok_or_else(|| SignalFault::OtherKind { what: "no array of NumPy".to_owned() })?;
    let (version, rest) = rest.split_first_chunk::<2>().ok_or_else(cut)?;
    let (length, before) = match version[0] {
        1 => {
            let length = rest.first_chunk().ok_or_else(cut)?;
            (usize::from(u16::from_le_bytes(*length)), 10)
        }
        2 | 3 => {
            let length = rest.first_chunk().ok_or_else(cut)?;
            (u32::from_le_bytes(*length) as usize, 12)
        }
        other => {
            return Err(SignalFault::damaged(format!(
                "its version is {other}; it must be 1, 2 or 3"
            )));
        }
    };
    if length > HEADER_MAX {
        return Err(SignalFault::damaged(format!("its header has {length} bytes")));
    }
    let text = bytes.get(before..before + length).ok_or_else(cut)?;
    let text =
        std::str::from_utf8(text).map_err(|_| SignalFault::damaged("its header is not text"))?;
    let entry = |key: &str, end: char| {
        let (_, rest) = text.split_once(key)?;
        rest.split_once(end).map(|(value, _)| value.trim())
    };
    let named = entry("'descr': '", '\'').unwrap_or_default();
    let numbers = number_type(named).ok_or_else(|| {
        SignalFault::damaged(format!(
            "its numbers are {named:?}; they must be integers or floating-point numbers of 1 to 8 bytes"
        ))
    })?;
    let shape = entry("'shape': (", ')').unwrap_or_default();
    let lengths = shape.split(',').map(str::trim).filter(|length| !length.is_empty());
    let lengths: Option<Vec<usize>> = lengths.map(|length| length.parse().ok()).collect();
    let lengths = lengths.filter(|lengths| lengths.len() <= AXES_MAX).ok_or_else(|| {
        SignalFault::damaged(format!("its shape is ({shape}), which is none of an array"))
    })?;
    Ok(ArrayHeader {
        numbers,
        shape: lengths,
        is_by_columns: entry("'fortran_order': ", ',') == Some("True"),
        data: before + length,
    })
}

fn number_type(name: &str) -> Option<NumberType> {
    let (order, kind, size) = (name.get(..1)?, name.get(1..2)?, name.get(2..)?);
    let is_big_endian = match order {
        "<" | "|" => false,
        ">" => true,
        _ => return None,
    };
    let size: usize = size.parse().ok()?;
    let kind = match (kind, size) {
        ("f", 4 | 8) => NumberKind::Floating,
        ("i", 1 | 2 | 4 | 8) => NumberKind::Signed,
        ("u", 1 | 2 | 4 | 8) => NumberKind::Unsigned,
        _ => return None,
    };
    Some(NumberType { kind, size, is_big_endian })
}

impl NumberType {
    /// Returns the numbers of some bytes; those of a last one that is cut off are left out.
    pub(crate) fn decode(self, bytes: &[u8]) -> Vec<f64> {
        bytes.chunks_exact(self.size).map(|bytes| self.number(bytes)).collect()
    }

    fn number(self, bytes: &[u8]) -> f64 {
        let byte = |bits: u64, &byte: &u8| bits << 8 | u64::from(byte);
        let bits = match self.is_big_endian {
            true => bytes.iter().fold(0, byte),
            false => bytes.iter().rev().fold(0, byte),
        };
        match (self.kind, self.size) {
            (NumberKind::Floating, 8) => f64::from_bits(bits),
            (NumberKind::Floating, _) => f64::from(f32::from_bits(bits as u32)),
            (NumberKind::Unsigned, _) => bits as f64,
            (NumberKind::Signed, size) => {
                // The sign is in the highest bit of the number's own size.
                let unused = 64 - 8 * size as u32;
                ((bits << unused).cast_signed() >> unused) as f64
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes
    }

    fn check(bytes: &[u8], expected: &str) {
        let found = match header(bytes) {
            Ok(header) => format!("{:?} {} {}", header.shape, header.is_by_columns, header.data),
            Err(fault) => fault.to_string(),
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn headers_are_read_and_others_refused() {
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 5), }\n";
        check(&file(text), "[2, 3, 5] false 73");
        check(&file(&text.replace("False", "True")), "[2, 3, 5] true 72");
        check(&file(text)[..40], "is damaged: it ends within its header");
        check(
            &file(&text.replace("<f8", "|O")),
            "is damaged: its numbers are \"|O\"; they must be integers or floating-point numbers of 1 to 8 bytes",
        );
        check(
            &file(&text.replace("(2, 3, 5)", "(2, -3)")),
            "is damaged: its shape is (2, -3), which is none of an array",
        );
    }

    #[test]
    fn numbers_of_every_type_are_decoded() {
        for (name, bytes, expected) in [
            ("<f8", &1.5_f64.to_le_bytes()[..], 1.5),
            (">f4", &(-2.5_f32).to_be_bytes(), -2.5),
            ("<i2", &(-3_i16).to_le_bytes(), -3.0),
            ("|i1", &[0xff], -1.0),
            ("|u1", &[0xff], 255.0),
            (">u2", &[1, 0], 256.0),
            ("<i8", &(-5_i64).to_le_bytes(), -5.0),
        ] {
            assert_eq!(number_type(name).unwrap().decode(bytes), [expected], "{name}");
        }
    }
}
