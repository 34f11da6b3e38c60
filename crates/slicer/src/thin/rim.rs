//! The rim of a thin place, made ready to be asked for its distance.

use geom::polyline::distance_to_segment;
use nalgebra::{Point2, center, distance};

/// Side of the square cells that pieces of the rim are sorted by, mm: about the half-widths asked
/// for, so that a question looks at few cells and few pieces.
const CELL_MM: f64 = 0.5;

/// Rings as short pieces, sorted by the cell of their middle.
pub(super) struct Rim {
    /// Row, column and ends, ascending.
    pieces: Vec<(i64, i64, [Point2<f64>; 2])>,
    /// Half of the longest piece, mm.
    reach: f64,
}

impl Rim {
    /// Sorts the sides of closed rings; no side should be much longer than a cell.
    pub(super) fn new(rings: &[Vec<Point2<f64>>]) -> Self {
        let sides = rings
            .iter()
            .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]));
        let mut pieces: Vec<_> = sides
            .map(|[a, b]| {
                let middle = center(&a, &b);
                (cell(middle.y), cell(middle.x), [a, b])
            })
            .collect();
        pieces.sort_by_key(|&(row, column, _)| (row, column));
        let reach = pieces.iter().map(|(_, _, [a, b])| distance(a, b) / 2.0).fold(0.0, f64::max);
        Self { pieces, reach }
    }

    /// Returns the distance of `p` from the rim, of which it is known that it is at most `bound`.
    pub(super) fn distance(&self, p: &Point2<f64>, bound: f64) -> f64 {
        let reach = bound + self.reach;
        let (first, last) = (cell(p.x - reach), cell(p.x + reach));
        let mut least = bound;
        for row in cell(p.y - reach)..=cell(p.y + reach) {
            let from = self.pieces.partition_point(|&(r, c, _)| (r, c) < (row, first));
            for (r, c, [a, b]) in &self.pieces[from..] {
                if (*r, *c) > (row, last) {
                    break;
                }
                least = least.min(distance_to_segment(a, b, p));
            }
        }
        least
    }
}

fn cell(coordinate: f64) -> i64 {
    (coordinate / CELL_MM).floor() as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_distance_is_the_least_over_all_pieces() {
        let ring: Vec<Point2<f64>> = (0..400)
            .map(|k| {
                let angle = TAU * f64::from(k) / 400.0;
                let radius = 5.0 + 1.5 * (7.0 * angle).sin();
                Point2::new(radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        let rim = Rim::new(std::slice::from_ref(&ring));
        for k in 0..200 {
            let p = Point2::new(f64::from(k) * 0.05 - 5.0, f64::from(k % 17) * 0.5 - 4.0);
            let all = (0..ring.len())
                .map(|i| distance_to_segment(&ring[i], &ring[(i + 1) % ring.len()], &p))
                .fold(f64::INFINITY, f64::min);
            let bound = distance(&p, &ring[0]);
            assert!((rim.distance(&p, bound) - all).abs() < 1e-12, "{p}");
        }
    }
}
