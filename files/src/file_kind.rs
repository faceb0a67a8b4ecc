//! What kind of file some bytes are, by how they begin.

use crate::arrays::npy;

/// A file that is no text, or none of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Text, as far as its first bytes say.
    Text,
    /// Compressed by gzip.
    Gzip,
    /// A ZIP archive, which workbooks and NumPy's archives are.
    Zip,
    /// The container of workbooks before 2007.
    CompoundFile,
    /// MATLAB 5 to 7.2.
    Matlab,
    /// HDF5, which MATLAB 7.3 writes, too.
    Hdf5,
    /// An array of NumPy.
    Numpy,
    /// Something that is not read.
    Other {
        /// What it is, as part of a sentence.
        what: &'static str,
        /// What to do to get velocities from it.
        cure: &'static str,
    },
}

const SAVE_AS_CSV: &str = "open it where it comes from, and save the table as CSV";
const EXPORT: &str = "write its column of velocities as CSV";
const UNPACK: &str = "unpack it first";

/// How kinds of files that are not read begin, what they are, and what to do.
const OTHERS: [(&[u8], &str, &str); 27] = [
    (b"PAR1", "a Parquet file", EXPORT),
    (b"ARROW1", "an Arrow file", EXPORT),
    (b"FEA1", "a Feather file", EXPORT),
    (b"\x80\x04\x95", "a pickle of Python", EXPORT),
    (b"RDX", "data of R", "write them by write.csv(…, row.names = FALSE)"),
    (b"X\nV=", "data of R", "write them by write.csv(…, row.names = FALSE)"),
    (b"$FL2", "data of SPSS", EXPORT),
    (b"<stata_dta>", "data of Stata", EXPORT),
    (b"SQLite format 3", "a database of SQLite", EXPORT),
    (b"TDSm", "a TDMS file of LabVIEW", EXPORT),
    (b"CDF\x01", "a NetCDF file", EXPORT),
    (b"CDF\x02", "a NetCDF file", EXPORT),
    (b"%PDF", "a PDF", "get the numbers as CSV from where it was made"),
    (b"{\\rtf", "a text of a word processor (RTF)", SAVE_AS_CSV),
    (b"\x89PNG", "a picture", "get the numbers as CSV from where it was made"),
    (b"\xff\xd8\xff", "a picture", "get the numbers as CSV from where it was made"),
    (b"GIF8", "a picture", "get the numbers as CSV from where it was made"),
    (b"RIFF", "a recording (RIFF)", EXPORT),
    (b"BZh", "compressed by bzip2", UNPACK),
    (b"\xfd7zXZ\0", "compressed by xz", UNPACK),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd", UNPACK),
    (b"7z\xbc\xaf", "an archive of 7-Zip", UNPACK),
    (b"Rar!", "an archive of RAR", UNPACK),
    (b"\x7fELF", "a program", "name the file of velocities"),
    (b"MZ\x90\0", "a program", "name the file of velocities"),
    (
        b"version https://git-lfs.github.com/spec/",
        "a pointer of Git LFS and not the file itself",
        "`git lfs pull` gets it",
    ),
    (b"-----BEGIN ", "a key or certificate", "name the file of velocities"),
];
/// How texts begin that are no tables, in lower case.
const TEXTS: [(&str, &str, &str); 6] = [
    ("<!doctype html", "a web page, or a table saved as one", SAVE_AS_CSV),
    ("<html", "a web page, or a table saved as one", SAVE_AS_CSV),
    ("<table", "a table of a web page", SAVE_AS_CSV),
    ("<?xml", "XML, as some programs write spreadsheets", SAVE_AS_CSV),
    ("<", "text with marks of HTML or XML", SAVE_AS_CSV),
    (
        "{",
        "JSON",
        "put the list into the job file, as [data] velocities = [3900.0, …], or save it as CSV",
    ),
];
/// Where a tar archive says that it is one.
const TAR_MARK_AT: usize = 257;

impl FileKind {
    /// Returns the kind of a file with these bytes, of which the first 4096 suffice.
    pub fn recognize(bytes: &[u8]) -> Self {
        let begins = |with: &[u8]| bytes.starts_with(with);
        if begins(b"\x1f\x8b") {
            return Self::Gzip;
        }
        if begins(b"PK\x03\x04") || begins(b"PK\x05\x06") {
            return Self::Zip;
        }
        if begins(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") {
            return Self::CompoundFile;
        }
        // MATLAB 7.3 writes 512 bytes of its own before those of HDF5.
        let is_hdf5 = [0, 512, 1024, 2048]
            .into_iter()
            .any(|at| bytes.get(at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n")));
        if is_hdf5 {
            return Self::Hdf5;
        }
        if begins(npy::MAGIC) {
            return Self::Numpy;
        }
        if begins(b"MATLAB 5.0 MAT-file") || begins(b"MATLAB 7.3 MAT-file") {
            return Self::Matlab;
        }
        if bytes.get(TAR_MARK_AT..).is_some_and(|rest| rest.starts_with(b"ustar")) {
            return Self::Other { what: "an archive of tar", cure: UNPACK };
        }
        let other = OTHERS.iter().find(|(with, _, _)| begins(with));
        other.map_or_else(|| of_text(bytes), |&(_, what, cure)| Self::Other { what, cure })
    }
}

/// Returns the kind of a file that seems to be text.
fn of_text(bytes: &[u8]) -> FileKind {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let begin: Vec<u8> = bytes.iter().take(64).map(u8::to_ascii_lowercase).collect();
    if let Some((_, what, cure)) =
        TEXTS.iter().find(|(with, _, _)| begin.starts_with(with.as_bytes()))
    {
        return FileKind::Other { what, cure };
    }
    // A list of JSON; a section's name ends on its line.
    let first = bytes.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let is_list = first.starts_with(b"[") && first.len() == bytes.trim_ascii_end().len();
    let is_list = is_list || begin.starts_with(b"[{") || bytes.starts_with(b"[\n");
    if is_list {
        let (_, what, cure) = TEXTS[TEXTS.len() - 1];
        return FileKind::Other { what, cure };
    }
    let is_listing = begin.starts_with(b"total ")
        && bytes.windows(5).take(400).any(|part| part == b"\n-rw-" || part == b"\ndrwx");
    if is_listing {
        return FileKind::Other {
            what: "the listing of a directory",
            cure: "name the file of velocities",
        };
    }
    FileKind::Text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_known_by_its_first_bytes() {
        let what = |bytes: &[u8]| match FileKind::recognize(bytes) {
            FileKind::Other { what, .. } => what,
            FileKind::Text => "text",
            FileKind::Gzip => "gzip",
            FileKind::Zip => "zip",
            FileKind::CompoundFile => "compound",
            FileKind::Matlab => "matlab",
            FileKind::Hdf5 => "hdf5",
            FileKind::Numpy => "numpy",
        };
        let padded = [&b"MATLAB 7.3 MAT-file"[..], &[b' '; 493], b"\x89HDF\r\n\x1a\n"].concat();
        let tar = [&b"velocities.csv"[..], &[0; 243], b"ustar"].concat();
        for (bytes, expected) in [
            (&b"velocity\n3900\n"[..], "text"),
            (b"", "text"),
            (b"[data]\nvelocity\n", "text"),
            (b"[probe header]\n\nversion=1\n", "text"),
            (b"\x1f\x8b\x08", "gzip"),
            (b"PK\x03\x04", "zip"),
            (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0", "compound"),
            (b"MATLAB 5.0 MAT-file, Platform", "matlab"),
            (&padded, "hdf5"),
            (b"\x89HDF\r\n\x1a\n", "hdf5"),
            (&tar, "an archive of tar"),
            (b"PAR1....", "a Parquet file"),
            (b" <html><body>", "a web page, or a table saved as one"),
            (b"\xef\xbb\xbf<?xml version", "XML, as some programs write spreadsheets"),
            (b"{\"velocity\": [3900]}", "JSON"),
            (b"[3900, 3910]\n", "JSON"),
            (b"[{\"v\": 1},\n", "JSON"),
            (
                b"version https://git-lfs.github.com/spec/v1\n",
                "a pointer of Git LFS and not the file itself",
            ),
            (b"total 8\n-rw-r--r-- 1 a b 5 v.csv\n", "the listing of a directory"),
        ] {
            assert_eq!(what(bytes), expected, "{:?}", String::from_utf8_lossy(bytes));
        }
    }
}
