//! Reads what people keep models in: STL, 3MF and OBJ.
//!
//! Whatever the file, the result is a [`Soup`] in the Model frame. An STL or an OBJ has no unit:
//! its numbers are taken for millimetres. A 3MF has one, and its numbers become millimetres here.
//! What a file holds besides the shape, colours, settings or programs, is never taken over.

mod archive;
mod obj;
mod threemf;

use crate::note::Note;
use crate::soup::{Facet, Soup};
use crate::stl::{self, StlError};
use std::ops::Range;
use std::path::Path;

/// How a model is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Loose triangles, binary or text.
    Stl,
    /// A package of objects and the places they are built at.
    ThreeMf,
    /// Vertices and the faces between them, as text.
    Obj,
}

impl Format {
    /// Returns the format that a file name says; all others are STL. What has no name (`-`) is
    /// told by its first bytes.
    #[must_use]
    pub fn of(name: &Path, bytes: &[u8]) -> Self {
        if name == Path::new("-") {
            return if bytes.starts_with(archive::SIGNATURE) { Self::ThreeMf } else { Self::Stl };
        }
        let extension = name.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("3mf") {
            Self::ThreeMf
        } else if extension.eq_ignore_ascii_case("obj") {
            Self::Obj
        } else {
            Self::Stl
        }
    }
}

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    /// The facets of all objects, where they are to be built; mm if the file has a unit.
    pub soup: Soup,
    /// The objects that those are, in the order of their facets: more than one have places with regard
    /// to each other.
    pub objects: Vec<Built>,
    /// What the user should know.
    pub notes: Vec<Note>,
}

/// One of the objects that a file holds, where it is to be built.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// What the file calls it, printable and not long; empty when it has no name.
    pub name: String,
    /// Its facets among those of all.
    pub facets: Range<usize>,
    /// The settings that it alone is to have, if there are any.
    pub settings: Option<OwnSettings>,
}

/// Settings of one object, as another slicer wrote them.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnSettings {
    /// Whose words they are.
    pub slicer: Slicer,
    /// Keys and values, as they stand in the file.
    pub pairs: Vec<(String, String)>,
}

/// A slicer that keeps settings in a 3MF.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slicer {
    /// PrusaSlicer and its like.
    Prusa,
    /// OrcaSlicer and its like.
    Orca,
}

/// The only object of a file.
fn alone(soup: &Soup) -> Vec<Built> {
    vec![Built { name: String::new(), facets: 0..soup.facets.len(), settings: None }]
}

/// Why a file cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// It is to be an STL, and is none.
    #[error(transparent)]
    Stl(#[from] StlError),
    /// It is no file of its kind, or a damaged one.
    #[error("{format}: {what}")]
    Malformed {
        /// What it should be.
        format: &'static str,
        /// What is wrong, and where.
        what: String,
    },
    /// It unfolds to more than such a file may hold.
    #[error("{what}")]
    Excessive {
        /// What, how much, and the limit.
        what: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("{place}: coordinate is {value}")]
    NotFinite {
        /// Where.
        place: String,
        /// As it stands.
        value: String,
    },
    /// A coordinate is beyond the numbers that a mesh is made of.
    #[error("{place}: {value:e} is beyond 3.4e38, the largest coordinate")]
    NumberRange {
        /// Where.
        place: String,
        /// Its value.
        value: f64,
    },
}

impl ModelError {
    /// Returns the name of the class, a word that never changes.
    #[must_use]
    pub fn class(&self) -> &'static str {
        match self {
            Self::Stl(error) => error.class(),
            Self::Malformed { .. } => "WrongFormat",
            Self::Excessive { .. } => "LimitExceeded",
            Self::NotFinite { .. } => "NotFinite",
            Self::NumberRange { .. } => "NumberRange",
        }
    }

    /// Returns what the user can do about it, where there is something to say.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let text = match self {
            Self::Stl(error) => return error.hint(),
            Self::Malformed { .. } => "export the model again, or as STL",
            Self::Excessive { .. } => "export the model as STL",
            Self::NotFinite { .. } | Self::NumberRange { .. } => {
                "the program that wrote the file computed nonsense there; repair it at the source"
            }
        };
        Some(text.to_owned())
    }
}

/// Reads a file.
///
/// # Errors
///
/// [`ModelError`], when the bytes are no such file or not all of one.
pub fn read(format: Format, bytes: &[u8]) -> Result<Given, ModelError> {
    if bytes.is_empty() {
        return Err(StlError::EmptyFile.into());
    }
    let given = match format {
        Format::Stl => {
            let (soup, report) = stl::read(bytes)?;
            Given { objects: alone(&soup), soup, notes: report.notes }
        }
        Format::ThreeMf => threemf::read(bytes)?,
        Format::Obj => obj::read(bytes)?,
    };
    if given.soup.facets.is_empty() {
        return Err(StlError::NoTriangles.into());
    }
    Ok(given)
}

/// Settings of another slicer that a 3MF holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Embedded {
    /// Those of PrusaSlicer and its like: a line `; key = value` for each.
    Prusa(Vec<u8>),
    /// Those of OrcaSlicer and its like: a JSON object.
    Orca(Vec<u8>),
}

/// Returns the settings of another slicer that a 3MF holds; `None` where there are none, or the file is
/// no such package.
///
/// # Errors
///
/// [`ModelError`] when they are there and cannot be unpacked.
pub fn embedded_settings(bytes: &[u8]) -> Result<Option<Embedded>, ModelError> {
    if bytes.starts_with(archive::SIGNATURE) { threemf::settings(bytes) } else { Ok(None) }
}

/// A facet of such corners, in single precision as everywhere before the weld.
fn facet(corners: [[f64; 3]; 3], place: impl Fn() -> String) -> Result<Facet, ModelError> {
    let flat = corners.as_flattened();
    if let Some(&value) = flat.iter().find(|c| c.abs() > f64::from(f32::MAX)) {
        return Err(ModelError::NumberRange { place: place(), value });
    }
    // Adding zero makes −0 plain zero.
    Ok(corners.map(|corner| corner.map(|c| c as f32 + 0.0)))
}

/// Text of a file that may be shown anywhere: printable, and not long.
fn shown(bytes: &[u8]) -> String {
    const LENGTH: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * LENGTH)]);
    text.chars().take(LENGTH).map(|c| if c.is_control() { '?' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_the_format() {
        let of = |name: &str| Format::of(Path::new(name), b"PK\x03\x04");
        assert_eq!(of("a/part.3MF"), Format::ThreeMf);
        assert_eq!(of("part.Obj"), Format::Obj);
        assert_eq!(["part.stl", "part", "3mf", "part.3mf.stl"].map(of), [Format::Stl; 4]);
        assert_eq!(of("-"), Format::ThreeMf);
        assert_eq!(Format::of(Path::new("-"), b"solid"), Format::Stl);
    }

    #[test]
    fn nothing_is_no_model() {
        for format in [Format::Stl, Format::ThreeMf, Format::Obj] {
            assert_eq!(read(format, b"").unwrap_err().class(), "EmptyFile");
        }
        assert_eq!(read(Format::Obj, b"v 0 0 0\n").unwrap_err().class(), "NoTriangles");
    }
}
