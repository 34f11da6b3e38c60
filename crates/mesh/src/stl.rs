//! Reads STL from bytes that nobody vouches for, and writes it.
//!
//! Numbers are in file units, frame Model. The kind of file is decided on raw bytes
//! (`classify`); binary facets are decoded by the stl_io crate in slices (`binary`), ASCII by
//! our own tokens (`ascii`), because stl_io refuses many sound ASCII files and silently cuts
//! others short. Whatever the bytes, the answer is a [`Soup`] of finite numbers without `-0` or a
//! [`StlError`] that says where; memory follows the size of the file, never what a header claims.
//!
//! Stored normals are read and dropped: the winding of the corners is the truth.

mod ascii;
mod binary;
mod classify;
mod error;

pub use error::{Place, StlError};

use crate::mesh::Mesh;
use crate::note::{self, Note};
use crate::soup::{Facet, Soup};
use classify::Kind;
pub(crate) use classify::without_mark;

/// How an STL file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// 50 bytes a facet.
    Binary,
    /// Words and decimal numbers.
    Ascii,
}

/// What was found besides the facets.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadReport {
    /// How the file is written.
    pub format: Format,
    /// The name of the (first) solid or the binary header, printable ASCII, at most
    /// [`NAME_LENGTH`] characters: safe to print anywhere, and still not to be trusted.
    pub name: String,
    /// How many facets were read.
    pub facets: usize,
    /// What the user should know.
    pub notes: Vec<Note>,
}

/// The longest name that is passed on, in characters. A G-code comment of 80 bytes must hold it;
/// PrusaSlicer and OctoPrint labels cut at 60 too.
pub const NAME_LENGTH: usize = 60;

/// Reads an STL file.
///
/// # Errors
///
/// [`StlError`], when the bytes are not an STL or not all of one.
pub fn read(bytes: &[u8]) -> Result<(Soup, ReadReport), StlError> {
    match classify::kind(bytes)? {
        Kind::Binary => binary::read(bytes),
        Kind::Ascii => ascii::read(bytes),
    }
}

/// Writes a binary STL; coordinates are rounded to `f32`, normals follow the winding.
///
/// # Panics
///
/// When there are more than 2³² triangles, which no STL can hold.
#[must_use]
pub fn write(mesh: &Mesh) -> Vec<u8> {
    let n_facets = mesh.triangles.len();
    assert!(u32::try_from(n_facets).is_ok(), "an STL counts its facets in 32 bits");
    let triangles: Vec<stl_io::Triangle> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
            stl_io::Triangle {
                normal: stl_io::Normal::new([0, 1, 2].map(|k| tidy(normal[k] as f32))),
                vertices: [a, b, c]
                    .map(|p| stl_io::Vertex::new([0, 1, 2].map(|k| tidy(p[k] as f32)))),
            }
        })
        .collect();
    let mut bytes = Vec::with_capacity(HEADER + FACET * n_facets);
    stl_io::write_stl(&mut bytes, triangles.iter()).expect("writing to memory does not fail");
    assert_eq!(bytes.len(), HEADER + FACET * n_facets, "every facet is written");
    bytes
}

/// Bytes before the first facet of a binary STL: 80 of text and a count.
const HEADER: usize = 84;

/// Bytes of a facet of a binary STL: normal, three corners, attribute.
const FACET: usize = 50;

/// Makes `-0` plain zero, so that equal numbers have equal bits.
fn tidy(c: f32) -> f32 {
    c + 0.0
}

/// Returns whether a stored normal is not finite or points against the winding of its facet.
///
/// Zero normals say nothing and are fine. "Against" is more than 120° off: writers round normals
/// of slivers badly, and only a normal on the wrong side hints at a wrong winding.
fn contradicts(normal: [f32; 3], facet: &Facet) -> bool {
    if !normal.iter().all(|c| c.is_finite()) {
        return true;
    }
    let [a, b, c] = facet.map(|p| nalgebra::Vector3::from(p.map(f64::from)));
    let winding = (b - a).cross(&(c - a));
    let dot = winding.dot(&nalgebra::Vector3::from(normal.map(f64::from)));
    dot < -0.5 * winding.norm()
}

/// Returns the note about stored normals, when there is something to say.
fn normals_note(n_contradicting: usize, first: usize) -> Option<Note> {
    (n_contradicting > 0).then(|| {
        let message = format!(
            "the stored normals of {} (first: facet {first}) are not finite or contradict the \
             order of the corners; normals are computed from the corners",
            note::count(n_contradicting, "facet")
        );
        Note::new(note::NORMALS_IGNORED, message)
    })
}

/// Returns at most [`NAME_LENGTH`] printable ASCII characters of `bytes`.
fn printable(bytes: &[u8]) -> String {
    let text: String = bytes
        .iter()
        .take(NAME_LENGTH)
        .map(|&b| if b == b' ' || b.is_ascii_graphic() { b as char } else { '?' })
        .collect();
    text.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn what_is_written_is_read() {
        let vertices = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, -5.0, 0.0], [-0.0, 0.0, 3.0]];
        let mesh = Mesh {
            vertices: vertices.map(Point3::from).to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        };
        let bytes = write(&mesh);
        assert_eq!(bytes.len(), 84 + 4 * 50);
        let (soup, report) = read(&bytes).unwrap();
        assert_eq!(report.format, Format::Binary);
        assert_eq!((report.facets, report.notes.len()), (4, 0));
        for (facet, triangle) in soup.facets.iter().zip(&mesh.triangles) {
            for (corner, &v) in facet.iter().zip(triangle) {
                assert_eq!(*corner, [0, 1, 2].map(|k| mesh.vertices[v as usize][k] as f32));
            }
        }
        // No bit pattern of -0 survives.
        assert!(soup.facets.iter().flatten().flatten().all(|c| c.to_bits() != 1 << 31));
    }

    #[test]
    fn names_are_harmless() {
        assert_eq!(printable(b"  part\x07\xffname  "), "part??name");
        assert_eq!(printable(&[b'a'; 100]).len(), NAME_LENGTH);
    }

    #[test]
    fn normals_contradict_only_when_on_the_wrong_side() {
        let facet = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(!contradicts([0.0; 3], &facet));
        assert!(!contradicts([1.0, 0.0, 0.0], &facet));
        assert!(contradicts([0.0, 0.0, -1.0], &facet));
        assert!(contradicts([0.0, f32::NAN, 1.0], &facet));
    }
}
