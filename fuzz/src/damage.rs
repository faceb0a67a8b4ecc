//! Structured damage: changes of an input by disks, networks, editors and attackers.

use std::ops::Range;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

/// Maximum number of damages to one input.
const DAMAGES_MAX: usize = 6;
/// Maximum size of a damaged input, bytes.
const BYTES_MAX: usize = 1 << 18;

/// Words, most of which no field accepts.
const WORDS: [&str; 30] = [
    "nan",
    "inf",
    "-inf",
    "-0.0",
    "0",
    "-1",
    "2",
    "1e308",
    "-1e308",
    "5e-324",
    "1e-300",
    "1e999",
    "9223372036854775807",
    "9223372036854775808",
    "-9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "99999999999999999999999999999999999999999",
    "0x7fffffffffffffff",
    "true",
    "null",
    "\"\"",
    "\"x\"",
    "''",
    "[]",
    "[[]]",
    "{}",
    "{ a = 1 }",
    "1979-05-27",
    "\"\\u0000\u{fffd}\"",
];
/// Punctuation that gives a text its structure.
const MARKS: [&str; 16] =
    ["[", "]", "{", "}", "=", ",", ".", ":", "\"", "'", "\"\"\"", "#", "\n", "\r\n", "\0", " "];
/// Texts that open a level, repeated for depth.
const OPENINGS: [&str; 5] = ["[", "{\"a\":", "{a=", "a.", "\""];
/// Doubles without a physical meaning.
const DOUBLES: [f64; 10] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN_POSITIVE,
    5e-324,
    -0.0,
    0.0,
    -1.0,
    1e18,
];

/// One damage. Positions are fractions of the input.
#[derive(Debug, Clone)]
enum Damage {
    /// Changes a bit.
    Flip(Index, u8),
    /// Changes a byte.
    Set(Index, u8),
    /// Replaces a word or number.
    Word(Index, &'static str),
    /// Inserts a text.
    Insert(Index, &'static str),
    /// Removes a part.
    Remove(Index, Index),
    /// Removes the rest.
    Truncate(Index),
    /// Repeats a part.
    Repeat(Index, Index, usize),
    /// Opens many levels.
    Nest(Index, &'static str, usize),
    /// Replaces the rest by that of another seed.
    Splice(Index, Index, Index),
    /// Writes a double into eight bytes, if possible after a protocol buffers tag that announces
    /// one.
    Double(Index, f64),
    /// Makes a length or a number impossibly large.
    Varint(Index),
}

fn damage() -> impl Strategy<Value = Damage> {
    use Damage::*;
    let at = any::<Index>;
    // Usually few, sometimes many.
    let often = || prop_oneof![4 => 1..4_usize, 1 => 100..5000_usize];
    prop_oneof![
        1 => (at(), 0..8_u8).prop_map(|(at, bit)| Flip(at, bit)),
        1 => (at(), select(vec![0, 1, 0x7f, 0x80, 0xff])).prop_map(|(at, byte)| Set(at, byte)),
        4 => (at(), select(&WORDS[..])).prop_map(|(at, word)| Word(at, word)),
        1 => (at(), select(&MARKS[..])).prop_map(|(at, mark)| Insert(at, mark)),
        1 => (at(), at()).prop_map(|(from, to)| Remove(from, to)),
        1 => at().prop_map(Truncate),
        1 => (at(), at(), often()).prop_map(|(from, to, count)| Repeat(from, to, count)),
        1 => (at(), select(&OPENINGS[..]), often()).prop_map(|(at, open, depth)| Nest(at, open, depth)),
        1 => (at(), at(), at()).prop_map(|(at, seed, from)| Splice(at, seed, from)),
        2 => (at(), select(&DOUBLES[..])).prop_map(|(at, double)| Double(at, double)),
        1 => at().prop_map(Varint),
    ]
}

/// Returns one of the `seeds`, with or without damage.
pub fn damaged(seeds: Vec<Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    (any::<Index>(), vec(damage(), 0..=DAMAGES_MAX)).prop_map(move |(seed, damages)| {
        let mut bytes = seed.get(&seeds).clone();
        for damage in &damages {
            apply(damage, &mut bytes, &seeds);
            bytes.truncate(BYTES_MAX);
        }
        bytes
    })
}

/// Same as [`damaged`], for texts; invalid UTF-8 is replaced.
pub fn damaged_text(seeds: Vec<String>) -> impl Strategy<Value = String> {
    let seeds = seeds.into_iter().map(String::into_bytes).collect();
    damaged(seeds).prop_map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

fn apply(damage: &Damage, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let length = bytes.len();
    // Any position, including the end.
    let place = |at: &Index| at.index(length + 1);
    let part = |a: &Index, b: &Index| place(a).min(place(b))..place(a).max(place(b));
    match damage {
        Damage::Flip(at, bit) if length > 0 => bytes[at.index(length)] ^= 1 << bit,
        Damage::Set(at, byte) if length > 0 => bytes[at.index(length)] = *byte,
        Damage::Flip(..) | Damage::Set(..) => {}
        Damage::Word(at, word) => {
            let words = words(bytes);
            if !words.is_empty() {
                bytes.splice(at.get(&words).clone(), word.bytes());
            }
        }
        Damage::Insert(at, mark) => insert(bytes, place(at), mark.as_bytes()),
        Damage::Remove(a, b) => drop(bytes.drain(part(a, b))),
        Damage::Truncate(at) => bytes.truncate(place(at)),
        Damage::Repeat(a, b, count) => {
            let part = part(a, b);
            let repeated = bytes[part.clone()].repeat((*count).min(BYTES_MAX / part.len().max(1)));
            insert(bytes, part.end, &repeated);
        }
        Damage::Nest(at, open, depth) => insert(bytes, place(at), open.repeat(*depth).as_bytes()),
        Damage::Splice(at, seed, from) => {
            let other = seed.get(seeds);
            bytes.truncate(place(at));
            bytes.extend_from_slice(&other[from.index(other.len() + 1)..]);
        }
        Damage::Double(at, double) => {
            let tags: Vec<usize> =
                (0..length.saturating_sub(8)).filter(|&at| bytes[at] & 7 == 1).collect();
            if !tags.is_empty() {
                let at = at.get(&tags) + 1;
                bytes[at..at + 8].copy_from_slice(&double.to_le_bytes());
            }
        }
        Damage::Varint(at) => insert(bytes, place(at), &[0xff; 9]),
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, inserted: &[u8]) {
    bytes.splice(at..at, inserted.iter().copied());
}

/// Returns the positions of words and numbers.
fn words(bytes: &[u8]) -> Vec<Range<usize>> {
    let is_of_word = |byte: u8| byte.is_ascii_alphanumeric() || b"_+-.".contains(&byte);
    let mut words = Vec::new();
    let mut start = None;
    for (at, &byte) in bytes.iter().chain([&b' ']).enumerate() {
        match (start, is_of_word(byte)) {
            (None, true) => start = Some(at),
            (Some(from), false) => {
                words.push(from..at);
                start = None;
            }
            _ => {}
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use proptest::strategy::ValueTree as _;
    use proptest::test_runner::TestRunner;

    use super::*;

    #[test]
    fn words_are_found() {
        let text = b"a = -1.5e3, [bc]";
        let found: Vec<_> = words(text).into_iter().map(|word| &text[word]).collect();
        assert_eq!(found, [&b"a"[..], b"-1.5e3", b"bc"]);
    }

    #[test]
    fn damage_is_bounded_and_of_every_kind() {
        let seeds = vec![b"a = 1\n[b]\nc = 2.5\n".repeat(50), Vec::new()];
        let strategy = damaged(seeds.clone());
        let mut runner = TestRunner::deterministic();
        let made: Vec<_> =
            (0..1000).map(|_| strategy.new_tree(&mut runner).unwrap().current()).collect();
        assert!(made.iter().all(|bytes| bytes.len() <= BYTES_MAX));
        assert!(made.iter().any(|bytes| bytes.len() > 10 * seeds[0].len()), "nothing is long");
        assert!(made.iter().any(|bytes| seeds.contains(bytes)), "nothing is whole");
        let holds =
            |part: &[u8]| made.iter().any(|bytes| bytes.windows(part.len()).any(|w| w == part));
        assert!(holds(b"= nan") && holds(&[0xff; 9]) && holds(&b"[".repeat(100)));
    }
}
