//! Round holes as polygons of few corners: polyholes.
//!
//! A bead on the inner side of a tight bend is pulled inwards, and a drilled hole comes out narrower
//! than it is drawn. Along a straight line it is not, so that a hole whose sides are straight and touch
//! the circle lets through what it is drawn for. Corners, which reach beyond the circle, lie over the
//! middles of the sides below where every other layer is turned by half a side.
//!
//! Source: C. Palmer (2011), "Polyholes", <https://hydraraptor.blogspot.com/2011/02/polyholes.html>:
//! twice as many sides as the diameter has mm, for a nozzle of 0.4 mm. That half a side of turn seals
//! the corners is SuperSlicer's. Here a hole is looked for as it is seen along the axis, so that upright
//! bores are found on cones and spheres as on planes.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use geom::grid::mm;
use geom::polyline::distance_to_segment;
use geom::region::{Fill, Region, Ring};
use geom::simplify::simplify_line;
use nalgebra::{Matrix3, Point2, Vector3};

use crate::chart::Chart;

/// Which holes become polygons, and which polygons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolyholeParams {
    /// How far corners of a round hole may lie off its circle, and bores of neighbouring layers off
    /// each other, mm.
    pub threshold: f64,
    /// Whether every other layer is turned by half a side.
    pub is_twisted: bool,
    /// Diameter of the nozzle, mm: wider ones need fewer sides.
    pub nozzle: f64,
}

/// A round hole, seen along the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bore {
    /// mm.
    pub centre: Point2<f64>,
    /// Of the circle on which its corners lie, mm.
    pub radius: f64,
}

impl Bore {
    /// Returns whether another layer's hole is the same one, to within this distance, mm.
    #[must_use]
    pub fn is_like(&self, other: &Self, threshold: f64) -> bool {
        (self.centre - other.centre).norm() <= threshold
            && (self.radius - other.radius).abs() <= threshold
    }

    /// Returns the polygon around the circle; `is_turned` by half a side.
    fn polygon(&self, is_turned: bool, nozzle: f64) -> Vec<Point2<f64>> {
        let sides = sides(2.0 * self.radius, nozzle);
        let half_side = PI / sides as f64;
        let reach = self.radius / half_side.cos();
        let begin = if is_turned { half_side } else { 0.0 };
        let corner = |k: usize| {
            let (sin, cos) = (begin + 2.0 * half_side * k as f64).sin_cos();
            self.centre + nalgebra::Vector2::new(cos, sin) * reach
        };
        (0..sides).map(corner).collect()
    }
}

/// How many sides a hole of this diameter has.
fn sides(diameter: f64, nozzle: f64) -> usize {
    /// Sides by mm of the diameter, by mm of the nozzle.
    const SIDES_TIMES_NOZZLE: f64 = 2.0 * 0.4;
    ((diameter * SIDES_TIMES_NOZZLE / nozzle).round() as usize).max(3)
}

impl PolyholeParams {
    /// Returns how much wider a hole becomes at most, mm: its area by the length of its outline.
    #[must_use]
    pub fn greatest(&self) -> f64 {
        /// Of a triangle for the widest hole that has one, by mm of the nozzle.
        const BY_NOZZLE: f64 = 0.29 / 0.4;
        BY_NOZZLE * self.nozzle
    }
}

/// Finds the round holes of a section in a chart, whose outlines were thinned out to within `tolerance`
/// mm.
#[must_use]
pub fn bores(
    section: &Region,
    chart: &Chart,
    tolerance: f64,
    params: &PolyholeParams,
) -> Vec<Bore> {
    let holes = section.islands().iter().flat_map(|island| island.iter().skip(1));
    holes.filter_map(|hole| bore(hole, chart, params.threshold.max(tolerance))).collect()
}

/// Puts polygons in the place of these holes.
#[must_use]
pub fn with_polyholes(
    section: &Region,
    bores: &[Bore],
    is_odd: bool,
    chart: &Chart,
    params: &PolyholeParams,
) -> Region {
    let is_turned = is_odd && params.is_twisted;
    let polygons: Vec<Vec<Point2<f64>>> =
        bores.iter().map(|bore| bore.polygon(is_turned, params.nozzle)).collect();
    let polygons = Region::from_rings(polygons.iter().map(Vec::as_slice), Fill::NonZero);
    section.difference(&chart.region_under(&polygons))
}

/// The circle of a hole that is round.
fn bore(hole: &Ring, chart: &Chart, threshold: f64) -> Option<Bore> {
    let points: Vec<Point2<f64>> = hole.iter().map(|p| chart.seen_from_above(&mm(*p))).collect();
    let corners = corners(&points);
    if corners.len() < LEAST_CORNERS {
        return None;
    }
    let centre = centre_of_circle(&corners)?;
    let distance = |p: &Point2<f64>| (p - centre).norm();
    // Points within a side of the tessellated circle lie inside of it.
    let radius = corners.iter().map(distance).fold(0.0, f64::max);
    if corners.iter().any(|p| radius - distance(p) > threshold) {
        return None;
    }
    let turns = turns(&corners, &centre)?;
    let mut sorted = turns.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    let is_chord = |turn: &f64| {
        let sagitta = radius * (1.0 - (turn / 2.0).cos());
        *turn <= FRAC_PI_4 && (sagitta <= threshold || *turn <= LONGEST_BY_USUAL * usual)
    };
    turns.iter().all(is_chord).then_some(Bore { centre, radius })
}

/// A hole of eight corners or fewer is meant to have them, like that of a nut.
const LEAST_CORNERS: usize = 9;

/// A longer side than this by the usual one is meant to be flat, like that of a shaft's D.
const LONGEST_BY_USUAL: f64 = 1.5;

/// The corners of a ring: without points that lie on its sides.
fn corners(ring: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let Some(first) = (0..ring.len()).find(|&k| is_corner(ring, k)) else { return Vec::new() };
    let mut open: Vec<Point2<f64>> = ring[first..].iter().chain(&ring[..=first]).copied().collect();
    open = simplify_line(&open, ON_SIDE_MM);
    open.pop();
    // On a side that is parallel to the line it is measured from, any point may be the farthest.
    (0..open.len()).filter(|&k| is_corner(&open, k)).map(|k| open[k]).collect()
}

/// Whether a point of a ring does not lie on the line between those beside it.
fn is_corner(ring: &[Point2<f64>], k: usize) -> bool {
    let [before, after] = [ring[(k + ring.len() - 1) % ring.len()], ring[(k + 1) % ring.len()]];
    distance_to_segment(&before, &after, &ring[k]) > ON_SIDE_MM
}

/// How far rounding takes a point off its side, mm.
const ON_SIDE_MM: f64 = 5e-5;

/// The centre of the circle that fits best: least squares of what `|p|² − 2 c·p − k` lacks of 0.
///
/// Source: I. Kåsa (1976), "A circle fitting procedure and its error analysis".
fn centre_of_circle(points: &[Point2<f64>]) -> Option<Point2<f64>> {
    let origin = *points.first()?;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in points {
        let p = p - origin;
        let row = Vector3::new(p.x, p.y, 1.0);
        normal += row * row.transpose();
        right += row * p.norm_squared();
    }
    let solved = normal.lu().solve(&right)?;
    let centre = origin + nalgebra::Vector2::new(solved.x, solved.y) / 2.0;
    (centre.x.is_finite() && centre.y.is_finite()).then_some(centre)
}

/// By how much each side turns around the centre, radians; `None` where the ring does not go around it
/// once and always in the same direction.
fn turns(corners: &[Point2<f64>], centre: &Point2<f64>) -> Option<Vec<f64>> {
    let turn = |k: usize| {
        let [from, to] = [corners[k] - centre, corners[(k + 1) % corners.len()] - centre];
        // Holes run clockwise.
        -from.perp(&to).atan2(from.dot(&to))
    };
    let turns: Vec<f64> = (0..corners.len()).map(turn).collect();
    let is_once = (turns.iter().sum::<f64>() - TAU).abs() < FRAC_PI_4;
    (is_once && turns.iter().all(|turn| *turn > 0.0)).then_some(turns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    const HOW: PolyholeParams = PolyholeParams { threshold: 0.01, is_twisted: true, nozzle: 0.4 };
    const CENTRE: Point2<f64> = Point2::new(20.0, -7.0);

    fn around(radius: f64, angles: impl Iterator<Item = f64>) -> Vec<Point2<f64>> {
        angles.map(|a| CENTRE + Vector2::new(a.cos(), a.sin()) * radius).collect()
    }

    fn circle(radius: f64, sides: u32) -> Vec<Point2<f64>> {
        around(radius, (0..sides).map(|k| TAU * f64::from(k) / f64::from(sides)))
    }

    /// A plate with a hole, in a chart.
    fn plate(hole: &[Point2<f64>], chart: &Chart) -> Region {
        let half = 50.0;
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let plate = Region::from_rings([corners.map(Point2::from).as_slice()], Fill::NonZero);
        let hole = Region::from_rings([hole], Fill::NonZero);
        chart.region_under(&plate.difference(&hole))
    }

    fn found(hole: &[Point2<f64>], chart: &Chart) -> Vec<Bore> {
        bores(&plate(hole, chart), chart, 0.0, &HOW)
    }

    #[test]
    fn round_holes_are_found_on_every_chart() {
        let charts = [Chart::Plane, Chart::cone(0.6), Chart::Sphere { radius: 90.0 }];
        for chart in charts {
            for sides in [9, 32, 200] {
                let bores = found(&circle(1.5, sides), &chart);
                let [bore] = bores[..] else { panic!("{chart:?} {sides}: {bores:?}") };
                assert!(bore.is_like(&Bore { centre: CENTRE, radius: 1.5 }, 1e-3), "{bore:?}");
            }
        }
    }

    #[test]
    fn other_holes_stay() {
        let nut = circle(3.0, 6);
        let octagon = circle(3.0, 8);
        let slot: Vec<Point2<f64>> = circle(2.0, 32)
            .iter()
            .map(|p| p + Vector2::new(if p.x > CENTRE.x { 1.0 } else { -1.0 }, 0.0))
            .collect();
        // Flat for 37° of the 360.
        let shaft = around(2.5, (10..=96).map(|k| TAU * f64::from(k) / 96.0));
        let ellipse: Vec<Point2<f64>> = circle(2.0, 64)
            .iter()
            .map(|p| CENTRE + (p - CENTRE).component_mul(&Vector2::new(1.02, 1.0)))
            .collect();
        for hole in [nut, octagon, slot, shaft, ellipse] {
            assert_eq!(found(&hole, &Chart::Plane), []);
        }
    }

    /// Points along its sides, where triangles of a tessellated bore meet, do not hide that it is round.
    #[test]
    fn points_on_the_sides_of_a_circle_do_not_count() {
        let circle = circle(1.5, 24);
        let mut ring = Vec::new();
        for k in 0..24 {
            let (from, to) = (circle[k], circle[(k + 1) % 24]);
            ring.extend([from, from + (to - from) * (0.2 + 0.02 * k as f64)]);
        }
        assert_eq!(found(&ring, &Chart::Plane).len(), 1);
    }

    #[test]
    fn sides_touch_the_circle_and_every_other_layer_is_turned() {
        for (radius, sides) in [(0.5, 3), (1.5, 6), (4.0, 16)] {
            let bore = Bore { centre: CENTRE, radius };
            let plate = plate(&circle(radius, 64), &Chart::Plane);
            let hole = |is_odd| {
                let region = with_polyholes(&plate, &[bore], is_odd, &Chart::Plane, &HOW);
                region.islands()[0][1].iter().map(|p| mm(*p)).collect::<Vec<_>>()
            };
            let [even, odd] = [false, true].map(hole);
            assert_eq!((even.len(), odd.len()), (sides, sides), "{radius}");
            let reach = radius / (PI / sides as f64).cos();
            for k in 0..sides {
                let middle = nalgebra::center(&even[k], &even[(k + 1) % sides]);
                assert!(((middle - CENTRE).norm() - radius).abs() < 1e-4);
                assert!(((even[k] - CENTRE).norm() - reach).abs() < 1e-4);
                // A corner of the next layer lies over the middle of the side.
                let over = CENTRE + (middle - CENTRE) * (reach / radius);
                assert!(odd.iter().any(|p| (p - over).norm() < 1e-4));
            }
        }
    }

    #[test]
    fn holes_become_wider_by_less_than_told() {
        for tenths in 2..200 {
            let bore = Bore { centre: CENTRE, radius: f64::from(tenths) / 20.0 };
            let polygon = bore.polygon(false, HOW.nozzle);
            let area = Region::from_rings([polygon.as_slice()], Fill::NonZero).area();
            let wider = area - PI * bore.radius.powi(2);
            assert!(wider / (TAU * bore.radius) < HOW.greatest(), "{bore:?}");
        }
    }
}
