//! The variables of a file of MATLAB 5 to 7.2.
//!
//! Vectors of numbers are columns, those in structures, too; matrices and all else are passed over. What is
//! compressed is unpacked within a bound.

use std::io::Read as _;

use flate2::read::ZlibDecoder;
use osteon_common::limits;

use super::content::{Content, NumberColumn, tables_of};
use super::problem::Problem;

const WHAT: &str = "a MATLAB file";
/// Length of the text and version at the beginning.
const HEADER: usize = 128;
/// Most variables, and fields of structures, that are looked at.
const VARIABLES_MAX: usize = 1000;
/// How deep structures are followed.
const DEPTH_MAX: usize = 4;

/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays.
const STRUCTURE: u8 = 2;
const FIRST_NUMERIC: u8 = 6;
const LAST_NUMERIC: u8 = 15;
/// Flag of arrays of complex numbers.
const COMPLEX: u8 = 0x08;

/// Returns a table of the file's vectors for each length.
pub(super) fn tables(bytes: &[u8]) -> Result<Vec<Content>, Problem> {
    let damaged = |reason: &str| Problem::Damaged { what: WHAT, reason: reason.to_owned() };
    if bytes.get(126..HEADER) != Some(b"IM") {
        return Err(damaged("it is of a big-endian machine, or damaged; save it again"));
    }
    let mut found = Variables::default();
    found
        .elements(bytes.get(HEADER..).unwrap_or_default(), 0)
        .ok_or_else(|| damaged("it ends too early"))?;
    if found.columns.is_empty() {
        return Err(Problem::NoVectors { what: WHAT });
    }
    Ok(tables_of(&found.columns, WHAT))
}

/// Vectors that were found, and how many bytes were unpacked for them.
#[derive(Default)]
struct Variables {
    columns: Vec<NumberColumn>,
    unpacked: u64,
    looked_at: usize,
}

impl Variables {
    /// Looks at the elements of a file; `None` if it is damaged.
    fn elements(&mut self, mut bytes: &[u8], depth: usize) -> Option<()> {
        while bytes.len() >= 8 {
            let (kind, data, rest) = element(bytes)?;
            match kind {
                MATRIX => self.array(data, None, depth)?,
                COMPRESSED if depth == 0 => {
                    let room = limits::FILE_BYTES_MAX.checked_sub(self.unpacked)?;
                    let mut unpacked = Vec::new();
                    ZlibDecoder::new(data).take(room + 1).read_to_end(&mut unpacked).ok()?;
                    self.unpacked += unpacked.len() as u64;
                    if self.unpacked > limits::FILE_BYTES_MAX {
                        return None;
                    }
                    self.elements(&unpacked, 1)?;
                }
                _ => {}
            }
            bytes = rest;
        }
        Some(())
    }

    /// Looks at an array: its flags, lengths and name, and its values.
    fn array(&mut self, data: &[u8], name: Option<&str>, depth: usize) -> Option<()> {
        self.looked_at += 1;
        if data.is_empty() || depth > DEPTH_MAX || self.looked_at > VARIABLES_MAX {
            return Some(());
        }
        let (_, flags, rest) = element(data)?;
        let (class, flag) = (*flags.first()?, *flags.get(1)?);
        let (_, lengths, rest) = element(rest)?;
        let lengths: Vec<usize> = lengths.chunks_exact(4).map(whole).collect();
        let (_, own_name, rest) = element(rest)?;
        let own_name = String::from_utf8_lossy(own_name);
        let name = name.unwrap_or(&own_name);
        if class == STRUCTURE {
            return self.structure(name, rest, depth);
        }
        let is_vector = lengths.iter().filter(|&&length| length != 1).count() == 1;
        if !(FIRST_NUMERIC..=LAST_NUMERIC).contains(&class) || flag & COMPLEX != 0 || !is_vector {
            return Some(());
        }
        let (kind, values, _) = element(rest)?;
        let numbers = numbers(kind, values)?;
        if Some(numbers.len()) == lengths.iter().copied().reduce(usize::saturating_mul) {
            self.columns.push(NumberColumn { name: name.to_owned(), numbers });
        }
        Some(())
    }

    /// Looks at the fields of a structure: the length of their names, the names, and an array for each.
    fn structure(&mut self, name: &str, data: &[u8], depth: usize) -> Option<()> {
        let (_, length, rest) = element(data)?;
        let length = whole(length.get(..4)?);
        let (_, names, mut rest) = element(rest)?;
        if length == 0 {
            return Some(());
        }
        for field in names.chunks_exact(length).take(VARIABLES_MAX) {
            let field = field.split(|&byte| byte == 0).next().unwrap_or_default();
            // An empty structure has names, and no values.
            let Some((kind, data, after)) = element(rest) else { return Some(()) };
            if kind == MATRIX {
                let path = format!("{name}.{}", String::from_utf8_lossy(field));
                self.array(data, Some(&path), depth + 1)?;
            }
            rest = after;
        }
        Some(())
    }
}

/// Returns the first element of some bytes: its type, its data, and what follows it.
fn element(bytes: &[u8]) -> Option<(u32, &[u8], &[u8])> {
    let tag = u32::from_le_bytes(bytes.get(..4)?.try_into().ok()?);
    // A small one has its length in the upper half of its type, and its data in place of the length.
    let small = (tag >> 16) as usize;
    if small != 0 {
        return Some((tag & 0xffff, bytes.get(4..4 + small.min(4))?, bytes.get(8..)?));
    }
    let length = whole(bytes.get(4..8)?);
    let data = bytes.get(8..)?.get(..length)?;
    let padded = if tag == COMPRESSED { length } else { length.checked_next_multiple_of(8)? };
    Some((tag, data, bytes.get(8 + padded..).unwrap_or_default()))
}

fn whole(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | usize::from(byte))
}

/// Returns the numbers of an element; `None` if its type is none of numbers.
fn numbers(kind: u32, data: &[u8]) -> Option<Vec<f64>> {
    /// The numbers of one type.
    fn of<const N: usize>(data: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        data.chunks_exact(N).filter_map(|bytes| bytes.try_into().ok()).map(number).collect()
    }
    Some(match kind {
        1 => of(data, |bytes| f64::from(i8::from_le_bytes(bytes))),
        2 => of(data, |bytes| f64::from(u8::from_le_bytes(bytes))),
        3 => of(data, |bytes| f64::from(i16::from_le_bytes(bytes))),
        4 => of(data, |bytes| f64::from(u16::from_le_bytes(bytes))),
        5 => of(data, |bytes| f64::from(i32::from_le_bytes(bytes))),
        6 => of(data, |bytes| f64::from(u32::from_le_bytes(bytes))),
        7 => of(data, |bytes| f64::from(f32::from_le_bytes(bytes))),
        9 => of(data, f64::from_le_bytes),
        12 => of(data, |bytes| i64::from_le_bytes(bytes) as f64),
        13 => of(data, |bytes| u64::from_le_bytes(bytes) as f64),
        _ => return None,
    })
}
