//! Turns a welded mesh into one that encloses something, and says what was done.
//!
//! In this order, each step only where the mesh needs it:
//!
//! 1. facets with two equal corners go, and facets that occur twice (`facets`);
//! 2. facets are split where a vertex lies on an open side of theirs (`tjunction`);
//! 3. facets that share a side are made to agree which way is out (`winding`);
//! 4. surfaces that cannot enclose anything go (`sheets`);
//! 5. holes are closed: flat ones for certain, others as a guess (`holes`);
//! 6. every shell is turned outwards, cavities stay cavities (`winding`).
//!
//! The steps run again until nothing changes, so a second repair finds nothing to do (for tangles
//! without end, see `MOST_ROUNDS`). Numbers are mm in the frame of the mesh. A closed, well-wound
//! mesh passes unchanged.

pub(crate) mod facets;
mod fill;
mod holes;
mod loops;
mod sheets;
mod tjunction;
mod winding;

use crate::measure;
use crate::mesh::Mesh;
use crate::note::Tally;
use crate::topology::{Edges, Solid};
use crate::weld::near_mm;

/// After this many rounds a repair ends even if it would find more to do. Real models need two.
/// Of 500 000 tangles of up to 150 random facets between a few points all ended by then; 9 in
/// 200 000 took more than six, because facets that closed a hole were copies elsewhere.
const MOST_ROUNDS: usize = 10;

/// What a repair did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RepairReport {
    /// Facets with two equal corners that were removed; lengths, mm.
    pub degenerate: Tally,
    /// Facets that were removed because they occur more than once; areas, mm².
    pub duplicate: Tally,
    /// Edges that more than two facets share once duplicates are gone; lengths, mm.
    pub nonmanifold_edges: Tally,
    /// Vertices at which a facet was split; their distances from its side, mm.
    pub t_junctions: Tally,
    /// Facets that were turned over; areas, mm².
    pub flipped: Tally,
    /// Flat holes that were closed; areas, mm².
    pub closed: Tally,
    /// Other holes that were closed in one of several ways; areas, mm².
    pub guessed: Tally,
    /// Holes that were left open; lengths of their rims, mm.
    pub left_open: Tally,
    /// Surfaces without an inside that were removed; areas, mm².
    pub dropped: Tally,
}

impl RepairReport {
    /// Returns whether the mesh was changed.
    #[must_use]
    pub fn has_changes(&self) -> bool {
        let facets = [&self.degenerate, &self.duplicate, &self.t_junctions, &self.flipped];
        let shells = [&self.closed, &self.guessed, &self.dropped];
        facets.into_iter().chain(shells).any(|tally| tally.count > 0)
    }

    /// Returns whether the shape is partly a guess.
    #[must_use]
    pub fn is_guess(&self) -> bool {
        self.guessed.count > 0
    }
}

/// Repairs a mesh.
///
/// # Panics
///
/// When a triangle names a vertex that does not exist.
#[must_use]
pub fn repair(mut mesh: Mesh) -> (Mesh, RepairReport) {
    let degenerate = facets::drop_degenerate(&mut mesh);
    let edges = Edges::of(&mesh);
    let (solid, mut report) = mended(mesh, edges);
    report.degenerate.merge(&degenerate);
    (solid.into_mesh(), report)
}

/// Which way a facet runs, compared with the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Winding {
    /// As in the file.
    Given,
    /// Turned over.
    Turned,
    /// The file says nothing, or both: facets that close a hole or come from a double skin.
    Free,
}

/// A mesh under repair.
struct Work {
    mesh: Mesh,
    /// One for each triangle.
    windings: Vec<Winding>,
}

impl Work {
    fn new(mesh: Mesh) -> Self {
        let windings = vec![Winding::Given; mesh.triangles.len()];
        Self { mesh, windings }
    }

    /// Removes the facets that are not to be kept.
    fn retain(&mut self, keep: &[bool]) {
        let mut kept = keep.iter();
        self.mesh.triangles.retain(|_| *kept.next().expect("one for each facet"));
        let mut kept = keep.iter();
        self.windings.retain(|_| *kept.next().expect("one for each facet"));
    }

    /// Adds facets that the file does not have.
    fn add(&mut self, facets: &[[u32; 3]]) {
        self.mesh.triangles.extend_from_slice(facets);
        self.windings.resize(self.mesh.triangles.len(), Winding::Free);
    }

    /// Turns a facet over.
    fn turn(&mut self, triangle: usize) {
        self.mesh.triangles[triangle].swap(1, 2);
        self.windings[triangle] = match self.windings[triangle] {
            Winding::Given => Winding::Turned,
            Winding::Turned => Winding::Given,
            Winding::Free => Winding::Free,
        };
    }
}

/// A mesh under repair whose sides are known.
struct Joined {
    solid: Solid,
    windings: Vec<Winding>,
}

impl Joined {
    fn new(work: Work) -> Self {
        Self { solid: Solid::new(work.mesh), windings: work.windings }
    }

    fn into_work(self) -> Work {
        Work { mesh: self.solid.into_mesh(), windings: self.windings }
    }

    /// The facets that were turned over, by area.
    fn turned(&self) -> Tally {
        let mut tally = Tally::default();
        for (t, _) in (0..).zip(&self.windings).filter(|(_, w)| **w == Winding::Turned) {
            let corners = self.solid.mesh().corners(t);
            tally.add(measure::area_of(&corners), corners[0]);
        }
        tally
    }

    /// Returns the solid without vertices that no facet uses.
    fn finished(self) -> Solid {
        if !self.solid.mesh().has_unused_vertices() {
            return self.solid;
        }
        let mut mesh = self.solid.into_mesh();
        mesh.drop_unused_vertices();
        Solid::new(mesh)
    }

    /// Changes the mesh and finds its sides again.
    fn changed(self, change: impl FnOnce(&mut Work)) -> Self {
        let mut work = self.into_work();
        change(&mut work);
        Self::new(work)
    }

    /// Removes the shells for which `empty` is set, counting them.
    fn without(self, empty: &[bool], dropped: &mut Tally) -> Self {
        for (shell, _) in self.solid.shells().iter().zip(empty).filter(|(_, empty)| **empty) {
            let centre = nalgebra::center(&shell.bounds.min, &shell.bounds.max);
            dropped.add(shell.area_mm2, centre);
        }
        let keep: Vec<bool> =
            self.solid.shell_of().iter().map(|shell| !empty[*shell as usize]).collect();
        self.changed(|work| work.retain(&keep))
    }
}

/// Repairs a mesh without degenerate facets, whose edges are known, and finds its sides.
pub(crate) fn mended(mesh: Mesh, edges: Edges) -> (Solid, RepairReport) {
    let mut work = Work::new(mesh);
    let mut edges = edges;
    let mut report = RepairReport::default();
    let mut round = 0;
    loop {
        round += 1;
        // From what is left, as a second repair would have it.
        let near_mm = near_mm(&work.mesh.bounds());
        let facets_changed = mend_facets(&mut work, &mut edges, near_mm, &mut report);
        if round == 1 {
            report.nonmanifold_edges = edges.crowded(&work.mesh);
        }
        let solid = Solid::from_edges(work.mesh, edges);
        let joined = Joined { solid, windings: work.windings };
        let (joined, shells_changed) = mend_shells(joined, near_mm, &mut report);
        if !(facets_changed || shells_changed) || round == MOST_ROUNDS {
            report.flipped = joined.turned();
            return (joined.finished(), report);
        }
        work = joined.into_work();
        work.mesh.drop_unused_vertices();
        edges = Edges::of(&work.mesh);
    }
}

/// Steps 1 to 3, facet by facet; returns whether anything changed.
fn mend_facets(
    work: &mut Work,
    edges: &mut Edges,
    near_mm: f64,
    report: &mut RepairReport,
) -> bool {
    let mut changed = false;
    if edges.n_twisted() > 0 || !edges.crowds().is_empty() {
        let duplicate = facets::drop_duplicates(work, edges);
        if duplicate.count > 0 {
            report.duplicate.merge(&duplicate);
            *edges = Edges::of(&work.mesh);
            changed = true;
        }
    }
    if edges.n_open() > 0 {
        let split = tjunction::split(work, edges, near_mm);
        if split.count > 0 {
            report.t_junctions.merge(&split);
            *edges = Edges::of(&work.mesh);
            changed = true;
        }
    }
    if edges.n_twisted() > 0 && winding::agree(work, edges) {
        *edges = Edges::of(&work.mesh);
        changed = true;
    }
    changed
}

/// Steps 4 to 6, shell by shell; returns whether anything changed.
fn mend_shells(joined: Joined, near_mm: f64, report: &mut RepairReport) -> (Joined, bool) {
    let mut joined = joined;
    let mut changed = [false; 4];
    report.left_open = Tally::default();
    if joined.solid.open_sides() > 0 {
        (joined, changed[0]) = sheets::drop_flat(joined, near_mm, &mut report.dropped);
        (joined, changed[1]) = holes::close(joined, near_mm, report);
    }
    (joined, changed[2]) = sheets::drop_empty(joined, &mut report.dropped);
    (joined, changed[3]) = winding::turn_outwards(joined);
    (joined, changed.contains(&true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn without(mesh: &Mesh, facets: std::ops::Range<usize>) -> Mesh {
        let mut mesh = mesh.clone();
        mesh.triangles.drain(facets);
        mesh
    }

    fn inside_out(mesh: &Mesh) -> Mesh {
        let mut mesh = mesh.clone();
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh
    }

    /// Repairs and checks what holds for every repair.
    fn repaired(mesh: Mesh) -> (f64, RepairReport) {
        let edges = Edges::of(&mesh);
        let (solid, report) = mended(mesh, edges);
        solid.check().unwrap();
        let mesh = solid.into_mesh();
        let (again, second) = repair(mesh.clone());
        assert!(!second.has_changes(), "{second:?}");
        assert_eq!(again, mesh);
        (measure::volume_mm3(&mesh), report)
    }

    #[test]
    fn sound_shapes_pass_unchanged() {
        for name in shapes::NAMES {
            let mesh = shapes::by_name(name).unwrap();
            let (same, report) = repair(mesh.clone());
            assert!(!report.has_changes(), "{name}");
            assert_eq!(same, mesh, "{name}");
        }
    }

    #[test]
    fn flat_holes_close_for_certain() {
        let cube = shapes::cube(20.0);
        for (facets, area) in [(4..5, 200.0), (2..4, 400.0), (4..6, 400.0)] {
            let (volume, report) = repaired(without(&cube, facets));
            assert!((volume - 8000.0).abs() < 1e-9);
            assert!(!report.is_guess());
            assert_eq!(report.closed.count, 1);
            assert!((report.closed.total - area).abs() < 1e-9);
        }
    }

    #[test]
    fn two_missing_sides_are_a_guess() {
        let (volume, report) = repaired(without(&shapes::cube(20.0), 4..8));
        assert!(report.is_guess());
        assert!(volume > 3999.0 && volume < 8001.0);
    }

    #[test]
    fn a_tube_without_its_top_gets_a_ring() {
        let outline = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
        let hole = vec![[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]];
        let mut tube = shapes::extruded(&outline, &[hole], 10.0);
        let top = |t: &[u32; 3]| t.iter().all(|v| tube.vertices[*v as usize].z == 10.0);
        let keep: Vec<bool> = tube.triangles.iter().map(|t| !top(t)).collect();
        let mut kept = keep.iter();
        tube.triangles.retain(|_| *kept.next().unwrap());
        let (volume, report) = repaired(tube);
        assert!((volume - 2240.0).abs() < 1e-9);
        assert!((report.closed.total - 224.0).abs() < 1e-9);
        assert!(!report.is_guess());
    }

    #[test]
    fn windings_are_mended_and_counted() {
        let cube = shapes::cube(20.0);
        let (volume, report) = repaired(inside_out(&cube));
        assert!((volume - 8000.0).abs() < 1e-9);
        assert_eq!(report.flipped.count, 12);
        let mut half = cube;
        half.triangles.iter_mut().step_by(2).for_each(|t| t.swap(1, 2));
        let (volume, report) = repaired(half);
        assert!((volume - 8000.0).abs() < 1e-9);
        assert_eq!(report.flipped.count, 6);
    }

    #[test]
    fn cavities_stay_and_files_turned_inside_out_turn_back() {
        let inner = |mesh: &Mesh, shift: f64| {
            mesh.transformed(&nalgebra::Isometry3::translation(0.0, 0.0, shift))
        };
        let both = |a: &Mesh, b: &Mesh| {
            let n = a.vertices.len() as u32;
            let mut sum = a.clone();
            sum.vertices.extend(&b.vertices);
            sum.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
            sum
        };
        let (big, small) = (shapes::cube(20.0), inner(&shapes::cube(10.0), 5.0));
        let hollow = both(&big, &inside_out(&small));
        let (volume, report) = repaired(hollow.clone());
        assert_eq!((volume.round(), report), (7000.0, RepairReport::default()));
        let (volume, report) = repaired(inside_out(&hollow));
        assert_eq!((volume.round(), report.flipped.count), (7000.0, 24));
        let doubled = both(&big, &small);
        let (volume, report) = repaired(doubled);
        assert_eq!((volume.round(), report), (9000.0, RepairReport::default()));
        let beside = both(&big, &inner(&inside_out(&small), 50.0));
        let (volume, report) = repaired(beside);
        assert_eq!((volume.round(), report.flipped.count), (9000.0, 12));
    }

    #[test]
    fn what_encloses_nothing_goes() {
        let mut sheet = shapes::cube(20.0);
        sheet.triangles.truncate(2);
        let (_, report) = repaired(sheet);
        assert_eq!((report.dropped.count, report.dropped.total), (1, 400.0));
        assert_eq!(repair(Mesh::default()).0, Mesh::default());
    }
}
