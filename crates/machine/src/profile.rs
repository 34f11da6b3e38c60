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
    /// Greatest speed of the filament, fed or drawn back, mm/s.
    pub extruder_speed: f64,
    /// The bore of the nozzle, mm.
    pub nozzle_diameter: f64,
    /// What of the hot end may run into the print.
    pub nozzle: NozzleShape,
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
    /// What turns the nozzle, where it does not always stand upright.
    pub head: Option<crate::head::Head>,
}

/// The outline of nozzle and hot end, turned about the nozzle's axis: a flat face around the bore, a
/// cone, and a block above. Lengths mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NozzleShape {
    /// Radius of the flat face.
    pub flat_radius: f64,
    /// Half the angle of the cone, from the axis, radians.
    pub half_angle: f64,
    /// Height of the underside of the block above the face.
    pub block_height: f64,
    /// How far the block reaches from the axis.
    pub block_radius: f64,
    /// Height of the underside of the carriage and of the rail it runs on above the face: a beam over
    /// the whole bed, along the rail.
    pub carriage_height: f64,
    /// How wide that beam is, across the rail, with the nozzle in its middle.
    pub carriage_width: f64,
}

impl NozzleShape {
    /// A common brass nozzle for filament of 1.75 mm in a block of 40 mm.
    pub const COMMON: Self = Self {
        flat_radius: 0.5,
        half_angle: std::f64::consts::FRAC_PI_6,
        block_height: 12.0,
        block_radius: 20.0,
        carriage_height: 60.0,
        carriage_width: 60.0,
    };

    /// Returns how high the outline lies above the face at a distance from the axis, mm; infinite
    /// beyond the block.
    #[must_use]
    pub fn height(&self, distance: f64) -> f64 {
        if distance <= self.flat_radius {
            0.0
        } else if distance <= self.block_radius {
            ((distance - self.flat_radius) / self.half_angle.tan()).min(self.block_height)
        } else {
            f64::INFINITY
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nozzle_rises_from_its_face_to_the_block() {
        let nozzle = NozzleShape::COMMON;
        assert_eq!((nozzle.height(0.0), nozzle.height(0.5)), (0.0, 0.0));
        assert!((nozzle.height(1.5) - 3.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!((nozzle.height(8.0), nozzle.height(20.0)), (12.0, 12.0));
        assert_eq!(nozzle.height(20.1), f64::INFINITY);
    }
}
