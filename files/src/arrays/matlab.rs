//! The variables of a file of MATLAB 5 to 7.2.
//!
//! Fields of structures are variables, too. What is compressed is unpacked within a bound.

use std::io::Read as _;

use flate2::read::ZlibDecoder;

use super::{DamagedArray, NumberType};

/// Length of the text and version at the beginning.
const HEADER: usize = 128;
/// Most variables, and fields of structures, that are looked at.
const VARIABLES_MAX: usize = 1000;
/// How deep structures are followed.
const DEPTH_MAX: usize = 8;

/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays.
const STRUCTURE: u8 = 2;
const FIRST_NUMERIC: u8 = 6;
const LAST_NUMERIC: u8 = 15;
const OPAQUE: u8 = 17;
/// Flags of arrays of complex numbers and of truth values.
const COMPLEX: u8 = 0x08;
const LOGICAL: u8 = 0x02;

/// A variable, or a field of a structure.
#[derive(Debug, Clone)]
pub struct MatlabVariable<'a> {
    /// Its name; that of a field follows that of its structure after a dot.
    pub name: String,
    /// Lengths of the dimensions as MATLAB's `size` gives them; the first is the fastest in the file.
    pub shape: Vec<usize>,
    /// What it holds.
    pub content: MatlabContent<'a>,
}

/// What a variable of MATLAB holds.
#[derive(Debug, Clone, Copy)]
pub enum MatlabContent<'a> {
    /// Real numbers, as many as the shape says.
    Numbers(NumberType, &'a [u8]),
    /// Something else: what it is, with its article.
    Other(&'static str),
}

/// Calls `each` with every variable of a file. What is compressed may unpack to `unpacked_max` bytes.
///
/// # Errors
/// If the file is damaged, of a big-endian machine, or unpacks to more.
pub fn visit(
    bytes: &[u8],
    unpacked_max: u64,
    each: &mut dyn FnMut(MatlabVariable<'_>),
) -> Result<(), DamagedArray> {
    if bytes.get(126..HEADER) != Some(b"IM") {
        let reason = "it is of a big-endian machine, or damaged; save it again";
        return Err(DamagedArray::new(reason));
    }
    let mut visit = VariableVisit { each, room: unpacked_max, looked_at: 0 };
    visit.elements(bytes.get(HEADER..).unwrap_or_default(), true)
}

fn cut() -> DamagedArray {
    DamagedArray::new("it ends too early")
}

/// A pass over the variables of a file.
struct VariableVisit<'v> {
    each: &'v mut dyn FnMut(MatlabVariable<'_>),
    /// How many bytes may still be unpacked.
    room: u64,
    looked_at: usize,
}

impl VariableVisit<'_> {
    /// Looks at the elements of a file, or at those of a compressed one, among which none is compressed.
    fn elements(&mut self, mut bytes: &[u8], may_be_compressed: bool) -> Result<(), DamagedArray> {
        while bytes.len() >= 8 {
            let (kind, data, rest) = element(bytes).ok_or_else(cut)?;
            match kind {
                MATRIX => self.array(data, None, 0)?,
                COMPRESSED if may_be_compressed => {
                    let unpacked = self.unpacked(data)?;
                    self.elements(&unpacked, false)?;
                }
                _ => {}
            }
            bytes = rest;
        }
        if bytes.is_empty() { Ok(()) } else { Err(cut()) }
    }

    fn unpacked(&mut self, data: &[u8]) -> Result<Vec<u8>, DamagedArray> {
        let mut unpacked = Vec::new();
        let read = ZlibDecoder::new(data).take(self.room + 1).read_to_end(&mut unpacked);
        read.map_err(|error| DamagedArray::new(format!("a variable does not unpack: {error}")))?;
        let left = self.room.checked_sub(unpacked.len() as u64);
        self.room = left.ok_or_else(|| {
            DamagedArray::new("it unpacks to more bytes than are read; save fewer variables in it")
        })?;
        Ok(unpacked)
    }

    /// Looks at an array: its flags, lengths and name, and its values. A field has no name of its own.
    fn array(
        &mut self,
        data: &[u8],
        field: Option<String>,
        depth: usize,
    ) -> Result<(), DamagedArray> {
        self.looked_at += 1;
        if data.is_empty() || depth > DEPTH_MAX || self.looked_at > VARIABLES_MAX {
            return Ok(());
        }
        let (_, flags, rest) = element(data).ok_or_else(cut)?;
        let &[class, flag, ..] = flags else { return Err(cut()) };
        let (_, second, rest) = element(rest).ok_or_else(cut)?;
        // Objects have no lengths.
        let (shape, own_name, rest): (Vec<usize>, _, _) = match class {
            OPAQUE => (Vec::new(), second, rest),
            _ => {
                let (_, own_name, rest) = element(rest).ok_or_else(cut)?;
                (second.chunks_exact(4).map(whole).collect(), own_name, rest)
            }
        };
        let name = field.unwrap_or_else(|| String::from_utf8_lossy(own_name).into_owned());
        if class == STRUCTURE && shape.iter().all(|&length| length == 1) {
            return self.structure(&name, rest, depth);
        }
        let content = match other(class, flag) {
            Some(what) => MatlabContent::Other(what),
            None => numbers(&name, &shape, rest)?,
        };
        (self.each)(MatlabVariable { name, shape, content });
        Ok(())
    }

    /// Looks at the fields of a structure: the length of their names, the names, and an array for each.
    fn structure(&mut self, name: &str, data: &[u8], depth: usize) -> Result<(), DamagedArray> {
        let (_, length, rest) = element(data).ok_or_else(cut)?;
        let length = whole(length.get(..4).ok_or_else(cut)?);
        let (_, names, mut rest) = element(rest).ok_or_else(cut)?;
        if length == 0 {
            return Ok(());
        }
        for field in names.chunks_exact(length).take(VARIABLES_MAX) {
            let field = field.split(|&byte| byte == 0).next().unwrap_or_default();
            let (kind, data, after) = element(rest).ok_or_else(cut)?;
            if kind == MATRIX {
                let path = format!("{name}.{}", String::from_utf8_lossy(field));
                self.array(data, Some(path), depth + 1)?;
            }
            rest = after;
        }
        Ok(())
    }
}

/// Returns what an array of this class is, if not one of real numbers.
fn other(class: u8, flag: u8) -> Option<&'static str> {
    Some(match class {
        1 => "a cell array",
        STRUCTURE => "an array of structures",
        4 => "a text",
        5 => "a sparse matrix",
        FIRST_NUMERIC..=LAST_NUMERIC if flag & COMPLEX != 0 => "an array of complex numbers",
        FIRST_NUMERIC..=LAST_NUMERIC if flag & LOGICAL != 0 => "an array of truth values",
        FIRST_NUMERIC..=LAST_NUMERIC => return None,
        16 => "a function",
        _ => "an object",
    })
}

/// Returns the numbers of an array, whose element is the first of `rest`.
fn numbers<'a>(
    name: &str,
    shape: &[usize],
    rest: &'a [u8],
) -> Result<MatlabContent<'a>, DamagedArray> {
    let (kind, values, _) = element(rest).ok_or_else(cut)?;
    let numbers = NumberType::of_matlab(kind);
    let expected = shape.iter().try_fold(1_usize, |count, &length| count.checked_mul(length));
    match numbers {
        Some(numbers)
            if expected.and_then(|count| count.checked_mul(numbers.size()))
                == Some(values.len()) =>
        {
            Ok(MatlabContent::Numbers(numbers, values))
        }
        _ => Err(DamagedArray::new(format!(
            "the numbers of the variable {name:?} take {} bytes, which do not fit its size {shape:?}",
            values.len()
        ))),
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

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use flate2::Compression;
    use flate2::write::ZlibEncoder;

    use super::*;

    fn tagged(kind: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = kind.to_le_bytes().to_vec();
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    }

    /// An array of this class with the size 1 x 1, and what follows its name.
    fn scalar(class: u8, name: &str, rest: &[u8]) -> Vec<u8> {
        let size: Vec<u8> = [1_u32, 1].into_iter().flat_map(u32::to_le_bytes).collect();
        let flags = [class, 0, 0, 0, 0, 0, 0, 0];
        let parts =
            [tagged(6, &flags), tagged(5, &size), tagged(1, name.as_bytes()), rest.to_vec()];
        tagged(MATRIX, &parts.concat())
    }

    fn file(endian: &[u8; 2], elements: &[u8]) -> Vec<u8> {
        [&[b' '; 126][..], endian, elements].concat()
    }

    /// Returns the names of all variables, or the error.
    fn names(file: &[u8]) -> String {
        let mut names = Vec::new();
        match visit(file, 4096, &mut |variable| names.push(variable.name)) {
            Ok(()) => names.join(" "),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn what_is_packed_or_nested_too_deep_is_not_followed() {
        let number = scalar(6, "x", &tagged(9, &1.5_f64.to_le_bytes()));
        let packed = |bytes: &[u8]| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(bytes).unwrap();
            let data = encoder.finish().unwrap();
            let length = (data.len() as u32).to_le_bytes();
            [&COMPRESSED.to_le_bytes()[..], &length, &data].concat()
        };
        let mut deep = number.clone();
        for _ in 0..1000 {
            let names = [tagged(5, &2_u32.to_le_bytes()), tagged(1, b"f\0"), deep].concat();
            deep = scalar(STRUCTURE, "s", &names);
        }
        let bomb = packed(&scalar(6, "x", &tagged(9, &[0; 1 << 20])));
        let more = "it unpacks to more bytes than are read; save fewer variables in it";
        for (elements, expected) in [
            (number.clone(), "x"),
            (packed(&number), "x"),
            ([packed(&number), number.clone()].concat(), "x x"),
            // What is packed twice is passed over.
            (packed(&packed(&number)), ""),
            (bomb, more),
            (packed(&number).repeat(100), more),
            (deep, ""),
            (number[..number.len() - 8].to_vec(), "it ends too early"),
            (
                scalar(6, "x", &tagged(9, &[0; 16])),
                "the numbers of the variable \"x\" take 16 bytes, which do not fit its size [1, 1]",
            ),
        ] {
            assert_eq!(names(&file(b"IM", &elements)), expected);
        }
        let other = "it is of a big-endian machine, or damaged; save it again";
        assert_eq!(names(&file(b"MI", &number)), other);
    }
}
