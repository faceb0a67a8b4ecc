//! Arrays of whole numbers in NumPy's format, version 1.0.

/// The header's length with its first ten bytes is a multiple of this.
const ALIGNMENT: usize = 64;

/// Returns the file of an array of this shape, whose last axis is the fastest.
pub(super) fn of_samples(shape: &[usize], samples: &[i16]) -> Vec<u8> {
    let lengths: Vec<String> = shape.iter().map(ToString::to_string).collect();
    let header =
        format!("{{'descr': '<i2', 'fortran_order': False, 'shape': ({},), }}", lengths.join(", "));
    let length = (10 + header.len() + 1).next_multiple_of(ALIGNMENT);
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    // Four axes take far less than 64 KiB.
    file.extend(((length - 10) as u16).to_le_bytes());
    file.extend(header.as_bytes());
    file.resize(length - 1, b' ');
    file.push(b'\n');
    file.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
    file
}
