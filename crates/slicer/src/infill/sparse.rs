//! Lines of sparse areas.
//!
//! Patterns are fixed in space and cut by the layer, so that the lines of a layer stand on those
//! of the layer below whatever the layer's shape: upright planes for parallel lines, triangles and
//! stars; upright hexagons; slanted planes of which every three meet at right angles (`cubic`); the
//! gyroid. Concentric loops and spirals follow the layer itself.

use geom::polyline::distance_to_segment;
use geom::region::Region;
use geom::spiral::{Spiral, Turning};
use nalgebra::{Point2, Rotation2, Vector3};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_3};

use super::clip::{Clipped, clipped};
use super::link::JoinParams;
use super::spiral::Turns;
use super::{Chord, FillLayer, FillLine, InfillParams, Pattern};
use super::{closed_lines, concentric, field, honeycomb, open_lines, rectilinear};
use crate::bead::Bead;
use crate::chart::Chart;
use crate::toolpath::Role;

/// A line that nobody sees may lie this far from its course, mm; the bead is twenty times as wide.
const CURVE_TOLERANCE_MM: f64 = 0.02;

/// Squares of the grid in a period of the gyroid. Its lines are never bent more sharply than a
/// circle of a tenth of the period, in which a side of this length is off by a fortieth of it.
const STEPS_IN_PERIOD: f64 = 18.0;

/// Squares of the grid between two planes of `cubic` on a curved layer.
const STEPS_IN_SPACING: f64 = 5.0;

/// Sides of the grid's squares, mm.
const LEAST_STEP_MM: f64 = 0.05;
const GREATEST_STEP_MM: f64 = 1.0;

/// Squares along an axis of the grid, at most.
const MOST_STEPS: f64 = 2048.0;

/// The bead of sparse lines.
pub(crate) fn bead(thickness: f64, params: &InfillParams) -> Bead {
    Bead { width: params.width, thickness }
}

/// How far the middles of sparse lines end from the edge of their area, mm.
pub(crate) fn from_edge(bead: &Bead, params: &InfillParams) -> f64 {
    (bead.spacing() / 2.0 - params.overlap * bead.width).max(0.0)
}

/// Fills a sparse area; but for `lightning`, whose lines are known when all layers are.
pub(crate) fn fill(area: &Region, layer: &FillLayer<'_>, params: &InfillParams) -> Vec<FillLine> {
    let bead = bead(layer.thickness, params);
    let spacing = bead.spacing() / params.density;
    let from_edge = from_edge(&bead, params);
    match params.pattern {
        Pattern::Concentric => {
            let loops = concentric::sparse(area, &layer.chart, bead.spacing() / 2.0, spacing);
            return closed_lines(loops, Role::InternalInfill, bead).collect();
        }
        Pattern::Archimedean => {
            // Sparse lines must stand on those of the layer below: neither phase nor sense changes.
            let core = layer.chart.inset(area, from_edge);
            let turning = Turning::CounterClockwise;
            let spiral = Spiral { pitch: spacing, phase: 0.0, turning };
            let chords = Turns::inside(&core, spiral).chords(layer.tolerance);
            let joins = joins(params);
            return open_lines(&core, &chords, &joins, Role::InternalInfill, bead, layer);
        }
        Pattern::Lightning => return Vec::new(),
        _ => {}
    }
    let core = layer.chart.inset(area, from_edge);
    let sparse = Sparse {
        area: layer.chart.region_from_above(&core),
        spacing: spacing * closeness(params.pattern, layer),
        bead,
        layer,
        params,
    };
    sparse.lines()
}

/// Joins along the rim of a sparse area are material that no one asked for.
fn joins(params: &InfillParams) -> JoinParams {
    JoinParams { longest: params.longest_join, fill_rim: false }
}

/// A sparse area as seen along the axis.
struct Sparse<'a> {
    area: Region,
    /// Distance of parallel lines with the length that is wanted, mm.
    spacing: f64,
    bead: Bead,
    layer: &'a FillLayer<'a>,
    params: &'a InfillParams,
}

impl Sparse<'_> {
    fn lines(&self) -> Vec<FillLine> {
        let (angle, spacing) = (self.params.angle, self.spacing);
        match self.params.pattern {
            Pattern::AlignedRectilinear => self.parallel(&[(angle, 0.5)], spacing),
            Pattern::Grid => {
                self.parallel(&[(angle, 0.5), (angle + FRAC_PI_2, 0.5)], 2.0 * spacing)
            }
            // Three planes meet where the shares of the first and the last make up that of the
            // middle one: with thirds the axis lies in the middle of a triangle. With halves each
            // plane passes midway between the meetings of the other two.
            Pattern::Triangles => self.parallel(&star(angle, [1.0, 2.0, 1.0], 3.0), 3.0 * spacing),
            Pattern::Stars => self.parallel(&star(angle, [1.0; 3], 2.0), 3.0 * spacing),
            Pattern::Cubic => self.cubic(),
            Pattern::Gyroid => self.gyroid(),
            Pattern::Honeycomb => self.honeycomb(),
            Pattern::Rectilinear
            | Pattern::Concentric
            | Pattern::Archimedean
            | Pattern::Lightning => {
                self.parallel(&[(super::angle_in(self.layer, self.params), 0.5)], spacing)
            }
        }
    }

    /// Upright planes: for each family its direction and where the first lies, in spacings.
    fn parallel(&self, families: &[(f64, f64)], spacing: f64) -> Vec<FillLine> {
        let rows = families.iter().flat_map(|&(angle, first)| {
            rectilinear::rows_at(&self.area, first * spacing, spacing, angle)
        });
        // All together: joins of families on their own would lie on each other along the rim.
        let rows: Vec<Chord> = rows.collect();
        self.joined(&rows)
    }

    /// Planes that slant by as much as the faces of a cube standing on its corner.
    fn cubic(&self) -> Vec<FillLine> {
        let spacing = 3.0 * self.spacing;
        let families = [0.0, 1.0, 2.0].map(|k| self.params.angle + k * 2.0 * FRAC_PI_3);
        if self.layer.chart.is_flat() {
            let rise = FRAC_1_SQRT_2 * self.layer.height(&Point2::origin());
            let families = families.map(|angle| (angle, CUBE_CORNER - rise / spacing));
            return self.parallel(&families, spacing);
        }
        let step = (spacing / STEPS_IN_SPACING).clamp(LEAST_STEP_MM, GREATEST_STEP_MM);
        let mut all = Clipped::default();
        for angle in families {
            let across = Vector3::new(-angle.sin(), angle.cos(), FRAC_1_SQRT_2) / spacing;
            let clipped = self.field(step, move |p| p.coords.dot(&across) - CUBE_CORNER);
            all.chords.extend(clipped.chords);
            all.loops.extend(clipped.loops);
        }
        self.clipped(&all)
    }

    fn gyroid(&self) -> Vec<FillLine> {
        let period = field::gyroid_period(self.spacing);
        let step = (period / STEPS_IN_PERIOD).clamp(LEAST_STEP_MM, GREATEST_STEP_MM);
        let turned = Rotation2::new(-self.params.angle);
        let gyroid = field::gyroid(period);
        self.clipped(&self.field(step, move |p| {
            let flat = turned * p.xy();
            gyroid(&nalgebra::Point3::new(flat.x, flat.y, p.z))
        }))
    }

    fn field(&self, step: f64, field: impl Fn(&nalgebra::Point3<f64>) -> f64) -> Clipped {
        let Some(bounds) = self.area.bounds() else { return Clipped::default() };
        let corners = [bounds.min, bounds.max].map(geom::grid::mm);
        let extent = corners[1] - corners[0];
        let step = step.max(extent.max() / MOST_STEPS);
        let courses = field::courses(corners, step, |p| self.layer.height(p), field);
        clipped(&self.area, &courses)
    }

    fn honeycomb(&self) -> Vec<FillLine> {
        let Some(bounds) = self.area.bounds() else { return Vec::new() };
        let corner = |p| geom::grid::mm(p).coords.abs();
        let reach = corner(bounds.min).sup(&corner(bounds.max)).norm();
        let courses =
            honeycomb::courses(reach, self.spacing, self.bead.spacing(), self.params.angle);
        self.clipped(&clipped(&self.area, &courses))
    }

    fn clipped(&self, clipped: &Clipped) -> Vec<FillLine> {
        let mut lines = self.joined(&clipped.chords);
        let loops = clipped.loops.iter().map(|points| {
            let mut points = points.clone();
            points.extend(points.first().copied());
            let mut points =
                under(&geom::simplify::simplify_line(&points, CURVE_TOLERANCE_MM), self.layer);
            points.pop();
            points
        });
        let loops: Vec<Vec<Point2<f64>>> = loops.filter(|points| points.len() >= 3).collect();
        lines.extend(closed_lines(loops, Role::InternalInfill, self.bead));
        lines
    }

    /// Chords joined along the rim, in the chart.
    fn joined(&self, chords: &[Chord]) -> Vec<FillLine> {
        let layer = FillLayer { tolerance: self.tolerance(), ..*self.layer };
        let (joins, role) = (joins(self.params), Role::InternalInfill);
        let mut lines = open_lines(&self.area, chords, &joins, role, self.bead, &layer);
        for line in &mut lines {
            line.points = under(&line.points, self.layer);
        }
        lines
    }

    fn tolerance(&self) -> f64 {
        match self.params.pattern {
            Pattern::Gyroid | Pattern::Cubic => self.layer.tolerance.max(CURVE_TOLERANCE_MM),
            _ => self.layer.tolerance,
        }
    }
}

/// A line seen along the axis, in the chart, with points until it is followed to within the
/// tolerance.
pub(super) fn under(line: &[Point2<f64>], layer: &FillLayer<'_>) -> Vec<Point2<f64>> {
    let chart = &layer.chart;
    let mut points: Vec<Point2<f64>> = line.iter().take(1).map(|p| chart.under(p)).collect();
    for pair in line.windows(2) {
        let ends = [chart.under(&pair[0]), chart.under(&pair[1])];
        under_side([pair[0], pair[1]], ends, layer, &mut points);
        points.push(ends[1]);
    }
    points
}

/// Where the planes of `cubic` lie at the axis, in spacings: three of them would meet on it in a
/// point of z = 0 for zero.
const CUBE_CORNER: f64 = 0.5;

/// Three families of lines at 60° to each other: the first lies `shares / parts` spacings from the
/// axis.
fn star(angle: f64, shares: [f64; 3], parts: f64) -> [(f64, f64); 3] {
    let turned = |k: usize| angle + k as f64 * FRAC_PI_3;
    [0, 1, 2].map(|k| (turned(k), shares[k] / parts))
}

/// How much closer lines lie as seen along the axis than on the layer, for the same length by area
/// of the layer; on the average over their directions.
///
/// On a layer that slopes by `a` planes with unit normal `n`, lying `s` apart, leave lines of
/// length `|n × N|/s` by area, where `N` is the layer's normal. On spheres as at the axis, since
/// lines of steeper and flatter layers are to lie over each other; so with the gyroid, whose
/// surface is nearly as long in cuts of all directions.
pub(super) fn closeness(pattern: Pattern, layer: &FillLayer<'_>) -> f64 {
    let Chart::Cone { cos } = layer.chart else { return 1.0 };
    // Vertical part of the planes' normals, and their distance as seen along the axis by that in
    // space.
    let (vertical, stretch) = match pattern {
        Pattern::Gyroid => return 1.0,
        Pattern::Cubic => (1.0 / 3.0_f64.sqrt(), 1.5_f64.sqrt()),
        _ => (0.0, 1.0),
    };
    let (level, sin) = ((1.0_f64 - vertical * vertical).sqrt(), (1.0_f64 - cos * cos).sqrt());
    const DIRECTIONS: u32 = 36;
    let lengths = (0..DIRECTIONS).map(|k| {
        let azimuth = std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS);
        let along_normal = vertical * cos + level * sin * azimuth.cos();
        (1.0 - along_normal * along_normal).sqrt()
    });
    stretch * lengths.sum::<f64>() / f64::from(DIRECTIONS)
}

fn under_side(
    [a, b]: [Point2<f64>; 2],
    ends: [Point2<f64>; 2],
    layer: &FillLayer<'_>,
    points: &mut Vec<Point2<f64>>,
) {
    let middle = nalgebra::center(&a, &b);
    let at = layer.chart.under(&middle);
    let is_short = (b - a).norm_squared() <= layer.tolerance * layer.tolerance;
    if is_short || distance_to_segment(&ends[0], &ends[1], &at) <= layer.tolerance {
        return;
    }
    under_side([a, middle], [ends[0], at], layer, points);
    points.push(at);
    under_side([middle, b], [at, ends[1]], layer, points);
}
