//! Lines that fill an area.
//!
//! Every pattern answers the same question: which lines, inside an area, lie a given distance
//! apart? Open lines come as chords that end on the rim of the area and are then joined along it;
//! closed ones are loops.
//!
//! Lines keep half a spacing from the edge of the area. With the pieces of rim that join them they
//! then take exactly the area's volume: a line that ends at the rim leaves half a spacing at either
//! end, and each join along the rim makes up for two of those halves.

pub(crate) mod clip;
mod concentric;
mod field;
mod honeycomb;
pub(crate) mod ironing;
pub mod lightning;
mod link;
mod monotonic;
mod rectilinear;
mod rim;
mod solid;
pub(crate) mod sparse;
mod spiral;
pub(crate) mod support;

use geom::region::Region;
use geom::simplify::simplify_line;
use geom::spiral::Turning;
use nalgebra::Point2;

pub use self::ironing::IroningParams;
use self::link::JoinParams;
use self::solid::Solid;
use crate::bead::Bead;
use crate::bridge::Bridge;
use crate::chart::Chart;
use crate::skins::Skins;
use crate::surface::LayerSurface;
use crate::toolpath::Role;

/// How the lines of a sparse area run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Parallel lines, turned by 90° from layer to layer.
    Rectilinear,
    /// Parallel lines, the same in every layer: walls.
    AlignedRectilinear,
    /// Two sets of parallel lines in every layer, each half as dense.
    Grid,
    /// Three sets of parallel lines that meet in points.
    Triangles,
    /// Three sets of parallel lines of which no three meet: triangles and hexagons.
    Stars,
    /// Cubes that stand on a corner.
    Cubic,
    /// The gyroid, a surface without straight lines that divides space in two.
    Gyroid,
    /// Hexagonal cells.
    Honeycomb,
    /// Loops that follow the outline inwards.
    Concentric,
    /// The Archimedean spiral about the rotation axis.
    Archimedean,
    /// Trees that stand only below tops (see [`lightning`]); they are known when all layers are.
    Lightning,
}

/// How the lines of a solid area run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolidPattern {
    /// Parallel lines, turned by 90° from layer to layer, with the least travel.
    Rectilinear,
    /// Parallel lines that are laid from one side of the area to the other, so that each lies
    /// beside one that was laid before: no seam is seen where two stretches would meet.
    Monotonic {
        /// Whether neighbouring lines are joined at their ends.
        joined: bool,
    },
    /// Loops that follow the outline inwards.
    Concentric,
    /// The Archimedean spiral about the rotation axis.
    Archimedean,
}

impl SolidPattern {
    /// Returns the pattern that takes the place of this one in the solid areas of a curved layer.
    fn evenly_curved(self) -> Self {
        match self {
            Self::Concentric => Self::Concentric,
            Self::Rectilinear | Self::Monotonic { .. } | Self::Archimedean => Self::Archimedean,
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
    pub solid_pattern: SolidPattern,
    /// Pattern of solid areas that are seen from above.
    pub top_pattern: SolidPattern,
    /// Direction of parallel lines, radians from the part's reference azimuth.
    pub angle: f64,
    /// Width of sparse lines, mm.
    pub width: f64,
    /// Width of solid lines, mm.
    pub solid_width: f64,
    /// Width of solid lines that are seen from above, mm.
    pub top_width: f64,
    /// The longest piece of rim that joins two lines of a sparse area, mm.
    pub longest_join: f64,
    /// Material of a bridge by what its place holds.
    pub bridge_flow: f64,
    /// How far sparse lines reach into the walls, in widths.
    pub overlap: f64,
    /// How tops are ironed, if they are.
    pub ironing: Option<IroningParams>,
    /// How many layers the lines of sparse areas are as thick as, where that many have a sparse area.
    pub every: usize,
    /// As thick as this such lines may be, mm.
    pub thickest: f64,
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
#[derive(Clone, Copy)]
pub struct FillLayer<'a> {
    /// Counted from 0; patterns alternate with it.
    pub index: usize,
    /// Metric of its chart.
    pub chart: Chart,
    /// The family that it belongs to.
    pub surface: &'a dyn LayerSurface,
    /// Level of its upper side, mm.
    pub level: f64,
    /// Thickness of the beads, mm.
    pub thickness: f64,
    /// How far lines may lie from their ideal course, mm.
    pub tolerance: f64,
}

impl FillLayer<'_> {
    /// How high the layer is at a place as seen along the axis, mm; beyond its end as high as there.
    fn height(&self, p: &Point2<f64>) -> f64 {
        let height = self.surface.height(self.level, p.coords.norm());
        if height.is_finite() { height } else { self.level }
    }
}

/// Lines shorter than this many widths are blobs and are left out.
const LEAST_LENGTH_IN_WIDTHS: f64 = 0.5;

/// Least share of its cross-section that a sparse line keeps where there is little room: a thread that
/// is thinner tears.
const LEAST_FLOW: f64 = 0.5;

/// In a solid area joins are part of the filling, however long.
const SOLID_JOINS: JoinParams = JoinParams { longest: f64::INFINITY, fill_rim: true };

/// What fills the solid and sparse areas of an island.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Filling {
    /// Lines in any order.
    pub lines: Vec<FillLine>,
    /// Lines that want to be laid one after the other, as they are.
    pub in_order: Vec<Vec<FillLine>>,
    /// Places between lines that want a single bead of their own width.
    pub thin: Vec<Region>,
}

/// Fills the solid and sparse areas of an island.
#[must_use]
pub fn fill(skins: &Skins, layer: &FillLayer<'_>, params: &InfillParams) -> Filling {
    let mut filling = Filling::default();
    let angle = angle_in(layer, params);
    let (inner, top) = (params.solid_pattern, params.top_pattern);
    let solids = [
        (
            &skins.solid,
            Solid { role: Role::SolidInfill, width: params.solid_width, pattern: inner, angle },
        ),
        (
            &skins.top,
            Solid { role: Role::TopSolidInfill, width: params.top_width, pattern: top, angle },
        ),
    ];
    solid::fill(&solids, layer, &mut filling);
    if params.density > 0.0 && !skins.sparse.is_empty() {
        filling.lines.extend(sparse_lines(&skins.sparse, layer, params));
    }
    filling
}

/// Fills an area with sparse lines.
pub(crate) fn sparse_lines(
    area: &Region,
    layer: &FillLayer<'_>,
    params: &InfillParams,
) -> Vec<FillLine> {
    let mut lines = sparse::fill(area, layer, params);
    make_room(&mut lines, area, layer);
    lines
}

/// Makes sparse lines narrower, all alike, where they would lay more than their area holds: lines of
/// dense patterns cross each other, and joins along the rim take room too.
fn make_room(lines: &mut [FillLine], area: &Region, layer: &FillLayer<'_>) {
    let length = |line: &FillLine| {
        let pairs = line.points.windows(2).map(|w| layer.chart.length(&w[0], &w[1])).sum::<f64>();
        let close = match (line.closed, line.points.first(), line.points.last()) {
            (true, Some(first), Some(last)) => layer.chart.length(last, first),
            _ => 0.0,
        };
        pairs + close
    };
    let laid: f64 = lines.iter().map(|line| length(line) * line.bead.area()).sum();
    let room = layer.chart.area(area) * layer.thickness;
    if laid > room {
        let flow = (room / laid).max(LEAST_FLOW);
        lines.iter_mut().for_each(|line| line.bead = line.bead.with_flow(flow));
    }
}

/// Returns parallel lines across an area, `spacing` mm apart, from rim to rim.
pub(crate) fn straight_lines(
    area: &Region,
    spacing: f64,
    angle: f64,
) -> impl Iterator<Item = [Point2<f64>; 2]> {
    rectilinear::rows_at(area, spacing / 2.0, spacing, angle)
        .into_iter()
        .filter_map(|chord| Some([*chord.points.first()?, *chord.points.last()?]))
}

/// Fills a bridge with straight lines, beads with `flow` times the volume of their place.
pub(crate) fn fill_bridge(
    bridge: &Bridge,
    layer: &FillLayer<'_>,
    params: &InfillParams,
    filling: &mut Filling,
) {
    let bead = Bead { width: params.solid_width, thickness: layer.thickness };
    for island in bridge.area.islands() {
        let area = Region::from_island(island.clone());
        let seen = layer.chart.region_from_above(&area);
        let even = rectilinear::evenly(&seen, bead.spacing(), bridge.angle);
        let role = Role::BridgeInfill;
        let mut lines = open_lines(&even.core, &even.chords, &SOLID_JOINS, role, bead, layer);
        for line in &mut lines {
            line.points = sparse::under(&line.points, layer);
        }
        let length: f64 = lines
            .iter()
            .flat_map(|line| line.points.windows(2))
            .map(|w| layer.chart.length(&w[0], &w[1]))
            .sum();
        // On a slope lines lie farther apart than they look.
        let spacing = if layer.chart.is_flat() {
            even.spacing
        } else {
            (layer.chart.area(&area) / length).clamp(0.5 * even.spacing, 2.0 * even.spacing)
        };
        let bead = Bead::with_spacing(spacing, layer.thickness).with_flow(params.bridge_flow);
        filling.lines.extend(lines.into_iter().map(|line| FillLine { bead, ..line }));
    }
}

/// The direction of parallel lines in a layer.
pub(crate) fn angle_in(layer: &FillLayer<'_>, params: &InfillParams) -> f64 {
    params.angle + if layer.index.is_multiple_of(2) { 0.0 } else { std::f64::consts::FRAC_PI_2 }
}

fn turning(index: usize) -> Turning {
    if index.is_multiple_of(2) { Turning::CounterClockwise } else { Turning::Clockwise }
}

fn open_lines(
    core: &Region,
    chords: &[Chord],
    joins: &JoinParams,
    role: Role,
    bead: Bead,
    layer: &FillLayer<'_>,
) -> Vec<FillLine> {
    fill_lines(link::joined(core, chords, joins), role, bead, layer).collect()
}

fn fill_lines(
    lines: Vec<Vec<Point2<f64>>>,
    role: Role,
    bead: Bead,
    layer: &FillLayer<'_>,
) -> impl Iterator<Item = FillLine> {
    lines
        .into_iter()
        .map(|points| simplify_line(&points, layer.tolerance))
        .filter(move |points| geom::polyline::length(points) >= LEAST_LENGTH_IN_WIDTHS * bead.width)
        .map(move |points| FillLine { role, bead, closed: false, points })
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
    use crate::surface::{Cone, Plane, Spheres};
    use geom::region::Fill;
    use std::f64::consts::{FRAC_PI_4, TAU};

    const LAYER: FillLayer<'static> = FillLayer {
        index: 0,
        chart: Chart::Plane,
        surface: &Plane,
        level: 3.1,
        thickness: 0.2,
        tolerance: 0.002,
    };

    const PARAMS: InfillParams = InfillParams {
        density: 0.2,
        pattern: Pattern::Rectilinear,
        solid_pattern: SolidPattern::Rectilinear,
        top_pattern: SolidPattern::Rectilinear,
        angle: FRAC_PI_4,
        width: 0.45,
        solid_width: 0.45,
        top_width: 0.45,
        longest_join: 10.0,
        bridge_flow: 1.0,
        overlap: 0.0,
        ironing: None,
        every: 1,
        thickest: 0.4,
    };

    const PATTERNS: [Pattern; 10] = [
        Pattern::Rectilinear,
        Pattern::AlignedRectilinear,
        Pattern::Grid,
        Pattern::Triangles,
        Pattern::Stars,
        Pattern::Cubic,
        Pattern::Gyroid,
        Pattern::Honeycomb,
        Pattern::Concentric,
        Pattern::Archimedean,
    ];

    const SOLID_PATTERNS: [SolidPattern; 5] = [
        SolidPattern::Rectilinear,
        SolidPattern::Monotonic { joined: true },
        SolidPattern::Monotonic { joined: false },
        SolidPattern::Concentric,
        SolidPattern::Archimedean,
    ];

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
            .chain(filling.in_order.iter().flatten())
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
        for pattern in SOLID_PATTERNS {
            for (k, area) in areas().iter().enumerate() {
                let skins = Skins { solid: area.clone(), ..Skins::default() };
                for index in 0..2 {
                    let layer = FillLayer { index, ..LAYER };
                    let params = InfillParams { solid_pattern: pattern, ..PARAMS };
                    let ratio = laid(&fill(&skins, &layer, &params)) / area.area();
                    // Turns of a spiral end where the area does, whatever the pitch; in a narrow
                    // strip that is a good part of it.
                    let slack = match pattern {
                        SolidPattern::Rectilinear => 0.01,
                        SolidPattern::Monotonic { .. } => 0.012,
                        SolidPattern::Concentric => 0.02,
                        SolidPattern::Archimedean if k == 3 => 0.1,
                        SolidPattern::Archimedean => 0.03,
                    };
                    assert!((ratio - 1.0).abs() < slack, "{pattern:?}, area {k}: {ratio}");
                }
            }
        }
    }

    /// The greatest distance of a place of an area from the lines in it, mm.
    fn widest_groove(area: &Region, filling: &Filling) -> f64 {
        let bounds = area.bounds().unwrap();
        let (low, high) = (geom::grid::mm(bounds.min), geom::grid::mm(bounds.max));
        let sides: Vec<[Point2<f64>; 2]> = filling
            .lines
            .iter()
            .flat_map(|line| line.points.windows(2).map(|w| [w[0], w[1]]))
            .collect();
        let distance = |p: &Point2<f64>| {
            let to = |[a, b]: &[Point2<f64>; 2]| {
                let along = b - a;
                let share = (p - a).dot(&along) / along.norm_squared();
                (p - (a + along * share.clamp(0.0, 1.0))).norm()
            };
            sides.iter().map(to).fold(f64::MAX, f64::min)
        };
        let count = 160;
        let at = |k: usize, low: f64, high: f64| low + (high - low) * k as f64 / count as f64;
        let places = (0..count * count)
            .map(|k| Point2::new(at(k % count, low.x, high.x), at(k / count, low.y, high.y)));
        places.filter(|p| area.contains(p)).map(|p| distance(&p)).fold(0.0, f64::max)
    }

    #[test]
    fn turns_leave_no_groove_round_the_axis() {
        let about_axis = |radius: f64| {
            let at = |i: i32| f64::from(i) * TAU / 200.0;
            let ring: Vec<[f64; 2]> =
                (0..200).map(|i| [radius * at(i).cos(), radius * at(i).sin()]).collect();
            polygon(&ring)
        };
        let cone = Cone::new(0.3).unwrap();
        let chart = cone.chart(9.0);
        let layer = FillLayer { surface: &cone, chart, level: 9.0, ..LAYER };
        let params = InfillParams { top_width: 0.4, ..PARAMS };
        for k in 0..6_u32 {
            let middle = 6.0 + 0.07 * f64::from(k);
            for index in 0..2 {
                let layer = FillLayer { index, ..layer };
                let ring = about_axis(9.0).difference(&about_axis(3.0));
                let top = ring.intersection(&about_axis(middle));
                let solid = ring.difference(&about_axis(middle));
                let skins = Skins { top, solid, ..Skins::default() };
                let filling = fill(&skins, &layer, &params);
                // At walls half a turn ends on them.
                let between = about_axis(8.0).difference(&about_axis(4.0));
                let groove = widest_groove(&between, &filling);
                assert!(groove < 0.3, "{middle} {index}: {groove}");
                let ratio = laid(&filling) / ring.area();
                assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
            }
        }
    }

    /// The longest stretch along which a line lies nearer than this to another, or to itself farther
    /// along, mm.
    fn laid_twice(filling: &Filling, apart: f64) -> f64 {
        let step = 0.1;
        let mut places: Vec<(Point2<f64>, usize, f64)> = Vec::new();
        for (line, points) in filling.lines.iter().map(|line| &line.points).enumerate() {
            let mut along = 0.0;
            for side in points.windows(2) {
                let length = (side[1] - side[0]).norm();
                let count = (length / step).ceil();
                let shares = (0..count as u32).map(|i| f64::from(i) / count);
                places.extend(shares.map(|share| {
                    (side[0] + (side[1] - side[0]) * share, line, along + share * length)
                }));
                along += length;
            }
        }
        let mut by_x = places.clone();
        by_x.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
        let (mut longest, mut run): (f64, f64) = (0.0, 0.0);
        for (at, line, along) in &places {
            let first = by_x.partition_point(|(p, ..)| p.x < at.x - apart);
            let near = by_x[first..].iter().take_while(|(p, ..)| p.x < at.x + apart);
            let is_twice = near.into_iter().any(|(p, other, beyond)| {
                let is_other = other != line || (along - beyond).abs() > 2.0;
                is_other && (p - at).norm() < apart
            });
            run = if is_twice { run + step } else { 0.0 };
            longest = longest.max(run);
        }
        longest
    }

    /// Where a rim runs round the axis no line is laid over the turn beside it.
    #[test]
    fn rims_that_run_along_turns_are_not_laid_on_them() {
        let cone = Cone::new(0.3).unwrap();
        let layer = FillLayer { surface: &cone, chart: cone.chart(9.0), level: 9.0, ..LAYER };
        let plate = rectangle(-16.0, -16.0, 32.0, 32.0);
        for k in 0..12_u32 {
            // As a bar across a cone is cut: straight inside, round outside.
            let radius = 11.7 + 0.04 * f64::from(k);
            let at = |i: i32| f64::from(i) * 0.03;
            let arc: Vec<[f64; 2]> =
                (-18..=18).map(|i| [radius * at(i).cos(), radius * at(i).sin()]).collect();
            for turned in 0..4 {
                let (sin, cos) = (TAU / 4.0 * f64::from(turned)).sin_cos();
                let hole: Vec<[f64; 2]> =
                    arc.iter().map(|[x, y]| [x * cos - y * sin, x * sin + y * cos]).collect();
                let area = plate.difference(&polygon(&hole));
                let skins = Skins { solid: area.clone(), ..Skins::default() };
                let filling = fill(&skins, &layer, &PARAMS);
                let twice = laid_twice(&filling, 0.3 * PARAMS.solid_width);
                assert!(twice < 5.0, "{radius} {turned}: {twice} mm are laid twice");
                let ratio = laid(&filling) / area.area();
                assert!((ratio - 1.0).abs() < 0.03, "{radius} {turned}: {ratio}");
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

    /// Share of an area that sparse lines take, on the average over 6 mm of height.
    fn share_of(pattern: Pattern, density: f64, of_layer: impl Fn(f64) -> f64) -> f64 {
        let params = InfillParams { pattern, density, ..PARAMS };
        let area = rectangle(-30.0, -30.0, 60.0, 60.0);
        let skins = Skins { sparse: area.clone(), ..Skins::default() };
        let layers = 12;
        let total: f64 = (0..layers)
            .map(|k| {
                let level = of_layer(0.5 * f64::from(k));
                let layer = FillLayer { index: k as usize, level, ..LAYER };
                laid(&fill(&skins, &layer, &params))
            })
            .sum();
        total / f64::from(layers) / area.area()
    }

    #[test]
    fn sparse_lines_have_the_density() {
        for pattern in PATTERNS {
            for density in [0.1, 0.2, 0.4] {
                let share = share_of(pattern, density, |z| z) / density;
                // Joins along the rim come on top: up to half of a rim of 240 mm.
                let rim = 120.0 * 0.407 / 3600.0 / density;
                assert!((0.97..1.03 + rim).contains(&share), "{pattern:?} {density}: {share}");
            }
        }
    }

    #[test]
    fn sparse_lines_have_the_density_on_cones_and_spheres() {
        let cone = Cone::new(0.6).unwrap();
        let spheres = Spheres::new(-120.0).unwrap();
        let families: [&dyn LayerSurface; 2] = [&cone, &spheres];
        let area = rectangle(-25.0, -25.0, 50.0, 50.0);
        let skins = Skins { sparse: area.clone(), ..Skins::default() };
        for pattern in PATTERNS {
            let params = InfillParams { pattern, ..PARAMS };
            for surface in families {
                let (mut total, mut true_area) = (0.0, 0.0);
                for k in 0..8 {
                    let level = 30.0 + 0.7 * f64::from(k);
                    let chart = surface.chart(level);
                    let layer = FillLayer { index: k as usize, chart, surface, level, ..LAYER };
                    true_area += chart.area(&area);
                    for line in fill(&skins, &layer, &params).lines {
                        let pieces = line.points.windows(2);
                        let length: f64 = pieces.map(|w| chart.length(&w[0], &w[1])).sum();
                        total += length * line.bead.spacing();
                    }
                }
                let share = total / true_area / params.density;
                assert!((0.95..1.13).contains(&share), "{pattern:?}: {share}");
            }
        }
    }

    #[test]
    fn fields_are_the_same_in_all_layers() {
        // Every point of a line that is no join along the rim lies on a surface that is fixed in
        // space, whatever the layer.
        let cone = Cone::new(0.6).unwrap();
        let bowl = Cone::new(-0.3).unwrap();
        let spheres = Spheres::new(-40.0).unwrap();
        let families: [&dyn LayerSurface; 4] = [&Plane, &cone, &bowl, &spheres];
        let area = disc(9.0);
        for pattern in [Pattern::Gyroid, Pattern::Cubic] {
            let params = InfillParams { pattern, ..PARAMS };
            for surface in families {
                let level = 21.3;
                let layer = FillLayer { chart: surface.chart(level), surface, level, ..LAYER };
                let core = layer.chart.inset(&area, 0.25);
                let bead = Bead { width: 0.45, thickness: 0.2 };
                let wanted = bead.spacing() / params.density * sparse::closeness(pattern, &layer);
                let gyroid = field::gyroid(field::gyroid_period(wanted));
                let mut judged = 0;
                let lines = sparse::fill(&area, &layer, &params);
                let points = lines
                    .iter()
                    .flat_map(|line| line.points.windows(2))
                    .flat_map(|w| [0.0, 0.25, 0.5].map(|share| w[0] + (w[1] - w[0]) * share));
                for p in points.filter(|p| core.contains(p)) {
                    let at = surface.lift(level, &p);
                    let (sin, cos) = FRAC_PI_4.sin_cos();
                    let turned = nalgebra::Point3::new(
                        at.x * cos + at.y * sin,
                        at.y * cos - at.x * sin,
                        at.z,
                    );
                    let off = match pattern {
                        // The function changes by about 1.2 in a radian.
                        Pattern::Gyroid => gyroid(&turned).abs() * 0.8 * wanted,
                        _ => (0..3)
                            .map(|k| {
                                let angle = f64::from(k) * TAU / 3.0;
                                let across = turned.y * angle.cos() - turned.x * angle.sin();
                                let share = (across + at.z / 2.0_f64.sqrt()) / (3.0 * wanted) - 0.5;
                                (share - share.round()).abs() * 3.0 * wanted
                            })
                            .fold(f64::INFINITY, f64::min),
                    };
                    assert!(off < 0.05, "{pattern:?}: {off} at {at}");
                    judged += 1;
                }
                assert!(judged > 12, "{pattern:?}: {judged}");
            }
        }
    }

    #[test]
    fn monotonic_lines_lie_beside_earlier_ones() {
        // A square with a round hole: behind the hole the stretches meet again.
        let area = rectangle(-12.0, -12.0, 24.0, 24.0).difference(&disc(5.0));
        for joined in [true, false] {
            let top_pattern = SolidPattern::Monotonic { joined };
            let params = InfillParams { top_pattern, angle: 0.0, ..PARAMS };
            let skins = Skins { top: area.clone(), ..Skins::default() };
            let filling = fill(&skins, &LAYER, &params);
            assert!(filling.lines.is_empty() && filling.in_order.len() == 1);
            let lines = &filling.in_order[0];
            assert_eq!(lines.len() < 8, joined, "{} lines", lines.len());
            // Long pieces along x in the order in which they are laid.
            let rows: Vec<[Point2<f64>; 2]> = lines
                .iter()
                .flat_map(|line| line.points.windows(2))
                .filter(|w| (w[1].x - w[0].x).abs() > 1.0 && (w[1].y - w[0].y).abs() < 1e-6)
                .map(|w| [w[0], w[1]])
                .collect();
            assert!(rows.len() > 50);
            for (k, later) in rows.iter().enumerate() {
                for earlier in &rows[..k] {
                    let middle = |row: &[Point2<f64>; 2]| f64::midpoint(row[0].x, row[1].x);
                    let apart = (middle(later) - middle(earlier)).abs();
                    let lengths =
                        (later[0].x - later[1].x).abs() + (earlier[0].x - earlier[1].x).abs();
                    let is_beside = apart < lengths / 2.0 - 0.5;
                    let rises = later[0].y >= earlier[0].y - 1e-6;
                    assert!(rises || !is_beside, "{earlier:?} before {later:?}");
                }
            }
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
                let limit = match pattern {
                    Pattern::Concentric => 40,
                    Pattern::Triangles | Pattern::Stars | Pattern::Cubic => 24,
                    _ => 16,
                };
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
        let spheres = Spheres::new(-1.0).unwrap();
        for pattern in [Pattern::Rectilinear, Pattern::Grid] {
            let params = InfillParams { pattern, ..PARAMS };
            for chart in charts {
                let layer = FillLayer { chart, surface: &spheres, ..LAYER };
                let area = disc(9.0);
                let core = chart.inset(&area, 0.25);
                let bead = Bead { width: 0.45, thickness: 0.2 };
                let share = if pattern == Pattern::Grid { 2.0 } else { 1.0 };
                let pitch =
                    share * bead.spacing() / params.density * sparse::closeness(pattern, &layer);
                let lines = sparse::fill(&area, &layer, &params);
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
