//! Arrays in NumPy's archives: ZIP files whose members are arrays, stored or deflated.
//!
//! The directory at the end of the archive says where the members are; what it says is checked against the
//! members' own headers only as far as it is needed to find their data.

use std::io::Read as _;

use flate2::read::DeflateDecoder;

use crate::reading_error::SignalFault;

/// Most bytes of an archive, and of its unpacked arrays together.
pub(crate) const ARCHIVE_BYTES_MAX: u64 = 256 << 20;
/// Most members of an archive.
const MEMBERS_MAX: usize = 1000;
/// Lengths of the fixed parts of the end, of an entry of the directory, and of a member's header.
const END: usize = 22;
const ENTRY: usize = 46;
const MEMBER: usize = 30;
/// Longest comment behind the end.
const COMMENT_MAX: usize = 0xffff;

/// An array of an archive.
#[derive(Debug)]
pub(crate) struct ArchivedArray {
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
}

/// Unpacks all arrays of an archive.
pub(crate) fn arrays(archive: &[u8]) -> Result<Vec<ArchivedArray>, SignalFault> {
    let damaged = || SignalFault::damaged("its directory of arrays is missing or cut off");
    let first = archive.len().saturating_sub(END + COMMENT_MAX);
    let end = (first..archive.len().saturating_sub(END - 1))
        .rev()
        .find(|&place| archive[place..].starts_with(b"PK\x05\x06"))
        .ok_or_else(damaged)?;
    let count = short(archive, end + 10).ok_or_else(damaged)?;
    if count > MEMBERS_MAX {
        let problem = format!("its directory has {count} entries, at most {MEMBERS_MAX} are read");
        return Err(SignalFault::damaged(problem));
    }
    let mut place = long(archive, end + 16).ok_or_else(damaged)?;
    let (mut found, mut unpacked) = (Vec::new(), 0);
    for _ in 0..count {
        let entry = archive.get(place..).filter(|it| it.starts_with(b"PK\x01\x02"));
        let entry = entry.ok_or_else(damaged)?;
        let lengths = [28, 30, 32].map(|at| short(entry, at));
        let [Some(name), Some(extra), Some(comment)] = lengths else { return Err(damaged()) };
        let text = entry.get(ENTRY..ENTRY + name).ok_or_else(damaged)?;
        let text = String::from_utf8_lossy(text);
        if let Some(name) = text.strip_suffix(".npy") {
            let bytes = member(archive, entry, ARCHIVE_BYTES_MAX - unpacked)?;
            unpacked += bytes.len() as u64;
            found.push(ArchivedArray { name: name.to_owned(), bytes });
        }
        place = place.saturating_add(ENTRY + name + extra + comment);
    }
    Ok(found)
}

/// Unpacks a member of at most `room` bytes; `entry` is its entry in the directory.
fn member(archive: &[u8], entry: &[u8], room: u64) -> Result<Vec<u8>, SignalFault> {
    let damaged = || SignalFault::damaged("an array of it is cut off");
    let packed = long(entry, 20).ok_or_else(damaged)?;
    let place = long(entry, 42).ok_or_else(damaged)?;
    let own =
        archive.get(place..).filter(|it| it.starts_with(b"PK\x03\x04")).ok_or_else(damaged)?;
    let name = short(own, 26).ok_or_else(damaged)?;
    let extra = short(own, 28).ok_or_else(damaged)?;
    let begin = MEMBER + name + extra;
    let data = own.get(begin..).and_then(|rest| rest.get(..packed)).ok_or_else(damaged)?;
    let mut bytes = Vec::new();
    match short(entry, 10) {
        Some(0) => data.take(room + 1).read_to_end(&mut bytes)?,
        Some(8) => DeflateDecoder::new(data)
            .take(room + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| SignalFault::damaged(format!("an array of it: {error}")))?,
        _ => {
            return Err(SignalFault::damaged(
                "an array of it is packed in another way than by NumPy",
            ));
        }
    };
    match bytes.len() as u64 > room {
        true => Err(SignalFault::TooLarge { max: ARCHIVE_BYTES_MAX }),
        false => Ok(bytes),
    }
}

fn short(bytes: &[u8], at: usize) -> Option<usize> {
    let bytes = bytes.get(at..at + 2)?.first_chunk()?;
    Some(usize::from(u16::from_le_bytes(*bytes)))
}

fn long(bytes: &[u8], at: usize) -> Option<usize> {
    let bytes = bytes.get(at..at + 4)?.first_chunk()?;
    usize::try_from(u32::from_le_bytes(*bytes)).ok()
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use flate2::Compression;
    use flate2::write::DeflateEncoder;

    use super::*;

    /// An archive of members, each with its name and bytes; deflated or stored.
    fn archive(members: &[(&str, &[u8])], is_deflated: bool) -> Vec<u8> {
        let (mut file, mut directory) = (Vec::new(), Vec::new());
        for (name, bytes) in members {
            let mut packed = DeflateEncoder::new(Vec::new(), Compression::default());
            packed.write_all(bytes).unwrap();
            let packed = if is_deflated { packed.finish().unwrap() } else { bytes.to_vec() };
            let method = if is_deflated { 8_u16 } else { 0 };
            let place = file.len() as u32;
            let mut common = Vec::new();
            common.extend([20, 0, 0, 0]);
            common.extend(method.to_le_bytes());
            common.extend([0; 8]);
            common.extend((packed.len() as u32).to_le_bytes());
            common.extend((bytes.len() as u32).to_le_bytes());
            common.extend((name.len() as u16).to_le_bytes());
            file.extend(b"PK\x03\x04");
            file.extend(&common);
            // A member may have an extra field that its entry has not.
            file.extend([4, 0]);
            file.extend(name.bytes().chain([1, 0, 0, 0]));
            file.extend(packed);
            directory.extend(b"PK\x01\x02\x14\x00");
            directory.extend(&common);
            directory.extend([0; 12]);
            directory.extend(place.to_le_bytes());
            directory.extend(name.bytes());
        }
        let place = file.len() as u32;
        let count = (members.len() as u16).to_le_bytes();
        file.extend(&directory);
        file.extend(b"PK\x05\x06\x00\x00\x00\x00");
        file.extend(count.into_iter().chain(count));
        file.extend((directory.len() as u32).to_le_bytes());
        file.extend(place.to_le_bytes());
        file.extend([0, 0]);
        file
    }

    #[test]
    fn arrays_are_found_stored_and_deflated() {
        for is_deflated in [false, true] {
            let members: [(&str, &[u8]); 3] =
                [("a.npy", b"one"), ("readme", b"two"), ("b.npy", &[7; 5000])];
            let file = archive(&members, is_deflated);
            let found = arrays(&file).unwrap();
            let names: Vec<_> = found.iter().map(|array| array.name.as_str()).collect();
            assert_eq!(names, ["a", "b"]);
            assert_eq!((found[0].bytes.as_slice(), found[1].bytes.len()), (&b"one"[..], 5000));
            // However it is cut or spoilt, it is refused or read, and nothing else.
            for length in 0..file.len() {
                let mut spoilt = file.clone();
                spoilt[length] ^= 0x5a;
                drop(arrays(&spoilt));
                assert!(arrays(&file[..length]).is_err(), "{length}");
            }
        }
    }
}
