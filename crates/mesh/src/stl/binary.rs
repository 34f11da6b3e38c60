//! Decodes the facets of a binary STL with the stl_io crate.
//!
//! stl_io reads what a header promises, and trusts it. So the number of facets is settled here
//! first, and stl_io gets the facets in slices, each behind a header of our making with the exact
//! count. The header begins with a line end: stl_io then looks at one byte, not at the whole
//! slice, to see that this is no ASCII file. Slices are decoded in parallel straight into their
//! places, so the result does not depend on the number of threads.

use super::classify::{promised, whole_facets};
use super::error::{Place, StlError};
use super::{FACET, Format, HEADER, ReadReport, contradicts, normals_note, printable, tidy};
use crate::note::{self, Note};
use crate::soup::{Facet, Soup};
use rayon::prelude::*;
use std::io::{Read, Seek, SeekFrom};

/// Facets that are decoded in one go: 3.2 MB. Smaller, and starting stl_io shows; larger, and two
/// threads end at different times.
const SLICE: usize = 1 << 16;

/// Reads a binary STL.
pub(super) fn read(bytes: &[u8]) -> Result<(Soup, ReadReport), StlError> {
    let (n_facets, count_note) = settle_count(bytes)?;
    let body = &bytes[HEADER..HEADER + FACET * n_facets];
    let mut facets: Vec<Facet> = Vec::new();
    facets.try_reserve_exact(n_facets).map_err(|_| StlError::NoMemory { facets: n_facets })?;
    facets.resize(n_facets, Facet::default());
    let slices: Vec<Result<Normals, StlError>> = facets
        .par_chunks_mut(SLICE)
        .zip(body.par_chunks(SLICE * FACET))
        .enumerate()
        .map(|(i, (facets, body))| decode(body, i * SLICE, facets))
        .collect();
    let mut normals = Normals::default();
    for slice in slices {
        normals.add(&slice?);
    }
    let end = bytes[..80].iter().position(|b| *b == 0).unwrap_or(80);
    let name = printable(bytes[..end].trim_ascii());
    let mut notes: Vec<Note> = count_note.into_iter().collect();
    notes.extend(normals_note(normals.contradicting, normals.first));
    Ok((Soup { facets }, ReadReport { format: Format::Binary, name, facets: n_facets, notes }))
}

/// Decides how many facets there are when header and size may disagree.
///
/// 0 and 2³² − 1 are what writers leave that stream and never come back to fill in the count; a
/// file with more whole facets than promised, and not a byte too many, is taken whole. Anything
/// missing is refused.
fn settle_count(bytes: &[u8]) -> Result<(usize, Option<Note>), StlError> {
    let present = whole_facets(bytes);
    let n_tail = bytes.len().saturating_sub(HEADER + FACET * present);
    let promise = promised(bytes);
    let cut = StlError::TruncatedBinary { promised: promise, present, size: bytes.len() };
    let Some(promise) = promise else { return Err(cut) };
    let wanted = promise as usize;
    let (n_facets, note) = if n_tail == 0 && wanted == present {
        (present, None)
    } else if n_tail == 0 && present > 0 && (promise == u32::MAX || wanted < present) {
        let message = format!(
            "the header promises {promise} facets, the file holds exactly {present}; all are used"
        );
        (present, Some(Note::new(note::COUNT_MISMATCH, message)))
    } else if wanted > present || (wanted == 0 && present > 0) {
        return Err(cut);
    } else if wanted > 0 {
        let n_bytes = bytes.len() - (HEADER + FACET * wanted);
        let message = format!("{} after the last facet are ignored", note::count(n_bytes, "byte"));
        (wanted, Some(Note::new(note::TRAILING_BYTES, message)))
    } else {
        (0, None)
    };
    if n_facets == 0 { Err(StlError::NoTriangles) } else { Ok((n_facets, note)) }
}

/// How many stored normals contradict, and the first of them (facets from 1).
#[derive(Default)]
struct Normals {
    contradicting: usize,
    first: usize,
}

impl Normals {
    fn add(&mut self, later: &Self) {
        if self.contradicting == 0 {
            self.first = later.first;
        }
        self.contradicting += later.contradicting;
    }
}

/// Decodes the facets in `body`, the first of which is number `offset` (from 0) of the file.
fn decode(body: &[u8], offset: usize, facets: &mut [Facet]) -> Result<Normals, StlError> {
    let mut reader = Slice::new(body);
    let broken = |_| StlError::TruncatedBinary {
        promised: None,
        present: offset,
        size: HEADER + FACET * offset,
    };
    let mut triangles = stl_io::create_stl_reader(&mut reader).map_err(broken)?;
    let mut normals = Normals::default();
    for (i, facet) in facets.iter_mut().enumerate() {
        let number = offset + i + 1;
        // The iterator must not be asked again after an error: it would repeat it for ever.
        let triangle = triangles.next().expect("the count is exact").map_err(broken)?;
        *facet = triangle.vertices.map(|v| v.0.map(tidy));
        if let Some(k) = facet.iter().flatten().position(|c| !c.is_finite()) {
            return Err(StlError::NotFinite {
                facet: number,
                corner: k / 3 + 1,
                value: facet[k / 3][k % 3].to_string(),
                place: Place::Byte(HEADER + FACET * (number - 1) + 12 + 4 * k),
            });
        }
        if contradicts(triangle.normal.0, facet) {
            normals.add(&Normals { contradicting: 1, first: number });
        }
    }
    Ok(normals)
}

/// Some facets behind a header of our own, for stl_io.
struct Slice<'a> {
    header: [u8; HEADER],
    body: &'a [u8],
    at: usize,
}

impl<'a> Slice<'a> {
    fn new(body: &'a [u8]) -> Self {
        let mut header = [0; HEADER];
        header[0] = b'\n';
        let count = u32::try_from(body.len() / FACET).expect("a slice is short");
        header[80..].copy_from_slice(&count.to_le_bytes());
        Self { header, body, at: 0 }
    }
}

impl Read for Slice<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let rest = match self.header.get(self.at..) {
            Some(rest) if !rest.is_empty() => rest,
            _ => self.body.get(self.at - HEADER..).unwrap_or_default(),
        };
        let n = rest.len().min(buffer.len());
        buffer[..n].copy_from_slice(&rest[..n]);
        self.at += n;
        Ok(n)
    }
}

impl Seek for Slice<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match to {
            SeekFrom::Start(at) => {
                let end = HEADER + self.body.len();
                self.at = usize::try_from(at).map_or(end, |at| at.min(end));
                Ok(self.at as u64)
            }
            _ => Err(std::io::ErrorKind::Unsupported.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stl::read;

    fn file(count: u32, n_facets: usize, tail: &[u8]) -> Vec<u8> {
        let mut bytes = b"a part".to_vec();
        bytes.resize(80, 0);
        bytes.extend_from_slice(&count.to_le_bytes());
        for i in 0..n_facets {
            for c in [0.0, 0.0, 1.0, i as f32, -0.0, 0.0, i as f32 + 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
                bytes.extend_from_slice(&c.to_le_bytes());
            }
            bytes.extend_from_slice(&[0, 0]);
        }
        bytes.extend_from_slice(tail);
        bytes
    }

    /// Facets read and the codes of the notes, or the class of the error.
    fn outcome(bytes: &[u8]) -> Result<(usize, Vec<&'static str>), &'static str> {
        let (soup, report) = read(bytes).map_err(|e| e.class())?;
        assert_eq!(soup.facets.len(), report.facets);
        assert_eq!(report.name, "a part");
        Ok((report.facets, report.notes.iter().map(|n| n.code).collect()))
    }

    #[test]
    fn counts_and_tails() {
        let mismatch = |n| Ok((n, vec![note::COUNT_MISMATCH]));
        assert_eq!(outcome(&file(3, 3, b"")), Ok((3, vec![])));
        assert_eq!(outcome(&file(0, 3, b"")), mismatch(3));
        assert_eq!(outcome(&file(2, 3, b"")), mismatch(3));
        assert_eq!(outcome(&file(u32::MAX, 3, b"")), mismatch(3));
        assert_eq!(outcome(&file(3, 3, b"1234567")), Ok((3, vec![note::TRAILING_BYTES])));
        assert_eq!(outcome(&file(4, 3, b"")), Err("TruncatedBinary"));
        assert_eq!(outcome(&file(3, 2, &[0; 49])), Err("TruncatedBinary"));
        assert_eq!(outcome(&file(0, 2, b"x")), Err("TruncatedBinary"));
        assert_eq!(outcome(&file(u32::MAX - 1, 2, b"")), Err("TruncatedBinary"));
        assert_eq!(outcome(&file(0, 0, b"")), Err("NoTriangles"));
        assert_eq!(outcome(&file(0, 0, b"x")), Err("NoTriangles"));
    }

    #[test]
    fn ten_facets_are_no_line_end() {
        // The count byte 0x0A makes stl_io's own probe take a line.
        assert_eq!(outcome(&file(10, 10, b"")), Ok((10, vec![])));
    }

    #[test]
    fn slices_join_without_a_seam() {
        let n = SLICE + 5;
        let bytes = file(n as u32, n, b"");
        let (soup, _) = read(&bytes).unwrap();
        assert!((0..n).all(|i| soup.facets[i][0][0] == i as f32));
    }

    #[test]
    fn nonsense_numbers_are_found_where_they_are() {
        let mut bytes = file(3, 3, b"");
        let at = 84 + 50 + 12 + 4 * 5;
        bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        let (facet, corner, value) = (2, 2, "NaN".to_owned());
        let place = Place::Byte(at);
        assert_eq!(read(&bytes), Err(StlError::NotFinite { facet, corner, value, place }));
    }

    #[test]
    fn normals_against_the_winding_are_counted() {
        let mut bytes = file(3, 3, b"");
        for i in [1, 2] {
            let at = 84 + 50 * i + 8;
            bytes[at..at + 4].copy_from_slice(&(-1.0_f32).to_le_bytes());
        }
        let (_, report) = read(&bytes).unwrap();
        assert!(report.notes[0].message.contains("2 facets (first: facet 2)"));
    }
}
