//! Why bytes are not read as STL: one variant a class of fault, with where it was found.

/// Why a file cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StlError {
    /// There is not a single byte.
    #[error("the file is empty (0 bytes)")]
    EmptyFile,
    /// The bytes are another kind of file.
    #[error("not an STL file but {what} ({size} bytes)")]
    WrongFormat {
        /// What the file is, with an article.
        what: &'static str,
        /// What the user can do.
        advice: &'static str,
        /// Its size in bytes.
        size: usize,
    },
    /// A binary file ends too early.
    #[error("binary STL cut short at byte {size}: {}", promise(*promised, *present))]
    TruncatedBinary {
        /// How many facets the header promises; `None` when the file ends before the count.
        promised: Option<u32>,
        /// How many whole facets are there.
        present: usize,
        /// The size of the file in bytes.
        size: usize,
    },
    /// An ASCII file breaks the grammar.
    #[error("line {line} (byte {offset}): expected {expected}, found {found}")]
    AsciiSyntax {
        /// The line, from 1.
        line: usize,
        /// The byte, from 0.
        offset: usize,
        /// What would have been right.
        expected: &'static str,
        /// What is there, shortened and made printable.
        found: String,
    },
    /// The text is not in a byte-based encoding.
    #[error("text in {encoding}; an ASCII STL has one byte a character")]
    Encoding {
        /// The encoding.
        encoding: &'static str,
    },
    /// A coordinate is NaN or infinite.
    #[error("facet {facet}, corner {corner}: coordinate is {value}, at {place}")]
    NotFinite {
        /// The facet, from 1 in file order.
        facet: usize,
        /// The corner, 1 to 3.
        corner: usize,
        /// The coordinate as it stands.
        value: String,
        /// Where.
        place: Place,
    },
    /// A number does not fit into the numbers of STL.
    #[error("line {line} (byte {offset}): {found} is beyond 3.4e38, the largest number of an STL")]
    NumberRange {
        /// The line, from 1.
        line: usize,
        /// The byte, from 0.
        offset: usize,
        /// The number, shortened.
        found: String,
    },
    /// The file is an STL without a single facet.
    #[error("the file has no facets")]
    NoTriangles,
    /// The facets are there, and no memory for them.
    #[error("there is no memory for {facets} facets")]
    NoMemory {
        /// How many they are.
        facets: usize,
    },
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A byte of a binary file, from 0.
    Byte(usize),
    /// A line of a text file, from 1.
    Line(usize),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Line(line) => write!(f, "line {line}"),
        }
    }
}

fn promise(promised: Option<u32>, present: usize) -> String {
    match promised {
        Some(n) => format!("the header promises {n} facets, {present} are whole"),
        None => "the 84 bytes of the header are not complete".to_owned(),
    }
}

impl StlError {
    /// Returns the name of the class, a word that never changes.
    #[must_use]
    pub fn class(&self) -> &'static str {
        match self {
            Self::EmptyFile => "EmptyFile",
            Self::WrongFormat { .. } => "WrongFormat",
            Self::TruncatedBinary { .. } => "TruncatedBinary",
            Self::AsciiSyntax { .. } => "AsciiSyntax",
            Self::Encoding { .. } => "Encoding",
            Self::NotFinite { .. } => "NotFinite",
            Self::NumberRange { .. } => "NumberRange",
            Self::NoTriangles => "NoTriangles",
            Self::NoMemory { .. } => "LimitExceeded",
        }
    }

    /// Returns what the user can do about it, where there is something to say.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let text = match self {
            Self::EmptyFile => "the export or download did not finish; make the file again",
            Self::WrongFormat { advice, .. } => advice,
            Self::TruncatedBinary { .. } => {
                "data is missing, so the shape would be wrong; export or download it again"
            }
            Self::AsciiSyntax { found, .. } if found.contains(',') => {
                "numbers are written with a decimal comma; export with a decimal point"
            }
            Self::AsciiSyntax { .. } => "export the model again, as binary STL if possible",
            Self::Encoding { .. } => "save the text as UTF-8 or ASCII, or export a binary STL",
            Self::NotFinite { .. } | Self::NumberRange { .. } => {
                "the program that wrote the file computed nonsense there; repair it at the source"
            }
            Self::NoTriangles => "check what was selected for export",
            Self::NoMemory { .. } => "export the model with fewer facets",
        };
        Some(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_say_where_and_how_much() {
        let cut = StlError::TruncatedBinary { promised: Some(12), present: 7, size: 434 };
        let text = "binary STL cut short at byte 434: the header promises 12 facets, 7 are whole";
        assert_eq!(cut.to_string(), text);
        assert_eq!(cut.class(), "TruncatedBinary");
        let syntax = StlError::AsciiSyntax {
            line: 4,
            offset: 70,
            expected: "a number",
            found: "'1,5' (a decimal comma)".to_owned(),
        };
        assert!(syntax.to_string().starts_with("line 4 (byte 70): expected a number, found"));
        assert!(syntax.hint().unwrap().contains("comma"));
    }
}
