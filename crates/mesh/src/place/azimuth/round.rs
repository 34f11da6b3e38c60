//! A bound on the harmonics of a surface, much quicker to find than the harmonics themselves.
//!
//! Triangles are gathered in the cells of a grid over the footprint. With `d` the way from the
//! centre `c` of a cell,
//!
//! ```text
//! z^k = (c + d)^k = c^k + k c^(k−1) d + k(k−1)/2 c^(k−2) d² + …,
//! |rest| ≤ k(k−1)(k−2)/6 |d|³ max(|c|, |z|)^(k−3)
//! ```
//!
//! so three moments of the area of a cell give all its harmonics, and the sum of `|d|³` how far
//! they are off at most: first the surface is passed over once, then the cells once a harmonic.
//! Of the harmonics weighted by height, only the low ones are looked at, and two moments do.
//! With large triangles the bound is large, and says nothing; then the sums are few anyway.

use super::Place;
use nalgebra::Complex;

/// Cells along a side of the grid: they are as large as a triangle of a part of some hundred
/// thousand.
const SIDE: usize = 512;

/// Centres of cells lie within this of the origin, which the farthest point is 1 from; to the
/// power of the number of harmonics it is still small.
const REACH: f64 = 1.0 + 2.0 / SIDE as f64;

/// Moments of a cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    area: f64,
    first: Complex<f64>,
    second: Complex<f64>,
    /// The same, of area times height.
    height: f64,
    height_first: Complex<f64>,
}

/// What is known of a surface.
pub(super) struct Sums {
    cells: Vec<Cell>,
    area: f64,
    /// Integrals of |d|² and |d|³, at most.
    squares: f64,
    cubes: f64,
}

impl Sums {
    pub(super) fn new() -> Self {
        Self { cells: vec![Cell::default(); SIDE * SIDE], area: 0.0, squares: 0.0, cubes: 0.0 }
    }

    /// Counts a triangle, given by its corners and area.
    pub(super) fn add(&mut self, corners: &[Place; 3], area: f64) {
        let [a, b, c] = corners.map(|(z, _)| z);
        let cell = cell_of((a + b + c) / 3.0);
        let centre = centre_of(cell);
        let arms = [a - centre, b - centre, c - centre];
        let heights = corners.map(|(_, height)| height);
        let (arm, height) = (arms.iter().sum::<Complex<f64>>(), heights.iter().sum::<f64>());
        let squares = arms.map(|d| d * d).iter().sum::<Complex<f64>>() + arm * arm;
        let mixed: Complex<f64> = arms.iter().zip(heights).map(|(d, height)| d * height).sum();
        // |d|² and |d|³ are convex: over a triangle they are on average no more than over its
        // corners.
        for d in arms {
            let square = d.norm_sqr();
            self.squares += square * (area / 3.0);
            self.cubes += square * square.sqrt() * (area / 3.0);
        }
        self.area += area;
        let sum = &mut self.cells[cell];
        sum.area += area;
        sum.first += arm * (area / 3.0);
        sum.second += squares * (area / 12.0);
        sum.height += height * (area / 3.0);
        sum.height_first += (mixed + arm * height) * (area / 12.0);
    }

    /// No harmonic is larger: of those weighted by area up to `high`, and of those weighted by
    /// height up to `low`.
    pub(super) fn largest(&self, low: usize, high: usize) -> f64 {
        let (n, m) = (high as f64, low as f64);
        let far = REACH.powi(high as i32);
        let off = self.cubes * n * (n - 1.0) * (n - 2.0) / 6.0 * far;
        let off_height = self.squares * m * (m - 1.0) / 2.0 * far;
        if self.area <= 0.0 {
            return 0.0;
        }
        let mut by_area = vec![Complex::new(0.0, 0.0); high];
        let mut by_height = vec![Complex::new(0.0, 0.0); low];
        let used = self.cells.iter().enumerate().filter(|(_, cell)| cell.area > 0.0);
        for (i, cell) in used {
            let centre = centre_of(i);
            // c^(k−2), c^(k−1) and c^k; what goes before the first power has no part in the sum.
            let (mut before, mut last) = (Complex::new(0.0, 0.0), Complex::new(1.0, 0.0));
            for (k, sum) in (1_u32..).zip(&mut by_area) {
                let power = last * centre;
                let k = f64::from(k);
                *sum += power * cell.area
                    + last * cell.first * k
                    + before * cell.second * (k * (k - 1.0) / 2.0);
                (before, last) = (last, power);
            }
            let mut last = Complex::new(1.0, 0.0);
            for (k, sum) in (1_u32..).zip(&mut by_height) {
                let power = last * centre;
                *sum += power * cell.height + last * cell.height_first * f64::from(k);
                last = power;
            }
        }
        let most = |sums: &[Complex<f64>]| sums.iter().map(|s| s.norm()).fold(0.0, f64::max);
        let largest = (most(&by_area) + off).max(most(&by_height) + off_height);
        largest / self.area
    }
}

/// The cell that a place is in, or the nearest.
fn cell_of(z: Complex<f64>) -> usize {
    let along = |x: f64| (((x + 1.0) / 2.0 * SIDE as f64).max(0.0) as usize).min(SIDE - 1);
    along(z.re) + SIDE * along(z.im)
}

fn centre_of(cell: usize) -> Complex<f64> {
    let at = |i: usize| (i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0;
    Complex::new(at(cell % SIDE), at(cell / SIDE))
}

#[cfg(test)]
mod tests {
    use super::super::{HIGH, LEAST, LOW, Surface, Weight};
    use super::*;
    use crate::mesh::Mesh;
    use crate::shapes;

    /// The bound, and the largest harmonic itself.
    fn both(mesh: &Mesh) -> (f64, f64) {
        let surface = Surface::of(mesh).unwrap();
        let mut sums = Sums::new();
        for corners in &mesh.triangles {
            let (places, area) = surface.triangle(corners);
            sums.add(&places, area);
        }
        let by_area = surface.harmonics(HIGH, Weight::Area);
        let by_height = surface.harmonics(LOW, Weight::Height);
        let all = by_area.iter().chain(&by_height).map(|harmonic| harmonic.norm());
        (sums.largest(LOW, HIGH), all.fold(0.0, f64::max))
    }

    #[test]
    fn it_is_a_bound() {
        for name in shapes::NAMES {
            let (bound, largest) = both(&shapes::by_name(name).unwrap());
            assert!(bound >= largest, "{name}: {bound} {largest}");
        }
    }

    #[test]
    fn fine_round_parts_are_surely_round_and_others_are_not() {
        let mut ball = shapes::icosphere(7, 40.0);
        let (bound, largest) = both(&ball);
        assert!(largest <= bound, "{bound} {largest}");
        for p in ball.vertices.iter_mut().filter(|p| p.x > 30.0) {
            p.x = 30.0;
        }
        let (bound, largest) = both(&ball);
        assert!(bound >= largest && largest > LEAST, "{bound} {largest}");
        assert!(both(&shapes::icosphere(8, 40.0)).0 < LEAST);
    }
}
