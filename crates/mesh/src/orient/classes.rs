//! Gathers facets by direction, whichever way they face.
//!
//! 1. Unit normals are folded to one half of the sphere and rounded to cells of the size that the
//!    tolerance spans; facets are sorted by cell.
//! 2. The cells with the most area in themselves and their neighbours are where classes may be;
//!    from each, the mean direction of the facets within the tolerance is followed to where it
//!    rests. Neighbours are looked up on both sides of the fold.
//! 3. Of directions closer than half the tolerance, the one with more area stays.
//!
//! A class may hold its area in a few large facets or in thousands of small noisy ones: the cost
//! is one sort of the facets either way.

use crate::mesh::Mesh;
use nalgebra::Vector3;
use rayon::prelude::*;

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
            (twice.try_normalize(0.0).unwrap_or_default(), twice.norm() / 2.0)
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
    cosine: f64,
    cell_size: f64,
    /// Facets, sorted by cell.
    facets: Vec<u32>,
    /// Cells, ascending, with where their facets begin and end.
    cells: Vec<(Key, std::ops::Range<usize>)>,
}

/// The place of a cell, its three coordinates in one number: a mesh of millions is sorted by it.
type Key = u64;

/// The key of facets without a direction; they come last.
const NOWHERE: Key = Key::MAX;

impl Grid {
    fn new(faces: &Faces, tolerance_rad: f64) -> Self {
        let cell_size = 2.0 * (tolerance_rad / 2.0).sin();
        let normals = faces.normals.par_iter().zip(0_u32..faces.normals.len() as u32);
        let mut keyed: Vec<(Key, u32)> = normals
            .map(|(normal, t)| match *normal == Vector3::zeros() {
                true => (NOWHERE, t),
                false => (key(place(&folded(normal), cell_size)), t),
            })
            .collect();
        keyed.par_sort_unstable();
        keyed.truncate(keyed.partition_point(|(key, _)| *key != NOWHERE));
        let mut cells = Vec::new();
        let mut start = 0;
        for run in keyed.chunk_by(|a, b| a.0 == b.0) {
            cells.push((run[0].0, start..start + run.len()));
            start += run.len();
        }
        let facets = keyed.into_iter().map(|(_, t)| t).collect();
        Self { cosine: tolerance_rad.cos(), cell_size, facets, cells }
    }

    /// Directions near which classes may be, the most promising first.
    fn seeds(&self, faces: &Faces) -> Vec<Vector3<f64>> {
        let area = |cell: &std::ops::Range<usize>| -> f64 {
            self.facets[cell.clone()].iter().map(|t| faces.areas_mm2[*t as usize]).sum()
        };
        let areas: Vec<f64> = self.cells.par_iter().map(|(_, cell)| area(cell)).collect();
        let mut order: Vec<usize> = (0..self.cells.len()).collect();
        order.sort_by(|a, b| areas[*b].total_cmp(&areas[*a]).then(a.cmp(b)));
        order.truncate(MOST_CELLS);
        let mut seeds: Vec<(f64, Vector3<f64>)> = order
            .into_iter()
            .map(|i| {
                let mean = self.mean(faces, self.cells[i].1.clone(), &Vector3::zeros(), -1.0).0;
                let around = self.around(&mean).iter().map(|j| areas[*j]).sum();
                (around, mean)
            })
            .collect();
        seeds.sort_by(|a, b| b.0.total_cmp(&a.0));
        seeds.into_iter().take(MOST_SEEDS).map(|(_, mean)| mean).collect()
    }

    /// Follows the mean direction of the facets around.
    fn refine(&self, faces: &Faces, seed: Vector3<f64>) -> Class {
        let mut direction = seed;
        for _ in 0..REFINEMENTS {
            direction = self.sum(faces, &direction).0;
        }
        Class { direction, area_mm2: self.sum(faces, &direction).1 }
    }

    /// Mean direction and area of the facets within the tolerance of a direction.
    fn sum(&self, faces: &Faces, direction: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let mut sum = Vector3::zeros();
        let mut area = 0.0;
        for i in self.around(direction) {
            let (mean, a) = self.mean(faces, self.cells[i].1.clone(), direction, self.cosine);
            sum += mean;
            area += a;
        }
        (sum.try_normalize(0.0).unwrap_or(*direction), area)
    }

    /// Sum of normal by area, and of area, of the facets of a cell whose normals, folded towards
    /// `direction`, reach `cosine`. Without a direction the cell's own fold is used.
    fn mean(
        &self,
        faces: &Faces,
        cell: std::ops::Range<usize>,
        direction: &Vector3<f64>,
        cosine: f64,
    ) -> (Vector3<f64>, f64) {
        let mut sum = Vector3::zeros();
        let mut area = 0.0;
        for &t in &self.facets[cell] {
            let (normal, a) = (faces.normals[t as usize], faces.areas_mm2[t as usize]);
            let along = normal.dot(direction);
            if along.abs() >= cosine {
                let normal = match along {
                    0.0 => folded(&normal),
                    _ if along < 0.0 => -normal,
                    _ => normal,
                };
                sum += normal * a;
                area += a;
            }
        }
        (sum, area)
    }

    /// The cells around a direction and its opposite, ascending.
    fn around(&self, direction: &Vector3<f64>) -> Vec<usize> {
        let length = direction.norm();
        let mut cells = Vec::with_capacity(54);
        for way in [1.0, -1.0] {
            let centre = place(&(direction * (way / length)), self.cell_size);
            for i in 0..27 {
                let offset = [i / 3 / 3 - 1, i / 3 % 3 - 1, i % 3 - 1];
                let near = key([0, 1, 2].map(|k| centre[k] + offset[k]));
                cells.extend(self.cells.binary_search_by_key(&near, |cell| cell.0));
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }
}

/// The coordinates of the cell of a direction.
fn place(direction: &Vector3<f64>, cell_size: f64) -> [i32; 3] {
    // Tolerances are some ten-thousandths at least; coordinates must fit a third of a key.
    let farthest = f64::from(HALF - 2);
    [0, 1, 2].map(|k| (direction[k] / cell_size).round().clamp(-farthest, farthest) as i32)
}

/// Half the range of a coordinate in a key.
const HALF: i32 = 1 << 20;

/// Keys have the order of the coordinates.
fn key(place: [i32; 3]) -> Key {
    place.into_iter().fold(0, |key, k| key << 21 | u64::from((k + HALF) as u32))
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
