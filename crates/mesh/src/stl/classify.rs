//! Decides what kind of file some bytes are, before anything is decoded.
//!
//! Order matters. A binary file whose count fits its size exactly is binary whatever its header
//! says: no text below 7.5 GB can do that by chance, because four text bytes read as a count are
//! at least 151 million facets. "The size is 84 + 50 n" alone proves nothing: one ASCII file in
//! fifty has such a size. Only then comes the word `solid`, and then the signatures of what
//! people feed to slicers by mistake. Text is never converted: bytes are compared as bytes.

use super::error::StlError;
use super::{FACET, HEADER};

/// What a file that may be an STL is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Binary,
    Ascii,
}

/// How far the first `facet normal` is looked for, bytes. A name of 1 MiB is in the corpus;
/// without a limit a text file of gigabytes would be searched to its end.
const NAME_WINDOW: usize = 2 << 20;

/// How much of a file is looked at to recognise text formats, bytes.
const TEXT_WINDOW: usize = 4096;

/// Decides how the bytes are to be read.
pub(super) fn kind(bytes: &[u8]) -> Result<Kind, StlError> {
    if bytes.is_empty() {
        return Err(StlError::EmptyFile);
    }
    let count = promised(bytes);
    let present = whole_facets(bytes);
    if count
        .is_some_and(|n| n > 0 && HEADER as u64 + FACET as u64 * u64::from(n) == bytes.len() as u64)
    {
        return Ok(Kind::Binary);
    }
    let text = without_mark(bytes).trim_ascii_start();
    if is_ascii_stl(text) {
        return Ok(Kind::Ascii);
    }
    if bytes.starts_with(b"\xff\xfe") {
        return Err(StlError::Encoding { encoding: "UTF-16 (little-endian)" });
    }
    if bytes.starts_with(b"\xfe\xff") {
        return Err(StlError::Encoding { encoding: "UTF-16 (big-endian)" });
    }
    if let Some((what, advice)) = signature(bytes) {
        return Err(StlError::WrongFormat { what, advice, size: bytes.len() });
    }
    let Some(count) = count else {
        return Err(if bytes.len() < 80 {
            StlError::WrongFormat {
                what: "something shorter than any STL",
                advice: "the export or download did not finish; make the file again",
                size: bytes.len(),
            }
        } else {
            StlError::TruncatedBinary { promised: None, present: 0, size: bytes.len() }
        });
    };
    if count as usize > present && is_text(&bytes[..HEADER]) {
        return Err(unknown_text(bytes));
    }
    let says_solid = starts_with_word(text, b"solid") && text[..text.len().min(80)].contains(&0);
    if says_solid && count as usize > present {
        return Err(unknown_text(bytes));
    }
    Ok(Kind::Binary)
}

/// Returns the number of facets that a binary header promises.
pub(super) fn promised(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(80..HEADER)?;
    Some(u32::from_le_bytes(count.try_into().expect("four bytes were asked for")))
}

/// Returns how many whole facets follow a binary header.
pub(super) fn whole_facets(bytes: &[u8]) -> usize {
    bytes.len().saturating_sub(HEADER) / FACET
}

/// Returns the bytes after a UTF-8 byte order mark.
pub(crate) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

fn unknown_text(bytes: &[u8]) -> StlError {
    StlError::WrongFormat {
        what: "text or data that only begins like one",
        advice: "export the model as STL",
        size: bytes.len(),
    }
}

/// Whether `text` begins with the word `solid` and goes on as an STL does.
fn is_ascii_stl(text: &[u8]) -> bool {
    let window = &text[..text.len().min(NAME_WINDOW)];
    let ends = window.get(5).is_none_or(|b| is_space(*b));
    if !starts_with_word(window, b"solid") || !ends {
        return false;
    }
    match first_keyword(window) {
        Some(at) => !window[..at].contains(&0),
        // `solid` and nothing else: an STL without facets, not a binary header.
        None => window.len() < 81 && !window.contains(&0),
    }
}

/// Finds `facet normal` or `endsolid` as whole words in any case.
fn first_keyword(text: &[u8]) -> Option<usize> {
    (0..text.len()).find(|&at| {
        let initial = text[at].to_ascii_lowercase();
        (initial == b'f' || initial == b'e')
            && (at == 0 || !is_word(text[at - 1]))
            && (is_facet_normal(&text[at..]) || is_whole_word(&text[at..], b"endsolid"))
    })
}

fn is_facet_normal(text: &[u8]) -> bool {
    if !is_whole_word(text, b"facet") {
        return false;
    }
    let rest = &text[b"facet".len()..];
    let n_spaces = rest.iter().take_while(|b| is_space(**b)).count();
    n_spaces > 0 && is_whole_word(&rest[n_spaces..], b"normal")
}

fn is_whole_word(text: &[u8], word: &[u8]) -> bool {
    starts_with_word(text, word) && text.get(word.len()).is_none_or(|b| !is_word(*b))
}

fn starts_with_word(text: &[u8], word: &[u8]) -> bool {
    text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word))
}

/// The blanks of the C locale, which is what the writers of ASCII STL use.
pub(super) fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c)
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Whether bytes can be text: no control characters, and half of them ASCII (names and comments
/// in other alphabets have more high bytes, but also blanks, digits and keywords).
fn is_text(bytes: &[u8]) -> bool {
    let plain = bytes.iter().filter(|b| b.is_ascii_graphic() || is_space(**b)).count();
    let high = bytes.iter().filter(|b| **b >= 0x80).count();
    plain + high == bytes.len() && plain >= high
}

/// What a file begins with, what it is, and what to do with it.
const SIGNATURES: &[(&[u8], &str, &str)] = &[
    (b"\x1f\x8b", "a gzip archive", UNPACK),
    (
        b"PK\x03\x04",
        "a zip archive, perhaps a 3MF",
        "a 3MF is read when its name ends in .3mf; unpack another zip first",
    ),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    (b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    (b"BZh", "a bzip2 archive", UNPACK),
    (b"\xfd7zXZ\x00", "an xz archive", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", UNPACK),
    (b"\x89PNG", "a PNG picture", EXPORT),
    (b"\xff\xd8\xff", "a JPEG picture", EXPORT),
    (b"GIF8", "a GIF picture", EXPORT),
    (b"%PDF", "a PDF document", EXPORT),
    (b"\x7fELF", "a Linux program", EXPORT),
    (b"GCDE", "binary G-code", GCODE),
    (b"glTF", "a glTF model", EXPORT),
    (b"ISO-10303-21", "a STEP model", EXPORT),
    (b"ply\n", "a PLY model", EXPORT),
    (b"ply\r", "a PLY model", EXPORT),
    (b"OFF\n", "an OFF model", EXPORT),
    (b"OFF\r", "an OFF model", EXPORT),
    (b"version https://git-lfs", "a Git LFS pointer", "fetch the real file with `git lfs pull`"),
];

const UNPACK: &str = "unpack it first";
const EXPORT: &str = "export the model as STL";
const GCODE: &str = "it is sliced already; `rhumb convert` translates G-code";

/// Recognises other kinds of files.
fn signature(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    if let Some((_, what, advice)) = SIGNATURES.iter().find(|s| bytes.starts_with(s.0)) {
        return Some((what, advice));
    }
    let text = without_mark(&bytes[..bytes.len().min(TEXT_WINDOW)]).trim_ascii_start();
    if starts_with_word(text, b"<!doctype html") || starts_with_word(text, b"<html") {
        return Some(("an HTML page", "the download saved a web page; fetch the file itself"));
    }
    if text.starts_with(b"<?xml") || text.starts_with(b"<amf") {
        return Some(("XML, perhaps an AMF", EXPORT));
    }
    if text.contains(&0) {
        return None;
    }
    if is_obj(text) {
        return Some(("an OBJ model", "an OBJ is read when its name ends in .obj"));
    }
    if is_gcode(text) {
        return Some(("G-code", GCODE));
    }
    None
}

fn lines(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|b| *b == b'\n' || *b == b'\r').map(<[u8]>::trim_ascii).filter(|l| !l.is_empty())
}

/// The first line that is no comment is a vertex.
fn is_obj(text: &[u8]) -> bool {
    let names =
        |l: &&[u8]| !l.starts_with(b"#") && !l.starts_with(b"o ") && !l.starts_with(b"mtllib");
    lines(text).find(names).is_some_and(|l| {
        l.strip_prefix(b"v").is_some_and(|rest| {
            rest.first().is_some_and(|b| is_space(*b))
                && rest.trim_ascii_start().first().is_some_and(|b| b"+-.0123456789".contains(b))
        })
    })
}

/// Begins like G-code, and a line starts with a G command.
fn is_gcode(text: &[u8]) -> bool {
    let is_command = |l: &[u8]| {
        l.len() >= 2 && l[0].eq_ignore_ascii_case(&b'G') && l[1].is_ascii_digit() && {
            let digits = l[1..].iter().take_while(|b| b.is_ascii_digit()).count();
            digits <= 2 && l.get(1 + digits).is_none_or(|b| !is_word(*b))
        }
    };
    text.first().is_some_and(|b| b";GMgm%".contains(b)) && lines(text).any(is_command)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn what(bytes: &[u8]) -> &'static str {
        match kind(bytes) {
            Err(StlError::WrongFormat { what, .. }) => what,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn foreign_files_are_named() {
        assert_eq!(what(b"\x1f\x8b\x08rest"), "a gzip archive");
        assert!(what(b"PK\x03\x04rest").contains("3MF"));
        assert_eq!(what(b" \n<!DOCTYPE HTML><html>404</html>"), "an HTML page");
        assert_eq!(what(b"# made by x\no thing\nv 0 0 1\nv 1 0 0\nf 1 2 3\n"), "an OBJ model");
        assert_eq!(what(b"; made\nG28\nG1 X1\n"), "G-code");
        assert_eq!(what(b"M104 S200\r\nG1 X1\r\n"), "G-code");
        assert_eq!(what(b"version https://git-lfs.github.com/spec/v1\n"), "a Git LFS pointer");
        assert_eq!(what(b"\x89PNG\r\n\x1a\n"), "a PNG picture");
        assert_eq!(what(b"ply\nformat ascii 1.0\n"), "a PLY model");
        assert_eq!(what(b"s"), "something shorter than any STL");
        assert!(what(&b"Dear all, please find the part attached. ".repeat(9)).contains("text"));
    }

    #[test]
    fn counts_that_fit_beat_every_header() {
        for header in
            [&b"solid x\nfacet normal 0 0 1"[..], b"\xff\xfes\0", b"\xef\xbb\xbfa", b"PK\x03\x04"]
        {
            let mut bytes = header.to_vec();
            bytes.resize(80, 0);
            bytes.extend_from_slice(&2_u32.to_le_bytes());
            bytes.resize(84 + 2 * 50, 7);
            assert_eq!(kind(&bytes), Ok(Kind::Binary));
        }
    }

    #[test]
    fn ascii_needs_the_word_and_a_keyword() {
        assert_eq!(kind(b"solid"), Ok(Kind::Ascii));
        assert_eq!(kind(b"\xef\xbb\xbf \n SOLID a\nFacet\t normal 0 0 1"), Ok(Kind::Ascii));
        let mut long = b"solid ".to_vec();
        long.resize(500, b'x');
        assert!(kind(&long).is_err(), "a long text without a keyword");
        long.extend_from_slice(b"\nendsolid x");
        assert_eq!(kind(&long), Ok(Kind::Ascii));
        assert!(kind(b"solidarity forever\nfacet normal").is_err());
        assert!(first_keyword(b"xfacet normal facet_normal facet normals").is_none());
    }

    #[test]
    fn encodings_and_headers_cut_short() {
        assert!(matches!(kind(b"\xff\xfes\0o\0"), Err(StlError::Encoding { .. })));
        assert!(matches!(kind(b"\xfe\xff\0s\0o"), Err(StlError::Encoding { .. })));
        let cut = StlError::TruncatedBinary { promised: None, present: 0, size: 83 };
        assert_eq!(kind(&[0; 83]), Err(cut));
        assert_eq!(kind(b""), Err(StlError::EmptyFile));
    }
}
