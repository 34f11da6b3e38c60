//! What the slicer hands on: lines of material in the part frame.

use geom::region::Region;
use nalgebra::{Point2, Point3};

use crate::bead::Bead;

/// What a line of material is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// The wall that is seen.
    ExternalPerimeter,
    /// A wall behind it.
    Perimeter,
    /// Sparse infill.
    InternalInfill,
    /// Sparse infill as thick as several layers.
    CombinedInfill,
    /// Solid infill that ends up inside or on the bed.
    SolidInfill,
    /// Solid infill that is seen from above.
    TopSolidInfill,
    /// Solid infill that spans a gap.
    BridgeInfill,
    /// A second, thin run over what is seen from above.
    Ironing,
    /// A bead between walls, of the width that is left there.
    GapFill,
    /// Skirt or brim.
    SkirtBrim,
    /// What carries overhangs and is broken away.
    SupportMaterial,
    /// The layers of it next to the part.
    SupportInterface,
}

impl Role {
    /// Returns whether it is a wall.
    #[must_use]
    pub fn is_wall(self) -> bool {
        matches!(self, Self::ExternalPerimeter | Self::Perimeter)
    }
}

/// How much of a wall's bead the layer below does not carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Overhang {
    /// Less than a quarter of its width.
    #[default]
    None,
    /// A quarter to a half.
    Quarter,
    /// A half to three quarters.
    Half,
    /// More than that.
    Most,
    /// All of it.
    Whole,
}

impl Overhang {
    /// All degrees, the least first.
    pub const ALL: [Self; 5] = [Self::None, Self::Quarter, Self::Half, Self::Most, Self::Whole];
}

/// A point of a line and the bead there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Where the tip of the nozzle passes, part frame, mm: on the upper side of the bead.
    pub at: Point3<f64>,
    /// The bead.
    pub bead: Bead,
    /// How the piece up to the next station hangs over.
    pub overhang: Overhang,
}

/// A line of material. Between stations the line is straight and the bead changes evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct Toolpath {
    /// What it is for.
    pub role: Role,
    /// Whether it ends where it begins; the first station is not repeated.
    pub closed: bool,
    /// At least two stations, or three when closed.
    pub stations: Vec<Station>,
}

impl Toolpath {
    /// Returns the length of the line, mm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.sides().map(|(a, b)| (b.at - a.at).norm()).sum()
    }

    /// Returns the volume of the line, mm³.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.sides()
            .map(|(a, b)| (b.at - a.at).norm() * f64::midpoint(a.bead.area(), b.bead.area()))
            .sum()
    }

    /// Returns the pieces between neighbouring stations, the closing one included.
    pub fn sides(&self) -> impl Iterator<Item = (&Station, &Station)> {
        let closing = self.closed.then(|| self.stations.first()).flatten();
        self.stations.iter().zip(self.stations.iter().skip(1).chain(closing))
    }
}

/// The walls that follow one outline of an island: the external one and those behind it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WallGroup {
    /// Closed loops, the external one first, then inwards. Empty only in an empty group.
    pub loops: Vec<Toolpath>,
}

/// Everything to be laid in one island of a layer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IslandPaths {
    /// The island itself, seen from above: travel inside it crosses no outline.
    pub outline: Region,
    /// Walls by outline: that of the island, then its holes.
    pub walls: Vec<WallGroup>,
    /// Infill and gap fill, in any order and direction.
    pub fills: Vec<Toolpath>,
    /// Open lines that are laid one after the other as they are, after all else of the island.
    pub in_order: Vec<Vec<Toolpath>>,
    /// Lines over all else of the island.
    pub ironing: Vec<Toolpath>,
}

impl IslandPaths {
    /// Returns all lines that are no walls.
    pub fn all_fills(&self) -> impl Iterator<Item = &Toolpath> {
        self.fills.iter().chain(self.in_order.iter().flatten())
    }
}

/// Everything to be laid in one layer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LayerPaths {
    /// Counted from 0.
    pub index: usize,
    /// Level of its upper side, mm.
    pub upper: f64,
    /// Nominal thickness, mm.
    pub thickness: f64,
    /// Skirt and brim, before all else.
    pub adhesion: Vec<Toolpath>,
    /// Supports, before the islands.
    pub supports: Vec<Toolpath>,
    /// The islands.
    pub islands: Vec<IslandPaths>,
    /// What could not be filled.
    pub lost: LostArea,
    /// How far the only wall climbs in its turn, mm, where the layer is one of a spiral vase.
    pub rise: Option<f64>,
}

impl LayerPaths {
    /// Returns the wall of a layer that has a single one and nothing else.
    #[must_use]
    pub fn only_wall(&self) -> Option<&Toolpath> {
        let [island] = self.islands.as_slice() else { return None };
        let mut loops = island.walls.iter().flat_map(|group| &group.loops);
        let wall = loops.next()?;
        let is_alone = loops.next().is_none() && island.all_fills().next().is_none();
        (is_alone && self.adhesion.is_empty() && self.supports.is_empty()).then_some(wall)
    }

    /// Returns whether nothing is laid.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.adhesion.is_empty() && self.supports.is_empty() && !self.lays_part()
    }

    /// Returns whether something of the part is laid.
    #[must_use]
    pub fn lays_part(&self) -> bool {
        self.islands.iter().any(|island| {
            !island.fills.is_empty()
                || !island.in_order.is_empty()
                || island.walls.iter().any(|group| !group.loops.is_empty())
        })
    }
}

/// Area of a layer that no bead fits in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LostArea {
    /// mm².
    pub area: f64,
    /// Where the largest piece lies, in the chart.
    pub worst: Option<Point2<f64>>,
    /// The area of that piece, mm².
    pub worst_area: f64,
}

impl LostArea {
    /// Counts the islands of `region` as lost.
    pub(crate) fn add(&mut self, region: &Region) {
        for island in region.islands() {
            let area: f64 = island.iter().map(|ring| geom::region::signed_area(ring)).sum();
            self.area += area;
            if area > self.worst_area {
                self.worst_area = area;
                self.worst =
                    island.first().and_then(|ring| ring.first()).map(|&p| geom::grid::mm(p));
            }
        }
    }

    /// Adds what another part of the layer lost.
    pub fn merge(&mut self, other: &Self) {
        self.area += other.area;
        if other.worst_area > self.worst_area {
            (self.worst, self.worst_area) = (other.worst, other.worst_area);
        }
    }
}
