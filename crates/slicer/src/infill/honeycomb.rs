//! Hexagonal cells, upright.
//!
//! Every second line is the mirror image of its neighbours. Two of them share a wall of each cell,
//! where they run side by side, a bead apart; the other walls are single. The pattern is that of
//! PrusaSlicer's `honeycomb`.

use nalgebra::{Point2, Rotation2};

use super::clip::Course;

/// The measures of a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cells {
    /// Length of a side of a cell, mm.
    side: f64,
    /// Half the distance of the lines that share a wall, mm.
    half_gap: f64,
}

impl Cells {
    /// Cells whose lines have the length by area of parallel lines `spacing` apart (mm); `bead` is
    /// the distance of two beads side by side.
    fn new(spacing: f64, bead: f64) -> Self {
        let half_gap = bead / 2.0;
        // The wider the cells, the less line there is in an area.
        let (mut low, mut high) = (bead, 4.0 * spacing + 4.0 * bead);
        for _ in 0..HALVINGS {
            let cells = Self { side: f64::midpoint(low, high), half_gap };
            if cells.length_by_area() > 1.0 / spacing {
                low = cells.side;
            } else {
                high = cells.side;
            }
        }
        Self { side: high, half_gap }
    }

    /// Distance of the walls of a cell, mm.
    fn width(&self) -> f64 {
        3.0_f64.sqrt() * self.side
    }

    fn length_by_area(&self) -> f64 {
        let across = (self.width() / 2.0 - 2.0 * self.half_gap).max(0.0);
        let slanted = across.hypot(self.side / 2.0);
        // In a place as wide as a cell and twice as high as rows lie apart: two lines, each with two
        // upright pieces and two slanted ones.
        4.0 * (self.side + slanted) / (3.0 * self.side * self.width())
    }
}

/// Enough to halve any interval of lengths below a grid step.
const HALVINGS: usize = 48;

/// Returns the lines within `reach` mm of the axis. `angle` is the direction of the shared walls.
pub(super) fn courses(reach: f64, spacing: f64, bead: f64, angle: f64) -> Vec<Course> {
    let cells = Cells::new(spacing, bead);
    let (width, row) = (cells.width(), 1.5 * cells.side);
    // Far enough beyond the reach that lines begin and end outside.
    let columns = (reach / width).ceil() as i64 + 2;
    let rows = (reach / row).ceil() as i64 + 2;
    let turned = Rotation2::new(angle - std::f64::consts::FRAC_PI_2);
    let mut courses = Vec::new();
    for column in -columns..=columns {
        for mirrored in [false, true] {
            let mut points = Vec::new();
            for k in -rows..=rows {
                // The axis lies in the middle of a cell: walls of even rows are half a cell off.
                let is_even = k.rem_euclid(2) == 0;
                let wall = match (is_even, mirrored) {
                    (true, false) => -0.5 * width + cells.half_gap,
                    (false, false) => -cells.half_gap,
                    (true, true) => 0.5 * width - cells.half_gap,
                    (false, true) => cells.half_gap,
                };
                let x = column as f64 * width + wall;
                let middle = k as f64 * row;
                points.push(turned * Point2::new(x, middle - cells.side / 2.0));
                points.push(turned * Point2::new(x, middle + cells.side / 2.0));
            }
            courses.push(Course { points, closed: false });
        }
    }
    courses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_hexagons_of_the_wanted_density() {
        for (spacing, bead) in [(2.0, 0.4), (4.0, 0.4), (0.9, 0.4)] {
            let cells = Cells::new(spacing, bead);
            assert!((cells.length_by_area() * spacing - 1.0).abs() < 1e-9);
        }
        // Without thickness: a hexagon of side a has walls of (4/3)/(√3 a)·2 with one pair doubled.
        let cells = Cells::new(4.0, 1e-6);
        let exact = 16.0 / (3.0 * 3.0_f64.sqrt()) * 4.0 / 2.0;
        assert!((cells.side / exact - 1.0).abs() < 1e-3, "{} {exact}", cells.side);
    }

    #[test]
    fn lines_that_share_a_wall_lie_a_bead_apart() {
        let courses = courses(10.0, 3.0, 0.4, 0.3);
        // Upright pieces run along the angle.
        let along = nalgebra::Vector2::new(0.3_f64.cos(), 0.3_f64.sin());
        let mut walls: Vec<(f64, f64)> = Vec::new();
        for course in &courses {
            for pair in course.points.chunks_exact(2) {
                assert!((pair[1] - pair[0]).perp(&along).abs() < 1e-9);
                let middle = nalgebra::center(&pair[0], &pair[1]).coords;
                walls.push((middle.dot(&along), along.perp(&middle)));
            }
        }
        let near: Vec<&(f64, f64)> =
            walls.iter().filter(|(u, v)| u.abs() < 8.0 && v.abs() < 8.0).collect();
        assert!(near.len() > 10);
        for (u, v) in near {
            let neighbours = walls
                .iter()
                .filter(|(a, b)| (a - u).abs() < 1e-6 && ((b - v).abs() - 0.4).abs() < 1e-6);
            assert_eq!(neighbours.count(), 1, "wall at {u} {v}");
        }
    }
}
