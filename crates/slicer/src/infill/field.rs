//! Patterns that fill space: level sets of a function of the place, cut by the layer.
//!
//! What a layer shows of such a pattern is where the function, taken on the layer, is a whole
//! number. It is found on a grid of triangles as seen along the axis: a value is *above* a level or
//! not, decided once for each corner, so that every level crosses each triangle in one piece or not
//! at all and pieces join without gaps. The points are then moved onto the level along the side
//! that they lie on.

use nalgebra::{Point2, Point3};

use super::clip::Course;

/// The function of the gyroid (sin x cos y + sin y cos z + sin z cos x) with its period, mm. Only the level 0 is ever met.
pub(super) fn gyroid(period: f64) -> impl Fn(&Point3<f64>) -> f64 {
    let scale = std::f64::consts::TAU / period;
    move |p| {
        let [(sx, cx), (sy, cy), (sz, cz)] = [p.x, p.y, p.z].map(|v| (v * scale).sin_cos());
        (sx * cy + sy * cz + sz * cx) / MORE_THAN_GREATEST
    }
}

/// More than the greatest value of the gyroid's function, 1.5: it then meets no level but 0.
const MORE_THAN_GREATEST: f64 = 2.0;

/// Length by area, in inverse periods, of the gyroid's lines in layers across one of its axes, on
/// the average over a period; by numerical integration. (Cuts of all directions would have π/4
/// times the surface of a period, 2.432: layers along the axes meet more of it.)
const GYROID_LENGTH: f64 = 2.499;

/// The period of a gyroid whose lines have the length by area of parallel lines `spacing` apart.
pub(super) fn gyroid_period(spacing: f64) -> f64 {
    GYROID_LENGTH * spacing
}

/// Returns the lines of a field in a box.
///
/// `step` is the side of the grid's squares, mm; `height` that of the layer over a place.
pub(super) fn courses(
    [low, high]: [Point2<f64>; 2],
    step: f64,
    height: impl Fn(&Point2<f64>) -> f64,
    field: impl Fn(&Point3<f64>) -> f64,
) -> Vec<Course> {
    let value = |p: &Point2<f64>| field(&Point3::new(p.x, p.y, height(p)));
    let grid = Grid::new(low, high, step);
    let values: Vec<f64> = (0..grid.corners()).map(|corner| value(&grid.at(corner))).collect();
    let mut pieces = Vec::new();
    for row in 0..grid.rows - 1 {
        for column in 0..grid.columns - 1 {
            for triangle in grid.triangles(row, column) {
                cross(&triangle, &values, &mut pieces);
            }
        }
    }
    let place = |key: &Key| grid.on_level(key, &values, value);
    join(&pieces).into_iter().map(|line| line.placed(place)).collect()
}

/// A grid of squares, each halved by a diagonal.
struct Grid {
    low: Point2<f64>,
    step: f64,
    columns: usize,
    rows: usize,
}

/// A crossing of a side (by its two corners, the lesser first) and a level.
type Key = (u32, u32, i64);

impl Grid {
    fn new(low: Point2<f64>, high: Point2<f64>, step: f64) -> Self {
        // Whole multiples of the step, so that the grid is the same whatever the box.
        let first = low.map(|v| (v / step).floor() - 1.0);
        let count = high.map(|v| (v / step).ceil() + 1.0) - first;
        let low = first * step;
        Self { low, step, columns: count.x as usize + 1, rows: count.y as usize + 1 }
    }

    fn corners(&self) -> usize {
        self.columns * self.rows
    }

    fn at(&self, corner: usize) -> Point2<f64> {
        let (row, column) = (corner / self.columns, corner % self.columns);
        self.low + nalgebra::Vector2::new(column as f64, row as f64) * self.step
    }

    fn triangles(&self, row: usize, column: usize) -> [[usize; 3]; 2] {
        let corner = row * self.columns + column;
        let above = corner + self.columns;
        [[corner, corner + 1, above + 1], [corner, above + 1, above]]
    }

    /// Where a side meets a level: by its ends, then nearer by the field itself.
    fn on_level(
        &self,
        &(a, b, level): &Key,
        values: &[f64],
        value: impl Fn(&Point2<f64>) -> f64,
    ) -> Point2<f64> {
        let level = level as f64;
        let (from, to) = (self.at(a as usize), self.at(b as usize));
        let mut below = (0.0, values[a as usize] - level);
        let mut above = (1.0, values[b as usize] - level);
        let mut share = 0.5;
        for _ in 0..REFINEMENTS {
            share = (below.0 * above.1 - above.0 * below.1) / (above.1 - below.1);
            let off = value(&(from + (to - from) * share)) - level;
            if (off >= 0.0) == (above.1 >= 0.0) {
                above = (share, off);
            } else {
                below = (share, off);
            }
            if above.1 == below.1 {
                break;
            }
        }
        from + (to - from) * share
    }
}

/// Of false position; the fields are nearly straight along a side.
const REFINEMENTS: usize = 3;

/// Appends the pieces in which levels cross a triangle.
fn cross(corners: &[usize; 3], values: &[f64], pieces: &mut Vec<[Key; 2]>) {
    let floors = corners.map(|corner| values[corner].floor() as i64);
    let (low, high) = (floors.iter().min(), floors.iter().max());
    let (Some(&low), Some(&high)) = (low, high) else { return };
    for level in low + 1..=high {
        let is_above = floors.map(|floor| floor >= level);
        let mut met = (0..3).filter_map(|k| {
            let next = (k + 1) % 3;
            let (a, b) = (corners[k] as u32, corners[next] as u32);
            (is_above[k] != is_above[next]).then_some((a.min(b), a.max(b), level))
        });
        if let (Some(from), Some(to)) = (met.next(), met.next()) {
            pieces.push([from, to]);
        }
    }
}

/// A line by the sides that it crosses.
struct Line {
    keys: Vec<Key>,
    closed: bool,
}

impl Line {
    fn placed(&self, place: impl Fn(&Key) -> Point2<f64>) -> Course {
        Course { points: self.keys.iter().map(place).collect(), closed: self.closed }
    }
}

/// Joins pieces that share a crossing.
fn join(pieces: &[[Key; 2]]) -> Vec<Line> {
    let mut ends: Vec<(Key, u32)> = Vec::with_capacity(2 * pieces.len());
    for (index, piece) in pieces.iter().enumerate() {
        ends.extend(piece.map(|key| (key, index as u32)));
    }
    ends.sort_unstable();
    let at = |key: Key| {
        let first = ends.partition_point(|(other, _)| *other < key);
        let same = ends[first..].iter().take(2).take_while(move |(other, _)| *other == key);
        same.map(|(_, index)| *index as usize)
    };
    let mut used = vec![false; pieces.len()];
    let mut lines = Vec::new();
    // Lines that end at the edge of the grid first; what is left over is closed.
    for is_closed in [false, true] {
        for start in 0..pieces.len() {
            let begin = pieces[start].iter().position(|key| at(*key).count() == 1);
            let (false, Some(begin)) = (used[start], begin.or(is_closed.then_some(0))) else {
                continue;
            };
            let mut keys = vec![pieces[start][begin]];
            let (mut piece, mut exit) = (start, pieces[start][1 - begin]);
            loop {
                used[piece] = true;
                let next = at(exit).find(|&i| !used[i]);
                let closes = is_closed && next.is_none();
                if !closes {
                    keys.push(exit);
                }
                let Some(next) = next else { break };
                let entry = usize::from(pieces[next][1] == exit);
                (piece, exit) = (next, pieces[next][1 - entry]);
            }
            lines.push(Line { keys, closed: is_closed });
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::distance;

    const BOX: [Point2<f64>; 2] = [Point2::new(-10.0, -8.0), Point2::new(10.0, 8.0)];

    fn length(course: &Course) -> f64 {
        let closing = match (course.points.first(), course.points.last()) {
            (Some(a), Some(b)) if course.closed => distance(a, b),
            _ => 0.0,
        };
        geom::polyline::length(&course.points) + closing
    }

    #[test]
    fn circles_are_closed_and_round() {
        let found = courses(BOX, 0.5, |_| 0.0, |p| p.x.hypot(p.y) / 3.0);
        let closed: Vec<&Course> = found.iter().filter(|course| course.closed).collect();
        assert_eq!(closed.len(), 2);
        for course in closed {
            let radius = course.points[0].coords.norm();
            assert!((radius / 3.0 - (radius / 3.0).round()).abs() < 1e-4);
            let around = std::f64::consts::TAU * radius;
            assert!((length(course) / around - 1.0).abs() < 0.01);
        }
        // The circle of 9 mm leaves the box through two sides.
        assert_eq!(found.iter().filter(|course| !course.closed).count() % 2, 0);
    }

    #[test]
    fn planes_are_straight_lines() {
        let found = courses(BOX, 1.0, |p| 0.3 * p.x, |p| (p.y + p.z) / 2.0 + 0.25);
        assert!(found.len() > 8);
        for point in found.iter().flat_map(|course| &course.points) {
            let level = (point.y + 0.3 * point.x) / 2.0 + 0.25;
            assert!((level - level.round()).abs() < 1e-9);
        }
    }

    #[test]
    fn a_gyroid_has_its_density_over_a_period() {
        let spacing = 2.0;
        let period = gyroid_period(spacing);
        let half = 3.0 * period;
        let layers = 24;
        let mut total = 0.0;
        for k in 0..layers {
            let z = period * f64::from(k) / f64::from(layers);
            let bounds = [Point2::new(-half, -half), Point2::new(half, half)];
            let area = nalgebra::Vector2::new(half, half);
            let found = courses(bounds, period / 24.0, |_| z, gyroid(period));
            let inside = |p: &Point2<f64>| p.x.abs() < area.x && p.y.abs() < area.y;
            total += found
                .iter()
                .flat_map(|course| course.points.windows(2))
                .filter(|w| inside(&nalgebra::center(&w[0], &w[1])))
                .map(|w| distance(&w[0], &w[1]))
                .sum::<f64>();
        }
        let density = total / f64::from(layers) / (2.0 * half).powi(2) * spacing;
        assert!((density - 1.0).abs() < 0.005, "{density}");
    }
}
