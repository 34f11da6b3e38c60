//! Is a place inside the mesh? Rays upwards through the facets, found by a grid seen from above.
//!
//! A place is inside when the facets above it wind round it: a facet that faces up counts one, one
//! that faces down takes one away. Whether a facet lies over a place is decided side by side, each
//! side taken from its lower end to its upper one and without its upper end, as
//! [`crate::section`] does: a ray through a side or a corner that facets share meets exactly one of
//! them. Part frame, mm.
//!
//! Each cell of the grid knows the facets that lie over it. They are entered row by row, over the
//! stretch that the facet covers there, so that long thin facets fill few cells.

use mesh::mesh::Mesh;
use nalgebra::{Point2, Point3};

/// Most cells along one side of the grid. More would cost memory for meshes of many small facets
/// and gain little: a cell then holds a handful.
const MOST_CELLS: f64 = 256.0;

/// A mesh, ready to be asked. See the [module](self).
#[derive(Debug)]
pub struct Columns<'a> {
    mesh: &'a Mesh,
    corner: Point2<f64>,
    /// Width of a cell along x and y, mm.
    cell: [f64; 2],
    /// Cells along x and y.
    count: [usize; 2],
    /// Where the facets of each cell begin in `facets`, and where the last ends.
    starts: Vec<usize>,
    facets: Vec<u32>,
}

impl<'a> Columns<'a> {
    /// Prepares to ask about `mesh`. Facets that are not finite or name no vertex are left out.
    #[must_use]
    pub fn new(mesh: &'a Mesh) -> Self {
        let bounds = mesh.bounds();
        let size = bounds.size();
        let cells = (mesh.triangles.len() as f64).sqrt().ceil().clamp(1.0, MOST_CELLS);
        // A mesh without extent has one cell, of any width.
        let width = |extent: f64| if extent > 0.0 { extent / cells } else { 1.0 };
        let count = [size.x, size.y].map(|extent| if extent > 0.0 { cells as usize } else { 1 });
        let mut columns = Self {
            mesh,
            corner: bounds.min.xy(),
            cell: [width(size.x), width(size.y)],
            count,
            starts: Vec::new(),
            facets: Vec::new(),
        };
        columns.fill();
        columns
    }

    /// Returns how often the mesh winds round a place: 0 outside.
    #[must_use]
    pub fn winding(&self, p: &Point3<f64>) -> i32 {
        let Some(cell) = self.cell_of(&p.xy()) else { return 0 };
        let facets = self.starts[cell]..self.starts[cell + 1];
        let over = |&facet: &u32| {
            let corners = corners(self.mesh, facet)?;
            let winding = winding(&corners, &p.xy());
            (winding != 0 && height(&corners, &p.xy()) > p.z).then_some(winding)
        };
        self.facets[facets].iter().filter_map(over).sum()
    }

    fn cell_of(&self, p: &Point2<f64>) -> Option<usize> {
        let index = |k: usize| {
            let cells = (p[k] - self.corner[k]) / self.cell[k];
            let is_inside = 0.0 <= cells && cells <= self.count[k] as f64;
            // The far border belongs to the last cell.
            is_inside.then(|| (cells as usize).min(self.count[k] - 1))
        };
        Some(index(1)? * self.count[0] + index(0)?)
    }

    /// Counts the facets of every cell, then enters them.
    fn fill(&mut self) {
        let cells = self.count[0] * self.count[1];
        let mut starts = vec![0; cells + 1];
        self.visit(|cell, _| starts[cell + 1] += 1);
        for cell in 0..cells {
            starts[cell + 1] += starts[cell];
        }
        let mut facets = vec![0; starts[cells]];
        let mut next = starts.clone();
        self.visit(|cell, facet| {
            facets[next[cell]] = facet;
            next[cell] += 1;
        });
        (self.starts, self.facets) = (starts, facets);
    }

    /// Shows every cell that a facet covers, with the facet.
    fn visit(&self, mut see: impl FnMut(usize, u32)) {
        let index = |k: usize, at: f64| {
            let cells = (at - self.corner[k]) / self.cell[k];
            (cells.max(0.0) as usize).min(self.count[k] - 1)
        };
        for facet in 0..self.mesh.triangles.len() as u32 {
            let Some(corners) = corners(self.mesh, facet) else { continue };
            let [least, most] = extent(corners.iter().map(|p| p.y));
            for row in index(1, least)..=index(1, most) {
                let low = self.corner.y + self.cell[1] * row as f64;
                let Some([left, right]) = stretch(&corners, [low, low + self.cell[1]]) else {
                    continue;
                };
                // One cell more on either side: the last bits of a stretch must not decide.
                let slack = self.cell[0] * EDGE_SHARE;
                for column in index(0, left - slack)..=index(0, right + slack) {
                    see(row * self.count[0] + column, facet);
                }
            }
        }
    }
}

/// How far a facet may reach into a cell unseen, as a share of the cell: far above the last bits of
/// a coordinate, far below a cell.
const EDGE_SHARE: f64 = 1e-6;

fn corners(mesh: &Mesh, facet: u32) -> Option<[Point3<f64>; 3]> {
    let named = mesh.triangles.get(facet as usize)?;
    let corner = |k: usize| mesh.vertices.get(named[k] as usize).copied();
    let corners = [corner(0)?, corner(1)?, corner(2)?];
    corners.iter().all(|p| p.coords.iter().all(|c| c.is_finite())).then_some(corners)
}

fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], v| [least.min(v), most.max(v)])
}

/// The extent along x of what of a facet lies between two heights in y.
fn stretch(corners: &[Point3<f64>; 3], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    let mut add = |x: f64| found = [found[0].min(x), found[1].max(x)];
    for k in 0..3 {
        let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
        if a.y >= low && a.y <= high {
            add(a.x);
        }
        for y in [low, high] {
            if (a.y < y) != (b.y < y) {
                add(a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)));
            }
        }
    }
    (found[0] <= found[1]).then_some(found)
}

/// How often the outline of a facet, seen from above, winds round `p`.
fn winding(corners: &[Point3<f64>; 3], p: &Point2<f64>) -> i32 {
    (0..3)
        .map(|k| {
            let (a, b) = (corners[k].xy(), corners[(k + 1) % 3].xy());
            let (low, high, sign) = if a.y < b.y { (a, b, 1) } else { (b, a, -1) };
            let is_met = low.y <= p.y && p.y < high.y && (high - low).perp(&(p - low)) > 0.0;
            if is_met { sign } else { 0 }
        })
        .sum()
}

/// The height of a facet's plane over `p`, which lies within its outline.
fn height(corners: &[Point3<f64>; 3], p: &Point2<f64>) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    a.z - ((p.x - a.x) * normal.x + (p.y - a.y) * normal.y) / normal.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::tests::block;
    use crate::section::{Section, Sweep};

    #[test]
    fn a_block_with_a_hole() {
        let mesh = block(10.0, 4.0, 8.0, 3.0);
        let columns = Columns::new(&mesh);
        let inside = [[9.0, 0.0, 4.0], [-6.9, -9.9, 0.01], [3.0, 4.5, 7.99]];
        let outside = [
            [3.0, 0.0, 4.0],
            [9.0, 0.0, -0.01],
            [9.0, 0.0, 8.01],
            [14.0, 0.0, 4.0],
            [3.0, 50.0, 4.0],
        ];
        assert!(inside.iter().all(|p| columns.winding(&Point3::from(*p)) == 1));
        assert!(outside.iter().all(|p| columns.winding(&Point3::from(*p)) == 0));
    }

    #[test]
    fn sections_and_columns_agree_everywhere() {
        let share = |i: u32, step: f64| (f64::from(i) * step).fract();
        // Points on lattice positions too, where rays run through corners and sides.
        for mesh in [mesh::shapes::by_name("mushroom"), mesh::shapes::by_name("gear")] {
            let mesh = mesh.unwrap();
            let (columns, mut sweep) = (Columns::new(&mesh), Sweep::new(&mesh));
            let bounds = mesh.bounds();
            for i in 1..200 {
                let z = bounds.min.z + bounds.size().z * share(i, 0.618_034);
                let mut section = Section::default();
                sweep.cut(z, &mut section);
                let places: Vec<Point2<f64>> = (0..40)
                    .map(|k| {
                        let x = (share(k, 0.37) - 0.5) * bounds.size().x;
                        let y = (share(k, 0.71) - 0.5) * bounds.size().y;
                        if k % 4 == 0 {
                            Point2::new(x.round(), y.round())
                        } else {
                            Point2::new(x, y)
                        }
                    })
                    .collect();
                for (place, expected) in places.iter().zip(section.windings(&places)) {
                    let p = Point3::new(place.x, place.y, z);
                    if section.distance(place) > 1e-6 {
                        assert_eq!(columns.winding(&p), expected, "{p}");
                    }
                }
            }
        }
    }

    #[test]
    fn broken_and_empty_meshes_hold_nothing() {
        assert_eq!(Columns::new(&Mesh::default()).winding(&Point3::origin()), 0);
        let mut mesh = block(5.0, 0.0, 10.0, 0.0);
        mesh.triangles.push([0, 1, 99]);
        assert_eq!(Columns::new(&mesh).winding(&Point3::new(1.0, 2.0, 3.0)), 1);
        let flat = Mesh { vertices: vec![Point3::origin(); 3], triangles: vec![[0, 1, 2]] };
        assert_eq!(Columns::new(&flat).winding(&Point3::origin()), 0);
    }
}
