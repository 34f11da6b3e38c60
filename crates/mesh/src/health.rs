//! The way from loose triangles to a solid, and what a user is told about it.
//!
//! Weld, repair, sides and shells, overlaps: [`solid_from_soup`] does them in this order and sums
//! them up in a [`Health`]. Numbers are mm, mm² and mm³ in the Model frame.

mod words;

use crate::measure;
use crate::note::{self, Note};
use crate::overlap::{self, SelfIntersection, ShellMeeting};
use crate::repair::facets::drop_degenerate;
use crate::repair::{RepairReport, mended};
use crate::soup::Soup;
use crate::stl::ReadReport;
use crate::topology::{Edges, Shell, Solid};
use crate::weld;

/// Up to this many triangles, surfaces are tested for passing through themselves: some 50 ms.
/// Larger meshes are tested between shells only; [`overlap::self_intersections`] does the rest on
/// demand.
pub const SELF_TEST_TRIANGLES: usize = 20_000;

/// How many crossings are counted before it is enough to know that there are many.
const MOST_CROSSINGS: usize = 100;

/// The state of a mesh: as it was found, what was done, and what is left.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Health {
    /// Facets in the file.
    pub facets: usize,
    /// Triangles after the repair.
    pub triangles: usize,
    /// Connected surfaces after the repair.
    pub shells: usize,
    /// Edges that one facet alone had, before any repair.
    pub open_edges: usize,
    /// Edges that one triangle alone has, after the repair.
    pub open_edges_left: usize,
    /// Edges that more than two facets shared, duplicates apart.
    pub nonmanifold_edges: usize,
    /// Vertices on open seams that were joined with a near one.
    pub welded: usize,
    /// Facets that were turned over.
    pub flipped: usize,
    /// Facets with two equal corners that were removed.
    pub degenerate: usize,
    /// Facets that were removed because they occurred more than once.
    pub duplicate: usize,
    /// Whether a hole was closed in one of several possible ways.
    pub guessed: bool,
    /// Whether surfaces pass through each other (tested as far as [`SELF_TEST_TRIANGLES`] says).
    pub overlaps: bool,
    /// Signed volume as in the file, mm³; without meaning when the surface was open.
    pub volume_before_mm3: f64,
    /// Volume of the solid, mm³. What overlaps counts twice.
    pub volume_mm3: f64,
    /// Area as in the file, mm².
    pub area_before_mm2: f64,
    /// Area of the solid, mm².
    pub area_mm2: f64,
    /// What the user should know, in the order of the work.
    pub notes: Vec<Note>,
}

/// Why there is no solid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Nothing in the file encloses a volume.
    #[error(
        "the {facets} facets enclose no volume: {degenerate} have two equal corners, \
         {dropped} surfaces ({} mm²) are flat, open or doubled",
        note::number(*dropped_mm2)
    )]
    NoVolume {
        /// Facets in the file.
        facets: usize,
        /// Those with two equal corners.
        degenerate: usize,
        /// Surfaces that were removed because they enclose nothing.
        dropped: usize,
        /// The area of these, mm².
        dropped_mm2: f64,
    },
    /// There are more facets than can be numbered.
    #[error("{facets} facets are too many; the limit is {limit}")]
    TooManyFacets {
        /// Facets in the file.
        facets: usize,
        /// The largest number that can be handled.
        limit: usize,
    },
}

impl MeshError {
    /// Returns the name of the class, a word that never changes.
    #[must_use]
    pub fn class(&self) -> &'static str {
        match self {
            Self::NoVolume { .. } => "NoVolume",
            Self::TooManyFacets { .. } => "LimitExceeded",
        }
    }

    /// Returns what the user can do about it.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        let text = match self {
            Self::NoVolume { .. } => {
                "a printable model is a closed surface; give sheets a thickness before exporting"
            }
            Self::TooManyFacets { .. } => "reduce the number of facets before exporting",
        };
        Some(text.to_owned())
    }
}

/// The largest number of facets: their corners are numbered in 32 bits.
const MOST_FACETS: usize = u32::MAX as usize / 3;

/// Welds and repairs a soup.
///
/// # Errors
///
/// [`MeshError`], when nothing encloses a volume.
pub fn solid_from_soup(soup: &Soup) -> Result<(Solid, Health), MeshError> {
    let facets = soup.facets.len();
    if facets > MOST_FACETS {
        return Err(MeshError::TooManyFacets { facets, limit: MOST_FACETS });
    }
    let mut mesh = weld::exactly(soup);
    let (volume_before_mm3, area_before_mm2) = measure::volume_and_area(&mesh);
    let mut welded = weld::report_on(&mesh);
    let mut degenerate = drop_degenerate(&mut mesh);
    let mut edges = Edges::of(&mesh);
    welded.open_sides = edges.n_open();
    if weld::join_seams(&mut mesh, &edges, &mut welded) {
        degenerate.merge(&drop_degenerate(&mut mesh));
        edges = Edges::of(&mesh);
    }
    let (solid, mut repaired) = mended(mesh, edges);
    repaired.degenerate.merge(&degenerate);
    if !solid.shells().iter().any(encloses) {
        return Err(MeshError::NoVolume {
            facets,
            degenerate: repaired.degenerate.count,
            dropped: repaired.dropped.count,
            dropped_mm2: repaired.dropped.total,
        });
    }
    let findings = Findings::of(&solid);
    let mut health = Health {
        facets,
        volume_before_mm3,
        area_before_mm2,
        open_edges: welded.open_sides,
        welded: welded.joined.count,
        overlaps: findings.overlap(),
        ..Health::of(&solid, &repaired)
    };
    health.notes = words::notes(&welded, &repaired, &solid, &findings);
    Ok((solid, health))
}

/// Whether a shell counts as a solid. Shells that a repair has left closed do, even when they
/// cross themselves so that their volume cancels; open ones do when they are no mere surface.
fn encloses(shell: &Shell) -> bool {
    const DEPTH_SHARE: f64 = 1e-3;
    let depth = 2.0 * shell.volume_mm3 / shell.area_mm2;
    shell.is_closed() || depth.abs() > DEPTH_SHARE * shell.bounds.diagonal()
}

/// What a look at the finished solid shows.
struct Findings {
    crossings: Vec<SelfIntersection>,
    meetings: Vec<ShellMeeting>,
    pinched: Vec<u32>,
}

impl Findings {
    fn of(solid: &Solid) -> Self {
        let small = solid.mesh().triangles.len() <= SELF_TEST_TRIANGLES;
        Self {
            crossings: match small {
                true => overlap::self_intersections(solid, MOST_CROSSINGS),
                false => Vec::new(),
            },
            meetings: overlap::shell_meetings(solid),
            pinched: pinched_solids(solid),
        }
    }

    fn overlap(&self) -> bool {
        let touching = overlap::MeetingKind::Touching;
        !self.crossings.is_empty() || self.meetings.iter().any(|m| m.kind != touching)
    }
}

/// The vertices at which solids touch, or one touches itself. A cavity that touches the outside
/// in a vertex is left out: nothing is joined there.
fn pinched_solids(solid: &Solid) -> Vec<u32> {
    let mut pinched = solid.pinched_vertices();
    if pinched.is_empty() || solid.shells().len() == 1 {
        return pinched;
    }
    let mut at: Vec<(u32, u32)> = Vec::new();
    for (corners, &shell) in solid.mesh().triangles.iter().zip(solid.shell_of()) {
        let here = corners.iter().filter(|v| pinched.binary_search(v).is_ok());
        at.extend(here.map(|v| (*v, shell)));
    }
    at.sort_unstable();
    at.dedup();
    let is_solid = |(_, shell): &&(u32, u32)| solid.shells()[*shell as usize].volume_mm3 > 0.0;
    let mut vertices = at.chunk_by(|a, b| a.0 == b.0);
    pinched.retain(|_| {
        let shells = vertices.next().expect("every pinched vertex has shells");
        shells.len() == 1 || shells.iter().filter(is_solid).count() > 1
    });
    pinched
}

impl Health {
    fn of(solid: &Solid, repaired: &RepairReport) -> Self {
        Self {
            triangles: solid.mesh().triangles.len(),
            shells: solid.shells().len(),
            open_edges_left: solid.open_sides(),
            nonmanifold_edges: repaired.nonmanifold_edges.count,
            flipped: repaired.flipped.count,
            degenerate: repaired.degenerate.count,
            duplicate: repaired.duplicate.count,
            guessed: repaired.is_guess(),
            volume_mm3: solid.volume_mm3(),
            area_mm2: solid.shells().iter().map(|s| s.area_mm2).sum(),
            ..Self::default()
        }
    }

    /// Puts what was said about the file before what is said about the mesh.
    #[must_use]
    pub fn with_read(self, read: &ReadReport) -> Self {
        self.with_notes(&read.notes)
    }

    /// Puts some notes before what is said about the mesh.
    #[must_use]
    pub fn with_notes(mut self, notes: &[Note]) -> Self {
        self.notes.splice(0..0, notes.iter().cloned());
        self
    }

    /// Returns the notes that say that the model was changed.
    pub fn repairs(&self) -> impl Iterator<Item = &Note> {
        self.notes.iter().filter(|n| note::REPAIRS.contains(&n.code))
    }

    /// Returns whether there is a note with this code.
    #[must_use]
    pub fn has(&self, code: &str) -> bool {
        self.notes.iter().any(|n| n.code == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soup::Facet;

    fn facets_of(mesh: &crate::mesh::Mesh) -> Vec<Facet> {
        let single = |p: nalgebra::Point3<f64>| [p.x as f32, p.y as f32, p.z as f32];
        (0..mesh.triangles.len() as u32).map(|t| mesh.corners(t).map(single)).collect()
    }

    fn cube() -> Vec<Facet> {
        facets_of(&crate::shapes::cube(20.0))
    }

    #[test]
    fn a_sound_cube_has_nothing_to_say() {
        let (solid, health) = solid_from_soup(&Soup { facets: cube() }).unwrap();
        solid.check().unwrap();
        assert_eq!((health.shells, health.triangles, health.facets), (1, 12, 12));
        assert!((health.volume_mm3 - 8000.0).abs() < 1e-9);
        assert_eq!(health.volume_before_mm3, health.volume_mm3);
        assert_eq!(health.notes, []);
    }

    #[test]
    fn every_repair_has_its_note() {
        let mut facets = cube();
        facets.remove(4);
        facets[7].swap(0, 1);
        facets.push(facets[0]);
        facets.push([[1.0, 2.0, 3.0]; 3]);
        let (_, health) = solid_from_soup(&Soup { facets }).unwrap();
        let codes: Vec<&str> = health.notes.iter().map(|n| n.code).collect();
        let expected = [
            note::DEGENERATE_REMOVED,
            note::DUPLICATES_REMOVED,
            note::FACETS_REORIENTED,
            note::HOLES_CLOSED,
        ];
        assert_eq!(codes, expected);
        assert_eq!((health.degenerate, health.duplicate, health.flipped), (1, 1, 1));
        assert_eq!(health.open_edges, 3);
        assert_eq!(health.open_edges_left, 0);
        assert_eq!(health.repairs().count(), 4);
        assert!((health.volume_mm3 - 8000.0).abs() < 1e-9);
        assert!(health.notes.iter().all(|n| n.message.len() < 300 && !n.message.ends_with('.')));
    }

    #[test]
    fn nothing_is_no_solid() {
        let error = solid_from_soup(&Soup::default()).unwrap_err();
        assert_eq!(error.class(), "NoVolume");
        let sheet = Soup { facets: cube()[..2].to_vec() };
        let error = solid_from_soup(&sheet).unwrap_err();
        assert!(matches!(error, MeshError::NoVolume { facets: 2, dropped: 1, .. }));
        assert!(error.hint().is_some());
    }
}
