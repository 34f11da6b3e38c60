//! Supports: columns under what no layer surface carries.
//!
//! What of a layer hangs over is judged on the layer itself ([`hanging`]): its overhang beyond the
//! layer below, taken along the normal, and not its angle to the vertical. From there supports go
//! straight down, as weight does, through all layers below, whatever surface these follow; so they
//! are known as they are seen along the axis ([`Shade`]). Where they meet the part they end on it, or,
//! if only the bed may carry them, they are left out from the top down ([`columns`]).
//!
//! Supports keep a gap to the part: aside `xy_gap` mm, and above and below as many whole layers as
//! it takes to be at least nine tenths of `top_gap` and `bottom_gap` mm. The layers of a column next to the part
//! are its *interface*, which is filled more densely, and reaches from line to line of the column: on
//! sloping layers it begins in each of them a little beside the one below, and would hang there.

use geom::grid::{mm, snap};
use geom::offset::COARSE_TOLERANCE_MM;
use geom::region::{Fill, Island, Region, Ring};
use nalgebra::{Point2, Rotation2};
use rayon::prelude::*;

use crate::bridge::spanned;
use crate::chart::Chart;
use crate::skins::SKIN_TOLERANCE_MM;

/// How the lines of a column run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SupportPattern {
    /// Parallel lines, the same in every layer: walls.
    Rectilinear,
    /// Parallel lines, turned by 90° from layer to layer.
    RectilinearGrid,
    /// Hexagonal cells.
    Honeycomb,
}

/// How parts are supported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupportParams {
    /// Slopes are supported that rise from the layer by less than this, radians; 0 for those where
    /// a layer reaches beyond the one below by more than half a bead.
    pub threshold: f64,
    /// Width of the outermost bead of the part, mm.
    pub wall_width: f64,
    /// Whether supports stand on the bed only, and never on the part.
    pub on_bed_only: bool,
    /// Whether gaps are left to bridges where a line of at most this length (mm) spans them; 0 for
    /// none.
    pub longest_bridge: f64,
    /// Distance from the part aside, mm.
    pub xy_gap: f64,
    /// Least distance from the part above a column, mm.
    pub top_gap: f64,
    /// Least distance from the part that a column stands on, mm.
    pub bottom_gap: f64,
    /// Layers of interface under the part.
    pub top_interface: usize,
    /// Layers of interface on the part.
    pub bottom_interface: usize,
    /// Width of the beads, mm.
    pub width: f64,
    /// Space between the lines of a column, mm.
    pub spacing: f64,
    /// Space between the lines of the interface, mm.
    pub interface_spacing: f64,
    /// Direction of the lines of a column, radians from the part's reference azimuth.
    pub angle: f64,
    /// How lines of a column run.
    pub pattern: SupportPattern,
    /// Whether a loop runs around columns.
    pub sheath: bool,
    /// No bead reaches farther from the rotation axis, mm.
    pub reach: f64,
}

/// How far columns reach beyond what hangs over, mm: an edge is as well carried as the middle, and no
/// column is so slender that it falls.
pub const MARGIN_MM: f64 = 1.0;

/// Slimmer strips than this are noise of outlines, mm.
const NOISE_MM: f64 = 0.02;

/// Smaller places than this carry themselves, mm²: a bead's dot is as large. Islands that begin in
/// mid-air are supported however small.
const LEAST_MM2: f64 = 0.15;

/// How closely columns follow outlines, mm.
const TOLERANCE_MM: f64 = 0.05;

impl SupportParams {
    /// Returns how far a layer of this thickness may reach beyond the one below, mm.
    #[must_use]
    pub fn carried_reach(&self, thickness: f64) -> f64 {
        if self.threshold > 0.0 { thickness / self.threshold.tan() } else { self.wall_width / 2.0 }
    }
}

/// Returns what of a layer must be supported, in its chart. `below` is the layer below, carried to it
/// along the normals.
#[must_use]
pub fn hanging(
    material: &Region,
    below: &Region,
    chart: &Chart,
    thickness: f64,
    params: &SupportParams,
) -> Region {
    // Thinned out like what is below: then upright walls are equal to the last bit.
    if material.thinned(SKIN_TOLERANCE_MM) == *below {
        return Region::default();
    }
    let reach = params.carried_reach(thickness);
    let beyond_reach = material.difference(&chart.outset(below, reach));
    let floating = material.filtered(|island| !is_carried(island, below));
    let bare = chart.opened(&beyond_reach, NOISE_MM / 2.0);
    let mut hangs = Region::default();
    if !bare.is_empty() {
        let beyond = material.difference(below);
        // Up to what carries it, so that the steps of a slope leave no stripes between them.
        hangs = chart.outset(&bare, reach + NOISE_MM).intersection(&beyond);
        hangs = hangs.without_small_islands(LEAST_MM2);
        if params.longest_bridge > 0.0 && !hangs.is_empty() {
            let (spacing, longest) = (params.wall_width, params.longest_bridge);
            let spanned = spanned(&hangs, below, chart, spacing, longest);
            // Beside the outermost lines are the walls, which go the same way.
            let spanned = chart.outset(&spanned, spacing);
            hangs = hangs.difference(&spanned).without_small_islands(LEAST_MM2);
        }
    }
    if floating.is_empty() { hangs } else { hangs.union(&floating) }
}

/// Whether an island of a layer has something below it.
fn is_carried(island: &Island, below: &Region) -> bool {
    island.iter().flatten().any(|&p| below.contains(&mm(p)))
        || !Region::from_island(island.clone()).intersection(below).is_empty()
}

/// One layer as it is seen along the axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shade {
    /// The part.
    pub material: Region,
    /// What of it must be supported.
    pub hanging: Region,
    /// Thickness of the layer, mm.
    pub thickness: f64,
}

/// What of one layer is support, as it is seen along the axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Column {
    /// All of it.
    pub whole: Region,
    /// What of it is next to the part.
    pub interface: Region,
    /// What of the part in this layer is supported from below.
    pub carried: Region,
}

impl Column {
    /// Returns whether nothing of the layer is support, nor carried by it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.whole.is_empty() && self.carried.is_empty()
    }
}

/// Returns the supports of all layers, which come from the bed up.
#[must_use]
pub fn columns(layers: &[Shade], params: &SupportParams) -> Vec<Column> {
    let contacts = contacts(layers, params);
    let needed = needed(layers, &contacts);
    // Arcs around corners of the part are cut by as much, and by beads along them once more.
    let aside = params.xy_gap + 2.0 * COARSE_TOLERANCE_MM;
    let clear = |(layer, needed): (&Shade, &Region)| {
        if needed.is_empty() { Region::default() } else { layer.material.outset_coarsely(aside) }
    };
    let clear: Vec<Region> = layers.par_iter().zip(&needed).map(clear).collect();
    let mut columns: Vec<Column> = (0..layers.len())
        .into_par_iter()
        .map(|k| column(k, layers, (&contacts, &needed, &clear[k]), params))
        .collect();
    for (column, contact) in columns.iter_mut().zip(contacts) {
        column.carried = contact;
    }
    columns
}

/// What columns reach up to under each layer: what hangs over, and a little around it.
fn contacts(layers: &[Shade], params: &SupportParams) -> Vec<Region> {
    let mut under = Region::default();
    let mut grounds = Vec::with_capacity(layers.len());
    for layer in layers {
        // Over none of this may a column stand that has to reach the bed.
        let is_asked = params.on_bed_only && !layer.hanging.is_empty();
        grounds.push(if is_asked {
            under.outset_coarsely(params.xy_gap)
        } else {
            Region::default()
        });
        if params.on_bed_only {
            under = under.union(&layer.material).thinned(TOLERANCE_MM / 2.0);
        }
    }
    let of = |(k, layer): (usize, &Shade)| {
        let hangs = layer.hanging.difference(&grounds[k]);
        if k == 0 || hangs.is_empty() {
            return Region::default();
        }
        let beside = layers[k - 1].material.outset_coarsely(params.xy_gap).union(&grounds[k]);
        let grown = hangs.outset_coarsely(MARGIN_MM).difference(&beside);
        // Not on the other side of a thin wall.
        let touches = |island: &&Island| {
            !Region::from_island((*island).clone()).intersection(&hangs).is_empty()
        };
        grown.filtered(touches).union(&hangs)
    };
    layers.par_iter().enumerate().map(of).collect()
}

/// Where columns pass through each layer, but for the gaps.
fn needed(layers: &[Shade], contacts: &[Region]) -> Vec<Region> {
    let mut needed = vec![Region::default(); layers.len()];
    let mut passing = Region::default();
    for k in (0..layers.len()).rev() {
        if let Some(contact) = contacts.get(k + 1).filter(|contact| !contact.is_empty()) {
            passing = passing.union(contact);
        }
        if !passing.is_empty() {
            passing = passing.difference(&layers[k].material).simplified(TOLERANCE_MM / 2.0);
        }
        needed[k].clone_from(&passing);
    }
    needed
}

/// The support of layer `k`: `contacts` and where columns are needed in all layers, and where the part
/// and the gap aside are in this one.
fn column(
    k: usize,
    layers: &[Shade],
    (contacts, needed, clear): (&[Region], &[Region], &Region),
    params: &SupportParams,
) -> Column {
    if needed[k].is_empty() {
        return Column::default();
    }
    let above = gap(params.top_gap, (k + 1..layers.len()).map(|i| layers[i].thickness));
    let below = gap(params.bottom_gap, (0..k).rev().map(|i| layers[i].thickness));
    // What reaches up beyond the gap; the margin around what hangs over ends with the rest.
    let Some(passing) = needed.get(k + above) else { return Column::default() };
    let mut free = passing.difference(clear);
    for i in (k + 1..=k + above).chain(k - below..k) {
        free = free.difference(&layers[i].material);
    }
    let radius = params.width / 2.0;
    // Too narrow for a bead are places of it that no line comes to: nothing need be done about them.
    let whole = within(free, params.reach - params.width).simplified(TOLERANCE_MM);
    let mut near = Region::default();
    let first_above = (k + above + 1).min(layers.len());
    for contact in &contacts[first_above..(first_above + params.top_interface).min(layers.len())] {
        near = near.union(contact);
    }
    let last_below = k - below;
    for layer in &layers[last_below - params.bottom_interface.min(last_below)..last_below] {
        near = near.union(&layer.material);
    }
    let interface = followed(&whole.intersection(&near), radius);
    if interface.is_empty() {
        return Column { whole, ..Column::default() };
    }
    let (interface, room) = if params.pattern == SupportPattern::Rectilinear {
        (from_line_to_line(&interface, params), params.width)
    } else {
        // What is left beside it holds lines only where it is wide enough for two of them; dense lines
        // that end short of the edge would lie between the sheath and where the others end.
        (interface, params.spacing / 2.0)
    };
    let body = followed(&whole.difference(&interface), room);
    let interface = followed(&whole.difference(&body), radius);
    Column { whole, interface, carried: Region::default() }
}

/// An interface that reaches up to the lines of a column on both sides, where these run the same way in
/// every layer: its own lines, across them, then end on one, and so do those of the next layer, which on
/// a slope begin a little beside.
fn from_line_to_line(interface: &Region, params: &SupportParams) -> Region {
    let (pitch, width) = (params.spacing + params.width, params.width);
    let row = |v: f64| ((v - pitch / 2.0) / pitch).floor();
    let at = |row: f64| pitch / 2.0 + pitch * row;
    let to_rows = Rotation2::new(-params.angle);
    let along_rows = turned(interface, &to_rows);
    let Some(bounds) = along_rows.bounds() else { return Region::default() };
    let (low, high) = (mm(bounds.min), mm(bounds.max));
    let bands = (row(low.y) as i64..=row(high.y) as i64).map(|k| {
        let [from, to] = [at(k as f64), at(k as f64 + 1.0)];
        block([low.x - pitch, high.x + pitch], [from + width / 2.0, to - width / 2.0])
    });
    let pieces = along_rows.intersection(&union_of(bands));
    // Over the lines by half a bead, so that ends lie on them for sure.
    let reaching = pieces.islands().iter().filter_map(|island| {
        let bounds = Region::from_island(island.clone()).bounds()?;
        let (low, high) = (mm(bounds.min), mm(bounds.max));
        let k = row(f64::midpoint(low.y, high.y));
        Some(block([low.x, high.x], [at(k) - width, at(k + 1.0) + width]))
    });
    interface.union(&turned(&union_of(reaching), &to_rows.inverse()))
}

/// The corners of an upright rectangle, mm.
fn block([left, right]: [f64; 2], [low, high]: [f64; 2]) -> [Point2<f64>; 4] {
    [[left, low], [right, low], [right, high], [left, high]].map(Point2::from)
}

fn union_of(blocks: impl Iterator<Item = [Point2<f64>; 4]>) -> Region {
    let blocks: Vec<[Point2<f64>; 4]> = blocks.collect();
    Region::from_rings(blocks.iter().map(<[_; 4]>::as_slice), Fill::NonZero)
}

fn turned(region: &Region, by: &Rotation2<f64>) -> Region {
    let turned = |ring: &Ring| ring.iter().map(|&p| snap(&(by * mm(p)))).collect();
    let rings: Vec<Ring> = region.rings().map(turned).collect();
    Region::from_grid_rings(&rings, Fill::Positive)
}

/// How many layers it takes to keep a gap, of these thicknesses in their order.
fn gap(wanted: f64, thicknesses: impl Iterator<Item = f64>) -> usize {
    /// What a gap may lack of what is wanted: layers are a little thinner than asked for where a
    /// whole number of them has to fit, and one more would be too wide for beads to sag across.
    const SLACK_SHARE: f64 = 0.1;
    let mut left = wanted * (1.0 - SLACK_SHARE);
    let mut count = 0;
    for thickness in thicknesses {
        if left <= 0.0 {
            break;
        }
        left -= thickness;
        count += 1;
    }
    count
}

/// The part of a region that a disc of the radius can reach without leaving it, as closely as columns
/// follow outlines: corners beyond that cost time in all that is done with them, and in the machine.
fn followed(region: &Region, radius: f64) -> Region {
    let half = TOLERANCE_MM / 2.0;
    if region.is_empty() {
        return Region::default();
    }
    Chart::Plane.opened(&region.thinned(half), radius).simplified(half)
}

/// What of a region lies within a distance (mm) of the axis.
fn within(region: Region, reach: f64) -> Region {
    // A polygon in the circle, and the circle in that.
    const CORNERS: u32 = 256;
    let step = std::f64::consts::TAU / f64::from(CORNERS);
    let inner = reach * (step / 2.0).cos();
    if region.rings().flatten().all(|&p| mm(p).coords.norm() < inner) {
        return region;
    }
    let corner = |k: u32| {
        let angle = step * f64::from(k);
        Point2::new(reach * angle.cos(), reach * angle.sin())
    };
    let ring: Vec<Point2<f64>> = (0..CORNERS).map(corner).collect();
    region.intersection(&Region::from_rings([ring.as_slice()], Fill::NonZero))
}
