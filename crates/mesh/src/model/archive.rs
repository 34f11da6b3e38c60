//! Members of a ZIP archive in memory (PKWARE APPNOTE.TXT 6.3.10): stored and deflated ones, with
//! the 64-bit sizes that large packages have. Nothing is ever written to a disk, so names of members
//! are only compared. Memory follows what a reader takes, and a member that unfolds to far more than
//! its size in the archive ends in an error.

use flate2::Crc;
use flate2::read::DeflateDecoder;
use std::io::{self, Read};

/// What an archive with members begins with.
pub(super) const SIGNATURE: &[u8] = b"PK\x03\x04";

/// The record at the end, its length without a comment, and the longest comment.
const END: &[u8] = b"PK\x05\x06";
const END_LENGTH: usize = 22;
const LONGEST_COMMENT: usize = 0xffff;

/// The larger record at the end, what points to it, and the length of that.
const END_64: &[u8] = b"PK\x06\x06";
const LOCATOR_64: &[u8] = b"PK\x06\x07";
const LOCATOR_64_LENGTH: usize = 20;

/// An entry of the directory, and its length without names.
const ENTRY: &[u8] = b"PK\x01\x02";
const ENTRY_LENGTH: usize = 46;

/// What stands before the bytes of a member, and its length without names.
const LOCAL: &[u8] = b"PK\x03\x04";
const LOCAL_LENGTH: usize = 30;

/// Stands for a number that is in the 64-bit field of an entry.
const IN_64: u64 = 0xffff_ffff;

/// The extra field with numbers of 64 bits.
const EXTRA_64: u16 = 1;

/// A member may always unfold to this many bytes, ...
const UNFOLDS_TO: u64 = 16 << 20;

/// ... and to so many times its size in the archive. Coordinates as text unfold to five to twenty
/// times that; blanks to a thousand times.
const UNFOLDS_BY: u64 = 100;

/// What is said of a damaged archive.
type Fault = &'static str;

/// An archive.
pub(super) struct Archive<'a> {
    bytes: &'a [u8],
    entries: Vec<Entry<'a>>,
}

/// A member.
struct Entry<'a> {
    name: &'a [u8],
    method: u16,
    is_encrypted: bool,
    crc: u32,
    packed: u64,
    size: u64,
    at: u64,
}

impl<'a> Archive<'a> {
    /// Reads the directory.
    pub(super) fn of(bytes: &'a [u8]) -> Result<Self, Fault> {
        let (count, start) = end(bytes).ok_or("the archive is cut short or is none")?;
        let mut entries = Vec::new();
        let mut at = usize::try_from(start).map_err(|_| DIRECTORY)?;
        for _ in 0..count {
            let (entry, next) = entry(bytes, at).ok_or(DIRECTORY)?;
            entries.push(entry);
            at = next;
        }
        Ok(Self { bytes, entries })
    }

    /// The names of the members.
    pub(super) fn names(&self) -> impl Iterator<Item = &'a [u8]> {
        self.entries.iter().map(|entry| entry.name)
    }

    /// Opens a member; `None` when there is none of this name. Names differ in case by accident only.
    pub(super) fn open(&self, name: &str) -> Option<Result<Member<'a>, Fault>> {
        let is_it = |entry: &&Entry| entry.name.eq_ignore_ascii_case(name.as_bytes());
        self.entries.iter().find(is_it).map(|entry| self.member(entry))
    }

    fn member(&self, entry: &Entry) -> Result<Member<'a>, Fault> {
        if entry.is_encrypted {
            return Err("the archive is encrypted");
        }
        let packed = packed(self.bytes, entry).ok_or("the archive is cut short")?;
        let source = match entry.method {
            0 => Source::Stored(packed),
            8 => Source::Deflated(DeflateDecoder::new(packed)),
            _ => return Err("the archive is packed in another way than deflate"),
        };
        let most = UNFOLDS_TO.max(UNFOLDS_BY * packed.len() as u64);
        Ok(Member { source, crc: Crc::new(), wanted: (entry.crc, entry.size), most })
    }
}

const DIRECTORY: Fault = "the directory of the archive is damaged";

/// The number of entries, and where they begin.
fn end(bytes: &[u8]) -> Option<(u64, u64)> {
    let last = bytes.len().checked_sub(END_LENGTH)?;
    let first = last.saturating_sub(LONGEST_COMMENT);
    let at = (first..=last).rev().find(|at| bytes[*at..].starts_with(END))?;
    let (count, start) = (u64::from(u16_at(bytes, at + 10)?), u64::from(u32_at(bytes, at + 16)?));
    let locator =
        at.checked_sub(LOCATOR_64_LENGTH).filter(|at| bytes[*at..].starts_with(LOCATOR_64));
    let Some(locator) = locator else { return Some((count, start)) };
    let large = usize::try_from(u64_at(bytes, locator + 8)?).ok()?;
    if !bytes.get(large..)?.starts_with(END_64) {
        return None;
    }
    Some((u64_at(bytes, large + 32)?, u64_at(bytes, large + 48)?))
}

/// The entry at some byte of the directory, and where the next is.
fn entry(bytes: &[u8], at: usize) -> Option<(Entry<'_>, usize)> {
    if !bytes.get(at..)?.starts_with(ENTRY) {
        return None;
    }
    let length = |offset| u16_at(bytes, at + offset).map(usize::from);
    let name_at = at + ENTRY_LENGTH;
    let extra_at = name_at + length(28)?;
    let comment_at = extra_at + length(30)?;
    let next = comment_at + length(32)?;
    let number = |offset| u32_at(bytes, at + offset).map(u64::from);
    let mut entry = Entry {
        name: bytes.get(name_at..extra_at)?,
        method: u16_at(bytes, at + 10)?,
        is_encrypted: u16_at(bytes, at + 8)? & 1 != 0,
        crc: u32_at(bytes, at + 16)?,
        packed: number(20)?,
        size: number(24)?,
        at: number(42)?,
    };
    let mut large = extra(bytes.get(extra_at..comment_at)?, EXTRA_64).unwrap_or_default();
    for field in [&mut entry.size, &mut entry.packed, &mut entry.at] {
        if *field == IN_64 {
            let (number, rest) = large.split_first_chunk::<8>()?;
            (*field, large) = (u64::from_le_bytes(*number), rest);
        }
    }
    Some((entry, next))
}

/// The extra field of a kind.
fn extra(mut fields: &[u8], kind: u16) -> Option<&[u8]> {
    while let Some((field, length)) = u16_at(fields, 0).zip(u16_at(fields, 2)) {
        let end = 4 + usize::from(length);
        let body = fields.get(4..end)?;
        if field == kind {
            return Some(body);
        }
        fields = &fields[end..];
    }
    None
}

/// The bytes of a member, as they are in the archive.
fn packed<'a>(bytes: &'a [u8], entry: &Entry) -> Option<&'a [u8]> {
    let at = usize::try_from(entry.at).ok()?;
    if !bytes.get(at..)?.starts_with(LOCAL) {
        return None;
    }
    let names = usize::from(u16_at(bytes, at + 26)?) + usize::from(u16_at(bytes, at + 28)?);
    let start = at + LOCAL_LENGTH + names;
    bytes.get(start..start.checked_add(usize::try_from(entry.packed).ok()?)?)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// A member that is being read. Ends in an error when it is not what the directory says, and in one
/// of the kind `FileTooLarge` when it unfolds to too much.
pub(super) struct Member<'a> {
    source: Source<'a>,
    crc: Crc,
    /// Checksum and size.
    wanted: (u32, u64),
    most: u64,
}

enum Source<'a> {
    Stored(&'a [u8]),
    Deflated(DeflateDecoder<&'a [u8]>),
}

impl Read for Member<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let damaged = || io::Error::new(io::ErrorKind::InvalidData, "the archive is damaged");
        let n = match &mut self.source {
            Source::Stored(rest) => rest.read(out)?,
            Source::Deflated(decoder) => decoder.read(out).map_err(|_| damaged())?,
        };
        self.crc.update(&out[..n]);
        // The checksum counts to 2³² only; sizes are compared as far.
        let (crc, size) = self.wanted;
        if n == 0 && !out.is_empty() && (self.crc.sum(), self.crc.amount()) != (crc, size as u32) {
            return Err(damaged());
        }
        self.most = self.most.checked_sub(n as u64).ok_or_else(|| {
            io::Error::new(io::ErrorKind::FileTooLarge, "the archive unfolds to too much")
        })?;
        Ok(n)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::DeflateEncoder;
    use std::io::Write;

    /// An archive of members with these names and contents.
    pub(in super::super) fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
        let (mut bytes, mut directory) = (Vec::new(), Vec::new());
        for (name, content) in members {
            let mut crc = Crc::new();
            crc.update(content);
            let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(content).unwrap();
            let packed = encoder.finish().unwrap();
            let at = bytes.len() as u32;
            let mut fields = Vec::new();
            fields.extend([20, 0, 0, 0, 8, 0, 0, 0, 0, 0]);
            for number in [crc.sum(), packed.len() as u32, content.len() as u32] {
                fields.extend(number.to_le_bytes());
            }
            fields.extend((name.len() as u16).to_le_bytes());
            fields.extend([0, 0]);
            bytes.extend(LOCAL.iter().chain(&fields).chain(name.as_bytes()).chain(&packed));
            directory.extend(ENTRY.iter().chain(&[20, 0]).chain(&fields).chain(&[0; 10]));
            directory.extend(at.to_le_bytes().iter().chain(name.as_bytes()));
        }
        let start = bytes.len() as u32;
        bytes.extend(&directory);
        bytes.extend(END.iter().chain(&[0; 4]));
        bytes.extend([(members.len() as u16).to_le_bytes(); 2].as_flattened());
        bytes.extend((directory.len() as u32).to_le_bytes());
        bytes.extend(start.to_le_bytes().iter().chain(&[0, 0]));
        bytes
    }

    fn content(bytes: &[u8], name: &str) -> io::Result<Vec<u8>> {
        let archive = Archive::of(bytes).map_err(io::Error::other)?;
        let member = archive.open(name).ok_or(io::ErrorKind::NotFound)?.map_err(io::Error::other);
        let mut content = Vec::new();
        member?.read_to_end(&mut content)?;
        Ok(content)
    }

    #[test]
    fn members_are_read() {
        let text = b"some text, some text, some text".repeat(100);
        let bytes = zip(&[("a", b""), ("folder/b.txt", &text)]);
        assert_eq!(content(&bytes, "a").unwrap(), b"");
        assert_eq!(content(&bytes, "Folder/B.txt").unwrap(), text);
        assert!(content(&bytes, "c").is_err());
        let commented = [bytes.as_slice(), b"a comment"].concat();
        assert_eq!(content(&commented, "folder/b.txt").unwrap(), text);
    }

    #[test]
    fn what_unfolds_to_too_much_ends() {
        let blanks = vec![b' '; 40 << 20];
        let bytes = zip(&[("bomb", &blanks)]);
        let error = content(&bytes, "bomb").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(
            content(&zip(&[("all", &blanks[..UNFOLDS_TO as usize])]), "all").unwrap().len(),
            16 << 20
        );
    }

    #[test]
    fn damage_is_noticed_and_never_fatal() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8 & 0x3f
        };
        let text: Vec<u8> = (0..2000).map(|_| random()).collect();
        let bytes = zip(&[("b", &text)]);
        let mut n_noticed = 0;
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x55;
            match content(&damaged, "b") {
                Ok(read) => assert_eq!(read, text, "byte {at}"),
                Err(_) => n_noticed += 1,
            }
            assert!(content(&bytes[..at], "b").is_err(), "cut at {at}");
        }
        assert!(n_noticed > bytes.len() * 9 / 10, "{n_noticed} of {}", bytes.len());
    }
}
