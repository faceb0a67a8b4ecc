//! The text of a file, whatever its encoding.

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{
    BIG5, EUC_KR, Encoding, GBK, SHIFT_JIS, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1250, WINDOWS_1251,
    WINDOWS_1252,
};
use unicode_normalization::{UnicodeNormalization as _, is_nfc};

use super::names::ColumnName;
use super::problem::{LocatedProblem, Problem};

/// Encodings that are tried on a text that is no UTF-8.
const LEGACY: [&Encoding; 7] =
    [WINDOWS_1252, WINDOWS_1251, SHIFT_JIS, GBK, WINDOWS_1250, BIG5, EUC_KR];
/// Bytes that are looked at to tell encodings apart.
const EXAMINED_MAX: usize = 64 << 10;
/// Share of the bytes that are 0 on one side in UTF-16: one of so many.
const ZEROS: usize = 8;

/// A text, and how it was found.
#[derive(Debug)]
pub(super) struct Decoded {
    pub(super) text: String,
    /// The encoding, if a job file must name it.
    pub(super) encoding: Option<&'static Encoding>,
    /// Whether characters without width were dropped.
    pub(super) had_invisible: bool,
}

/// Returns the text of a file, in the encoding of its byte order mark, or else the one given, or else
/// UTF-8, unless another is to be found out.
pub(super) fn decoded(
    mut bytes: Vec<u8>,
    given: Option<&'static Encoding>,
    is_found_out: bool,
) -> Result<Decoded, LocatedProblem> {
    let by_mark = Encoding::for_bom(&bytes).map(|(encoding, _)| encoding);
    let found = if by_mark.or(given).is_none() && is_found_out {
        detected(&bytes).map_err(|problem| (None, problem))?
    } else {
        None
    };
    let encoding = by_mark.or(given).or(found).unwrap_or(UTF_8);
    if encoding == UTF_8 || encoding.is_ascii_compatible() {
        without_padding(&mut bytes);
    }
    let text = if encoding == UTF_8 {
        if utf16(&bytes).is_some() {
            return Err((Some(1), Problem::NotUtf8));
        }
        match String::from_utf8(bytes) {
            Ok(text) => text,
            Err(error) => return Err(not_utf8(error.as_bytes(), error.utf8_error().valid_up_to())),
        }
    } else {
        let (text, _) = encoding.decode_with_bom_removal(&bytes);
        text.into_owned()
    };
    let text = match text.strip_prefix('\u{feff}') {
        Some(marked) => marked.to_owned(),
        None => text,
    };
    let had_invisible = !text.is_ascii() && text.contains(has_no_width);
    Ok(Decoded { text: plain_lines(normalised(text)), encoding: found, had_invisible })
}

/// Returns the refusal of bytes that are no UTF-8 from one on.
fn not_utf8(bytes: &[u8], valid: usize) -> LocatedProblem {
    let line = bytes[..valid].iter().filter(|&&byte| byte == b'\n').count() + 1;
    (Some(line), Problem::NotUtf8)
}

/// Removes what loggers and old systems leave behind the text: zeros, and the mark of its end.
fn without_padding(bytes: &mut Vec<u8>) {
    let is_padding = |byte: &u8| matches!(byte, 0 | 0x1a);
    let end = bytes.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1);
    bytes.truncate(end);
}

/// Returns a text in one form of composed characters, without those that have no width.
pub(super) fn normalised(text: String) -> String {
    if text.is_ascii() {
        return text;
    }
    let text = match text.contains(has_no_width) {
        true => text.replace(has_no_width, ""),
        false => text,
    };
    if is_nfc(&text) { text } else { text.nfc().collect() }
}

/// Returns whether nobody sees a character.
fn has_no_width(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{feff}' | '\u{ad}' | '\u{202a}'..='\u{202e}')
}

/// Returns a text with the usual ends of lines, if it has only others.
fn plain_lines(text: String) -> String {
    let usual = text.bytes().filter(|&byte| byte == b'\n').take(2).count();
    let others = ['\r', '\u{2028}', '\u{2029}', '\u{85}'];
    let is_other = |c: char| others.contains(&c);
    match usual < 2 && text.matches(is_other).nth(usual).is_some() {
        true if !text.contains("\r\n") => text.replace(is_other, "\n"),
        _ => text,
    }
}

/// Returns the encoding of a text without a byte order mark; `None` for UTF-8.
fn detected(bytes: &[u8]) -> Result<Option<&'static Encoding>, Problem> {
    let end = bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    if let Some(encoding) = utf16(&bytes[..end]) {
        return Ok(Some(encoding));
    }
    if str::from_utf8(bytes).is_ok() {
        return Ok(None);
    }
    let examined = &bytes[..bytes.len().min(EXAMINED_MAX)];
    let reads = |encoding: &&&'static Encoding| {
        let (text, _, has_errors) = encoding.decode(examined);
        let fields = |line: &str| line.split([',', ';', '\t', '|']).any(is_named);
        !has_errors && text.lines().take(100).any(fields)
    };
    // A word of velocities beyond ASCII can be read in one encoding only.
    let by_word = LEGACY.iter().find(reads).copied();
    let by_word = by_word.or_else(|| is_western(bytes).then_some(WINDOWS_1252));
    by_word.or_else(|| guessed(bytes)).map(Some).ok_or(Problem::UnknownEncoding)
}

/// Returns whether each byte beyond ASCII stands by itself, and is a sign of measurement (± ° µ · and the blank that does
/// not break) or, beside a letter of ASCII, an accented one: the text of a Western European language.
fn is_western(bytes: &[u8]) -> bool {
    let is_sign = |byte: u8| matches!(byte, 0xa0 | 0xb0 | 0xb1 | 0xb5 | 0xb7);
    let is_accented = |byte: u8| byte >= 0xc0 && !matches!(byte, 0xd7 | 0xf7);
    let at =
        |place: Option<usize>| place.and_then(|place| bytes.get(place)).copied().unwrap_or(b' ');
    bytes.iter().enumerate().filter(|(_, byte)| !byte.is_ascii()).all(|(place, &byte)| {
        let (before, behind) = (at(place.checked_sub(1)), at(Some(place + 1)));
        let is_in_word = before.is_ascii_alphabetic() || behind.is_ascii_alphabetic();
        let is_alone = before.is_ascii() && behind.is_ascii();
        is_alone && (is_sign(byte) || is_accented(byte) && is_in_word)
    })
}

/// Returns whether a text names velocities by a word beyond ASCII.
fn is_named(text: &str) -> bool {
    !text.is_ascii() && ColumnName::parse(text).has_word()
}

/// Returns UTF-16 in the order in which every other byte of a number is 0.
fn utf16(bytes: &[u8]) -> Option<&'static Encoding> {
    let zeros =
        |first: usize| bytes.iter().skip(first).step_by(2).filter(|&&byte| byte == 0).count();
    let (even, odd) = (zeros(0), zeros(1));
    let is_one_sided = even.max(odd) > bytes.len() / ZEROS && even.min(odd) <= bytes.len() / 64;
    is_one_sided.then_some(if odd > even { UTF_16LE } else { UTF_16BE })
}

/// Returns the encoding that the text most resembles, if it is one of those that are tried and reads all
/// of it.
fn guessed(bytes: &[u8]) -> Option<&'static Encoding> {
    let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
    detector.feed(&bytes[..bytes.len().min(EXAMINED_MAX)], true);
    let encoding = detector.guess(None, Utf8Detection::Deny);
    let (_, _, has_errors) = encoding.decode(bytes);
    let is_known = LEGACY.contains(&encoding) && !has_errors;
    is_known.then_some(encoding)
}
