//! The rim of a thin place, made ready to be asked for its distance.

use geom::polyline::{distance_to_segment, share_nearest};
use nalgebra::{Point2, Vector2, center, distance};

use crate::chart::Chart;

/// Side of the square cells that pieces of the rim are sorted by, mm: about the half-widths asked
/// for, so that a question looks at few cells and few pieces.
const CELL_MM: f64 = 0.5;

/// From so many times the distance asked for on, the axis is too far away for the metric to change
/// on the way.
const FAR_IN_BOUNDS: f64 = 8.0;

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

    /// Returns the true distance of `p` from the rim, of which it is known that it is at most `bound`
    /// (mm of the chart).
    pub(super) fn distance(&self, p: &Point2<f64>, bound: f64, chart: &Chart) -> f64 {
        if chart.is_flat() {
            return self.least(p, bound, bound, |a, b| distance_to_segment(a, b, p));
        }
        let s = p.coords.norm();
        let outwards = p.coords.try_normalize(0.0).unwrap_or_else(Vector2::x);
        let stretch = chart.stretch(s);
        // Seen from p in true lengths; far from the axis that is all.
        let seen = |q: &Point2<f64>| {
            let way = q - p;
            Point2::new(outwards.dot(&way), stretch * outwards.perp(&way))
        };
        let is_far = s > FAR_IN_BOUNDS * bound;
        let to_piece = |a: &Point2<f64>, b: &Point2<f64>| {
            let (from, to) = (seen(a), seen(b));
            if is_far {
                return distance_to_segment(&from, &to, &Point2::origin());
            }
            let share = share_nearest(&from, &to, &Point2::origin());
            [share, 0.0, 1.0]
                .map(|share| chart.distance(p, &(a + (b - a) * share)))
                .into_iter()
                .fold(f64::INFINITY, f64::min)
        };
        self.least(p, bound / stretch, bound, to_piece)
    }

    /// The least of `bound` and the distances of the pieces within `reach` of `p`.
    fn least(
        &self,
        p: &Point2<f64>,
        reach: f64,
        bound: f64,
        to_piece: impl Fn(&Point2<f64>, &Point2<f64>) -> f64,
    ) -> f64 {
        let reach = reach + self.reach;
        let (first, last) = (cell(p.x - reach), cell(p.x + reach));
        let mut least = bound;
        for row in cell(p.y - reach)..=cell(p.y + reach) {
            let from = self.pieces.partition_point(|&(r, c, _)| (r, c) < (row, first));
            for (r, c, [a, b]) in &self.pieces[from..] {
                if (*r, *c) > (row, last) {
                    break;
                }
                least = least.min(to_piece(a, b));
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
            assert!((rim.distance(&p, bound, &Chart::Plane) - all).abs() < 1e-12, "{p}");
        }
    }

    #[test]
    fn distances_are_true_on_curved_layers() {
        // A strip along a meridian and one round the axis, both with points as they come.
        let corners = |[x, y]: [f64; 2], [w, h]: [f64; 2]| {
            [[x, y], [x + w, y], [x + w, y + h], [x, y + h]].map(Point2::from).to_vec()
        };
        for chart in [Chart::cone(0.7), Chart::Sphere { radius: 25.0 }] {
            for (corner, size) in
                [([4.0, -0.4], [12.0, 0.8]), ([9.0, -6.0], [0.8, 12.0]), ([-0.3, 0.0], [0.9, 9.0])]
            {
                let ring: Vec<Point2<f64>> = corners(corner, size)
                    .windows(2)
                    .chain([[corners(corner, size)[3], corners(corner, size)[0]].as_slice()])
                    .flat_map(|side| {
                        (0..40)
                            .map(|k| side[0] + (side[1] - side[0]) * (f64::from(k) / 40.0))
                            .collect::<Vec<_>>()
                    })
                    .collect();
                let rim = Rim::new(std::slice::from_ref(&ring));
                let middle = Point2::from(corner) + Vector2::from(size) / 2.0;
                let long = Vector2::new(size[0], size[1]) / 2.0;
                for share in [-0.6, 0.1, 0.5] {
                    let along = if size[0] > size[1] { [share, 0.03] } else { [0.03, share] };
                    let p = middle + Vector2::new(long.x * along[0], long.y * along[1]);
                    let sides = ring.iter().zip(ring.iter().cycle().skip(1));
                    let true_distance = sides
                        .flat_map(|(a, b)| {
                            (0..=50).map(move |k| a + (b - a) * (f64::from(k) / 50.0))
                        })
                        .map(|q| chart.distance(&p, &q))
                        .fold(f64::INFINITY, f64::min);
                    let found = rim.distance(&p, distance(&p, &ring[0]), &chart);
                    assert!(
                        (found / true_distance - 1.0).abs() < 0.003,
                        "{p}: {found}, {true_distance}"
                    );
                }
            }
        }
    }
}
