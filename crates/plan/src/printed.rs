//! How high the print stands, so that travel clears it.
//!
//! On flat layers nothing stands higher than the nozzle. On curved ones the way to the next line may
//! lead over a dome, and the nozzle must rise above it: above the highest material on the way, and
//! not more.
//!
//! The heights are kept on a square grid. A cell holds the highest nozzle tip that laid material in
//! it; a question takes the cells around the way as well, so that the flat end of the nozzle, and
//! half a bead that sticks out of its cell, are covered.

use nalgebra::Point3;

/// Side of a cell, mm: about a bead, and half the flat end of a nozzle.
const CELL_MM: f64 = 0.5;

/// Most cells along a side; machines that reach farther get larger cells.
const MOST_CELLS: f64 = 1024.0;

/// Heights of the print over the bed.
#[derive(Debug, Clone)]
pub struct Printed {
    cell: f64,
    /// Cells along a side; the grid is centred on the axis.
    count: usize,
    /// Row by row, mm.
    heights: Vec<f32>,
}

/// Height that a cell is rounded down by, mm: more than an `f32` rounds off below 1000 mm, so that
/// the line just laid does not stand above the nozzle that laid it.
const ROUNDING_MM: f64 = 1e-4;

impl Printed {
    /// Returns the empty bed of a machine that reaches `radius` mm from the axis.
    #[must_use]
    pub fn nothing(radius: f64) -> Self {
        let cell = CELL_MM.max(2.0 * radius / MOST_CELLS);
        // One cell more on every side, for questions at the rim.
        let count = (2.0 * radius / cell).ceil() as usize + 2;
        Self { cell, count, heights: vec![0.0; count * count] }
    }

    /// Adds a straight bead with its upper side along `a` to `b`.
    pub fn add(&mut self, a: &Point3<f64>, b: &Point3<f64>) {
        for p in self.along(a, b) {
            let (column, row) = self.cell_of(&p);
            let height = &mut self.heights[row * self.count + column];
            *height = height.max((p.z - ROUNDING_MM) as f32);
        }
    }

    /// Returns the height of the print around `p`.
    #[must_use]
    pub fn around(&self, p: &Point3<f64>) -> f64 {
        let (column, row) = self.cell_of(p);
        let near = |k: usize| k.saturating_sub(1)..=(k + 1).min(self.count - 1);
        near(row)
            .flat_map(|row| near(column).map(move |column| (row, column)))
            .map(|(row, column)| f64::from(self.heights[row * self.count + column]))
            .fold(0.0, f64::max)
    }

    /// Returns how far, at most, the print stands above the straight way from `a` to `b`, and its
    /// greatest height on that way, mm. The first is negative where the whole way is clear.
    #[must_use]
    pub fn over(&self, a: &Point3<f64>, b: &Point3<f64>) -> (f64, f64) {
        self.along(a, b).fold((f64::NEG_INFINITY, 0.0), |(above, highest), p| {
            let height = self.around(&p);
            (f64::max(above, height - p.z), f64::max(highest, height))
        })
    }

    /// Points of a segment no farther apart than half a cell, seen from above.
    fn along(&self, a: &Point3<f64>, b: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> + use<> {
        let steps = ((b.xy() - a.xy()).norm() / (0.5 * self.cell)).ceil().max(1.0);
        let (a, b) = (*a, *b);
        (0..=steps as u32).map(move |k| a + (b - a) * (f64::from(k) / steps))
    }

    fn cell_of(&self, p: &Point3<f64>) -> (usize, usize) {
        let half = self.count as f64 / 2.0;
        // A float-to-int cast saturates; what is out of reach counts to the rim.
        let index =
            |coordinate: f64| ((coordinate / self.cell + half) as usize).min(self.count - 1);
        (index(p.x), index(p.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }

    #[test]
    fn a_ridge_on_the_way_is_seen_and_one_beside_it_is_not() {
        let mut printed = Printed::nothing(50.0);
        printed.add(&p(0.0, -10.0, 3.0), &p(0.0, 10.0, 5.0));
        let (above, highest) = printed.over(&p(-8.0, 0.0, 1.0), &p(8.0, 0.0, 1.0));
        assert!((highest - 4.0).abs() < 0.3, "{highest}");
        assert!((above - 3.0).abs() < 0.3, "{above}");
        let (above, _) = printed.over(&p(-8.0, 0.0, 6.0), &p(8.0, 0.0, 6.0));
        assert!(above < 0.0);
        assert_eq!(printed.over(&p(5.0, -9.0, 0.0), &p(5.0, 9.0, 0.0)).1, 0.0);
    }

    #[test]
    fn heights_only_grow_and_hold_outside_the_reach() {
        let mut printed = Printed::nothing(20.0);
        printed.add(&p(3.0, 3.0, 2.0), &p(4.0, 3.0, 2.0));
        printed.add(&p(3.0, 3.0, 1.0), &p(4.0, 3.0, 1.0));
        assert!(printed.around(&p(3.5, 3.0, 0.0)) >= 1.999);
        printed.add(&p(500.0, -500.0, 7.0), &p(600.0, -500.0, 7.0));
        assert!(printed.around(&p(900.0, -900.0, 0.0)) >= 6.999);
    }

    #[test]
    fn large_machines_take_no_more_memory() {
        assert!(Printed::nothing(5000.0).heights.len() < 1_100_000);
    }
}
