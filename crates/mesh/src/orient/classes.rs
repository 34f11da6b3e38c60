//! Gathers facets by direction, whichever way they face.
//!
//! 1. Facets are counted in cells of directions, in one pass: a cell knows the sum of its area
//!    vectors and how far its normals are apart. Cells are a lattice on each of three sides of a
//!    cube, by the axis that a normal has most of; a normal and its opposite are in one cell.
//! 2. The cells with the most area in themselves and their neighbours are where classes may be;
//!    from each, the mean direction of the facets within the tolerance is followed to where it
//!    rests. Neighbours are looked up on all sides of the cube.
//! 3. Of directions closer than half the tolerance, the one with more area stays.
//!
//! A class may hold its area in a few large facets or in thousands of small noisy ones: the cost
//! is the same pass over the facets either way. A cell that lies within the tolerance of a
//! direction as a whole, or beyond it, is added or left out as a whole; only the facets of cells
//! that such a border runs through are looked at one by one, and flat sides have no such cells.

use crate::mesh::Mesh;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Cells whose surroundings are measured: those with the most area of their own. A class with a
/// twentieth of the area spreads over a dozen cells, so one of them is among the first 250.
const MOST_CELLS: usize = 512;

/// Cells from which a direction is refined.
const MOST_SEEDS: usize = 64;

/// The cell of a class that has most of its area, with its neighbours, has at least this share.
const LEAST_SEED: f64 = 1.0 / 16.0;

/// Steps of the mean direction; it moves by a tenth of the tolerance at most after two.
const REFINEMENTS: usize = 4;

/// Facets of one piece of work: enough that its cells are few beside them. Pieces are added up in
/// their order: sums do not depend on the number of threads.
const PIECE: usize = 1 << 19;

/// Facets that share a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Class {
    /// The direction, of length 1; its sign means nothing.
    pub(super) direction: Vector3<f64>,
    /// The area of the facets that face it or its opposite, mm².
    pub(super) area_mm2: f64,
}

/// The classes of a mesh.
#[derive(Debug)]
pub(super) struct Classes {
    /// The largest first.
    pub(super) classes: Vec<Class>,
    /// The area of the surface, mm².
    pub(super) total_mm2: f64,
}

/// Returns the largest class, and at least all with `least_share` of the area.
pub(super) fn classes(mesh: &Mesh, tolerance_rad: f64, least_share: f64) -> Classes {
    let mut grid = Grid::of(mesh, tolerance_rad);
    let total_mm2 = grid.cells.iter().map(|cell| cell.area).sum::<f64>();
    let seeds = grid.seeds(LEAST_SEED * least_share * total_mm2);
    let mut found = grid.refined(seeds);
    found.sort_by(|a, b| b.area_mm2.total_cmp(&a.area_mm2));
    let same = (tolerance_rad / 2.0).cos();
    let mut classes: Vec<Class> = Vec::new();
    for class in found {
        if classes.iter().all(|c| c.direction.dot(&class.direction).abs() < same) {
            classes.push(class);
        }
    }
    Classes { classes, total_mm2 }
}

/// The facets by the cell of their direction.
struct Grid<'a> {
    mesh: &'a Mesh,
    tolerance: Reach,
    lattice: Lattice,
    /// The cell of each facet; [`NO_KEY`] where a facet has no area.
    keys: Vec<Key>,
    /// Cells with facets, ascending.
    cells: Vec<Cell>,
    /// For each place of the lattice, where in `cells` it is, plus one; 0 for none.
    slots: Vec<u32>,
}

/// How far directions may be apart.
#[derive(Clone, Copy)]
struct Reach {
    cosine: f64,
    /// The distance between the ends of two unit vectors that are so far apart.
    chord: f64,
}

/// Facets whose directions are near each other, folded to the side that the cell is on.
#[derive(Clone)]
struct Cell {
    key: Key,
    /// Sum of normal by area, and of area, mm².
    sum: Vector3<f64>,
    area: f64,
    /// The box around the normals.
    least: Vector3<f64>,
    most: Vector3<f64>,
    /// The facets, once a border has run through the cell.
    facets: Option<Vec<Facing>>,
}

/// Normal by area, folded, and area of a facet, mm².
#[derive(Clone, Copy)]
struct Facing {
    sum: Vector3<f64>,
    area: f64,
}

/// Where a cell lies with regard to the facets within the tolerance of a direction.
enum Side {
    /// All of it belongs to them, turned this way.
    In(f64),
    Out,
    Border,
}

/// Distances of directions that differ by less may be rounding.
const SAME_CHORD: f64 = 1e-9;

/// As `min` of numbers that are none of them NaN, in one instruction.
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

impl Cell {
    fn new(key: Key) -> Self {
        let (least, most) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        Self { key, sum: Vector3::zeros(), area: 0.0, least, most, facets: None }
    }

    fn add(&mut self, facing: &Facing, normal: &Vector3<f64>) {
        self.sum += facing.sum;
        self.area += facing.area;
        self.least = self.least.zip_map(normal, lesser);
        self.most = self.most.zip_map(normal, |a, b| -lesser(-a, -b));
    }

    fn merge(&mut self, other: &Self) {
        self.sum += other.sum;
        self.area += other.area;
        self.least = self.least.inf(&other.least);
        self.most = self.most.sup(&other.most);
    }

    fn side(&self, direction: &Vector3<f64>, chord: f64) -> Side {
        let middle = self.sum / self.area;
        let way = if middle.dot(direction) < 0.0 { -1.0 } else { 1.0 };
        let apart = (middle * way - direction).norm();
        // To the farthest corner of the box.
        let spread = (self.most - middle).sup(&(middle - self.least)).norm();
        if apart + spread < chord - SAME_CHORD {
            Side::In(way)
        } else if apart - spread > chord + SAME_CHORD {
            Side::Out
        } else {
            Side::Border
        }
    }

    /// The sum over the facets within the tolerance of a direction, folded towards it.
    fn near(&self, direction: &Vector3<f64>, tolerance: Reach) -> Facing {
        let mut near = Facing { sum: Vector3::zeros(), area: 0.0 };
        match self.side(direction, tolerance.chord) {
            Side::In(way) => near = Facing { sum: self.sum * way, area: self.area },
            Side::Out => {}
            Side::Border => {
                for facing in self.facets.iter().flatten() {
                    let along = facing.sum.dot(direction);
                    if along.abs() >= tolerance.cosine * facing.area {
                        near.sum += facing.sum * 1_f64.copysign(along);
                        near.area += facing.area;
                    }
                }
            }
        }
        near
    }
}

impl<'a> Grid<'a> {
    fn of(mesh: &'a Mesh, tolerance_rad: f64) -> Self {
        let chord = 2.0 * (tolerance_rad / 2.0).sin();
        let lattice = Lattice::of(chord.max(LEAST_CELL));
        let mut keys = vec![NO_KEY; mesh.triangles.len()];
        let pieces = mesh.triangles.par_chunks(PIECE).zip(keys.par_chunks_mut(PIECE));
        let pieces: Vec<Vec<Cell>> =
            pieces.map(|(triangles, keys)| counted(mesh, triangles, keys, lattice)).collect();
        let mut slots = vec![0; lattice.len()];
        let mut cells = Vec::new();
        for cell in pieces.into_iter().flatten() {
            match slots[cell.key as usize] {
                0 => {
                    slots[cell.key as usize] = cells.len() as u32 + 1;
                    cells.push(cell);
                }
                slot => cells[slot as usize - 1].merge(&cell),
            }
        }
        cells.sort_unstable_by_key(|cell| cell.key);
        for (i, cell) in (1..).zip(&cells) {
            slots[cell.key as usize] = i;
        }
        let tolerance = Reach { cosine: tolerance_rad.cos(), chord };
        Self { mesh, tolerance, lattice, keys, cells, slots }
    }

    /// Directions near which classes may be, the most promising first; of those with less than
    /// `least` area around them, the first at most.
    fn seeds(&self, least: f64) -> Vec<Vector3<f64>> {
        let cells = &self.cells;
        let mut order: Vec<usize> = (0..cells.len()).collect();
        order.sort_by(|a, b| cells[*b].area.total_cmp(&cells[*a].area).then(a.cmp(b)));
        order.truncate(MOST_CELLS);
        let around = |i: usize| {
            let mean = cells[i].sum.normalize();
            (self.around(&mean).iter().map(|j| cells[*j].area).sum(), mean)
        };
        let mut seeds: Vec<(f64, Vector3<f64>)> = order.into_iter().map(around).collect();
        seeds.sort_by(|a, b| b.0.total_cmp(&a.0));
        let of_use = seeds.partition_point(|(area, _)| *area >= least).clamp(1, MOST_SEEDS);
        seeds.into_iter().take(of_use).map(|(_, mean)| mean).collect()
    }

    /// Follows the mean direction of the facets around each seed.
    fn refined(&mut self, seeds: Vec<Vector3<f64>>) -> Vec<Class> {
        let mut rested = Vec::with_capacity(seeds.len());
        let mut moving = seeds;
        for step in 0..=REFINEMENTS {
            self.open(&moving);
            let sums: Vec<_> = moving.par_iter().map(|direction| self.sum(direction)).collect();
            let mut next = Vec::with_capacity(moving.len());
            for (direction, (mean, area_mm2)) in moving.into_iter().zip(sums) {
                if mean == direction || step == REFINEMENTS {
                    rested.push(Class { direction, area_mm2 });
                } else {
                    next.push(mean);
                }
            }
            moving = next;
        }
        rested
    }

    /// Mean direction and area of the facets within the tolerance of a direction of length 1.
    fn sum(&self, direction: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let mut sum = Vector3::zeros();
        let mut area = 0.0;
        for i in self.around(direction) {
            let near = self.cells[i].near(direction, self.tolerance);
            sum += near.sum;
            area += near.area;
        }
        (sum.try_normalize(0.0).unwrap_or(*direction), area)
    }

    /// Looks up the facets of the cells that the borders around some directions run through.
    fn open(&mut self, directions: &[Vector3<f64>]) {
        let is_border = |cell: &Cell, direction: &Vector3<f64>| {
            cell.facets.is_none()
                && matches!(cell.side(direction, self.tolerance.chord), Side::Border)
        };
        let mut is_wanted = vec![false; self.slots.len()];
        let mut any = false;
        for direction in directions {
            for i in self.around(direction) {
                let cell = &self.cells[i];
                if is_border(cell, direction) {
                    is_wanted[cell.key as usize] = true;
                    any = true;
                }
            }
        }
        if !any {
            return;
        }
        let wanted = |(t, key): (usize, &Key)| {
            let is_wanted = *key != NO_KEY && is_wanted[*key as usize];
            is_wanted.then(|| self.lattice.folded(&self.mesh.area_vector(t as u32))).flatten()
        };
        let found: Vec<_> = self.keys.par_iter().enumerate().filter_map(wanted).collect();
        for cell in self.cells.iter_mut().filter(|cell| is_wanted[cell.key as usize]) {
            cell.facets = Some(Vec::new());
        }
        for (key, facing, _) in found {
            let cell = &mut self.cells[self.slots[key as usize] as usize - 1];
            cell.facets.get_or_insert_default().push(facing);
        }
    }

    /// The cells around a direction and its opposite, ascending: all that have a facet within the
    /// tolerance of it, because each coordinate differs by no more than the chord.
    fn around(&self, direction: &Vector3<f64>) -> Vec<usize> {
        let mut cells = Vec::with_capacity(54);
        for way in [1.0, -1.0] {
            for axis in 0..3 {
                let [x, y] = self.lattice.place(axis, &(direction * way));
                for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                    let key = self.lattice.key(axis, [x + i - 1, y + j - 1]);
                    cells.extend((self.slots[key as usize] as usize).checked_sub(1));
                }
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }
}

/// Counts facets in cells; `keys` is where theirs go.
fn counted(mesh: &Mesh, triangles: &[[u32; 3]], keys: &mut [Key], lattice: Lattice) -> Vec<Cell> {
    let mut slots = vec![0_u32; lattice.len()];
    let mut cells = Vec::new();
    for (corners, place) in triangles.iter().zip(keys) {
        let Some((key, facing, normal)) = lattice.folded(&mesh.area_vector_of(corners)) else {
            continue;
        };
        *place = key;
        let slot = &mut slots[key as usize];
        if *slot == 0 {
            cells.push(Cell::new(key));
            *slot = cells.len() as u32;
        }
        cells[*slot as usize - 1].add(&facing, &normal);
    }
    cells
}

/// The place of a cell: the side of the cube and two coordinates in one number.
type Key = u32;

/// The key of a facet without area.
const NO_KEY: Key = Key::MAX;

/// Cells are no smaller than this share of the unit sphere's radius: a table of all of them is
/// small. Tolerances below 0.25° are served by larger cells.
const LEAST_CELL: f64 = 1.0 / 230.0;

/// The squares of smaller lengths lose digits.
const LEAST_AREA_MM2: f64 = 1e-140;

/// The places that cells have on a side of the cube, by the coordinates of the normal along it.
#[derive(Clone, Copy)]
struct Lattice {
    cells_per_unit: f64,
    /// Places are counted from 0; that of 0 is this, and there is one to spare for neighbours.
    half: i32,
}

impl Lattice {
    fn of(cell_size: f64) -> Self {
        Self { cells_per_unit: 1.0 / cell_size, half: (1.0 / cell_size) as i32 + 2 }
    }

    /// Places along a side.
    fn side(self) -> usize {
        2 * self.half as usize + 1
    }

    /// Places on all sides.
    fn len(self) -> usize {
        3 * self.side() * self.side()
    }

    /// The place of a direction of length 1, or near it, on the side across an axis.
    fn place(self, axis: usize, direction: &Vector3<f64>) -> [i32; 2] {
        let along = |x: f64| (x * self.cells_per_unit + f64::from(self.half) + 0.5) as i32;
        [along(direction[(axis + 1) % 3]), along(direction[(axis + 2) % 3])]
    }

    fn key(self, axis: usize, [x, y]: [i32; 2]) -> Key {
        ((axis * self.side() + x as usize) * self.side() + y as usize) as Key
    }

    /// The cell of a facet, from its normal times twice its area, what is counted of it, and its
    /// folded normal; `None` when it has no area.
    fn folded(self, twice: &Vector3<f64>) -> Option<(Key, Facing, Vector3<f64>)> {
        let area = twice.norm() / 2.0;
        // Neither NaN nor infinity may pass.
        if !(area > LEAST_AREA_MM2 && area < f64::INFINITY) {
            return None;
        }
        let size = twice.abs();
        let axis = if size.z >= size.x && size.z >= size.y {
            2
        } else if size.y >= size.x {
            1
        } else {
            0
        };
        let sum = twice * 0.5_f64.copysign(twice[axis]);
        let normal = sum * (1.0 / area);
        let key = self.key(axis, self.place(axis, &normal));
        Some((key, Facing { sum, area }, normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn classes_of_a_box() {
        let all = classes(&shapes::block(10.0, 20.0, 30.0), 1_f64.to_radians(), 0.0);
        let found = all.classes;
        let areas: Vec<f64> = found.iter().map(|c| c.area_mm2.round()).collect();
        assert_eq!(areas, [1200.0, 600.0, 400.0]);
        assert_eq!(found[0].direction.x.abs(), 1.0);
        assert_eq!(all.total_mm2, 2200.0);
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
        let found = classes(&mesh, 1_f64.to_radians(), 0.0).classes;
        assert_eq!(found.len(), 1);
        assert!((found[0].area_mm2 - 162.0).abs() < 0.01);
        assert!(found[0].direction.z.abs() < 1e-9);
    }

    /// Facets of one direction with some noise, each the other way up than the one before.
    fn noisy_side(direction: &Vector3<f64>, n: u32) -> Mesh {
        let rotation = nalgebra::Rotation3::rotation_between(&Vector3::z(), direction).unwrap();
        let mut mesh = Mesh::default();
        for i in 0..n {
            // A golden angle apart, leaning by up to 0.4°.
            let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
            let lean = Vector3::new(cos, sin, 0.0) * (0.007 * (f64::from(i) / f64::from(n)).sqrt());
            let x = f64::from(i) * 5.0;
            let rise = |x: f64, y: f64| -lean.x * x - lean.y * y;
            let points = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]
                .map(|[u, v]| rotation * nalgebra::Point3::new(x + u, v, rise(u, v)));
            mesh.vertices.extend(points);
            let [a, b, c] = [3 * i, 3 * i + 1, 3 * i + 2];
            mesh.triangles.push(if i % 2 == 0 { [a, b, c] } else { [a, c, b] });
        }
        mesh
    }

    #[test]
    fn a_side_is_one_class_wherever_it_looks() {
        // Among them the edges and corners of the cube that the cells are on.
        let corners = [-1.0, 0.0, 1.0];
        let all = corners.iter().flat_map(|x| corners.iter().map(move |y| [*x, *y]));
        for [x, y] in all {
            for direction in
                [Vector3::new(x, y, 1.0), Vector3::new(1.0, x, y), Vector3::new(x, 1.0, y)]
            {
                let direction = direction.normalize();
                let found = classes(&noisy_side(&direction, 200), 1_f64.to_radians(), 0.05);
                assert_eq!(found.classes.len(), 1, "{direction}");
                let class = found.classes[0];
                assert!((class.area_mm2 / found.total_mm2 - 1.0).abs() < 1e-9, "{direction}");
                assert!(class.direction.cross(&direction).norm() < 1e-3, "{direction}");
            }
        }
    }

    #[test]
    fn facets_are_within_the_tolerance_or_not() {
        // Of facets that lean by up to 0.4° all ways, those within 0.2° are a quarter: the number
        // grows with the square of the angle.
        let direction = Vector3::new(0.3, -0.5, 0.8).normalize();
        let mesh = noisy_side(&direction, 4000);
        let found = classes(&mesh, 0.0035, 0.05);
        let class = found.classes[0];
        let near = (0..4000)
            .map(|t| mesh.area_vector(t))
            .filter(|v| v.normalize().dot(&class.direction).abs() >= 0.0035_f64.cos());
        let area: f64 = near.map(|v| v.norm() / 2.0).sum();
        assert!((class.area_mm2 / area - 1.0).abs() < 1e-9);
        assert!((class.area_mm2 / found.total_mm2 - 0.25).abs() < 0.02, "{class:?}");
    }

    #[test]
    fn no_facets_no_classes() {
        assert!(classes(&Mesh::default(), 0.02, 0.05).classes.is_empty());
    }
}
