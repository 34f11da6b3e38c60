//! What a user is told about a model: a code that tests and scripts rely on, and a sentence.
//!
//! A message says what, how many, how large, where (Model frame, mm) and what was done about it.
//! Codes never change their meaning; messages may.

use nalgebra::Point3;

/// The binary header promises another number of facets than the file holds.
pub const COUNT_MISMATCH: &str = "CountMismatch";
/// Bytes follow the last facet of a binary file.
pub const TRAILING_BYTES: &str = "TrailingBytes";
/// An ASCII file ends without `endsolid`.
pub const MISSING_ENDSOLID: &str = "MissingEndsolid";
/// Stored normals are not finite or contradict the winding of their facets.
pub const NORMALS_IGNORED: &str = "NormalsIgnored";
/// The name of the solid held line ends or control characters.
pub const NAME_SANITIZED: &str = "NameSanitized";
/// Volumes of a model that are no part of its shape are left out.
pub const VOLUMES_LEFT_OUT: &str = "VolumesLeftOut";
/// An object of a file that encloses nothing is left out.
pub const OBJECT_LEFT_OUT: &str = "ObjectLeftOut";
/// A model has more bodies than it can be split into.
pub const NOT_SPLIT: &str = "NotSplit";
/// Settings of another slicer that come with a model are not taken over.
pub const EMBEDDED_SETTINGS_IGNORED: &str = "EmbeddedSettingsIgnored";
/// Vertices on open seams were joined within the weld tolerance.
pub const VERTICES_WELDED: &str = "VerticesWelded";
/// So far from the origin, the file's numbers are too coarse for the model's size.
pub const PRECISION_LOST: &str = "PrecisionLost";
/// Facets with two equal corners were removed.
pub const DEGENERATE_REMOVED: &str = "DegenerateRemoved";
/// Facets that occur more than once were removed.
pub const DUPLICATES_REMOVED: &str = "DuplicatesRemoved";
/// Facets were split where a vertex lies on one of their sides.
pub const T_JUNCTION: &str = "TJunction";
/// Facets were turned over.
pub const FACETS_REORIENTED: &str = "FacetsReoriented";
/// Holes were closed.
pub const HOLES_CLOSED: &str = "HolesClosed";
/// A hole was closed in one of several possible ways.
pub const SHAPE_GUESSED: &str = "ShapeGuessed";
/// A hole was left open.
pub const HOLES_LEFT: &str = "HolesLeft";
/// A surface that encloses nothing was removed.
pub const OPEN_SHELL_DROPPED: &str = "OpenShellDropped";
/// Surfaces share an edge, a vertex or a wall.
pub const NON_MANIFOLD: &str = "NonManifold";
/// Surfaces pass through each other.
pub const SELF_INTERSECTION: &str = "SelfIntersection";

/// Codes that say that the model was changed, in the order of the repair.
pub const REPAIRS: [&str; 7] = [
    VERTICES_WELDED,
    DEGENERATE_REMOVED,
    DUPLICATES_REMOVED,
    T_JUNCTION,
    FACETS_REORIENTED,
    HOLES_CLOSED,
    OPEN_SHELL_DROPPED,
];

/// One remark about a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// One of the codes of this module.
    pub code: &'static str,
    /// A sentence for the user, without a full stop.
    pub message: String,
}

impl Note {
    /// Returns a note.
    #[must_use]
    pub fn new(code: &'static str, message: String) -> Self {
        Self { code, message }
    }
}

/// Returns `1 facet`, `2 facets`, …
pub(crate) fn count(n: usize, noun: &str) -> String {
    match (n, noun.strip_suffix("ex")) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{n} {stem}ices"),
        (_, None) => format!("{n} {noun}s"),
    }
}

/// Returns a quantity with as many digits as a reader can use; never `-0`.
pub(crate) fn number(value: f64) -> String {
    // Three decimals show nothing of less, and nobody reads more digits.
    const PLAIN: std::ops::Range<f64> = 1e-3..1e6;
    let size = value.abs();
    if size != 0.0 && !PLAIN.contains(&size) {
        return format!("{value:.2e}");
    }
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Returns a position as text.
pub(crate) fn place(p: &Point3<f64>) -> String {
    format!("({}, {}, {})", number(p.x), number(p.y), number(p.z))
}

/// How often something was found, how much of it in all, and where the largest case is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// How many cases.
    pub count: usize,
    /// The sum of their sizes, in the unit that the owner names.
    pub total: f64,
    /// The size of the largest.
    pub worst: f64,
    /// Where the largest is, Model frame.
    pub at: Option<Point3<f64>>,
}

impl Tally {
    /// Counts one case.
    pub(crate) fn add(&mut self, size: f64, at: Point3<f64>) {
        self.count += 1;
        self.total += size;
        if self.at.is_none() || size > self.worst {
            self.worst = size;
            self.at = Some(at);
        }
    }

    /// Counts the cases of another tally.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.total += other.total;
        if self.at.is_none() || (other.at.is_some() && other.worst > self.worst) {
            self.worst = other.worst;
            self.at = other.at;
        }
    }

    /// Returns the place of the largest case as text.
    pub(crate) fn place(&self) -> String {
        self.at.map_or_else(String::new, |p| place(&p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_minus_zero() {
        let texts = [0.0, -0.0, -1e-9, 0.0005, 12.5, 1e30, -3.0].map(number);
        assert_eq!(texts, ["0", "0", "-1.00e-9", "5.00e-4", "12.5", "1.00e30", "-3"]);
        assert_eq!(count(1, "vertex"), "1 vertex");
        assert_eq!(count(3, "vertex"), "3 vertices");
        assert_eq!(count(0, "facet"), "0 facets");
    }

    #[test]
    fn tally_keeps_the_largest() {
        let mut tally = Tally::default();
        tally.add(1.0, Point3::new(1.0, 0.0, 0.0));
        tally.add(3.0, Point3::new(2.0, 0.0, 0.0));
        let mut sum = Tally::default();
        sum.merge(&tally);
        sum.merge(&Tally::default());
        assert_eq!((sum.count, sum.total, sum.worst), (2, 4.0, 3.0));
        assert_eq!(sum.place(), "(2, 0, 0)");
    }
}
