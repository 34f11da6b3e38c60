//! Harmonics of a fine mesh, by the moments of small cells.
//!
//! Triangles are gathered in the cells of a grid over the footprint. With `d` the way from the
//! centre `c` of a cell,
//!
//! ```text
//! z^k = Σ_j C(k,j) c^(k−j) d^j,      j = 0 … k,
//! |terms from j = n on| ≤ C(k,n) |d|^n max(|c|, |z|)^(k−n)
//! ```
//!
//! so the integrals of the first powers of `d` over the triangles of a cell give all its harmonics:
//! the surface is passed over once, for both weights, and the cells once a harmonic. What is left
//! out is known: of the low harmonics less than 1e-9, as little as the rounding of an STL leaves;
//! of the high ones too little to make a round part look like one that is not.
//!
//! A triangle that reaches far out of its cell is integrated by itself; a fine mesh has few.

use super::{HIGH, LEAST, LOW, Place, Surface, Weight, add_by_height, add_plain};
use crate::measure;
use nalgebra::{Complex, Point3};
use rayon::prelude::*;

/// From this number of triangles on, most of them are smaller than a cell.
pub(super) const WORTH_IT: usize = 1 << 17;

/// From this number of triangles on, the harmonics of a round part take longer than its cells.
pub(super) const TELL_ROUND: usize = 1 << 14;

/// Cells along a side of the grid.
const SIDE: usize = 256;

/// Corners of a triangle that is counted in a cell are within this of the centre of the cell.
const NEAR: f64 = 2.0 / SIDE as f64 * 1.5;

/// Sides of a triangle of which third moments are left out are shorter than this. Of a sum by area
/// those are less than 3e-8 if all triangles point the same way, but those of a surface point both
/// ways: what is left is less than 1e-9.
const SMALL: f64 = 4e-3;

/// The centroid of a small triangle whose corners are [`NEAR`] lies within this of the centre.
const MIDDLE_NEAR: f64 = NEAR - SMALL;

/// Centres of cells lie within this of the origin, which the farthest point is 1 from; to the
/// power of the number of harmonics it is still small.
const REACH: f64 = 1.0 + 2.0 / SIDE as f64;

/// Powers of `d` that are summed, weighted by area and by height: those below.
const N_AREA: usize = 5;
const N_HEIGHT: usize = 4;

/// Triangles that are summed by one thread: enough that its cells are few beside them, and the sum
/// is the same for any number of threads.
const CHUNK: usize = 1 << 20;

/// Integrals of powers of `d`, and of height times those.
#[derive(Clone, Copy, Default)]
struct Cell {
    area: f64,
    height: f64,
    /// From the first power on.
    by_area: [Complex<f64>; N_AREA - 1],
    by_height: [Complex<f64>; N_HEIGHT - 1],
}

impl Cell {
    fn merge(&mut self, other: &Self) {
        self.area += other.area;
        self.height += other.height;
        self.by_area.iter_mut().zip(other.by_area).for_each(|(sum, term)| *sum += term);
        self.by_height.iter_mut().zip(other.by_height).for_each(|(sum, term)| *sum += term);
    }

    /// Counts a triangle, given by the ways to its corners, their heights, and its area.
    ///
    /// With power sums p_j = Σ d_i^j, Newton's identities give the polynomials h_j of the integrals
    /// (`super`): j h_j = Σ p_i h_(j−i). With P_j = Σ ζ_i d_i^j, those of one doubled variable are
    /// Σ ζ_i h_k(d₁, d₂, d₃, d_i) = Σ h_(k−j) P_j.
    fn add(&mut self, d: [Complex<f64>; 3], heights: [f64; 3], area: f64) {
        let squares = d.map(|d| d * d);
        let cubes = [0, 1, 2].map(|i| squares[i] * d[i]);
        let fourths = squares.map(|d| d * d);
        let sum = |powers: &[Complex<f64>; 3]| powers[0] + powers[1] + powers[2];
        let weighted = |powers: &[Complex<f64>; 3]| {
            powers[0] * heights[0] + powers[1] * heights[1] + powers[2] * heights[2]
        };
        let (p1, p2, p3, p4) = (sum(&d), sum(&squares), sum(&cubes), sum(&fourths));
        let h2 = (p1 * p1 + p2) / 2.0;
        let h3 = (p1 * h2 + p2 * p1 + p3) / 3.0;
        let h4 = (p1 * h3 + p2 * h2 + p3 * p1 + p4) / 4.0;
        self.area += area;
        self.by_area[0] += p1 * (area / 3.0);
        self.by_area[1] += h2 * (area / 6.0);
        self.by_area[2] += h3 * (area / 10.0);
        self.by_area[3] += h4 * (area / 15.0);
        let height = heights[0] + heights[1] + heights[2];
        let (q1, q2, q3) = (weighted(&d), weighted(&squares), weighted(&cubes));
        self.height += height * (area / 3.0);
        self.by_height[0] += (p1 * height + q1) * (area / 12.0);
        self.by_height[1] += (h2 * height + p1 * q1 + q2) * (area / 30.0);
        self.by_height[2] += (h3 * height + h2 * q1 + p1 * q2 + q3) * (area / 60.0);
    }

    /// Counts a triangle with sides of less than [`SMALL`], given by the way `m` to its centroid and
    /// two sides from its first corner.
    ///
    /// With the arms `e_i` from the centroid to the corners, and their heights `ε_i` above it, it
    /// has ∫e² = A σ with σ = Σ e_i²/12 and ∫εe = A τ with τ = Σ ε_i e_i/12, and third moments that
    /// are left out.
    fn add_small(
        &mut self,
        m: Complex<f64>,
        [u, v]: [Complex<f64>; 2],
        heights: [f64; 3],
        area: f64,
    ) {
        let height = (heights[0] + heights[1] + heights[2]) * (1.0 / 3.0);
        let (du, dv) = (heights[1] - heights[0], heights[2] - heights[0]);
        // Σ e_i² = 2/3 (u² + v² − uv).
        let sigma = (u * (u - v) + v * v) * (1.0 / 18.0);
        let tau = (u * (2.0 * du - dv) + v * (2.0 * dv - du)) * (1.0 / 36.0);
        let square = m * m;
        let second = square + sigma;
        let third = m * (square + sigma * 3.0);
        let fourth = square * (square + sigma * 6.0);
        let weighted = area * height;
        self.area += area;
        self.by_area[0] += m * area;
        self.by_area[1] += second * area;
        self.by_area[2] += third * area;
        self.by_area[3] += fourth * area;
        self.height += weighted;
        self.by_height[0] += m * weighted + tau * area;
        self.by_height[1] += second * weighted + (m * tau) * (2.0 * area);
        self.by_height[2] += third * weighted + (square * tau) * (3.0 * area);
    }
}

/// What is known of a surface.
#[derive(Clone)]
pub(super) struct Cells {
    cells: Vec<Cell>,
    area: f64,
    /// Integral of |d|², at most.
    squares: f64,
    /// The area of triangles that are in no cell, and their low harmonics.
    apart: f64,
    by_area: [Complex<f64>; LOW],
    by_height: [Complex<f64>; LOW],
}

impl Cells {
    pub(super) fn of(surface: &Surface) -> Self {
        // Products, not quotients: there are millions.
        let (per_radius, per_height) = (1.0 / surface.circle.radius, 1.0 / surface.half_height);
        let place = |p: &Point3<f64>| {
            let arm = (p.xy() - surface.circle.centre) * per_radius;
            (Complex::new(arm.x, arm.y), (p.z - surface.middle) * per_height)
        };
        let of_chunk = |triangles: &[[u32; 3]]| {
            let mut cells = Self::new();
            for corners in triangles {
                let corners = corners.map(|v| surface.mesh.vertices[v as usize]);
                cells.add(&corners.map(|p| place(&p)), measure::area_of(&corners));
            }
            cells
        };
        let chunks: Vec<Self> = surface.mesh.triangles.par_chunks(CHUNK).map(of_chunk).collect();
        let mut chunks = chunks.into_iter();
        let mut all = chunks.next().unwrap_or_else(Self::new);
        chunks.for_each(|chunk| all.merge(&chunk));
        all
    }

    fn new() -> Self {
        let none = [Complex::new(0.0, 0.0); LOW];
        Self {
            cells: vec![Cell::default(); SIDE * SIDE],
            area: 0.0,
            squares: 0.0,
            apart: 0.0,
            by_area: none,
            by_height: none,
        }
    }

    fn merge(&mut self, other: &Self) {
        self.cells.iter_mut().zip(&other.cells).for_each(|(cell, own)| cell.merge(own));
        self.area += other.area;
        self.squares += other.squares;
        self.apart += other.apart;
        self.by_area.iter_mut().zip(other.by_area).for_each(|(sum, term)| *sum += term);
        self.by_height.iter_mut().zip(other.by_height).for_each(|(sum, term)| *sum += term);
    }

    /// Counts a triangle, given by its corners and area.
    fn add(&mut self, corners: &[Place; 3], area: f64) {
        let [a, b, c] = corners.map(|(z, _)| z);
        let m = (a + b + c) * (1.0 / 3.0);
        let cell = cell_of(m);
        let centre = centre_of(cell);
        let (u, v) = (b - a, c - a);
        let longest = u.norm_sqr().max(v.norm_sqr());
        // Far enough inside that its corners are near, too; products of less than that are quick.
        let way = m - centre;
        if longest < SMALL * SMALL && way.norm_sqr() < MIDDLE_NEAR * MIDDLE_NEAR {
            self.area += area;
            self.squares += (way.norm_sqr() + longest) * area;
            self.cells[cell].add_small(way, [u, v], corners.map(|(_, height)| height), area);
        } else {
            self.add_large(corners, area, cell);
        }
    }

    #[inline(never)]
    fn add_large(&mut self, corners: &[Place; 3], area: f64, cell: usize) {
        let centre = centre_of(cell);
        let [a, b, c] = corners.map(|(z, _)| z);
        let ways = [a - centre, b - centre, c - centre];
        let far = ways.map(|d| d.norm_sqr());
        self.area += area;
        if far.iter().any(|square| *square > NEAR * NEAR) {
            self.apart += area;
            add_plain(&mut self.by_area, [a, b, c], area);
            add_by_height(&mut self.by_height, *corners, area);
            return;
        }
        // |d|² is convex: over a triangle it is on average no more than over its corners.
        self.squares += far.iter().sum::<f64>() * (area / 3.0);
        self.cells[cell].add(ways, corners.map(|(_, height)| height), area);
    }

    /// The low harmonics.
    pub(super) fn harmonics(&self, weight: Weight) -> Vec<Complex<f64>> {
        let mut sums = match weight {
            Weight::Area => self.by_area,
            Weight::Height => self.by_height,
        };
        self.add_cells(&mut sums, weight);
        let share = if self.area > 0.0 { 1.0 / self.area } else { 0.0 };
        sums.iter().map(|sum| sum * share).collect()
    }

    /// Adds what the cells give.
    fn add_cells(&self, sums: &mut [Complex<f64>], weight: Weight) {
        for (i, cell) in self.cells.iter().enumerate().filter(|(_, cell)| cell.area > 0.0) {
            let (whole, moments) = match weight {
                Weight::Area => (cell.area, cell.by_area.as_slice()),
                Weight::Height => (cell.height, cell.by_height.as_slice()),
            };
            let centre = centre_of(i);
            // c^(k−1), c^(k−2), …; what is before the first power has no part in the sum.
            let mut powers = [Complex::new(0.0, 0.0); N_AREA];
            powers[0] = Complex::new(1.0, 0.0);
            for (k, sum) in (1_u32..).zip(&mut *sums) {
                let power = powers[0] * centre;
                let mut term = power * whole;
                let mut choose = 1.0;
                for (j, (moment, power)) in (1_u32..).zip(moments.iter().zip(&powers)) {
                    if j > k {
                        break;
                    }
                    choose *= f64::from(k + 1 - j) / f64::from(j);
                    term += moment * power * choose;
                }
                *sum += term;
                powers.rotate_right(1);
                powers[0] = power;
            }
        }
    }

    /// Whether no harmonic that is looked at can be one to speak of. When this is not sure, it
    /// takes a look at the harmonics themselves.
    pub(super) fn are_surely_round(&self) -> bool {
        self.largest() < LEAST
    }

    /// No harmonic weighted by area is larger.
    fn largest(&self) -> f64 {
        if self.area <= 0.0 {
            return 0.0;
        }
        let mut sums = [Complex::new(0.0, 0.0); HIGH];
        self.add_cells(&mut sums, Weight::Area);
        let left_out = choose(HIGH, N_AREA) * NEAR.powi(N_AREA as i32 - 2) * self.squares;
        let off = left_out * REACH.powi(HIGH as i32) + self.apart;
        (sums.iter().map(|sum| sum.norm()).fold(0.0, f64::max) + off) / self.area
    }
}

/// The number of ways to choose `k` of `n`.
fn choose(n: usize, k: usize) -> f64 {
    (0..k).map(|i| (n - i) as f64 / (i + 1) as f64).product()
}

/// The cell that a place is in, or the nearest.
fn cell_of(z: Complex<f64>) -> usize {
    let along = |x: f64| ((x + 1.0) * (SIDE as f64 / 2.0)) as i32;
    let [x, y] = [z.re, z.im].map(|x| along(x).clamp(0, SIDE as i32 - 1) as usize);
    x + SIDE * y
}

fn centre_of(cell: usize) -> Complex<f64> {
    let at = |i: usize| (i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0;
    Complex::new(at(cell % SIDE), at(cell / SIDE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::shapes;

    /// A ball with a piece off on one side and a slope on top.
    fn uneven(fineness: u32) -> Mesh {
        let mut ball = shapes::icosphere(fineness, 40.0);
        for p in &mut ball.vertices {
            p.x = p.x.min(30.0);
            p.z = p.z.min(60.0 + 0.3 * p.y);
        }
        ball
    }

    fn largest_difference(a: &[Complex<f64>], b: &[Complex<f64>]) -> f64 {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn cells_have_the_harmonics_of_the_surface() {
        // Nearly all, some and no triangles are in cells.
        let gear = shapes::by_name("gear").unwrap();
        for (mesh, in_cells) in [(uneven(8), 0.9..=1.0), (uneven(6), 0.0..=0.99), (gear, 0.0..=0.1)]
        {
            let surface = Surface::of(&mesh).unwrap();
            let cells = Cells::of(&surface);
            let share = 1.0 - cells.apart / cells.area;
            assert!(in_cells.contains(&share), "{share}");
            for weight in [Weight::Area, Weight::Height] {
                let difference =
                    largest_difference(&cells.harmonics(weight), &surface.harmonics(LOW, weight));
                assert!(difference < 1e-9, "{difference}");
            }
        }
    }

    #[test]
    fn small_triangles_are_as_good_as_exact() {
        let (mut exact, mut quick) = (Cell::default(), Cell::default());
        let mut state = 7_u64;
        let mut random = |size: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * size
        };
        for _ in 0..1000 {
            let centre = Complex::new(random(0.008), random(0.008));
            let corners = [(); 3].map(|()| centre + Complex::new(random(0.002), random(0.002)));
            let heights = [(); 3].map(|()| random(1.0));
            let [a, b, c] = corners;
            exact.add(corners, heights, 1.0);
            quick.add_small((a + b + c) / 3.0, [b - a, c - a], heights, 1.0);
        }
        assert!((exact.height - quick.height).abs() < 1e-9);
        // Second moments are exact; of the others third moments of the triangles are left out.
        let pairs = exact
            .by_area
            .iter()
            .chain(&exact.by_height)
            .zip(quick.by_area.iter().chain(&quick.by_height));
        for (i, (a, b)) in pairs.enumerate() {
            let off = (a - b).norm() / 1000.0;
            assert!(off < if [0, 1, 4].contains(&i) { 1e-15 } else { 1e-9 }, "{i}: {off:e}");
        }
    }

    #[test]
    fn it_is_a_bound() {
        let shapes = shapes::NAMES.map(|name| shapes::by_name(name).unwrap());
        for mesh in shapes.into_iter().chain([uneven(8)]) {
            let surface = Surface::of(&mesh).unwrap();
            let harmonics = surface.harmonics(HIGH, Weight::Area);
            let largest = harmonics.iter().map(|harmonic| harmonic.norm()).fold(0.0, f64::max);
            let bound = Cells::of(&surface).largest();
            assert!(bound >= largest, "{bound} {largest}");
        }
    }

    #[test]
    fn fine_round_parts_are_surely_round_and_others_are_not() {
        let is_round = |mesh: &Mesh| Cells::of(&Surface::of(mesh).unwrap()).are_surely_round();
        assert!(is_round(&shapes::icosphere(8, 40.0)));
        assert!(!is_round(&uneven(8)));
    }
}
