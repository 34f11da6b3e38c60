//! One layer put together: from its section to toolpaths in the part frame.

use std::borrow::Cow;

use geom::bands::Bands;
use geom::grid::{GridPoint, mm};
use geom::region::{Fill, Island, Region, Ring, is_inside};
use nalgebra::{Point2, Point3};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

use crate::adhesion::{AdhesionParams, around};
use crate::bead::Bead;
use crate::bridge::{Bridge, bridges};
use crate::chart::Chart;
use crate::compensation::CompensationParams;
use crate::fuzzy::{self, FuzzyParams, roughened};
use crate::hanging::Below;
use crate::infill;
use crate::infill::ironing::ironing;
use crate::infill::{FillLayer, FillLine, InfillParams, angle_in, fill, fill_bridge};
use crate::level::Level;
use crate::lift::Lift;
use crate::nearby::Nearby;
use crate::skins::{Neighbours, SKIN_TOLERANCE_MM, SkinParams, Skins, skins};
use crate::support::{Column, SupportParams};
use crate::thin::{AxisPoint, ThinParams, axes};
use crate::toolpath::{IslandPaths, LayerPaths, LostArea, Role, Toolpath, WallGroup};
use crate::walls::{ThinPlace, WallParams, Walls, split_thin, walls};

/// How layers are filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathParams {
    /// Walls.
    pub walls: WallParams,
    /// Beads in places too thin for two.
    pub thin: ThinParams,
    /// Solid bottoms and tops.
    pub skins: SkinParams,
    /// Lines inside.
    pub infill: InfillParams,
    /// What is different on the bed.
    pub first_layer: FirstLayerParams,
    /// Loops around the first layer.
    pub adhesion: AdhesionParams,
    /// How far outlines move before all that.
    pub compensation: CompensationParams,
    /// How rough outer walls are, if they are.
    pub fuzzy: Option<FuzzyParams>,
    /// How it is supported, if it is.
    pub support: Option<SupportParams>,
    /// Whether there is a single climbing wall above the bottom.
    pub vase: bool,
    /// How far simplified lines may lie from their course, mm.
    pub tolerance: f64,
}

/// What is different on the bed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FirstLayerParams {
    /// Width of all its lines, mm; `None` for that of the other layers.
    pub width: Option<f64>,
    /// Whether it has a single wall.
    pub one_wall: bool,
}

impl PathParams {
    /// Returns what holds for a layer: counted from the bed, whether it lies on it.
    #[must_use]
    pub fn of_layer(&self, index: usize, on_bed: bool) -> Self {
        let mut own = *self;
        let every = self.skins.solid_every;
        own.skins.all_solid |= every > 0 && index.is_multiple_of(every);
        if !on_bed {
            return own;
        }
        if self.first_layer.one_wall {
            own.walls.count = own.walls.count.min(1);
        }
        if let Some(width) = self.first_layer.width {
            (own.walls.external_width, own.walls.width) = (width, width);
            (own.infill.width, own.infill.solid_width) = (width, width);
            own.infill.top_width = width;
        }
        own
    }
}

/// What one layer is made of, and a remark on what did not fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Filled {
    /// The toolpaths.
    pub paths: LayerPaths,
    /// Loops of skirt and brim that the reach of the machine left out.
    pub adhesion_out_of_reach: usize,
    /// The islands that begin in mid-air.
    pub floating: Vec<Floating>,
}

/// An island with nothing at all below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floating {
    /// The lowest place of its outline, part frame: there it begins.
    pub at: Point3<f64>,
    /// mm².
    pub area: f64,
}

/// Fills the material of one layer; regions are in its chart.
#[must_use]
pub fn fill_layer(
    lift: &Lift<'_>,
    material: &Region,
    neighbours: &Neighbours<'_>,
    params: &PathParams,
) -> Filled {
    Parted::new(lift, material, neighbours, params).on(neighbours.support).fill(params)
}

/// A layer taken apart into what walls, skins and sparse infill take, before lines are drawn: layers can
/// be compared here.
#[derive(Clone)]
pub struct Parted<'a> {
    lift: Lift<'a>,
    pieces: Pieces,
    support: Option<&'a Column>,
    /// Sparse infill as thick as several layers, and the family that it is part of.
    thick: Option<Thick<'a>>,
    /// The lines of sparse infill that are known beforehand, in the chart.
    branches: &'a [Vec<Point2<f64>>],
}

/// What a layer was taken apart into, without its place: to be put by, and filled later.
#[derive(Clone)]
pub struct Pieces {
    material: Region,
    hanging: Below,
    islands: Vec<PartedIsland>,
    floating: Vec<Floating>,
    is_vase: bool,
}

impl Pieces {
    /// Returns about how much memory they take, bytes.
    #[must_use]
    pub fn size(&self) -> usize {
        let regions = self.material.point_count() + self.hanging.point_count();
        let islands = self.islands.iter().map(PartedIsland::size).sum::<usize>();
        size_of::<GridPoint>() * regions + islands
    }
}

/// Sparse infill as thick as several layers.
#[derive(Clone)]
struct Thick<'a> {
    region: Region,
    /// From the lower side of the lowest of these layers to the upper side of this one.
    lift: Lift<'a>,
    /// Counted like layers.
    index: usize,
}

/// An island taken apart.
#[derive(Clone)]
struct PartedIsland {
    outline: Region,
    walls: Walls,
    /// What is too thin for solid lines.
    thin: Region,
    skins: Skins,
    bridges: Vec<Bridge>,
}

impl PartedIsland {
    fn size(&self) -> usize {
        let Skins { top, solid, sparse, unsupported } = &self.skins;
        let Walls { groups, interior, thin } = &self.walls;
        let regions = [&self.outline, &self.thin, top, solid, sparse, unsupported, interior];
        let regions = regions.into_iter().chain(thin.iter().map(|place| &place.region));
        let on_walls: usize = groups.iter().flatten().map(|wall| wall.points.len()).sum();
        size_of::<GridPoint>() * regions.map(Region::point_count).sum::<usize>()
            + size_of::<(Point2<f64>, Bead)>() * on_walls
    }
}

impl<'a> Parted<'a> {
    /// Takes the material of a layer apart; regions are in its chart.
    #[must_use]
    pub fn new(
        lift: &Lift<'a>,
        material: &Region,
        neighbours: &Neighbours<'_>,
        params: &PathParams,
    ) -> Self {
        let frame = Frame::of(lift);
        let is_vase = params.vase && is_above_the_bottom(lift, material, params);
        let level = &lift.level;
        let below = neighbours.below.first().copied().filter(|_| level.index > 0);
        let hanging = Below::new(material, below, &frame.chart, params.walls.external_width);
        let around = Around::of(neighbours);
        let islands = material.islands().par_iter();
        let islands = islands.map(|island| part(island, &hanging, &around, &frame, params));
        let pieces = Pieces {
            islands: if is_vase { Vec::new() } else { islands.collect() },
            floating: if is_vase { Vec::new() } else { floating(material, neighbours, &frame) },
            material: material.clone(),
            hanging,
            is_vase,
        };
        Self::of(lift, pieces)
    }

    /// Puts pieces in the place that they were taken from.
    #[must_use]
    pub fn of(lift: &Lift<'a>, pieces: Pieces) -> Self {
        Self { lift: *lift, pieces, support: None, thick: None, branches: &[] }
    }

    /// Returns the pieces alone.
    #[must_use]
    pub fn into_pieces(self) -> Pieces {
        self.pieces
    }

    /// Returns the same taken apart again on another plane: what a layer is whose section, thickness
    /// and neighbours are those of this one. `None` where the place of the layer matters to more than
    /// the heights of its lines.
    #[must_use]
    pub fn again_on(&self, lift: &Lift<'a>) -> Option<Self> {
        let same = self.lift.level.thickness() == lift.level.thickness();
        let is_everywhere = |lift: &Lift<'_>| {
            let limits = lift.floor.is_some() || lift.ceiling.is_some() || lift.stair.is_some();
            lift.level.index > 0 && lift.surface.form().is_flat() && !limits && lift.below.is_none()
        };
        let Pieces { floating, is_vase, .. } = &self.pieces;
        let plain = self.thick.is_none() && floating.is_empty() && !is_vase;
        let fits = same && plain && is_everywhere(&self.lift) && is_everywhere(lift);
        fits.then(|| Self::of(lift, self.pieces.clone()))
    }

    /// Adds the supports of the layer.
    #[must_use]
    pub fn on(self, support: Option<&'a Column>) -> Self {
        Self { support, ..self }
    }

    /// Adds the lines of sparse infill that were found for all layers together, in the chart.
    #[must_use]
    pub fn with_branches(self, branches: &'a [Vec<Point2<f64>>]) -> Self {
        Self { branches, ..self }
    }

    /// Returns where the middles of sparse lines may lie, and how far such lines of the wanted density
    /// are apart, mm.
    #[must_use]
    pub fn core(&self, params: &PathParams) -> (Region, f64) {
        let Frame { chart, thickness, .. } = Frame::of(&self.lift);
        let bead = infill::sparse::bead(thickness, &params.infill);
        let from_edge = infill::sparse::from_edge(&bead, &params.infill);
        let core = chart.inset(&self.sparse(), from_edge);
        (core, bead.spacing() / params.infill.density)
    }

    /// Returns what sparse infill takes.
    #[must_use]
    pub fn sparse(&self) -> Region {
        let rings =
            self.pieces.islands.iter().flat_map(|island| island.skins.sparse.rings().cloned());
        let rings: Vec<Ring> = rings.collect();
        Region::from_grid_rings(&rings, Fill::Positive)
    }

    /// Leaves out the sparse infill of a region, which thicker lines of a layer above will fill. What
    /// is left between them and the walls is filled where a line fits in.
    pub fn leave_out(&mut self, region: &Region, params: &PathParams) {
        let Frame { chart, thickness, .. } = Frame::of(&self.lift);
        let spacing = Bead { width: params.infill.width, thickness }.spacing();
        for island in &mut self.pieces.islands {
            let left = island.skins.sparse.difference(region);
            island.skins.sparse = chart.opened(&left, spacing);
        }
    }

    /// Fills a region with sparse lines as thick as several layers: from the lower side of the lowest,
    /// which `lower` is the level of, to the upper side of this one. `index` counts such layers.
    pub fn fill_thick(&mut self, region: Region, lower: f64, index: usize) {
        let level = Level { lower, ..self.lift.level };
        self.thick = Some(Thick { region, lift: Lift { level, ..self.lift }, index });
    }

    /// Draws the lines.
    #[must_use]
    pub fn fill(self, params: &PathParams) -> Filled {
        let frame = Frame::of(&self.lift);
        let material = &self.pieces.material;
        if self.pieces.is_vase {
            return vase_layer(material, &frame, params);
        }
        let level = &self.lift.level;
        let islands: Vec<(IslandPaths, LostArea)> = self
            .pieces
            .islands
            .par_iter()
            .map(|island| {
                fill_island(island, &self.pieces.hanging, self.thick.as_ref(), &frame, params)
            })
            .collect();
        let mut filled = Filled {
            paths: LayerPaths {
                index: level.index,
                upper: level.upper,
                thickness: frame.thickness,
                ..LayerPaths::default()
            },
            floating: self.pieces.floating,
            ..Filled::default()
        };
        for (paths, lost) in islands {
            filled.paths.lost.merge(&lost);
            filled.paths.islands.push(paths);
        }
        let bead = infill::sparse::bead(frame.thickness, &params.infill);
        let least = infill::lightning::STUB_IN_WIDTHS * bead.width;
        let long = |line: &&Vec<_>| geom::polyline::length(line) >= least;
        for line in self.branches.iter().filter(long) {
            // A branch lies within one island.
            let Some(first) = line.first() else { continue };
            let home = self.pieces.islands.iter().position(|island| island.outline.contains(first));
            if let Some(paths) = home.and_then(|home| filled.paths.islands.get_mut(home)) {
                paths.fills.push(frame.line(line, bead, Role::InternalInfill, false));
            }
        }
        filled.paths.supports = supports(self.support, &frame, params);
        if level.index == 0 && frame.chart.is_flat() {
            let bead = Bead { width: params.walls.width, thickness: frame.thickness };
            let stands = self.support.map(|column| material.union(&column.whole));
            let stands = stands.as_ref().unwrap_or(material);
            let adhesion = around(stands, bead.width, bead.spacing(), &params.adhesion);
            filled.adhesion_out_of_reach = adhesion.out_of_reach;
            filled.paths.adhesion = adhesion
                .loops
                .iter()
                .map(|points| frame.line(points, bead, Role::SkirtBrim, true))
                .collect();
        }
        filled
    }
}

/// The islands of a layer that begin in mid-air.
fn floating(material: &Region, neighbours: &Neighbours<'_>, frame: &Frame<'_>) -> Vec<Floating> {
    if frame.lift.level.index == 0 {
        return Vec::new();
    }
    let ground = neighbours.below.first().map(|below| Nearby::of(below));
    let carried = neighbours.support.map(|column| &column.carried);
    let carried = carried.map(|seen| frame.chart.region_under(seen)).unwrap_or_default();
    let column = Nearby::of(&carried);
    let floats = |island: &&Island| {
        !ground.as_ref().is_some_and(|ground| is_carried(island, ground))
            && !is_carried(island, &column)
    };
    material.filtered(floats).islands().iter().map(|i| frame.floating(i)).collect()
}

/// The lines of what supports the part.
fn supports(column: Option<&Column>, frame: &Frame<'_>, params: &PathParams) -> Vec<Toolpath> {
    let (Some(column), Some(how)) = (column, &params.support) else {
        return Vec::new();
    };
    let here = |seen: &Region| {
        let is_limited = frame.lift.floor.is_some() || frame.lift.ceiling.is_some();
        if seen.is_empty() || !is_limited {
            return seen.clone();
        }
        let laid = frame.lift.printable(&frame.chart.region_under(seen));
        frame.chart.region_from_above(&laid)
    };
    let lines = infill::support::lines(column, here, &frame.fill_layer(params), how);
    lines.iter().map(|line| frame.fill(line)).collect()
}

/// Whether a layer of a vase is none of its solid bottom, and nowhere ends on the flat layers that
/// curved ones begin on.
fn is_above_the_bottom(lift: &Lift<'_>, material: &Region, params: &PathParams) -> bool {
    let is_free = |floor: f64| {
        let thickness = lift.level.thickness();
        let mut outline = material.rings().flatten().map(|&p| lift.point(&mm(p)));
        outline.all(|at| at.z > floor + 2.0 * thickness)
    };
    lift.level.index >= params.skins.bottom_layers && lift.floor.is_none_or(is_free)
}

/// The outer walls of a layer and nothing else.
fn vase_layer(material: &Region, frame: &Frame<'_>, params: &PathParams) -> Filled {
    let wanted = WallParams { count: 1, ..params.walls };
    let islands = material.islands().iter().filter_map(|island| {
        let outline = Region::from_island(vec![island.first()?.clone()]);
        let found = walls(&outline, &frame.chart, frame.thickness, &wanted);
        let groups = found.groups.iter().map(|group| WallGroup {
            loops: group
                .iter()
                .map(|wall| Toolpath {
                    role: Role::ExternalPerimeter,
                    closed: true,
                    stations: frame.lift.stations(&wall.points, true),
                })
                .collect(),
        });
        let outline = frame.seen_from_above(outline);
        Some(IslandPaths { walls: groups.collect(), outline, ..IslandPaths::default() })
    });
    let level = &frame.lift.level;
    let mut paths = LayerPaths {
        index: level.index,
        upper: level.upper,
        thickness: frame.thickness,
        islands: islands.collect(),
        ..LayerPaths::default()
    };
    paths.rise = paths.only_wall().is_some().then(|| level.thickness());
    Filled { paths, ..Filled::default() }
}

/// Whether an island has anything of the layer below under it.
fn is_carried(island: &Island, below: &Nearby<'_>) -> bool {
    let below = below.meeting(island);
    // Nearly always it stands on its like, or a corner of one lies in the other. All are looked at for
    // that before any is cut: of rings within rings each would be cut with all that are around it.
    let stands =
        |on: &&Island| *on == island || has_corner_in(island, on) || has_corner_in(on, island);
    if below.iter().any(stands) {
        return true;
    }
    let outline = Region::from_island(island.clone());
    let meets =
        |other: &Island| !outline.intersection(&Region::from_island(other.clone())).is_empty();
    below.into_iter().any(meets)
}

/// Whether the first corner of an island lies in another.
fn has_corner_in(island: &Island, other: &Island) -> bool {
    let corner = island.first().and_then(|outer| outer.first());
    corner.is_some_and(|corner| is_inside(other, &mm(*corner)))
}

/// How far from its box an island looks for what bridges rest on, mm: many times further than beads and
/// anchors reach.
const NEAR_MM: f64 = 10.0;

/// The neighbours of a layer, their islands by place.
struct Around<'a> {
    above: Vec<Nearby<'a>>,
    below: Vec<Nearby<'a>>,
    support: Option<&'a Column>,
}

impl<'a> Around<'a> {
    fn of(neighbours: &Neighbours<'a>) -> Self {
        let placed = |regions: &[&'a Region]| regions.iter().map(|r| Nearby::of(r)).collect();
        let Neighbours { above, below, support } = neighbours;
        Self { above: placed(above), below: placed(below), support: *support }
    }
}

fn sharing<'a>(island: &Island, neighbours: &[Nearby<'a>]) -> Vec<Cow<'a, Region>> {
    neighbours.iter().map(|region| region.sharing(island)).collect()
}

/// Takes an island apart.
fn part(
    island: &Island,
    hanging: &Below,
    around: &Around<'_>,
    frame: &Frame<'_>,
    params: &PathParams,
) -> PartedIsland {
    let outline = Region::from_island(island.clone());
    let [above, below] = [&around.above, &around.below].map(|all| sharing(island, all));
    let [above, below] = [&above, &below].map(|all| all.iter().map(AsRef::as_ref).collect());
    let neighbours = &Neighbours { above, below, support: around.support };
    let Frame { chart, thickness, .. } = *frame;
    let walls = suitable_walls(&outline, hanging, neighbours, frame, params);
    let solid_bead = Bead { width: params.infill.solid_width, thickness };
    let split = split_thin(&walls.interior, &chart, solid_bead.spacing() / 2.0);
    let interior = split.thick.thinned(SKIN_TOLERANCE_MM);
    let spacing = solid_bead.spacing();
    let mut skins = skins(&interior, &chart, neighbours, spacing, &params.skins);
    let rests = frame.lift.level.index == 0 || skins.unsupported.is_empty();
    let bridges = match around.below.first().filter(|_| !rests) {
        Some(below) => bridges(&mut skins, &below.around(island, NEAR_MM), &chart, spacing),
        None => Vec::new(),
    };
    PartedIsland { outline, walls, thin: split.thin, skins, bridges }
}

fn fill_island(
    island: &PartedIsland,
    hanging: &Below,
    thick: Option<&Thick<'_>>,
    frame: &Frame<'_>,
    params: &PathParams,
) -> (IslandPaths, LostArea) {
    let PartedIsland { outline, walls, skins, bridges, .. } = island;
    let index = frame.lift.level.index;
    let layer = frame.fill_layer(params);
    let ironed = params.infill.ironing.map_or_else(Vec::new, |how| {
        let across = angle_in(&layer, &params.infill) + FRAC_PI_2;
        ironing(&skins.top, across, &layer, &how)
    });
    let mut filling = fill(skins, &layer, &params.infill);
    for bridge in bridges {
        fill_bridge(bridge, &layer, &params.infill, &mut filling);
    }

    let between = filling.thin.iter().chain(std::iter::once(&island.thin));
    let gaps = between.filter(|gap| !gap.is_empty()).cloned();
    let gaps: Vec<ThinPlace> =
        gaps.map(|region| ThinPlace { region, role: Role::GapFill }).collect();
    let mut lost = LostArea::default();
    let mut fills: Vec<Toolpath> = filling.lines.iter().map(|line| frame.fill(line)).collect();
    fills.extend(thick.into_iter().flat_map(|thick| thick.lines(outline, params)));
    for place in walls.thin.iter().chain(&gaps) {
        fills.extend(single_beads(place, frame, params, &mut lost));
    }
    let rough = params.fuzzy.filter(|_| index > 0);
    let room = rough.map(|how| {
        let between = params.walls.external_width / 2.0 + fuzzy::APART_SHARE * how.depth;
        Bands::of(&frame.chart.inset(outline, between))
    });
    let groups = walls.groups.iter().map(|group| {
        let loops = group.iter().map(|wall| {
            let role = if wall.depth == 0 { Role::ExternalPerimeter } else { Role::Perimeter };
            let rough = rough.zip(room.as_ref()).filter(|_| wall.depth == 0);
            let points =
                rough.map(|(how, room)| roughened(&wall.points, index, &how, |p| room.contains(p)));
            let points = points.as_ref().unwrap_or(&wall.points);
            let stations = if hanging.is_open() {
                frame.lift.hanging_stations(&hanging.along(points))
            } else {
                frame.lift.stations(points, true)
            };
            Toolpath { role, closed: true, stations }
        });
        WallGroup { loops: loops.collect() }
    });
    let in_order = filling.in_order.iter().filter(|lines| !lines.is_empty());
    let paths = IslandPaths {
        walls: groups.collect(),
        outline: frame.seen_from_above(outline.clone()),
        fills,
        ironing: ironed.iter().map(|line| frame.fill(line)).collect(),
        in_order: in_order
            .map(|lines| lines.iter().map(|line| frame.fill(line)).collect())
            .collect(),
    };
    (paths, lost)
}

impl Thick<'_> {
    /// The lines within an island.
    fn lines(&self, outline: &Region, params: &PathParams) -> Vec<Toolpath> {
        let region = self.region.intersection(outline);
        if region.is_empty() {
            return Vec::new();
        }
        let frame = Frame::of(&self.lift);
        let layer = FillLayer { index: self.index, ..frame.fill_layer(params) };
        let lines = infill::sparse_lines(&region, &layer, &params.infill);
        let role = Role::CombinedInfill;
        lines.into_iter().map(|line| frame.fill(&FillLine { role, ..line })).collect()
    }
}

/// The walls of an island: as many as are wanted, or one on top, or more where they hang over.
fn suitable_walls(
    outline: &Region,
    hanging: &Below,
    neighbours: &Neighbours<'_>,
    frame: &Frame<'_>,
    params: &PathParams,
) -> Walls {
    let mut wanted = params.walls;
    let is_topmost = || match neighbours.above.first() {
        Some(above) => outline.intersection(above).is_empty(),
        None => true,
    };
    if wanted.one_on_top && wanted.count > 1 && is_topmost() {
        wanted.count = 1;
    }
    let mut found = walls(outline, &frame.chart, frame.thickness, &wanted);
    let below = neighbours.below.first().filter(|_| wanted.more_on_overhangs && hanging.is_open());
    let Some(below) = below else { return found };
    let spacing = Bead { width: wanted.width, thickness: frame.thickness }.spacing();
    for _ in 0..MOST_EXTRA_WALLS {
        let inner = frame.chart.inset(&found.interior, spacing);
        let next = found.interior.difference(&inner);
        let bare = next.difference(below).area();
        if next.is_empty() || bare < EXTRA_WALL_SHARE * next.area() {
            break;
        }
        wanted.count += 1;
        found = walls(outline, &frame.chart, frame.thickness, &wanted);
    }
    found
}

/// Walls that a steep overhang gets beyond those that are wanted, at most: together they reach
/// further than any slope that prints without support.
const MOST_EXTRA_WALLS: usize = 4;

/// One more wall is worth it where so much of its place has nothing below it.
const EXTRA_WALL_SHARE: f64 = 0.3;

fn single_beads(
    place: &ThinPlace,
    frame: &Frame<'_>,
    params: &PathParams,
    lost: &mut LostArea,
) -> Vec<Toolpath> {
    let Frame { chart, thickness, .. } = *frame;
    let least = match place.role {
        Role::ExternalPerimeter => params.thin.least_width,
        _ => params.thin.least_gap,
    };
    axes(&place.region, &chart, least, params.thin.greatest_width, lost)
        .into_iter()
        .map(|axis| {
            let with_bead = |p: AxisPoint| {
                // Between walls the bead takes the whole gap; on its own it must not bulge out of
                // the part.
                let bead = match place.role {
                    Role::ExternalPerimeter => Bead { width: p.width, thickness },
                    _ => Bead::with_spacing(p.width, thickness),
                };
                (p.at, bead)
            };
            let line: Vec<(Point2<f64>, Bead)> = axis.into_iter().map(with_bead).collect();
            Toolpath {
                role: place.role,
                closed: false,
                stations: frame.lift.stations(&line, false),
            }
        })
        .collect()
}

/// A layer's place in space and the metric of its chart.
struct Frame<'a> {
    lift: &'a Lift<'a>,
    chart: Chart,
    /// Along the normal; of caps, at the axis.
    thickness: f64,
}

impl<'a> Frame<'a> {
    fn of(lift: &'a Lift<'a>) -> Self {
        Self {
            lift,
            chart: lift.surface.chart(lift.level.upper),
            thickness: lift.level.thickness() / lift.surface.level_step(1.0),
        }
    }

    fn fill_layer(&self, params: &PathParams) -> FillLayer<'_> {
        FillLayer {
            index: self.lift.level.index,
            chart: self.chart,
            surface: self.lift.surface,
            level: self.lift.level.upper,
            thickness: self.thickness,
            tolerance: params.tolerance,
        }
    }

    fn line(&self, points: &[Point2<f64>], bead: Bead, role: Role, closed: bool) -> Toolpath {
        let line: Vec<(Point2<f64>, Bead)> = points.iter().map(|p| (*p, bead)).collect();
        Toolpath { role, closed, stations: self.lift.stations(&line, closed) }
    }

    fn fill(&self, line: &FillLine) -> Toolpath {
        self.line(&line.points, line.bead, line.role, line.closed)
    }

    fn floating(&self, island: &Island) -> Floating {
        let outline = island.iter().flatten().map(|&p| self.lift.point(&mm(p)));
        let lowest = outline.min_by(|a, b| a.z.total_cmp(&b.z)).unwrap_or_else(Point3::origin);
        let area = self.chart.area(&Region::from_island(island.clone()));
        Floating { at: lowest, area }
    }

    /// A region of the chart as it is seen from above.
    fn seen_from_above(&self, region: Region) -> Region {
        if self.chart.is_flat() {
            return region;
        }
        let seen = |&p: &GridPoint| self.lift.point(&mm(p)).xy();
        let rings: Vec<Vec<Point2<f64>>> =
            region.rings().map(|ring| ring.iter().map(seen).collect()).collect();
        Region::from_rings(rings.iter().map(Vec::as_slice), Fill::Positive)
    }
}
