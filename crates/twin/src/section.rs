//! Plane cuts of a mesh, straight from the facets.
//!
//! A facet that has corners on both sides of `z = c` gives one directed piece of the outline, from
//! the side that comes down through the plane to the side that goes up, so that the inside lies on
//! its left seen from above. Pieces are never chained: area is the sum of their cross products, put
//! right along rows where the outline winds round something twice or the wrong way;
//! length the sum of their lengths, and a place is inside when the pieces wind round it. A corner
//! at exactly `c` counts as above, so a closed mesh always gives closed outlines. Part frame, mm.
//!
//! Limits. The length of shells that overlap is counted as often as they do, holes of an open mesh
//! leave the area undefined; facets that are not finite or name no vertex are left out.
//!
//! Layers come from below upwards, so a sweep over facets in slabs of height finds those of one
//! plane in time proportional to what it cuts.

use std::collections::HashMap;

use mesh::mesh::Mesh;
use nalgebra::{Point2, Point3, Vector2};

/// One directed piece of an outline, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it starts.
    pub from: Point2<f64>,
    /// Where it ends; the inside is on the left.
    pub to: Point2<f64>,
}

/// What a plane cuts from a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// The outline, in no order.
    pub pieces: Vec<Piece>,
}

/// Cuts a mesh by planes, best from below upwards.
#[derive(Debug)]
pub struct Sweep<'a> {
    mesh: &'a Mesh,
    /// Facets with their extent in z, by the slab in which they begin.
    facets: Vec<Facet>,
    slabs: Slabs,
    /// The first facet of a slab above the last plane.
    next: usize,
    /// Facets of the slabs below, and of that of the last plane, that had not ended there, as
    /// indices of `facets`.
    active: Vec<u32>,
    last: f64,
}

#[derive(Debug, Clone, Copy)]
struct Facet {
    least: f64,
    most: f64,
    triangle: u32,
}

/// Facets in a slab, about: fewer slabs than layers have facets, more than there are layers.
const FACETS_OF_A_SLAB: usize = 16;

/// Points in a slab, about: as many as a piece of an outline passes.
const POINTS_OF_A_SLAB: usize = 4;

impl<'a> Sweep<'a> {
    /// Prepares to cut `mesh`.
    #[must_use]
    pub fn new(mesh: &'a Mesh) -> Self {
        let facets: Vec<Facet> = (0_u32..)
            .zip(&mesh.triangles)
            .filter_map(|(triangle, corners)| {
                let z = corners_of(mesh, corners)?.map(|p| p.z);
                let (least, most) = (z[0].min(z[1]).min(z[2]), z[0].max(z[1]).max(z[2]));
                Some(Facet { least, most, triangle })
            })
            .collect();
        let heights: Vec<f64> = facets.iter().map(|facet| facet.least).collect();
        let (slabs, order) = Slabs::sort(&heights, FACETS_OF_A_SLAB);
        let facets = order.iter().map(|&k| facets[k as usize]).collect();
        Self { mesh, facets, slabs, next: 0, active: Vec::new(), last: f64::NEG_INFINITY }
    }

    /// Cuts at height `z`, replacing what `section` held.
    pub fn cut(&mut self, z: f64, section: &mut Section) {
        section.pieces.clear();
        if z < self.last || z.is_nan() || self.last.is_nan() {
            (self.next, self.last) = (0, f64::NEG_INFINITY);
            self.active.clear();
        }
        self.last = z;
        let end = self.slabs.end(z).max(self.next);
        self.active.extend(self.next as u32..end as u32);
        self.next = end;
        let (facets, mesh) = (&self.facets, self.mesh);
        self.active.retain(|&facet| facets[facet as usize].most >= z);
        let cut = |&facet: &u32| {
            let corners = mesh.triangles.get(facets[facet as usize].triangle as usize)?;
            piece(&corners_of(mesh, corners)?, z)
        };
        section.pieces.extend(self.active.iter().filter_map(cut));
    }
}

/// Numbers in slabs of one thickness, and where those of each end in a row that is sorted by slab.
/// Counting sorts them in one pass; that they are in no order within a slab costs a search no more
/// than a look at each.
#[derive(Debug)]
struct Slabs {
    low: f64,
    /// Slabs for a difference of 1.
    density: f64,
    ends: Vec<u32>,
}

impl Slabs {
    /// Returns the slabs, of about `each` numbers, and the indices of the numbers slab by slab.
    fn sort(numbers: &[f64], each: usize) -> (Self, Vec<u32>) {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &number in numbers {
            (low, high) = (low.min(number), high.max(number));
        }
        let count = numbers.len() / each + 1;
        let density = if high > low { count as f64 / (high - low) } else { 0.0 };
        let mut slabs = Self { low, density, ends: vec![0; count] };
        for &number in numbers {
            let slab = slabs.of(number);
            slabs.ends[slab] += 1;
        }
        let mut end = 0;
        for count in &mut slabs.ends {
            end += std::mem::replace(count, end);
        }
        let mut sorted = vec![0; numbers.len()];
        for (index, &number) in (0_u32..).zip(numbers) {
            let slab = slabs.of(number);
            sorted[slabs.ends[slab] as usize] = index;
            slabs.ends[slab] += 1;
        }
        (slabs, sorted)
    }

    /// The slab of a number; the outermost for what lies beyond.
    fn of(&self, number: f64) -> usize {
        (((number - self.low) * self.density).max(0.0) as usize).min(self.ends.len() - 1)
    }

    /// Where the slab of a number begins.
    fn begin(&self, number: f64) -> usize {
        self.of(number).checked_sub(1).map_or(0, |before| self.ends[before] as usize)
    }

    /// Where the slab of a number ends; at the begin for what is below all.
    fn end(&self, number: f64) -> usize {
        if number >= self.low { self.ends[self.of(number)] as usize } else { 0 }
    }
}

impl Section {
    /// Returns the area that the outline winds round at all, mm²: what shells share counts once, and
    /// so does what is turned inside out, as in the print.
    #[must_use]
    pub fn area(&self) -> f64 {
        let signed = self.signed_area();
        let is_simple = self.miscounted(ROWS_TO_LOOK).abs() <= NEGLIGIBLE * signed.abs();
        if is_simple { signed } else { signed + self.miscounted(ROWS_TO_MEASURE) }
    }

    fn signed_area(&self) -> f64 {
        // Near the outline products are small, so differences lose no digits.
        let Some(first) = self.pieces.first() else { return 0.0 };
        let origin = first.from;
        let twice: f64 = self.pieces.iter().map(|p| (p.from - origin).perp(&(p.to - origin))).sum();
        0.5 * twice
    }

    /// What the signed area lacks, mm², measured along rows: 0 where the outline winds round all
    /// that it winds round once, and where it is open.
    fn miscounted(&self, rows: usize) -> f64 {
        let rows = rows.min(MOST_CROSSINGS / self.pieces.len().max(1)).max(1);
        let ends = self.pieces.iter().flat_map(|p| [p.from.y, p.to.y]);
        let (low, high) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        let height = (high - low) / rows as f64;
        if !(height > 0.0 && height.is_finite()) {
            return 0.0;
        }
        let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); rows];
        for piece in &self.pieces {
            let (a, b, step) = if piece.from.y < piece.to.y {
                (piece.from, piece.to, -1)
            } else {
                (piece.to, piece.from, 1)
            };
            // The first row whose middle is not below, for either end.
            let row = |y: f64| ((y - low) / height - 0.5).ceil().max(0.0) as usize;
            for (k, crossings) in crossings.iter_mut().enumerate().take(row(b.y)).skip(row(a.y)) {
                let y = low + (k as f64 + 0.5) * height;
                crossings.push((a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)), step));
            }
        }
        crossings.iter_mut().map(|row| miscounted_in(row)).sum::<f64>() * height
    }

    /// Returns the length of the outline, mm.
    #[must_use]
    pub fn perimeter(&self) -> f64 {
        self.pieces.iter().map(|p| (p.to - p.from).norm()).sum()
    }

    /// Returns how far the outline turns at its convex corners, rad: 2π for each outline that is convex, more
    /// for others. Moved outwards by `d` and rounded there, the section grows by `d` along its outline and by
    /// `d²/2` for each radian (Steiner's formula; no less where it is notched).
    #[must_use]
    pub fn convex_turns(&self) -> f64 {
        let direction = |piece: &Piece| {
            let along = piece.to - piece.from;
            (along.norm() > SHORTEST_PIECE).then_some(along)
        };
        let key = |p: &Point2<f64>| [p.x, p.y].map(|c| (c / SHORTEST_PIECE).round() as i64);
        let ways = || self.pieces.iter().filter_map(|p| Some((p, direction(p)?)));
        let leaving: HashMap<[i64; 2], Vector2<f64>> =
            ways().map(|(piece, along)| (key(&piece.from), along)).collect();
        let turns = ways().filter_map(|(piece, along)| {
            let next = leaving.get(&key(&piece.to))?;
            Some(along.perp(next).atan2(along.dot(next)).max(0.0))
        });
        turns.sum()
    }

    /// Returns how often the outline winds round each of `points`, in their order.
    #[must_use]
    pub fn windings(&self, points: &[Point2<f64>]) -> Vec<i32> {
        let heights: Vec<f64> = points.iter().map(|p| p.y).collect();
        let (slabs, order) = Slabs::sort(&heights, POINTS_OF_A_SLAB);
        let mut windings = vec![0; points.len()];
        for piece in &self.pieces {
            let (low, high, sign) = if piece.from.y < piece.to.y {
                (piece.from, piece.to, 1)
            } else {
                (piece.to, piece.from, -1)
            };
            let near = slabs.begin(low.y)..slabs.end(high.y);
            for &i in order.get(near).unwrap_or_default() {
                let p = points[i as usize];
                // A ray towards +x meets pieces with low.y <= y < high.y.
                if low.y <= p.y && p.y < high.y && (high - low).perp(&(p - low)) > 0.0 {
                    windings[i as usize] += sign;
                }
            }
        }
        windings
    }

    /// Returns the distance of `p` from the outline, mm; infinite when there is none.
    #[must_use]
    pub fn distance(&self, p: &Point2<f64>) -> f64 {
        let distance =
            |piece: &Piece| geom::polyline::distance_to_segment(&piece.from, &piece.to, p);
        self.pieces.iter().map(distance).fold(f64::INFINITY, f64::min)
    }
}

/// Rows that tell whether an outline winds round anything but once.
const ROWS_TO_LOOK: usize = 32;

/// Rows that measure what it winds round otherwise: at the worst, a side along the rows, one row in a
/// thousand is miscounted.
const ROWS_TO_MEASURE: usize = 1024;

/// Most crossings of rows and pieces, which bounds the memory: fewer rows for huge outlines.
const MOST_CROSSINGS: usize = 4_000_000;

/// Pieces shorter than this are where a corner of the mesh lies in the plane, mm.
const SHORTEST_PIECE: f64 = 1e-6;

/// Share of the area that rounding alone may miscount.
const NEGLIGIBLE: f64 = 1e-9;

/// How much longer the places of a row are that the outline winds round than what it counts there;
/// 0 where the row does not end outside.
fn miscounted_in(row: &mut [(f64, i32)]) -> f64 {
    row.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut winding, mut lacking, mut before) = (0, 0.0, 0.0);
    for &mut (x, step) in row {
        lacking += (x - before) * f64::from(i32::from(winding != 0) - winding);
        winding += step;
        before = x;
    }
    if winding == 0 { lacking } else { 0.0 }
}

/// Returns the volume that the facets enclose, mm³.
#[must_use]
pub fn volume(mesh: &Mesh) -> f64 {
    let Some(origin) = mesh.vertices.first() else { return 0.0 };
    let six_times: f64 = mesh
        .triangles
        .iter()
        .filter_map(|corners| {
            let [a, b, c] = corners_of(mesh, corners)?.map(|p| p - origin);
            Some(a.dot(&b.cross(&c)))
        })
        .sum();
    six_times / 6.0
}

/// Returns the area of the facets, mm².
#[must_use]
pub fn surface(mesh: &Mesh) -> f64 {
    let twice = mesh.triangles.iter().filter_map(|corners| {
        let [a, b, c] = corners_of(mesh, corners)?;
        Some((b - a).cross(&(c - a)).norm())
    });
    0.5 * twice.sum::<f64>()
}

/// Returns what a body gains at its convex edges, over that on its surface, for each mm² that all of its outside
/// moves outwards: half of the sum of their lengths times their outer angles, mm (Steiner's formula,
/// `V + S·d + M·d² + 4π/3·d³`).
#[must_use]
pub fn convex_edges(mesh: &Mesh) -> f64 {
    // Each side by its ends, with the facet and how it runs along it.
    let mut sides = Vec::with_capacity(3 * mesh.triangles.len());
    for (facet, corners) in (0_u32..).zip(&mesh.triangles) {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            sides.push((a.min(b), a.max(b), a > b, facet));
        }
    }
    sides.sort_unstable();
    let normal = |facet: u32| {
        let [a, b, c] = corners_of(mesh, mesh.triangles.get(facet as usize)?)?;
        (b - a).cross(&(c - a)).try_normalize(0.0)
    };
    let turn = |pair: &[(u32, u32, bool, u32)]| {
        let [(low, high, false, left), (other_low, other_high, true, right)] = *pair else {
            return None;
        };
        let (from, to) = (mesh.vertices.get(low as usize)?, mesh.vertices.get(high as usize)?);
        if (low, high) != (other_low, other_high) {
            return None;
        }
        let (along, left, right) = (to - from, normal(left)?, normal(right)?);
        let across = left.cross(&right);
        let angle = across.norm().atan2(left.dot(&right));
        (across.dot(&along) > 0.0).then(|| along.norm() * angle)
    };
    0.5 * sides.windows(2).filter_map(turn).sum::<f64>()
}

/// The corners of a facet; `None` when it names no vertex or is not finite.
fn corners_of(mesh: &Mesh, corners: &[u32; 3]) -> Option<[Point3<f64>; 3]> {
    let corner = |k: usize| mesh.vertices.get(corners[k] as usize).copied();
    let corners = [corner(0)?, corner(1)?, corner(2)?];
    corners.iter().all(|p| p.coords.iter().all(|c| c.is_finite())).then_some(corners)
}

fn piece(corners: &[Point3<f64>; 3], z: f64) -> Option<Piece> {
    let mut from = None;
    let mut to = None;
    for k in 0..3 {
        let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
        match (a.z < z, b.z < z) {
            // Computed from the lower end in both facets of an edge: the same point in both.
            (false, true) => from = Some(crossing(b, a, z)),
            (true, false) => to = Some(crossing(a, b, z)),
            _ => {}
        }
    }
    Some(Piece { from: from?, to: to? })
}

fn crossing(low: &Point3<f64>, high: &Point3<f64>, z: f64) -> Point2<f64> {
    let share = (z - low.z) / (high.z - low.z);
    let along: Vector2<f64> = high.xy() - low.xy();
    low.xy() + along * share
}

#[cfg(test)]
pub(crate) mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A box around the z axis shifted by `x`, with a square hole through it when `hole` > 0;
    /// half-widths in mm.
    pub(crate) fn block(half: f64, hole: f64, height: f64, x: f64) -> Mesh {
        let mut mesh = Mesh::default();
        add_shell(&mut mesh, half, [0.0, height], x, false);
        if hole > 0.0 {
            add_shell(&mut mesh, hole, [-1.0, height + 1.0], x, true);
        }
        mesh
    }

    /// The hole sticks out above and below, which no cut within the height sees.
    fn add_shell(mesh: &mut Mesh, half: f64, z: [f64; 2], x: f64, inside_out: bool) {
        let base = mesh.vertices.len() as u32;
        for z in z {
            for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                mesh.vertices.push(Point3::new(x + sx * half, sy * half, z));
            }
        }
        let faces: [[u32; 4]; 6] =
            [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
        for [a, b, c, d] in faces {
            for t in [[a, b, c], [a, c, d]] {
                let [a, b, c] = t.map(|k| base + k);
                mesh.triangles.push(if inside_out { [a, c, b] } else { [a, b, c] });
            }
        }
    }

    fn cut(mesh: &Mesh, z: f64) -> Section {
        let mut section = Section::default();
        Sweep::new(mesh).cut(z, &mut section);
        section
    }

    #[test]
    fn area_and_length_of_a_block_with_a_hole() {
        let section = cut(&block(10.0, 4.0, 8.0, 3.0), 2.5);
        assert!((section.area() - (400.0 - 64.0)).abs() < 1e-12);
        assert!((section.perimeter() - (80.0 + 32.0)).abs() < 1e-12);
        // The corners of the hole are none where material grows.
        assert!((section.convex_turns() - TAU).abs() < 1e-9);
        assert!(cut(&block(10.0, 0.0, 8.0, 0.0), 9.0).pieces.is_empty());
        assert!((volume(&block(10.0, 0.0, 8.0, 50.0)) - 3200.0).abs() < 1e-9);
        // Twelve edges of a quarter turn each; all of a box is convex.
        let edges = std::f64::consts::FRAC_PI_4 * 4.0 * (20.0 + 20.0 + 8.0);
        assert!((convex_edges(&block(10.0, 0.0, 8.0, 50.0)) - edges).abs() < 1e-9);
    }

    #[test]
    fn a_sweep_equals_single_cuts_in_any_order() {
        let share = |i: u32, step: f64| (f64::from(i) * step).fract();
        let vertices =
            (0..600).map(|i| Point3::new(share(i, 0.618), share(i, 0.37), share(i, 0.17)));
        let mesh = Mesh {
            vertices: vertices.collect(),
            triangles: (0..200).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        };
        let mut sweep = Sweep::new(&mesh);
        let mut section = Section::default();
        for z in [-0.9, 0.3, 0.31, 0.5, 0.7, 2.0, 0.2, f64::NAN, 0.4] {
            sweep.cut(z, &mut section);
            let mut expected = cut(&mesh, z).pieces;
            let mut found = section.pieces.clone();
            let key = |p: &Piece| (p.from.x.to_bits(), p.from.y.to_bits());
            expected.sort_by_key(key);
            found.sort_by_key(key);
            assert_eq!(found, expected, "z = {z}");
        }
    }

    /// The outline of a polygon.
    fn outline(corners: &[[f64; 2]]) -> Vec<Piece> {
        let ends = corners.iter().skip(1).chain(corners.first());
        let point = |c: &[f64; 2]| Point2::new(c[0], c[1]);
        corners.iter().zip(ends).map(|(a, b)| Piece { from: point(a), to: point(b) }).collect()
    }

    #[test]
    fn area_is_what_the_outline_winds_round_however_often() {
        let square = |x: f64, side: f64| {
            outline(&[[x, x], [x + side, x], [x + side, x + side], [x, x + side]])
        };
        let eight =
            Section { pieces: outline(&[[0.0, 0.0], [20.0, 20.0], [20.0, 0.0], [0.0, 20.0]]) };
        assert!((eight.area() - 200.0).abs() < 1e-3, "both lobes: {}", eight.area());
        let overlapping = Section { pieces: [square(0.0, 20.0), square(10.0, 20.0)].concat() };
        assert!((overlapping.area() - 700.0).abs() < 0.5, "{}", overlapping.area());
        let nested = Section { pieces: [square(0.0, 20.0), square(5.0, 10.0)].concat() };
        assert!((nested.area() - 400.0).abs() < 0.5, "{}", nested.area());
        let mut hole = square(5.0, 10.0);
        hole.iter_mut().for_each(|p| std::mem::swap(&mut p.from, &mut p.to));
        let hollow = Section { pieces: [square(0.0, 20.0), hole].concat() };
        assert_eq!(hollow.area(), 300.0);
    }

    #[test]
    fn inside_is_where_the_outline_winds_round() {
        let section = cut(&block(10.0, 4.0, 8.0, 0.0), 1.0);
        let places = [[0.0, 0.0], [7.0, 0.0], [-7.0, 3.0], [11.0, 0.0], [-12.0, 4.0], [4.5, 9.9]];
        let points = places.map(Point2::from);
        assert_eq!(section.windings(&points), [0, 1, 1, 0, 0, 1]);
        assert_eq!(section.distance(&points[3]), 1.0);
        assert_eq!(section.distance(&points[0]), 4.0);
    }

    #[test]
    fn a_cut_through_vertices_is_closed() {
        let mut mesh = block(5.0, 0.0, 10.0, 0.0);
        // A corner row at exactly the height of the cut.
        mesh.vertices[4].z = 4.0;
        mesh.vertices[5].z = 4.0;
        for z in [4.0, 4.0 - 1e-12, 4.0 + 1e-12] {
            let area = cut(&mesh, z).area();
            assert!((area - 100.0).abs() < 1e-6, "{z}: {area}");
        }
    }

    #[test]
    fn broken_facets_are_left_out() {
        let mut mesh = block(5.0, 0.0, 10.0, 0.0);
        mesh.triangles.push([0, 1, 99]);
        mesh.vertices.push(Point3::new(f64::NAN, 0.0, 2.0));
        mesh.triangles.push([0, 6, 8]);
        assert!((cut(&mesh, 5.0).area() - 100.0).abs() < 1e-12);
        assert!((volume(&mesh) - 1000.0).abs() < 1e-9);
    }
}
