//! Closes holes.
//!
//! A rim that lies in a plane has one obvious filling; a rim inside it that runs the other way
//! round is the inner border of a ring. Such a repair is certain. A rim in space can be filled in
//! many ways: the filling of least area is a guess, and reported as one.
//!
//! When a guess would add nearly as much surface as the shell has, the shell is no solid with a
//! hole but a curved sheet, and is removed. A rim that cannot be filled stays open.

use super::fill::{self, Plane};
use super::loops::{Rim, rims};
use super::{Joined, RepairReport};
use crate::measure;
use crate::mesh::Mesh;
use geom::bounding::{Bounds, BoxTree};
use nalgebra::{Point2, Point3, distance};

/// A rim is flat when it lies within this share of its size from a plane: 2 µm for a hole of
/// 20 mm. Rounding of `f32` coordinates is a thousand times smaller; a step that a printer could
/// show, a hundred times larger.
const FLAT_SHARE: f64 = 1e-4;

/// A guess that adds more than this share of the shell's area makes no solid of it. A hemisphere
/// needs half its area more; a bent sheet, nearly all of it.
const SHEET_SHARE: f64 = 0.8;

/// Normals of one plane agree to this cosine (2.6°): small rims have inexact normals, and the
/// distance of their points from the plane is checked besides.
const SAME_PLANE: f64 = 0.999;

/// How many pairs of flat rims may be compared, so that thousands of rims in one place do not
/// take for ever; beyond that, each is filled alone, which encloses the same volume.
const MOST_PAIRS: usize = 2_000_000;

/// What a rim is.
enum Shape {
    Flat(Plane),
    Crack,
    Space,
}

/// Closes what can be closed; returns whether anything changed.
pub(super) fn close(joined: Joined, near_mm: f64, report: &mut RepairReport) -> (Joined, bool) {
    let mesh = joined.solid.mesh();
    let rims = rims(&joined.solid);
    let mut certain = flat_fillings(mesh, &rims, near_mm);
    let mut open = vec![true; rims.len()];
    certain.iter().flat_map(|filling| &filling.rims).for_each(|rim| open[*rim] = false);
    let mut guesses = guesses(mesh, &rims, &open);
    let mut copies = Copies::of(mesh, &certain, &guesses);
    certain.retain(|filling| {
        let kept = copies.accept(&filling.facets);
        filling.rims.iter().for_each(|rim| open[*rim] = !kept);
        kept
    });
    for guess in &mut guesses {
        *guess = guess.take().filter(|facets| copies.accept(facets));
    }
    let sheets = sheets(&joined, &rims, &guesses);
    if sheets.contains(&true) {
        // What was joined to the sheets looks different without them: the next round sees to it.
        return (joined.without(&sheets, &mut report.dropped), true);
    }
    let mut facets = Vec::new();
    for filling in &certain {
        report.closed.add(area(mesh, &filling.facets), middle(mesh, &rims[filling.rims[0]]));
        facets.extend_from_slice(&filling.facets);
    }
    for (i, filling) in guesses.iter().enumerate() {
        if let Some(filling) = filling {
            report.guessed.add(area(mesh, filling), middle(mesh, &rims[i]));
            facets.extend_from_slice(filling);
        } else if open[i] {
            report.left_open.add(length(mesh, &rims[i]), middle(mesh, &rims[i]));
        }
    }
    if facets.is_empty() {
        return (joined, false);
    }
    (joined.changed(|work| work.add(&facets)), true)
}

fn shape(mesh: &Mesh, rim: &Rim, near_mm: f64) -> Shape {
    let points = fill::positions(mesh, &rim.vertices);
    let flat_mm = near_mm.max(FLAT_SHARE * Bounds::of(&points).diagonal());
    match Plane::through(&points) {
        Some(plane) if plane.farthest(&points) <= flat_mm => Shape::Flat(plane),
        Some(_) => Shape::Space,
        None if is_straight(&points, flat_mm) => Shape::Crack,
        None => Shape::Space,
    }
}

/// Whether points lie on a line, to within `flat_mm`.
fn is_straight(points: &[Point3<f64>], flat_mm: f64) -> bool {
    let Some(first) = points.first() else { return true };
    let far = |from: &Point3<f64>| {
        let by_distance =
            |a: &&Point3<f64>, b: &&Point3<f64>| distance(from, a).total_cmp(&distance(from, b));
        points.iter().max_by(by_distance).copied().unwrap_or(*from)
    };
    let end = far(first);
    let along = far(&end) - end;
    points.iter().all(|p| (p - end).cross(&along).norm() <= flat_mm * along.norm())
}

/// Fills the rims that are still open, by guesses.
fn guesses(mesh: &Mesh, rims: &[Rim], open: &[bool]) -> Vec<Option<Vec<[u32; 3]>>> {
    let mut areas_left = fill::MOST_AREAS;
    let fill = |(rim, open): (&Rim, &bool)| {
        let can_be_filled = *open && rim.vertices.len() >= 3;
        can_be_filled.then(|| fill::in_space(mesh, &rim.vertices, &mut areas_left))?
    };
    rims.iter().zip(open).map(fill).collect()
}

/// Finds fillings that would only repeat facets: a flap or a wall of one facet has a rim too, but
/// nothing to fill.
struct Copies {
    /// The corners of all facets of the fillings, sorted.
    wanted: Vec<[u32; 3]>,
    /// Whether there is such a facet already.
    taken: Vec<bool>,
}

impl Copies {
    fn of(mesh: &Mesh, certain: &[Filling], guesses: &[Option<Vec<[u32; 3]>>]) -> Self {
        let flat = certain.iter().flat_map(|filling| &filling.facets);
        let guessed = guesses.iter().flatten().flatten();
        let mut wanted: Vec<[u32; 3]> = flat.chain(guessed).map(sorted).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let mut on_rim = vec![false; mesh.vertices.len()];
        wanted.iter().flatten().for_each(|v| on_rim[*v as usize] = true);
        let mut copies = Self { taken: vec![false; wanted.len()], wanted };
        for facet in mesh.triangles.iter().filter(|t| t.iter().all(|v| on_rim[*v as usize])) {
            copies.take(facet);
        }
        copies
    }

    /// Marks a facet as taken.
    fn take(&mut self, facet: &[u32; 3]) {
        if let Ok(i) = self.wanted.binary_search(&sorted(facet)) {
            self.taken[i] = true;
        }
    }

    /// Returns whether none of some facets is taken; if so, they are from now on.
    fn accept(&mut self, facets: &[[u32; 3]]) -> bool {
        let is_taken = |t| self.wanted.binary_search(&sorted(t)).is_ok_and(|i| self.taken[i]);
        if facets.iter().any(is_taken) {
            return false;
        }
        facets.iter().for_each(|facet| self.take(facet));
        true
    }
}

fn sorted(facet: &[u32; 3]) -> [u32; 3] {
    let mut corners = *facet;
    corners.sort_unstable();
    corners
}

/// The shells that guesses would nearly double.
fn sheets(joined: &Joined, rims: &[Rim], guesses: &[Option<Vec<[u32; 3]>>]) -> Vec<bool> {
    let shells = joined.solid.shells();
    let mut added = vec![0.0; shells.len()];
    for (rim, filling) in rims.iter().zip(guesses) {
        if let Some(filling) = filling {
            added[rim.shell as usize] += area(joined.solid.mesh(), filling);
        }
    }
    shells.iter().zip(added).map(|(s, added)| added > SHEET_SHARE * s.area_mm2).collect()
}

/// A filling and the rims that it closes.
struct Filling {
    facets: Vec<[u32; 3]>,
    rims: Vec<usize>,
}

/// Fills the flat rims, rings as rings, and the cracks.
fn flat_fillings(mesh: &Mesh, rims: &[Rim], near_mm: f64) -> Vec<Filling> {
    let shapes: Vec<Shape> = rims.iter().map(|rim| shape(mesh, rim, near_mm)).collect();
    let drawn: Vec<Option<Drawn<'_>>> =
        rims.iter().zip(&shapes).map(|(rim, shape)| Drawn::new(mesh, rim, shape)).collect();
    let outer_of = outer_rims(&drawn, near_mm);
    let mut rings: Vec<Vec<usize>> = (0..rims.len()).map(|i| vec![i]).collect();
    for (inner, outer) in outer_of.iter().enumerate() {
        if let Some(outer) = outer {
            rings[*outer].push(inner);
        }
    }
    let mut fillings = Vec::new();
    for (i, ring) in rings.into_iter().enumerate() {
        match &shapes[i] {
            Shape::Crack if rims[i].vertices.len() >= 3 => {
                fillings.push(Filling { facets: fill::crack(&rims[i].vertices), rims: ring });
            }
            Shape::Flat(_) if outer_of[i].is_none() => {
                fillings.extend(fill_ring(mesh, rims, &shapes, ring));
            }
            _ => {}
        }
    }
    fillings
}

/// Fills a flat rim and those inside it: as a ring, or each alone when they touch or cross.
fn fill_ring(mesh: &Mesh, rims: &[Rim], shapes: &[Shape], ring: Vec<usize>) -> Vec<Filling> {
    let fill = |ring: &[usize]| -> Option<Vec<[u32; 3]>> {
        let Shape::Flat(plane) = &shapes[ring[0]] else { return None };
        let borders: Vec<&[u32]> = ring.iter().map(|i| rims[*i].vertices.as_slice()).collect();
        fill::in_plane(mesh, &borders, plane)
    };
    if let Some(facets) = fill(&ring) {
        return vec![Filling { facets, rims: ring }];
    }
    let alone = |i: usize| Some(Filling { facets: fill(&[i])?, rims: vec![i] });
    ring.into_iter().filter_map(alone).collect()
}

/// A flat rim with its points.
struct Drawn<'a> {
    plane: &'a Plane,
    points: Vec<Point3<f64>>,
    /// The points in the plane.
    ring: Vec<Point2<f64>>,
    bounds: Bounds,
}

impl<'a> Drawn<'a> {
    fn new(mesh: &Mesh, rim: &Rim, shape: &'a Shape) -> Option<Self> {
        let Shape::Flat(plane) = shape else { return None };
        let points = fill::positions(mesh, &rim.vertices);
        let ring = points.iter().map(|p| plane.flatten(p)).collect();
        let bounds = Bounds::of(&points);
        Some(Self { plane, points, ring, bounds })
    }

    /// Whether `inner` is the inner border of a ring with this rim outside.
    fn surrounds(&self, inner: &Self, near_mm: f64) -> bool {
        let flat_mm = near_mm.max(FLAT_SHARE * self.bounds.diagonal());
        self.bounds.diagonal() > inner.bounds.diagonal()
            && self.plane.normal.dot(&inner.plane.normal) < -SAME_PLANE
            // One point tells where a rim lies; rims that cross are found when they are filled.
            && self.holds(&self.plane.flatten(&inner.points[0]))
            && self.plane.farthest(&inner.points) <= flat_mm
    }

    /// Whether a point of the plane lies inside, by the even-odd rule.
    fn holds(&self, p: &Point2<f64>) -> bool {
        let mut inside = false;
        for (i, a) in self.ring.iter().enumerate() {
            let b = &self.ring[(i + 1) % self.ring.len()];
            if (a.y > p.y) != (b.y > p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                inside ^= p.x < x;
            }
        }
        inside
    }
}

/// For each flat rim, the smallest rim around it that runs the other way.
fn outer_rims(drawn: &[Option<Drawn<'_>>], near_mm: f64) -> Vec<Option<usize>> {
    let mut outer_of = vec![None; drawn.len()];
    let flat: Vec<usize> = (0..drawn.len()).filter(|i| drawn[*i].is_some()).collect();
    if flat.len() < 2 {
        return outer_of;
    }
    let known = |i: usize| drawn[i].as_ref().expect("flat rims are drawn");
    let tree = BoxTree::new(flat.iter().map(|i| known(*i).bounds).collect());
    let mut n_pairs = 0;
    for &i in &flat {
        let near = tree.meeting(&known(i).bounds);
        n_pairs += near.len();
        if n_pairs > MOST_PAIRS {
            break;
        }
        let around = near
            .into_iter()
            .map(|k| flat[k as usize])
            .filter(|j| *j != i && known(*j).surrounds(known(i), near_mm));
        let by_size = |a: &usize, b: &usize| {
            known(*a).bounds.diagonal().total_cmp(&known(*b).bounds.diagonal())
        };
        outer_of[i] = around.min_by(by_size);
    }
    // A rim cannot be the inner border of one ring and the outer of another.
    for i in 0..drawn.len() {
        if outer_of[i].is_some_and(|outer: usize| outer_of[outer].is_some()) {
            outer_of[i] = None;
        }
    }
    outer_of
}

fn area(mesh: &Mesh, facets: &[[u32; 3]]) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    facets.iter().map(|t| measure::area_of(&corners(t))).sum()
}

fn middle(mesh: &Mesh, rim: &Rim) -> Point3<f64> {
    let bounds = Bounds::of(&fill::positions(mesh, &rim.vertices));
    nalgebra::center(&bounds.min, &bounds.max)
}

fn length(mesh: &Mesh, rim: &Rim) -> f64 {
    let points = fill::positions(mesh, &rim.vertices);
    (0..points.len()).map(|i| distance(&points[i], &points[(i + 1) % points.len()])).sum()
}
