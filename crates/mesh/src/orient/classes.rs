//! Gathers facets by direction, whichever way they face.
//!
//! 1. Unit normals are folded to one half of the sphere and rounded to cells of the size that the
//!    tolerance spans; facets are brought together by cell, in a few counting passes.
//! 2. The cells with the most area in themselves and their neighbours are where classes may be;
//!    from each, the mean direction of the facets within the tolerance is followed to where it
//!    rests. Neighbours are looked up on both sides of the fold.
//! 3. Of directions closer than half the tolerance, the one with more area stays.
//!
//! A class may hold its area in a few large facets or in thousands of small noisy ones: the cost
//! is the same few passes over the facets either way. A cell that lies within the tolerance of a
//! direction as a whole, or beyond it, is added or left out as a whole, so that a flat face of a
//! million facets is not walked once for each direction near it.

use crate::mesh::Mesh;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::OnceLock;

/// Cells whose surroundings are measured: those with the most area of their own. A class with a
/// twentieth of the area spreads over a dozen cells, so one of them is among the first 250.
const MOST_CELLS: usize = 512;

/// Cells from which a direction is refined.
const MOST_SEEDS: usize = 64;

/// Steps of the mean direction; it moves by a tenth of the tolerance at most after two.
const REFINEMENTS: usize = 4;

/// Normals and areas of the facets of a mesh.
pub(super) struct Faces {
    /// Outward normals of length 1; zero where a facet has no area.
    pub(super) normals: Vec<Vector3<f64>>,
    pub(super) areas_mm2: Vec<f64>,
    pub(super) total_mm2: f64,
    /// Diagonal of the box around the mesh, mm.
    pub(super) diagonal: f64,
}

impl Faces {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let n = mesh.triangles.len() as u32;
        let (mut normals, mut areas_mm2) = (Vec::new(), Vec::new());
        let facets = (0..n).into_par_iter().map(|t| {
            let twice = mesh.area_vector(t);
            let length = twice.norm();
            (if length > 0.0 { twice / length } else { Vector3::zeros() }, length / 2.0)
        });
        facets.unzip_into_vecs(&mut normals, &mut areas_mm2);
        let total_mm2 = areas_mm2.iter().sum();
        Self { normals, areas_mm2, total_mm2, diagonal: mesh.bounds().diagonal() }
    }
}

/// Facets that share a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Class {
    /// The direction, of length 1; its sign means nothing.
    pub(super) direction: Vector3<f64>,
    /// The area of the facets that face it or its opposite, mm².
    pub(super) area_mm2: f64,
}

/// Returns the classes, the largest first.
pub(super) fn classes(faces: &Faces, tolerance_rad: f64) -> Vec<Class> {
    let grid = Grid::new(faces, tolerance_rad);
    let mut found: Vec<Class> =
        grid.seeds(faces).into_par_iter().map(|seed| grid.refine(faces, seed)).collect();
    found.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2));
    let same = (tolerance_rad / 2.0).cos();
    let mut classes: Vec<Class> = Vec::new();
    for class in found {
        if classes.iter().all(|c| c.direction.dot(&class.direction).abs() < same) {
            classes.push(class);
        }
    }
    classes
}

/// The facets by the cell of their direction.
struct Grid {
    tolerance: Reach,
    cell_size: f64,
    /// Facets, sorted by cell, ascending within a cell.
    facets: Vec<u32>,
    /// Cells, ascending.
    cells: Vec<Cell>,
}

/// How far directions may be apart.
#[derive(Clone, Copy)]
struct Reach {
    cosine: f64,
    /// The distance between the ends of two unit vectors that are so far apart.
    chord: f64,
}

/// Facets whose directions are near each other.
struct Cell {
    key: Key,
    /// Where they are in [`Grid::facets`].
    facets: Range<usize>,
    /// Asked of a cell when a direction comes near it.
    whole: OnceLock<Whole>,
}

/// All facets of a cell together, folded as the cell is.
#[derive(Clone, Copy)]
struct Whole {
    /// Sum of normal by area, and of area.
    sum: Vector3<f64>,
    area: f64,
    /// The direction of the sum, and the distance of the farthest normal from it.
    middle: Vector3<f64>,
    spread: f64,
}

/// The place of a cell, its three coordinates in one number.
type Key = u32;

/// Cells are no smaller than this share of the unit sphere's radius: so many have numbers of 32
/// bits. Tolerances below 0.08° are served by larger cells.
const LEAST_CELL: f64 = 1.0 / 700.0;

/// Distances of directions that differ by less may be rounding.
const SAME_CHORD: f64 = 1e-9;

impl Grid {
    fn new(faces: &Faces, tolerance_rad: f64) -> Self {
        let chord = 2.0 * (tolerance_rad / 2.0).sin();
        let cell_size = chord.max(LEAST_CELL);
        let lattice = Lattice::of(cell_size);
        let normals = faces.normals.par_iter().zip(0_u32..faces.normals.len() as u32);
        let keyed = normals
            .filter(|(normal, _)| **normal != Vector3::zeros())
            .map(|(normal, t)| pack(lattice.key(place(&folded(normal), cell_size)), t))
            .collect();
        let keyed = sorted(keyed, lattice);
        let mut cells = Vec::new();
        let mut start = 0;
        for run in keyed.chunk_by(|a, b| a >> 32 == b >> 32) {
            let facets = start..start + run.len();
            start = facets.end;
            cells.push(Cell { key: (run[0] >> 32) as Key, facets, whole: OnceLock::new() });
        }
        let facets = keyed.into_iter().map(|entry| entry as u32).collect();
        Self { tolerance: Reach { cosine: tolerance_rad.cos(), chord }, cell_size, facets, cells }
    }

    /// Directions near which classes may be, the most promising first.
    fn seeds(&self, faces: &Faces) -> Vec<Vector3<f64>> {
        let area = |cell: &Cell| -> f64 {
            self.facets[cell.facets.clone()].iter().map(|t| faces.areas_mm2[*t as usize]).sum()
        };
        let areas: Vec<f64> = self.cells.par_iter().map(area).collect();
        let mut order: Vec<usize> = (0..self.cells.len()).collect();
        order.sort_by(|a, b| areas[*b].total_cmp(&areas[*a]).then(a.cmp(b)));
        order.truncate(MOST_CELLS);
        let mut seeds: Vec<(f64, Vector3<f64>)> = order
            .into_par_iter()
            .map(|i| {
                let mean = self.whole(faces, &self.cells[i]).sum;
                let around = self.around(&mean).iter().map(|j| areas[*j]).sum();
                (around, mean)
            })
            .collect();
        seeds.sort_by(|a, b| b.0.total_cmp(&a.0));
        seeds.into_iter().take(MOST_SEEDS).map(|(_, mean)| mean).collect()
    }

    /// Follows the mean direction of the facets around.
    fn refine(&self, faces: &Faces, seed: Vector3<f64>) -> Class {
        let mut direction = seed.try_normalize(0.0).unwrap_or(seed);
        for _ in 0..REFINEMENTS {
            let (mean, area_mm2) = self.sum(faces, &direction);
            if mean == direction {
                return Class { direction, area_mm2 };
            }
            direction = mean;
        }
        Class { direction, area_mm2: self.sum(faces, &direction).1 }
    }

    /// Mean direction and area of the facets within the tolerance of a direction of length 1.
    fn sum(&self, faces: &Faces, direction: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let mut sum = Vector3::zeros();
        let mut area = 0.0;
        for i in self.around(direction) {
            let (mean, a) = self.near(faces, &self.cells[i], direction);
            sum += mean;
            area += a;
        }
        (sum.try_normalize(0.0).unwrap_or(*direction), area)
    }

    /// Sum of normal by area, and of area, of the facets of a cell within the tolerance of a
    /// direction or its opposite, folded towards it.
    fn near(&self, faces: &Faces, cell: &Cell, direction: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let whole = self.whole(faces, cell);
        let way = if whole.middle.dot(direction) < 0.0 { -1.0 } else { 1.0 };
        let apart = (whole.middle * way - direction).norm();
        if apart + whole.spread < self.tolerance.chord - SAME_CHORD {
            return (whole.sum * way, whole.area);
        }
        if apart - whole.spread > self.tolerance.chord + SAME_CHORD {
            return (Vector3::zeros(), 0.0);
        }
        let mut sum = Vector3::zeros();
        let mut area = 0.0;
        for &t in &self.facets[cell.facets.clone()] {
            let (normal, a) = (faces.normals[t as usize], faces.areas_mm2[t as usize]);
            let along = normal.dot(direction);
            if along.abs() >= self.tolerance.cosine {
                sum += normal * a.copysign(along);
                area += a;
            }
        }
        (sum, area)
    }

    fn whole(&self, faces: &Faces, cell: &Cell) -> Whole {
        *cell.whole.get_or_init(|| {
            let facets = &self.facets[cell.facets.clone()];
            let normal = |t: &u32| folded(&faces.normals[*t as usize]);
            let mut sum = Vector3::zeros();
            let mut area = 0.0;
            for t in facets {
                let a = faces.areas_mm2[*t as usize];
                sum += normal(t) * a;
                area += a;
            }
            let middle = sum.try_normalize(0.0).unwrap_or_default();
            let apart = |t: &u32| (normal(t) - middle).norm_squared();
            let spread = facets.iter().map(apart).fold(0.0, f64::max).sqrt();
            Whole { sum, area, middle, spread }
        })
    }

    /// The cells around a direction and its opposite, ascending.
    fn around(&self, direction: &Vector3<f64>) -> Vec<usize> {
        let lattice = Lattice::of(self.cell_size);
        let length = direction.norm();
        let mut cells = Vec::with_capacity(54);
        for way in [1.0, -1.0] {
            let centre = place(&(direction * (way / length)), self.cell_size);
            for i in 0..27 {
                let offset = [i / 3 / 3 - 1, i / 3 % 3 - 1, i % 3 - 1];
                let near = lattice.key([0, 1, 2].map(|k| centre[k] + offset[k]));
                cells.extend(self.cells.binary_search_by_key(&near, |cell| cell.key));
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }
}

/// The coordinates of the cell of a direction.
fn place(direction: &Vector3<f64>, cell_size: f64) -> [i32; 3] {
    [0, 1, 2].map(|k| (direction[k] / cell_size).round() as i32)
}

/// The coordinates that cells have: from `-half` to `half`, with one to spare for neighbours.
#[derive(Clone, Copy)]
struct Lattice {
    half: i32,
}

impl Lattice {
    fn of(cell_size: f64) -> Self {
        Self { half: (1.0 / cell_size).round() as i32 + 1 }
    }

    fn count(self) -> u32 {
        2 * self.half as u32 + 1
    }

    /// Keys have the order of the coordinates.
    fn key(self, place: [i32; 3]) -> Key {
        place.into_iter().fold(0, |key, k| key * self.count() + (k + self.half) as u32)
    }
}

/// A key and a facet in one number.
fn pack(key: Key, facet: u32) -> u64 {
    u64::from(key) << 32 | u64::from(facet)
}

/// Sorts by key; facets of one key keep their order. A counting sort for each coordinate, the last
/// first (D. Knuth, TAOCP vol. 3, section 5.2.5).
fn sorted(entries: Vec<u64>, lattice: Lattice) -> Vec<u64> {
    let mut entries = entries;
    let mut other = vec![0; entries.len()];
    let n = lattice.count();
    for unit in [1, n, n * n] {
        let coordinate = |entry: u64| ((entry >> 32) as Key / unit % n) as usize;
        let mut next = vec![0_usize; n as usize];
        for &entry in &entries {
            next[coordinate(entry)] += 1;
        }
        let mut start = 0;
        for slot in &mut next {
            start += std::mem::replace(slot, start);
        }
        for &entry in &entries {
            let slot = &mut next[coordinate(entry)];
            other[*slot] = entry;
            *slot += 1;
        }
        std::mem::swap(&mut entries, &mut other);
    }
    entries
}

/// The one of a direction and its opposite with z > 0, or y > 0, or x > 0.
fn folded(n: &Vector3<f64>) -> Vector3<f64> {
    let first = [n.z, n.y, n.x].into_iter().find(|c| *c != 0.0);
    if first.is_some_and(|c| c < 0.0) { -n } else { *n }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn classes_of_a_box() {
        let faces = Faces::of(&shapes::block(10.0, 20.0, 30.0));
        let found = classes(&faces, 1_f64.to_radians());
        let areas: Vec<f64> = found.iter().map(|c| c.area_mm2.round()).collect();
        assert_eq!(areas, [1200.0, 600.0, 400.0]);
        assert_eq!(found[0].direction.x.abs(), 1.0);
        assert_eq!(faces.total_mm2, 2200.0);
    }

    #[test]
    fn directions_on_the_fold_are_one_class() {
        // Walls whose normals lie on both sides of the horizon, and face both ways.
        let mut mesh = Mesh::default();
        for (i, tilt) in [-0.004, -0.002, 0.002, 0.004].into_iter().enumerate() {
            let x = i as f64 * 5.0;
            let start = mesh.vertices.len() as u32;
            let points = [[x, 0.0, 0.0], [x, 9.0, 0.0], [x + 9.0 * tilt, 0.0, 9.0]];
            mesh.vertices.extend(points.map(nalgebra::Point3::from));
            let [a, b, c] = [start, start + 1, start + 2];
            mesh.triangles.push(if i % 2 == 0 { [a, b, c] } else { [a, c, b] });
        }
        let found = classes(&Faces::of(&mesh), 1_f64.to_radians());
        assert_eq!(found.len(), 1);
        assert!((found[0].area_mm2 - 162.0).abs() < 0.01);
        assert!(found[0].direction.z.abs() < 1e-9);
    }

    #[test]
    fn no_facets_no_classes() {
        assert!(classes(&Faces::of(&Mesh::default()), 0.02).is_empty());
    }
}
