//! How high the print stands, so that travel clears it.
//!
//! On flat layers nothing stands higher than the nozzle. On curved ones the way to the next line may
//! lead over a dome, and the nozzle must rise above it: above the highest material on the way, and
//! not more.
//!
//! What stands beside the way must clear the cone of the nozzle and the block above it. Nothing is ever
//! printed above the layer that is being laid, and layers were checked to clear the nozzle where its tip
//! runs on them; so only a way below that layer, such as the chord between two places of a dome, is
//! looked at.
//!
//! The heights are kept on a square grid. A cell holds the highest nozzle tip that laid material in
//! it; a question takes the cells around the way as well, so that the flat end of the nozzle, and
//! half a bead that sticks out of its cell, are covered.

use geom::polyline::distance_to_segment;
use machine::profile::NozzleShape;
use nalgebra::{Point2, Point3};

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
    /// The greatest height in each block of cells, row by row.
    blocks: Vec<f32>,
    /// Blocks along a side.
    block_count: usize,
    nozzle: NozzleShape,
}

/// Cells along the side of a block.
const BLOCK: usize = 8;

/// How far from the middle of its cell a bead may reach, mm, besides half a diagonal of the cell: half of
/// a wide one.
const HALF_BEAD_MM: f64 = 0.3;

/// Height that a cell is rounded down by, mm: more than an `f32` rounds off below 1000 mm, so that
/// the line just laid does not stand above the nozzle that laid it.
const ROUNDING_MM: f64 = 1e-4;

impl Printed {
    /// Returns the empty bed of a machine with this nozzle that reaches `radius` mm from the axis.
    #[must_use]
    pub fn nothing(radius: f64, nozzle: NozzleShape) -> Self {
        let cell = CELL_MM.max(2.0 * radius / MOST_CELLS);
        // One cell more on every side, for questions at the rim.
        let count = (2.0 * radius / cell).ceil() as usize + 2;
        let block_count = count.div_ceil(BLOCK);
        let heights = vec![0.0; count * count];
        let blocks = vec![0.0; block_count * block_count];
        Self { cell, count, heights, blocks, block_count, nozzle }
    }

    /// Adds a straight bead with its upper side along `a` to `b`.
    pub fn add(&mut self, a: &Point3<f64>, b: &Point3<f64>) {
        for p in self.along(a, b) {
            let (column, row) = self.cell_of(&p);
            let height = &mut self.heights[row * self.count + column];
            *height = height.max((p.z - ROUNDING_MM) as f32);
            let block = &mut self.blocks[row / BLOCK * self.block_count + column / BLOCK];
            *block = block.max((p.z - ROUNDING_MM) as f32);
        }
    }

    /// Returns how high the tip must be on the way from `a` to `b`, seen from above, so that cone and
    /// block clear what stands beside it, mm; at least `lowest`.
    #[must_use]
    pub fn beside(&self, a: &Point2<f64>, b: &Point2<f64>, lowest: f64) -> f64 {
        let side = self.cell * BLOCK as f64;
        let reach = self.nozzle.block_radius + side;
        let least = self.cell_of_plane(&(a.inf(b) - nalgebra::Vector2::repeat(reach)));
        let most = self.cell_of_plane(&(a.sup(b) + nalgebra::Vector2::repeat(reach)));
        let mut needed = lowest;
        for row in least.1 / BLOCK..=most.1 / BLOCK {
            for column in least.0 / BLOCK..=most.0 / BLOCK {
                let height = self.blocks[row * self.block_count + column];
                let middle = self.middle_of([column, row], BLOCK);
                if self.tip_below(&middle, side, height, (a, b)) > needed {
                    needed = self.beside_block([column, row], (a, b), needed);
                }
            }
        }
        needed
    }

    /// As [`beside`](Self::beside), for what stands in a block.
    fn beside_block(
        &self,
        [column, row]: [usize; 2],
        way: (&Point2<f64>, &Point2<f64>),
        lowest: f64,
    ) -> f64 {
        let within = |k: usize| k * BLOCK..((k + 1) * BLOCK).min(self.count);
        let cells = within(row).flat_map(|row| within(column).map(move |column| (row, column)));
        cells.fold(lowest, |needed, (row, column)| {
            let height = self.heights[row * self.count + column];
            let middle = self.middle_of([column, row], 1);
            needed.max(self.tip_below(&middle, self.cell, height, way))
        })
    }

    /// How high the tip must be for what stands `height` mm high in a square about `middle`.
    fn tip_below(
        &self,
        middle: &Point2<f64>,
        side: f64,
        height: f32,
        (a, b): (&Point2<f64>, &Point2<f64>),
    ) -> f64 {
        let half = side * std::f64::consts::FRAC_1_SQRT_2 + HALF_BEAD_MM;
        let distance = (distance_to_segment(a, b, middle) - half).max(0.0);
        f64::from(height) - self.underside(distance)
    }

    /// How high above its tip the nozzle is at this distance from its axis, mm; infinite beyond the block.
    fn underside(&self, distance: f64) -> f64 {
        let NozzleShape { flat_radius, half_angle, block_height, block_radius, .. } = self.nozzle;
        if distance > block_radius {
            return f64::INFINITY;
        }
        ((distance - flat_radius).max(0.0) / half_angle.tan()).min(block_height)
    }

    /// The middle of a square of `cells` by `cells`, given by its place among such squares.
    fn middle_of(&self, place: [usize; 2], cells: usize) -> Point2<f64> {
        let half = self.count as f64 / 2.0;
        let at = |k: usize| ((k as f64 + 0.5) * cells as f64 - half) * self.cell;
        Point2::new(at(place[0]), at(place[1]))
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
        self.cell_of_plane(&p.xy())
    }

    fn cell_of_plane(&self, p: &Point2<f64>) -> (usize, usize) {
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
        let mut printed = Printed::nothing(50.0, NozzleShape::COMMON);
        printed.add(&p(0.0, -10.0, 3.0), &p(0.0, 10.0, 5.0));
        let (above, highest) = printed.over(&p(-8.0, 0.0, 1.0), &p(8.0, 0.0, 1.0));
        assert!((highest - 4.0).abs() < 0.3, "{highest}");
        assert!((above - 3.0).abs() < 0.3, "{above}");
        let (above, _) = printed.over(&p(-8.0, 0.0, 6.0), &p(8.0, 0.0, 6.0));
        assert!(above < 0.0);
        assert_eq!(printed.over(&p(5.0, -9.0, 0.0), &p(5.0, 9.0, 0.0)).1, 0.0);
    }

    #[test]
    fn the_nozzle_clears_what_stands_beside_the_way() {
        let mut printed = Printed::nothing(50.0, NozzleShape::COMMON);
        printed.add(&p(-2.0, 3.0, 16.0), &p(2.0, 3.0, 16.0));
        let way = [Point2::new(-20.0, 0.0), Point2::new(20.0, 0.0)];
        let needed = printed.beside(&way[0], &way[1], 4.0);
        // Its side is 0.23 mm nearer than the line; cells and wide beads take 0.5 mm more.
        let cone = |d: f64| 16.0 - (d - 0.5) / std::f64::consts::FRAC_PI_6.tan();
        assert!(needed >= cone(2.77) && needed < cone(2.0), "{needed}");
        assert_eq!(printed.beside(&way[0], &way[1], 15.0), 15.0);
        let far = Point2::new(-20.0, -18.5);
        assert_eq!(printed.beside(&far, &Point2::new(20.0, -18.5), 1.0), 1.0);
        // Under the block, but beside the cone.
        let under = printed.beside(&Point2::new(-20.0, -10.0), &Point2::new(20.0, -10.0), 1.0);
        assert!((under - 4.0).abs() < 1e-3, "{under}");
    }

    #[test]
    fn heights_only_grow_and_hold_outside_the_reach() {
        let mut printed = Printed::nothing(20.0, NozzleShape::COMMON);
        printed.add(&p(3.0, 3.0, 2.0), &p(4.0, 3.0, 2.0));
        printed.add(&p(3.0, 3.0, 1.0), &p(4.0, 3.0, 1.0));
        assert!(printed.around(&p(3.5, 3.0, 0.0)) >= 1.999);
        printed.add(&p(500.0, -500.0, 7.0), &p(600.0, -500.0, 7.0));
        assert!(printed.around(&p(900.0, -900.0, 0.0)) >= 6.999);
    }

    #[test]
    fn large_machines_take_no_more_memory() {
        assert!(Printed::nothing(5000.0, NozzleShape::COMMON).heights.len() < 1_100_000);
    }
}
