//! A polar printer as facts.
//!
//! Lengths in mm, angles in radians, seconds, degrees Celsius. Values are checked where settings
//! are read; here they are taken as they are.

/// What the axes, the nozzle and the heaters of a printer can do.
#[derive(Debug, Clone, PartialEq)]
pub struct Printer {
    /// What it is called in reports.
    pub name: String,
    /// The carriage on its rail.
    pub rail: Axis,
    /// The lift.
    pub lift: Axis,
    /// The turning bed.
    pub bed: Turntable,
    /// Greatest acceleration of the nozzle along its path, mm/s².
    pub path_acceleration: f64,
    /// How much faster or slower the carriage may be from one moment to the next, mm/s.
    pub rail_jerk: f64,
    /// The same for the bed, rad/s.
    pub bed_jerk: f64,
    /// Filament speed for moves of the filament alone, mm/s.
    pub filament_speed: f64,
    /// The bore of the nozzle, mm.
    pub nozzle_diameter: f64,
    /// Nothing that is emitted comes nearer to the axis than this, unless it runs straight
    /// through it on a rail that allows so, mm.
    pub axis_clearance: f64,
    /// Moves per second that the firmware can take.
    pub moves_per_second: f64,
    /// Where the machine stands after homing.
    pub home: crate::program::Joints,
    /// Hottest nozzle allowed, °C.
    pub nozzle_temperature_max: f64,
    /// Coldest nozzle that may extrude, °C.
    pub nozzle_temperature_min_extrude: f64,
    /// Hottest bed allowed, °C.
    pub bed_temperature_max: f64,
    /// How rail, column and plate miss their ideal places.
    pub alignment: crate::kinematics::Alignment,
    /// How high the bed lies, as it was probed.
    pub bed_map: crate::height_map::HeightMap,
    /// Most turns of the bed from where it was homed, either way, radians; infinite where no wire
    /// runs to the bed.
    pub most_turn: f64,
}

/// A straight axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Least position, mm. A rail that passes the centre has a negative one.
    pub min: f64,
    /// Greatest position, mm.
    pub max: f64,
    /// Greatest speed, mm/s.
    pub speed: f64,
    /// Greatest acceleration, mm/s².
    pub acceleration: f64,
}

/// A bed that turns without end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turntable {
    /// Greatest speed, rad/s.
    pub speed: f64,
    /// Greatest acceleration, rad/s².
    pub acceleration: f64,
}

impl Axis {
    /// Returns whether `position` lies within the travel.
    #[must_use]
    pub fn reaches(&self, position: f64) -> bool {
        self.min <= position && position <= self.max
    }
}

impl Printer {
    /// Returns whether the carriage can run through the centre of the bed to the other side.
    #[must_use]
    pub fn passes_centre(&self) -> bool {
        self.rail.min < 0.0
    }
}
