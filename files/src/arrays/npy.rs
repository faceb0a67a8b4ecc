//! Arrays in NumPy's format: a header in Python's notation, and the numbers.

use super::{DamagedArray, NumberType};

/// How such a file begins.
pub const MAGIC: &[u8] = b"\x93NUMPY";
/// Bytes that contain the header of every array that is read.
pub const HEADER_BYTES: u64 = HEADER_MAX as u64 + 16;

/// Longest header that is read.
const HEADER_MAX: usize = 1 << 16;
/// Most axes of an array.
const AXES_MAX: usize = 8;

/// What the header of an array says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArrayHeader {
    /// Type of its numbers.
    pub numbers: NumberType,
    /// Lengths of the axes, as NumPy shows them.
    pub shape: Vec<usize>,
    /// Whether the first axis is the fastest in the file.
    pub is_by_columns: bool,
    /// Where the numbers begin, in bytes from the beginning of the file.
    pub data: usize,
}

impl ArrayHeader {
    /// Checks that a file of `found` bytes is as long as the header says.
    ///
    /// # Errors
    /// If it is not.
    pub fn check_length(&self, found: u64) -> Result<(), DamagedArray> {
        let Self { numbers, shape, data, .. } = self;
        let count = shape.iter().try_fold(1_usize, |count, &length| count.checked_mul(length));
        let expected =
            count.and_then(|count| count.checked_mul(numbers.size())?.checked_add(*data));
        match expected {
            Some(expected) if expected as u64 == found => Ok(()),
            Some(expected) => Err(DamagedArray::new(format!(
                "it has {found} bytes, and an array of the shape {shape:?} has {expected}"
            ))),
            None => {
                let reason = format!("its shape is {shape:?}, more than any file has");
                Err(DamagedArray::new(reason))
            }
        }
    }
}

/// Reads the header from the first bytes of a file; at most [`HEADER_BYTES`] are needed.
///
/// # Errors
/// If it is cut off, or none of an array of real numbers.
pub fn header(bytes: &[u8]) -> Result<ArrayHeader, DamagedArray> {
    let cut = || DamagedArray::new("it ends within its header");
    let rest =
        bytes.strip_prefix(MAGIC).ok_or_else(|| DamagedArray::new("it is no array of NumPy"))?;
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
            let reason = format!("its version is {other}; it must be 1, 2 or 3");
            return Err(DamagedArray::new(reason));
        }
    };
    if length > HEADER_MAX {
        return Err(DamagedArray::new(format!("its header has {length} bytes")));
    }
    let text = bytes.get(before..before + length).ok_or_else(cut)?;
    let text = std::str::from_utf8(text);
    parse(text.map_err(|_| DamagedArray::new("its header is not text"))?, before + length)
}

/// Reads the text of a header; the numbers begin at `data`.
fn parse(text: &str, data: usize) -> Result<ArrayHeader, DamagedArray> {
    let entry = |key: &str, end: char| {
        let (_, rest) = text.split_once(key)?;
        rest.split_once(end).map(|(value, _)| value.trim())
    };
    let named = entry("'descr': '", '\'').unwrap_or_default();
    let numbers = NumberType::of_numpy(named).ok_or_else(|| {
        DamagedArray::new(format!(
            "its numbers are {named:?}; they must be integers or floating-point numbers of 1 to 8 bytes"
        ))
    })?;
    let shape = entry("'shape': (", ')').unwrap_or_default();
    let lengths = shape.split(',').map(str::trim).filter(|length| !length.is_empty());
    let lengths: Option<Vec<usize>> = lengths.map(|length| length.parse().ok()).collect();
    let shape = lengths.filter(|lengths| lengths.len() <= AXES_MAX).ok_or_else(|| {
        DamagedArray::new(format!("its shape is ({shape}), which is none of an array"))
    })?;
    let is_by_columns = entry("'fortran_order': ", ',') == Some("True");
    Ok(ArrayHeader { numbers, shape, is_by_columns, data })
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
            Err(error) => error.to_string(),
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn headers_are_read_and_others_refused() {
        let text = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 5), }\n";
        check(&file(text), "[2, 3, 5] false 73");
        check(&file(&text.replace("False", "True")), "[2, 3, 5] true 72");
        check(&file(text)[..40], "it ends within its header");
        check(
            &file(&text.replace("<f8", "|O")),
            "its numbers are \"|O\"; they must be integers or floating-point numbers of 1 to 8 bytes",
        );
        check(
            &file(&text.replace("(2, 3, 5)", "(2, -3)")),
            "its shape is (2, -3), which is none of an array",
        );
    }
}
