//! Lines that fill an area.
//!
//! Every pattern answers the same question: which lines, inside an area, lie a given distance
//! apart? Open lines come as chords that end on the rim of the area and are then joined along it;
//! closed ones are loops.
//!
//! Lines keep half a spacing from the edge of the area. With the pieces of rim that join them they
//! then take exactly the area's volume: a line that ends at the rim leaves half a spacing at either
//! end, and each join along the rim makes up for two of those halves.

mod concentric;
mod link;
mod rectilinear;
mod spiral;

use geom::polyline::distance_to_segment;
use geom::region::{Island, Region};
use geom::simplify::simplify_line;
use geom::spiral::Turning;
use nalgebra::Point2;

use self::link::JoinParams;
use crate::bead::Bead;
use crate::chart::Chart;
use crate::skins::Skins;
use crate::toolpath::Role;

/// How the lines of an area run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Parallel lines, turned by 90° from layer to layer.
    Rectilinear,
    /// Two sets of parallel lines in every layer, each half as dense.
    Grid,
    /// Loops that follow the outline inwards.
    Concentric,
    /// The Archimedean spiral about the rotation axis.
    Archimedean,
}

impl Pattern {
    /// Returns the pattern that takes the place of this one in the solid areas of a curved layer.
    fn evenly_curved(self) -> Self {
        match self {
            Self::Concentric => Self::Concentric,
            Self::Rectilinear | Self::Grid | Self::Archimedean => Self::Archimedean,
        }
    }
}

/// How areas are filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InfillParams {
    /// Share of a sparse area that is filled, above 0 and at most 1; 0 leaves it empty.
    pub density: f64,
    /// Pattern of sparse areas.
    pub pattern: Pattern,
    /// Pattern of solid areas.
    pub solid_pattern: Pattern,
    /// Direction of parallel lines, radians from the part's reference azimuth.
    pub angle: f64,
    /// Width of sparse lines, mm.
    pub width: f64,
    /// Width of solid lines, mm.
    pub solid_width: f64,
    /// Width of solid lines that are seen from above, mm.
    pub top_width: f64,
}

/// A line of infill in the chart.
#[derive(Debug, Clone, PartialEq)]
pub struct FillLine {
    /// What it is for.
    pub role: Role,
    /// The bead, the same all along.
    pub bead: Bead,
    /// Whether it ends where it begins; the first point is not repeated.
    pub closed: bool,
    /// Points, mm.
    pub points: Vec<Point2<f64>>,
}

/// A place on the rim of an area: a share of the way along one side of one of its rings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RimPoint {
    /// Index of the ring among all rings of the area.
    pub(crate) ring: usize,
    /// Index of the side; side `i` begins at point `i`.
    pub(crate) side: usize,
    /// Share of the side before the place.
    pub(crate) share: f64,
}

/// A line across an area, from rim to rim.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chord {
    /// Points, mm.
    pub(crate) points: Vec<Point2<f64>>,
    /// Where on the rim it begins and ends; `None` for an end inside the area.
    pub(crate) ends: [Option<RimPoint>; 2],
}

/// The layer that is filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FillLayer {
    /// Counted from 0; patterns alternate with it.
    pub index: usize,
    /// Metric of its chart.
    pub chart: Chart,
    /// Thickness of the beads, mm.
    pub thickness: f64,
    /// How far lines may lie from their ideal course, mm.
    pub tolerance: f64,
}

/// Lines shorter than this many widths are blobs and are left out.
const LEAST_LENGTH_IN_WIDTHS: f64 = 0.5;

/// In a solid area joins are part of the filling, however long.
const SOLID_JOINS: JoinParams = JoinParams { longest: f64::INFINITY, fill_rim: true };

/// Joins along the rim of a sparse area are material that no one asked for: up to 10 mm they cost
/// less than the travel and the retraction that they save.
const SPARSE_JOINS: JoinParams = JoinParams { longest: 10.0, fill_rim: false };

/// What fills the solid and sparse areas of an island.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Filling {
    /// The lines.
    pub lines: Vec<FillLine>,
    /// Places between lines that want a single bead of their own width.
    pub thin: Vec<Region>,
}

/// Fills the solid and sparse areas of an island.
#[must_use]
pub fn fill(skins: &Skins, layer: &FillLayer, params: &InfillParams) -> Filling {
    let mut filling = Filling::default();
    for (region, role, width) in [
        (&skins.solid, Role::SolidInfill, params.solid_width),
        (&skins.top, Role::TopSolidInfill, params.top_width),
    ] {
        for island in region.islands() {
            solid(island, role, width, layer, params, &mut filling);
        }
    }
    if params.density > 0.0 && !skins.sparse.is_empty() {
        filling.lines.extend(sparse(&skins.sparse, layer, params));
    }
    filling
}

/// The direction of parallel lines in a layer.
fn angle_in(layer: &FillLayer, params: &InfillParams) -> f64 {
    params.angle + if layer.index.is_multiple_of(2) { 0.0 } else { std::f64::consts::FRAC_PI_2 }
}

fn solid(
    island: &Island,
    role: Role,
    width: f64,
    layer: &FillLayer,
    params: &InfillParams,
    filling: &mut Filling,
) {
    let bead = Bead { width, thickness: layer.thickness };
    let area = Region::from_island(island.clone());
    // Straight lines of a curved chart are not equally far apart everywhere; turns of the spiral are.
    let pattern = if layer.chart.is_flat() {
        params.solid_pattern
    } else {
        params.solid_pattern.evenly_curved()
    };
    match pattern {
        Pattern::Rectilinear | Pattern::Grid => {
            let even = rectilinear::evenly(&area, bead.spacing(), angle_in(layer, params));
            let bead = Bead::with_spacing(even.spacing, layer.thickness);
            let (core, chords) = (&even.core, &even.chords);
            filling.lines.extend(open_lines(core, chords, &SOLID_JOINS, role, bead, layer));
        }
        Pattern::Concentric => {
            concentric(&area, role, bead, layer, filling);
        }
        Pattern::Archimedean => {
            let core = layer.chart.inset(&area, bead.spacing() / 2.0);
            // Turns of neighbouring layers lie in each other's grooves.
            let phase = if layer.index.is_multiple_of(2) { 0.0 } else { std::f64::consts::PI };
            let turning = turning(layer.index);
            let chords = spiral::chords(&core, bead.spacing(), phase, turning, layer.tolerance);
            let lines = open_lines(&core, &chords, &SOLID_JOINS, role, bead, layer);
            match balanced(&lines, &area, layer) {
                Some(bead) => {
                    filling.lines.extend(lines.into_iter().map(|l| FillLine { bead, ..l }));
                }
                // Too narrow for turns of a fixed pitch: loops follow the outline instead.
                None => concentric(&area, role, bead, layer, filling),
            }
        }
    }
}

fn concentric(area: &Region, role: Role, bead: Bead, layer: &FillLayer, filling: &mut Filling) {
    let (loops, thin) = concentric::solid(area, &layer.chart, bead.spacing());
    filling.lines.extend(closed_lines(loops, role, bead));
    filling.thin.extend(thin);
}

/// How much wider or narrower than wanted the beads of a solid area may be to take its volume.
const BALANCE: std::ops::RangeInclusive<f64> = 0.9..=1.1;

/// The bead with which lines take the volume of their area: turns of a fixed pitch end where the
/// area does, and leave a little more or less than their own place. `None` where that is too much.
fn balanced(lines: &[FillLine], area: &Region, layer: &FillLayer) -> Option<Bead> {
    let length: f64 = lines
        .iter()
        .flat_map(|line| line.points.windows(2))
        .map(|w| layer.chart.length(&w[0], &w[1]))
        .sum();
    let bead = lines.first()?.bead;
    let spacing = layer.chart.area(area) / length;
    BALANCE
        .contains(&(spacing / bead.spacing()))
        .then(|| Bead::with_spacing(spacing, layer.thickness))
}

fn turning(index: usize) -> Turning {
    if index.is_multiple_of(2) { Turning::CounterClockwise } else { Turning::Clockwise }
}

fn sparse(area: &Region, layer: &FillLayer, params: &InfillParams) -> Vec<FillLine> {
    let role = Role::InternalInfill;
    let bead = Bead { width: params.width, thickness: layer.thickness };
    let spacing = bead.spacing() / params.density;
    let core = layer.chart.inset(area, bead.spacing() / 2.0);
    // Parallel lines are so as seen along the axis, where those of all layers lie over each other.
    let from_above = layer.chart.region_from_above(&core);
    let parallel = |spacing: f64, angle: f64| {
        let spacing = spacing * sparseness(&layer.chart);
        let chords = rectilinear::about_axis(&from_above, spacing, angle);
        let mut lines = open_lines(&from_above, &chords, &SPARSE_JOINS, role, bead, layer);
        for line in &mut lines {
            line.points = under(&line.points, layer);
        }
        lines
    };
    match params.pattern {
        Pattern::Rectilinear => parallel(spacing, angle_in(layer, params)),
        Pattern::Grid => {
            let mut lines = parallel(2.0 * spacing, params.angle);
            lines.extend(parallel(2.0 * spacing, params.angle + std::f64::consts::FRAC_PI_2));
            lines
        }
        Pattern::Concentric => {
            let loops = concentric::sparse(area, &layer.chart, bead.spacing() / 2.0, spacing);
            closed_lines(loops, role, bead).collect()
        }
        Pattern::Archimedean => {
            // Sparse lines must stand on those of the layer below: neither phase nor sense changes.
            let turning = Turning::CounterClockwise;
            let chords = spiral::chords(&core, spacing, 0.0, turning, layer.tolerance);
            open_lines(&core, &chords, &SPARSE_JOINS, role, bead, layer)
        }
    }
}

/// How much closer lines lie as seen along the axis than on the layer, on the average over their
/// directions: a layer that slopes by `a` is `1/cos a` larger than it looks; lines along the slope
/// are longer by as much, lines across it as long as they look. On spheres as at the axis, since
/// lines of steeper and flatter layers are to lie over each other.
fn sparseness(chart: &Chart) -> f64 {
    match chart {
        Chart::Cone { cos } => f64::midpoint(*cos, 1.0),
        Chart::Plane | Chart::Sphere { .. } => 1.0,
    }
}

/// A line seen along the axis, in the chart, with points until it is followed to within the
/// tolerance.
fn under(line: &[Point2<f64>], layer: &FillLayer) -> Vec<Point2<f64>> {
    let chart = &layer.chart;
    let mut points: Vec<Point2<f64>> = line.iter().take(1).map(|p| chart.under(p)).collect();
    for pair in line.windows(2) {
        let ends = [chart.under(&pair[0]), chart.under(&pair[1])];
        under_side([pair[0], pair[1]], ends, layer, &mut points);
        points.push(ends[1]);
    }
    points
}

fn under_side(
    [a, b]: [Point2<f64>; 2],
    ends: [Point2<f64>; 2],
    layer: &FillLayer,
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

fn open_lines(
    core: &Region,
    chords: &[Chord],
    joins: &JoinParams,
    role: Role,
    bead: Bead,
    layer: &FillLayer,
) -> Vec<FillLine> {
    link::joined(core, chords, joins)
        .into_iter()
        .map(|points| simplify_line(&points, layer.tolerance))
        .filter(|points| geom::polyline::length(points) >= LEAST_LENGTH_IN_WIDTHS * bead.width)
        .map(|points| FillLine { role, bead, closed: false, points })
        .collect()
}

fn closed_lines(
    loops: Vec<Vec<Point2<f64>>>,
    role: Role,
    bead: Bead,
) -> impl Iterator<Item = FillLine> {
    loops.into_iter().map(move |points| FillLine { role, bead, closed: true, points })
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use std::f64::consts::{FRAC_PI_4, TAU};

    const LAYER: FillLayer =
        FillLayer { index: 0, chart: Chart::Plane, thickness: 0.2, tolerance: 0.002 };

    const PARAMS: InfillParams = InfillParams {
        density: 0.2,
        pattern: Pattern::Rectilinear,
        solid_pattern: Pattern::Rectilinear,
        angle: FRAC_PI_4,
        width: 0.45,
        solid_width: 0.45,
        top_width: 0.45,
    };

    const PATTERNS: [Pattern; 4] =
        [Pattern::Rectilinear, Pattern::Grid, Pattern::Concentric, Pattern::Archimedean];

    fn polygon(points: &[[f64; 2]]) -> Region {
        let ring: Vec<Point2<f64>> = points.iter().map(|&p| Point2::from(p)).collect();
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Region {
        polygon(&[[x, y], [x + width, y], [x + width, y + height], [x, y + height]])
    }

    fn disc(radius: f64) -> Region {
        let ring: Vec<[f64; 2]> = (0..200)
            .map(|i| {
                let angle = f64::from(i) * TAU / 200.0;
                [radius * angle.cos() + 3.0, radius * angle.sin()]
            })
            .collect();
        polygon(&ring)
    }

    fn areas() -> Vec<Region> {
        let frame = rectangle(-12.0, -9.0, 24.0, 18.0).difference(&disc(5.0));
        vec![rectangle(-8.0, -8.0, 16.0, 16.0), disc(9.0), frame, rectangle(2.0, 1.0, 22.0, 1.3)]
    }

    /// Area that lines take, and what is left to single beads.
    fn laid(filling: &Filling) -> f64 {
        let thin: f64 = filling.thin.iter().map(|place| place.opened(0.1).area()).sum();
        let lines: f64 = filling
            .lines
            .iter()
            .map(|line| {
                let closing = if line.closed {
                    (line.points[0] - line.points[line.points.len() - 1]).norm()
                } else {
                    0.0
                };
                (geom::polyline::length(&line.points) + closing) * line.bead.spacing()
            })
            .sum();
        lines + thin
    }

    #[test]
    fn solid_lines_take_the_area() {
        for pattern in PATTERNS {
            for (k, area) in areas().iter().enumerate() {
                let skins = Skins { solid: area.clone(), ..Skins::default() };
                for index in 0..2 {
                    let layer = FillLayer { index, ..LAYER };
                    let params = InfillParams { solid_pattern: pattern, ..PARAMS };
                    let ratio = laid(&fill(&skins, &layer, &params)) / area.area();
                    // Turns of a spiral end where the area does, whatever the pitch; in a narrow
                    // strip that is a good part of it.
                    let slack = match pattern {
                        Pattern::Rectilinear | Pattern::Grid => 0.01,
                        Pattern::Concentric => 0.02,
                        Pattern::Archimedean if k == 3 => 0.1,
                        Pattern::Archimedean => 0.03,
                    };
                    assert!((ratio - 1.0).abs() < slack, "{pattern:?}, area {k}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn parallel_lines_fill_at_every_angle() {
        for k in 0..36 {
            let params = InfillParams { angle: f64::from(k) * TAU / 72.0, ..PARAMS };
            for (index, area) in areas().iter().enumerate() {
                let skins = Skins { solid: area.clone(), ..Skins::default() };
                let ratio = laid(&fill(&skins, &LAYER, &params)) / area.area();
                // The ends of a line lack half a spacing each, which shows in a narrow strip.
                let slack = if index == 3 { 0.025 } else { 0.006 };
                assert!((ratio - 1.0).abs() < slack, "angle {k}, area {index}: {ratio}");
            }
        }
    }

    #[test]
    fn sparse_lines_have_the_density() {
        for pattern in PATTERNS {
            let area = rectangle(-30.0, -30.0, 60.0, 60.0);
            let skins = Skins { sparse: area.clone(), ..Skins::default() };
            let params = InfillParams { pattern, ..PARAMS };
            let share = laid(&fill(&skins, &LAYER, &params)) / area.area();
            // Joins along the rim come on top.
            assert!((0.19..0.23).contains(&share), "{pattern:?}: {share}");
        }
    }

    #[test]
    fn lines_stay_inside_and_are_few() {
        for pattern in PATTERNS {
            for area in areas() {
                let skins = Skins { sparse: area.clone(), ..Skins::default() };
                let params = InfillParams { pattern, ..PARAMS };
                let lines = fill(&skins, &LAYER, &params).lines;
                let grown = area.outset(0.01);
                for line in &lines {
                    for p in &line.points {
                        assert!(grown.contains(p), "{pattern:?}: {p} is outside");
                    }
                }
                let limit = if pattern == Pattern::Concentric { 40 } else { 12 };
                assert!(lines.len() <= limit, "{pattern:?}: {} lines", lines.len());
            }
        }
    }

    #[test]
    fn sparse_lines_of_curved_layers_lie_over_each_other() {
        // On spheres of different radii and on a cone: every point of a line that is not a join
        // along the rim lies in one of the planes of the pattern.
        let charts =
            [Chart::Sphere { radius: 20.0 }, Chart::Sphere { radius: 31.0 }, Chart::cone(0.6)];
        for pattern in [Pattern::Rectilinear, Pattern::Grid] {
            let params = InfillParams { pattern, ..PARAMS };
            for chart in charts {
                let layer = FillLayer { chart, ..LAYER };
                let area = disc(9.0);
                let core = chart.inset(&area, 0.25);
                let bead = Bead { width: 0.45, thickness: 0.2 };
                let share = if pattern == Pattern::Grid { 2.0 } else { 1.0 };
                let pitch = share * bead.spacing() / params.density * sparseness(&chart);
                let lines = sparse(&area, &layer, &params);
                let mut judged = 0;
                let places = lines
                    .iter()
                    .flat_map(|line| line.points.windows(2))
                    .flat_map(|w| [0.0, 0.25, 0.5].map(|share| w[0] + (w[1] - w[0]) * share))
                    .filter(|p| core.contains(p));
                for p in places {
                    let seen = chart.seen_from_above(&p);
                    let off = [FRAC_PI_4, FRAC_PI_4 + TAU / 4.0].map(|angle| {
                        let across = seen.y * angle.cos() - seen.x * angle.sin();
                        ((across / pitch - 0.5) - (across / pitch - 0.5).round()).abs() * pitch
                    });
                    assert!(off[0].min(off[1]) < 0.01, "{chart:?} {pattern:?}: {p}, {off:?}");
                    judged += 1;
                }
                assert!(judged > 10, "{chart:?}: {judged}");
            }
        }
    }
}
