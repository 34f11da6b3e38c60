//! The motion program: what the machine is told to do, before it becomes text.
//!
//! Positions are joints: `s` along the rail (mm), the accumulated turn of the bed (radians), the
//! lift `z` (mm). Every move also says where in the part the nozzle then stands, for dialects
//! whose firmware turns part coordinates into joints itself.

use nalgebra::{Point2, Point3};

/// The turn of the bed, accumulated over the whole program and never wrapped, radians.
///
/// It is the bed's own count: unless the machine's [`BedScale`](crate::kinematics::BedScale) says
/// otherwise it grows when the nozzle runs counter-clockwise over the part. A wrapped angle where an
/// accumulated one belongs would spin the bed back by whole turns; hence the type.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct BedTurn(f64);

impl BedTurn {
    /// Returns the turn of `radians`, accumulated since homing.
    #[must_use]
    pub fn accumulated(radians: f64) -> Self {
        Self(radians)
    }

    /// Returns the turn at which the bed stands at `azimuth` (radians, any) and that is nearest to
    /// this one.
    #[must_use]
    pub fn nearest(self, azimuth: f64) -> Self {
        if (self.0 - azimuth).abs() <= std::f64::consts::PI {
            return Self(azimuth);
        }
        let whole_turns = ((self.0 - azimuth) / std::f64::consts::TAU).round();
        Self(azimuth + whole_turns * std::f64::consts::TAU)
    }

    /// Returns the accumulated angle, radians.
    #[must_use]
    pub fn radians(self) -> f64 {
        self.0
    }
}

/// Where the axes stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joints {
    /// The carriage on the rail, mm; negative beyond the centre.
    pub s: f64,
    /// The bed.
    pub turn: BedTurn,
    /// The lift, mm.
    pub z: f64,
}

/// One straight line in joint space, done at constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Where the axes end up.
    pub to: Joints,
    /// Where the nozzle then stands in the part, mm.
    pub at: Point3<f64>,
    /// Filament fed on the way, mm; negative when it is drawn back.
    pub filament: f64,
    /// Length of the nozzle's path over the part, mm; zero when only filament moves.
    pub path: f64,
    /// How long it takes at the commanded speed, s; positive.
    pub duration: f64,
}

impl Move {
    /// Returns the commanded speed: of the nozzle over the part, or of the filament where the
    /// nozzle stands still.
    #[must_use]
    pub fn feed(&self) -> Feed {
        let distance = if self.path > 0.0 { self.path } else { self.filament.abs() };
        Feed::mm_per_s(distance / self.duration)
    }

    /// Returns whether the nozzle moves and lays material on the way.
    #[must_use]
    pub fn extrudes(&self) -> bool {
        self.path > 0.0 && self.filament > 0.0
    }
}

/// A speed, which is mm/s everywhere but in a program's text.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Feed(f64);

impl Feed {
    /// Returns the speed of `mm_per_s`.
    #[must_use]
    pub fn mm_per_s(mm_per_s: f64) -> Self {
        Self(mm_per_s)
    }

    /// Returns the speed of `mm_per_min`, the unit of the word `F`.
    #[must_use]
    pub fn from_word(mm_per_min: f64) -> Self {
        Self(mm_per_min / 60.0)
    }

    /// Returns the speed in mm/s.
    #[must_use]
    pub fn in_mm_per_s(self) -> f64 {
        self.0
    }

    /// Returns the speed in mm/min, the unit of the word `F`.
    #[must_use]
    pub fn word(self) -> f64 {
        self.0 * 60.0
    }
}

/// What a stretch of material is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// The wall that is seen, whatever it rests on.
    ExternalPerimeter,
    /// A wall behind it.
    Perimeter,
    /// A wall behind it, more than half of whose bead the layer below does not carry. Other slicers name
    /// outer walls so as well.
    OverhangPerimeter,
    /// Sparse infill.
    InternalInfill,
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
    /// Anything else, such as priming.
    Custom,
}

impl Role {
    /// All roles, in the order of reports.
    pub const ALL: [Self; 13] = [
        Self::ExternalPerimeter,
        Self::Perimeter,
        Self::OverhangPerimeter,
        Self::InternalInfill,
        Self::SolidInfill,
        Self::TopSolidInfill,
        Self::BridgeInfill,
        Self::Ironing,
        Self::GapFill,
        Self::SkirtBrim,
        Self::SupportMaterial,
        Self::SupportInterface,
        Self::Custom,
    ];

    /// Returns the name that viewers read in `;TYPE:` comments.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::ExternalPerimeter => "External perimeter",
            Self::Perimeter => "Perimeter",
            Self::OverhangPerimeter => "Overhang perimeter",
            Self::InternalInfill => "Internal infill",
            Self::SolidInfill => "Solid infill",
            Self::TopSolidInfill => "Top solid infill",
            Self::BridgeInfill => "Bridge infill",
            Self::Ironing => "Ironing",
            Self::GapFill => "Gap fill",
            Self::SkirtBrim => "Skirt/Brim",
            Self::SupportMaterial => "Support material",
            Self::SupportInterface => "Support material interface",
            Self::Custom => "Custom",
        }
    }

    /// Returns whether it is a wall, whatever it rests on.
    #[must_use]
    pub fn is_wall(self) -> bool {
        matches!(self, Self::ExternalPerimeter | Self::Perimeter | Self::OverhangPerimeter)
    }

    /// Returns the role with this label.
    #[must_use]
    pub fn from_label(label: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.label() == label)
    }
}

/// A move along a circle of the part, level, at constant speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Where it ends and what it feeds; its path is that along the circle.
    pub motion: Move,
    /// The middle of the circle, part frame, mm.
    pub centre: Point2<f64>,
    /// Whether it runs clockwise, seen from above.
    pub clockwise: bool,
}

/// A move of a machine whose head turns the nozzle: straight in what its drives stand at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posed {
    /// Its place in the part, filament and time. The joints are those that would bring an upright
    /// nozzle to the same place.
    pub motion: Move,
    /// Where the drives end up.
    pub stance: crate::head::Stance,
    /// How far the point about which the nozzle turns runs round its tip, mm.
    pub swing: f64,
}

impl Posed {
    /// Returns the way that `F` speaks of, mm: that of the tip over the part, or of the point that the
    /// nozzle is turned about round the tip, where that is longer.
    #[must_use]
    pub fn way(&self) -> f64 {
        if self.motion.path > 0.0 { self.motion.path.max(self.swing) } else { 0.0 }
    }
}

/// One step of a program.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// A move of the axes or the filament.
    Move(Move),
    /// A move along a circle, for firmwares that take part coordinates and draw circles.
    Arc(Arc),
    /// A move of a machine whose head turns the nozzle.
    Posed(Box<Posed>),
    /// A new layer begins.
    Layer(Layer),
    /// What the following moves lay, and the width of the bead, mm.
    Bead(Role, f64),
    /// How thick the following beads are, mm, where that is not the thickness of their layer.
    Height(Option<f64>),
    /// The part fan, 0 (off) to 1.
    Fan(f64),
    /// What follows belongs to one of several objects, counted from 0, or to none.
    Object(Option<usize>),
    /// How long the print has taken so far, s.
    Elapsed(f64),
    /// How fast the firmware may speed up the nozzle from here on, mm/s².
    Acceleration(f64),
    /// A remark, for people.
    Remark(String),
    /// One line of the start or end program, as the printer's owner wrote it.
    Custom(String),
}

/// The begin of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Counted from 0.
    pub index: usize,
    /// Highest nozzle position so far, this layer included, mm.
    pub top: f64,
    /// Its nominal thickness, mm.
    pub height: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn the_bed_takes_the_short_way_and_keeps_count() {
        let turn = BedTurn::accumulated(5.0 * TAU + 3.0);
        let next = turn.nearest(-3.0);
        assert!((next.radians() - (6.0 * TAU - 3.0)).abs() < 1e-12);
        assert!((next.radians() - turn.radians()).abs() <= PI);
        assert_eq!(BedTurn::default().nearest(0.0).radians(), 0.0);
    }

    #[test]
    fn feed_words_are_per_minute() {
        assert_eq!(Feed::mm_per_s(30.0).word(), 1800.0);
        assert_eq!(Feed::from_word(1800.0), Feed::mm_per_s(30.0));
    }

    #[test]
    fn labels_are_read_back() {
        for role in Role::ALL {
            assert_eq!(Role::from_label(role.label()), Some(role));
        }
        assert_eq!(Role::from_label("Perimeters"), None);
    }
}
