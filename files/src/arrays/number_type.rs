//! Types of the numbers of an array, and their conversion.

/// Type of an array's numbers, as they are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberType {
    kind: NumberKind,
    size: usize,
    is_big_endian: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NumberKind {
    Floating,
    Signed,
    Unsigned,
}

impl NumberType {
    /// Double precision, little-endian.
    pub const DOUBLE: Self = Self::little_endian(NumberKind::Floating, 8);

    /// Returns the type that NumPy calls so; `None` if it is none of real numbers of 1 to 8 bytes.
    pub(crate) fn of_numpy(name: &str) -> Option<Self> {
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
        Some(Self { kind, size, is_big_endian })
    }

    /// Returns the type of the numbers in an element of this type of a file of MATLAB 5, little-endian;
    /// `None` if it is none of numbers.
    pub(crate) fn of_matlab(kind: u32) -> Option<Self> {
        let (kind, size) = match kind {
            1 => (NumberKind::Signed, 1),
            2 => (NumberKind::Unsigned, 1),
            3 => (NumberKind::Signed, 2),
            4 => (NumberKind::Unsigned, 2),
            5 => (NumberKind::Signed, 4),
            6 => (NumberKind::Unsigned, 4),
            7 => (NumberKind::Floating, 4),
            9 => (NumberKind::Floating, 8),
            12 => (NumberKind::Signed, 8),
            13 => (NumberKind::Unsigned, 8),
            _ => return None,
        };
        Some(Self::little_endian(kind, size))
    }

    /// Returns the bytes of each number.
    pub fn size(self) -> usize {
        self.size
    }

    /// Returns the numbers of some bytes; those of a last one that is cut off are left out.
    pub fn decode(self, bytes: &[u8]) -> Vec<f64> {
        bytes.chunks_exact(self.size).map(|bytes| self.number(bytes)).collect()
    }

    const fn little_endian(kind: NumberKind, size: usize) -> Self {
        Self { kind, size, is_big_endian: false }
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
            assert_eq!(NumberType::of_numpy(name).unwrap().decode(bytes), [expected], "{name}");
        }
        assert_eq!(NumberType::of_matlab(3).unwrap().decode(&(-3_i16).to_le_bytes()), [-3.0]);
        assert_eq!(NumberType::of_matlab(14), None);
    }
}
